//! The experiments as tabs of the page: attack bench, race, Table 1, sweep over β. What they have in common is a batch of
//! tasks with its progress, and a choice of cloners.

pub mod bench;
pub mod race;
pub mod sweep;
pub mod table1;

use std::hash::{Hash, Hasher};

use egui::accesskit::Live;
use egui::cache::{ComputerMut, FrameCache};
use egui::{ProgressBar, RichText, Ui};

use super::app::{App, PATIENCE};
use super::numbers;
use super::table::Cell;
use super::theme::Palette;
use super::widgets::heading;
use crate::ape::Digest;
use crate::attack::AttackerChoice;
use crate::experiment::{Outcome, Summary, Task};
use crate::lab::{Exported, Pool, TaskEvent, TaskId};

/// Tasks under way, and what has come of them.
pub struct Batch {
    tasks: Vec<(TaskId, f32)>,
    outcomes: Vec<Option<Outcome>>,
    /// Seconds on the page's clock.
    begun: f64,
    ended: Option<f64>,
    failure: Option<String>,
    /// Seconds that the workers have worked in all.
    work: f64,
}

impl Batch {
    pub fn begin(pool: &mut Pool, tasks: Vec<Task>, now: f64) -> Batch {
        // Nothing to do is done.
        let ended = tasks.is_empty().then_some(now);
        let outcomes = tasks.iter().map(|_| None).collect();
        let tasks = tasks.into_iter().map(|task| (pool.begin(task), 0.0)).collect();
        Batch { tasks, outcomes, begun: now, ended, failure: None, work: 0.0 }
    }

    /// Takes in news of one of its tasks; of others none.
    pub fn hear(&mut self, id: TaskId, event: &TaskEvent, now: f64) {
        let Some(index) = self.tasks.iter().position(|(task, _)| *task == id) else { return };
        match event {
            TaskEvent::Progress(part) => self.tasks[index].1 = *part,
            TaskEvent::Done(outcome, ms) => {
                self.work += ms / 1000.0;
                self.tasks[index].1 = 1.0;
                self.outcomes[index] = Some((**outcome).clone());
            }
            TaskEvent::Failed(sentence) => {
                self.tasks[index].1 = 1.0;
                self.failure = Some(sentence.clone());
            }
            TaskEvent::Ready { .. } => {}
        }
        if self.tasks.iter().all(|(_, part)| *part >= 1.0) && (self.failure.is_some() || self.is_complete()) {
            self.ended = self.ended.or(Some(now));
        }
    }

    fn is_complete(&self) -> bool {
        self.outcomes.iter().all(Option::is_some)
    }

    pub fn is_running(&self) -> bool {
        self.ended.is_none()
    }

    /// What has come so far, in the order of the tasks.
    pub fn outcomes(&self) -> impl Iterator<Item = &Outcome> {
        self.outcomes.iter().flatten()
    }

    pub fn cancel(&mut self, pool: &mut Pool, now: f64) {
        pool.cancel(self.tasks.iter().map(|(id, _)| *id));
        self.ended = Some(now);
    }

    /// How busy several workers were.
    fn busy(&self, workers: usize, seconds: f64) -> String {
        if workers < 2 || self.tasks.len() < 2 || seconds < 0.5 {
            return String::new();
        }
        format!(": {:.1} s of work, {:.1} of {workers} workers busy on average", self.work, self.work / seconds)
    }

    /// How far it is, with an estimate and a button that cancels; in the end how long it took.
    pub fn show(&mut self, ui: &mut Ui, pool: &mut Pool) {
        let palette = Palette::of(ui);
        let now = ui.input(|input| input.time);
        let done = self.tasks.iter().map(|(_, part)| f64::from(*part)).sum::<f64>() / self.tasks.len().max(1) as f64;
        if let Some(sentence) = &self.failure {
            ui.label(RichText::new(sentence).color(palette.warning));
        }
        if let Some(ended) = self.ended {
            let seconds = ended - self.begun;
            let text = match self.outcomes.iter().flatten().count() {
                _ if self.is_complete() => format!("done in {seconds:.1} s{}", self.busy(pool.size(), seconds)),
                count => format!("stopped after {seconds:.1} s with {count} of {} done", self.tasks.len()),
            };
            status(ui, &text, Live::Polite);
            return;
        }
        if pool.is_starting() && now - self.begun > PATIENCE {
            warn(ui, "A worker does not answer. It may still be on its way; Cancel gives it up.");
        }
        ui.horizontal(|ui| {
            let seconds = now - self.begun;
            let left = if done > 0.02 && seconds > 0.5 {
                format!(", about {:.0} s left", (seconds / done - seconds).ceil())
            } else {
                String::new()
            };
            let workers = match pool.size() {
                1 => "1 worker".to_owned(),
                size => format!("{size} workers"),
            };
            let text = format!("{:.0} %{left}, {workers}", 100.0 * done);
            if ui.button("Cancel").clicked() {
                self.cancel(pool, now);
            }
            let bar = ProgressBar::new(done as f32).desired_width(160.0).desired_height(10.0);
            ui.add(bar.fill(palette.accent)).accessible_name("Progress");
            status(ui, &text, Live::Off);
        });
        ui.ctx().request_repaint_after_secs(0.25);
    }
}

fn status(ui: &mut Ui, text: &str, live: Live) {
    let label = ui.label(RichText::new(text).small().color(Palette::of(ui).muted));
    ui.ctx().accesskit_node_builder(label.id, |node| {
        node.set_role(egui::Role::Status);
        node.set_live(live);
    });
}

/// What an ensemble from the session is called in a sentence.
fn title_of(exported: &Exported, app: &App) -> String {
    match (&app.opened, exported.update) {
        (Some(file), _) => file.name.clone(),
        (None, 0) => "the ensemble of this preset".to_owned(),
        (None, update) => format!("the ensemble after update {update}"),
    }
}

/// Run, update and digest of an ensemble.
type Moment = (u32, u32, Option<Digest>);

/// Whether the ensemble on the page is still this one.
fn is_shown(app: &App, moment: Moment) -> bool {
    app.shown().is_none_or(|(_, snapshot)| (snapshot.run, snapshot.update, snapshot.digest) == moment)
}

/// Says under results that they are of before.
fn warn(ui: &mut Ui, text: &str) {
    ui.label(RichText::new(text).small().color(Palette::of(ui).warning));
}

const OTHER_SETTINGS: &str = "Made with other settings than those at the side now.";

/// Which of the cloners take part.
fn choose_cloners(ui: &mut Ui, chosen: &mut Vec<AttackerChoice>) {
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new("Cloners:").small().color(Palette::of(ui).muted));
        let usual = AttackerChoice::usual();
        for &cloner in &usual {
            let mut is_chosen = chosen.contains(&cloner);
            let help = format!("{}. {}", cloner.model().title, cloner.model().summary);
            if ui.checkbox(&mut is_chosen, cloner.to_string()).on_hover_text(help).changed() {
                // In the order of the table.
                let keep = |other: &AttackerChoice| if *other == cloner { is_chosen } else { chosen.contains(other) };
                *chosen = usual.iter().copied().filter(keep).collect();
            }
        }
    });
}

/// Buttons that give results to the visitor as files.
fn exports(ui: &mut Ui, app: &mut App, name: &str, csv: impl Fn() -> String, json: impl Fn() -> String) {
    if ui.button("CSV").on_hover_text("Every run as a table").clicked() {
        app.save(&format!("{name}.csv"), &csv());
    }
    if ui.button("JSON").on_hover_text("Everything, as the command prints it").clicked() {
        app.save(&format!("{name}.json"), &json());
    }
}

/// The first lines of a tab: what it shows.
fn introduce(ui: &mut Ui, title: &str, text: &str) {
    heading(ui, 2, RichText::new(title).heading());
    ui.label(RichText::new(text).color(Palette::of(ui).muted));
    ui.add_space(4.0);
}

/// A figure over seeds, as mean ± standard deviation; its interval is in the hint.
fn summary_cell(summary: &Summary, is_steps: bool) -> Cell {
    let number = move |value: f64| if is_steps { numbers::short(value) } else { numbers::percent(value) };
    let Summary { mean, sd, ref values } = *summary;
    let seeds = values.len();
    let spread = if is_steps { numbers::short(sd) } else { format!("{:.0} %", 100.0 * sd) };
    let text = if seeds > 1 { format!("{} ± {spread}", number(mean)) } else { number(mean) };
    let summary = summary.clone();
    Cell::number(mean, text).hover_with(move |ui| {
        if seeds == 1 {
            return "One seed".to_owned();
        }
        let (low, high) = interval(ui, &summary);
        format!("95 % bootstrap interval {} to {}, {seeds} seeds", number(low), number(high))
    })
}

/// The interval of a summary, made once for as long as it is shown.
fn interval(ui: &Ui, summary: &Summary) -> (f64, f64) {
    #[derive(Default)]
    struct Intervals;
    #[derive(Clone, Copy)]
    struct Key<'a>(&'a Summary);
    impl Hash for Key<'_> {
        fn hash<H: Hasher>(&self, state: &mut H) {
            self.0.values.iter().for_each(|value| value.to_bits().hash(state));
        }
    }
    impl ComputerMut<Key<'_>, (f64, f64)> for Intervals {
        fn compute(&mut self, Key(summary): Key<'_>) -> (f64, f64) {
            summary.interval()
        }
    }
    ui.memory_mut(|memory| *memory.caches.cache::<FrameCache<(f64, f64), Intervals>>().get(Key(summary)))
}

/// A figure of the paper's, mean and standard deviation, where it has one.
fn paper_cell(figure: Option<(f64, f64)>, palette: &Palette) -> Cell {
    match figure {
        Some((mean, sd)) => {
            Cell::number(mean, format!("{} ± {sd:.2}", numbers::decimal(mean, 2))).colored(palette.muted)
        }
        None => Cell::number(f64::NEG_INFINITY, String::new()),
    }
}
