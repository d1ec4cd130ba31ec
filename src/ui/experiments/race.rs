//! The race on the page: an expert, the clone and the optimal policy from one cell with the same luck, step by
//! step, or a thousand times with the exact distribution of their steps.

mod board;
mod figures;

use std::rc::Rc;

use egui::{Button, ComboBox, Label, RichText, Slider, Ui, vec2};

use self::board::Board;
use super::{Batch, Moment, introduce, is_shown, title_of, warn};
use crate::ape::EnsembleFile;
use crate::attack::AttackerChoice;
use crate::experiment::{Outcome, Race, Raced, Racer, Task};
use crate::lab::{Exported, TaskEvent, TaskId};
use crate::mdp::Grid;
use crate::ui::app::{App, Wanted};
use crate::ui::numbers;
use crate::ui::theme::{MENU, NARROW, Palette, SPACE};
use crate::ui::widgets::{Icon, icon_button};

/// The tab: what is asked for and what has come of it.
pub struct RaceTab {
    /// The expert that races; none: one drawn anew for each episode.
    expert: Option<u32>,
    /// Who clones; none: as in the page's first clone panel.
    cloner: Option<AttackerChoice>,
    /// The cell where the next race starts; none: the one farthest from the goal.
    start: Option<usize>,
    luck: u32,
    /// Place in [`SPEEDS`].
    speed: usize,
    /// Episodes of the race that waits for its ensemble.
    asked: u32,
    /// The race under way; once it is over, only where it failed.
    batch: Option<(Subject, Batch)>,
    /// The race on the board.
    shown: Option<Rc<Held>>,
    /// The race that the figures are of.
    figures: Option<Rc<Held>>,
    replay: Replay,
    /// The grid of the page.
    grid: Option<Rc<Grid>>,
}

/// What was raced.
#[derive(Clone, PartialEq)]
struct Subject {
    /// Run and update of the ensemble, and its digest: runs of another session have the same numbers.
    moment: Moment,
    title: String,
    cloner: AttackerChoice,
    expert: Option<u32>,
    start: usize,
    horizon: u32,
}

/// A race and what has come of it.
struct Held {
    subject: Subject,
    luck: u32,
    raced: Raced,
}

/// How far the race on the board is shown.
#[derive(Default)]
struct Replay {
    /// Steps since the start.
    step: f64,
    is_playing: bool,
    /// The page's clock at the last frame, in seconds; none when it has just begun.
    last: Option<f64>,
}

/// Steps a second.
const SPEEDS: [u32; 9] = [1, 2, 5, 10, 20, 50, 100, 300, 1000];
/// Episodes of a large race.
const MANY: u32 = 1000;
/// Width of a box to choose from.
const BOX: f32 = 160.0;
/// Height of a histogram, least and most.
const HISTOGRAM: [f32; 2] = [62.0, 130.0];

impl Default for RaceTab {
    fn default() -> Self {
        RaceTab {
            expert: None,
            cloner: None,
            start: None,
            luck: 1,
            speed: 3,
            asked: 1,
            batch: None,
            shown: None,
            figures: None,
            replay: Replay::default(),
            grid: None,
        }
    }
}

impl RaceTab {
    /// The ensemble has come that was asked for.
    pub fn begin(&mut self, exported: Exported, app: &mut App, now: f64) {
        self.take_grid(app);
        let Some(start) = self.start() else { return };
        let Some(grid) = self.grid.as_ref().filter(|grid| *grid.spec() == exported.file.grid) else { return };
        let config = &app.setup().config;
        let expert = self.expert.filter(|&expert| (expert as usize) < exported.file.experts.len());
        let subject = Subject {
            moment: (exported.run, exported.update, exported.file.digest),
            title: title_of(&exported, app),
            cloner: self.cloner(app),
            expert,
            start,
            horizon: config.horizon,
        };
        let race = Race {
            ensemble: EnsembleFile { config: None, ..exported.file },
            cloner: subject.cloner,
            expert,
            start: grid.cell(start),
            horizon: config.horizon,
            episodes: self.asked,
            seed: config.seed,
            luck: self.luck,
        };
        let batch = Batch::begin(&mut app.pool, vec![Task::Race(Box::new(race))], now);
        self.batch = Some((subject, batch));
    }

    /// Takes in news of the race under way.
    pub fn hear(&mut self, id: TaskId, event: &TaskEvent, now: f64) {
        let start = self.start();
        let Some((subject, batch)) = &mut self.batch else { return };
        batch.hear(id, event, now);
        let Some(Outcome::Race(raced)) = batch.outcomes().next() else { return };
        let held = Rc::new(Held { subject: subject.clone(), luck: self.luck, raced: (**raced).clone() });
        self.batch = None;
        // Who has moved the start meanwhile does not want a race from the old one.
        if start != Some(held.subject.start) {
            return;
        }
        let is_same = |other: &Option<Rc<Held>>| other.as_ref().is_some_and(|other| other.subject == held.subject);
        let is_many = held.raced.episodes > 1;
        // What was found in a thousand episodes stays, as long as it is of the same racers.
        if is_many || !is_same(&self.figures) {
            self.figures = Some(held.clone());
        }
        // The first of a thousand episodes is the one that is on the board, if that is of the same racers and luck.
        let is_on_board = is_same(&self.shown) && self.shown.as_ref().is_some_and(|shown| shown.luck == held.luck);
        if !(is_many && is_on_board) {
            self.shown = Some(held);
            self.replay = Replay { is_playing: true, ..Replay::default() };
        }
    }

    pub fn show(&mut self, ui: &mut Ui, app: &mut App) {
        self.take_grid(app);
        let (Some(grid), Some(start)) = (self.grid.clone(), self.start()) else {
            ui.label(RichText::new("The first policies are on their way …").color(Palette::of(ui).muted));
            return;
        };
        self.advance(ui);
        let (width, height) = (ui.available_width(), ui.clip_rect().height() - 8.0);
        if width < NARROW {
            introduce_race(ui);
            self.show_controls(ui, app);
            self.show_board(ui, &grid, start, board::size(&grid, width, f32::INFINITY).x);
            self.show_racers(ui, app, &grid, f32::INFINITY);
            return;
        }
        // Below the board are its timeline and the words about its start.
        let side = board::size(&grid, (0.47 * width).floor(), (height - 64.0).max(200.0)).x;
        ui.horizontal_top(|ui| {
            ui.allocate_ui(vec2(side, height), |ui| {
                ui.vertical(|ui| self.show_board(ui, &grid, start, side));
            });
            ui.add_space(SPACE - 8.0);
            let top = ui.cursor().top();
            ui.vertical(|ui| {
                ui.set_width(ui.available_width());
                introduce_race(ui);
                self.show_controls(ui, app);
                let left = height - (ui.cursor().top() - top);
                self.show_racers(ui, app, &grid, left);
            });
        });
    }

    /// Keeps to the grid of the page; what was raced on another one is forgotten.
    fn take_grid(&mut self, app: &mut App) {
        let Some((started, _)) = app.shown() else { return };
        let spec = started.setup.ensemble.as_ref().map_or(&started.setup.grid, |ensemble| &ensemble.grid);
        if self.grid.as_ref().is_some_and(|grid| grid.spec() == spec) {
            return;
        }
        self.grid = Grid::new(spec.clone()).ok().map(Rc::new);
        (self.start, self.shown, self.figures) = (None, None, None);
        if let Some((_, mut batch)) = self.batch.take() {
            batch.cancel(&mut app.pool, 0.0);
        }
    }

    /// The cell where the next race starts.
    fn start(&self) -> Option<usize> {
        let grid = self.grid.as_ref()?;
        self.start.or_else(|| {
            let distance = grid.distances();
            grid.starts().iter().map(|&s| s as usize).max_by_key(|&state| distance[state])
        })
    }

    /// Who clones in the next race.
    fn cloner(&self, app: &App) -> AttackerChoice {
        let of_page = app.view.clones.first().copied().filter(|&cloner| Race::knows(cloner));
        self.cloner.or(of_page).unwrap_or(AttackerChoice::UNIFORM)
    }

    /// Moves the replay on by the page's clock; asks for another frame only while something moves.
    fn advance(&mut self, ui: &Ui) {
        let last = f64::from(self.last_step());
        let replay = &mut self.replay;
        if !replay.is_playing {
            return;
        }
        let now = ui.input(|input| input.time);
        // A page that was not looked at does not make a leap.
        let passed = (now - replay.last.unwrap_or(now)).clamp(0.0, 0.25);
        replay.last = Some(now);
        replay.step += passed * f64::from(SPEEDS[self.speed]);
        let is_still = ui.style().animation_time == 0.0;
        if replay.step >= last || is_still {
            *replay = Replay { step: last, ..Replay::default() };
        } else {
            ui.ctx().request_repaint();
        }
    }

    /// Steps until the last racer on the board has ended.
    fn last_step(&self) -> u32 {
        let runs = self.shown.iter().flat_map(|shown| &shown.raced.runs);
        runs.map(|run| run.path.len() as u32 - 1).max().unwrap_or(0)
    }

    fn show_board(&mut self, ui: &mut Ui, grid: &Grid, start: usize, width: f32) {
        let paths = match &self.shown {
            Some(shown) => std::array::from_fn(|racer| &*shown.raced.runs[racer].path),
            None => [&[][..]; 3],
        };
        let board = Board { grid, start, paths, step: self.replay.step };
        if let Some(start) = board.show(ui, board::size(grid, width, f32::INFINITY)) {
            // The racers go to their new start.
            self.start = Some(start);
            self.shown = None;
            self.replay = Replay::default();
        }
        // Where there is little room, the speed has a line of its own.
        if width < 420.0 {
            ui.horizontal(|ui| self.show_timeline(ui, width));
            ui.horizontal(|ui| self.show_speed(ui));
        } else {
            ui.horizontal(|ui| {
                self.show_timeline(ui, width - 160.0);
                self.show_speed(ui);
            });
        }
        let (row, col) = grid.cell(start);
        let text = format!("Start: row {row}, column {col}. Click another cell, or use the arrow keys.");
        ui.label(RichText::new(text).small().color(Palette::of(ui).muted));
    }

    /// A button that stops the racers or lets them run, and a slider to any step; together of this width.
    fn show_timeline(&mut self, ui: &mut Ui, width: f32) {
        const COUNT: f32 = 64.0;
        let last = self.last_step();
        ui.add_enabled_ui(last > 0, |ui| {
            let is_over = self.replay.step >= f64::from(last);
            let (icon, name) = match self.replay.is_playing {
                true => (Icon::Pause, "Pause the race"),
                false => (Icon::Play, "Show the race"),
            };
            if icon_button(ui, icon, name, false).clicked() {
                let step = if is_over { 0.0 } else { self.replay.step };
                self.replay = Replay { step, is_playing: !self.replay.is_playing, last: None };
            }
            let mut step = self.replay.step as u32;
            let others = ui.spacing().interact_size.y + COUNT + 3.0 * ui.spacing().item_spacing.x;
            ui.spacing_mut().slider_width = (width - others).max(60.0);
            let slider = Slider::new(&mut step, 0..=last.max(1)).show_value(false);
            if ui.add(slider).accessible_name("Step of the race").changed() {
                self.replay = Replay { step: f64::from(step), ..Replay::default() };
            }
            let text = RichText::new(format!("{step} of {last}")).small().color(Palette::of(ui).muted);
            ui.add_sized([COUNT, 20.0], Label::new(text));
        });
    }

    fn show_speed(&mut self, ui: &mut Ui) {
        ui.spacing_mut().slider_width = 64.0;
        let slider = Slider::new(&mut self.speed, 0..=SPEEDS.len() - 1).show_value(false);
        ui.add(slider).accessible_name("Speed of the race").on_hover_text("Steps per second");
        let text = format!("{} steps/s", SPEEDS[self.speed]);
        ui.label(RichText::new(text).small().color(Palette::of(ui).muted));
    }

    fn show_controls(&mut self, ui: &mut Ui, app: &mut App) {
        let experts = app.shown().map_or(1, |(_, snapshot)| snapshot.experts.len() as u32);
        // A word and its box stay on one line.
        if ui.available_width() < 2.0 * BOX + 130.0 {
            ui.horizontal(|ui| self.choose_expert(ui, experts));
            ui.horizontal(|ui| self.choose_cloner(ui, app));
        } else {
            ui.horizontal(|ui| {
                self.choose_expert(ui, experts);
                self.choose_cloner(ui, app);
            });
        }
        ui.horizontal_wrapped(|ui| {
            let is_running = self.batch.as_ref().is_some_and(|(_, batch)| batch.is_running());
            let can_race = !is_running && app.can_export();
            let mut asked = None;
            ui.add_enabled_ui(can_race, |ui| {
                let palette = Palette::of(ui);
                let race = Button::new(RichText::new("Race").color(palette.on_accent)).fill(palette.accent);
                if ui.add(race).on_hover_text("One episode, step by step").clicked() {
                    asked = Some(1);
                }
                if ui.button("Again with other luck").clicked() {
                    self.luck = self.luck.wrapping_add(1);
                    asked = Some(1);
                }
                if ui
                    .button("Race 1,000")
                    .on_hover_text("A thousand episodes at once, and how long they take")
                    .clicked()
                {
                    asked = Some(MANY);
                }
            });
            if let Some(episodes) = asked {
                self.asked = episodes;
                app.want(Wanted::Race);
            }
        });
        let of_page = app.view.clones.first().copied();
        if let Some(cloner) = of_page.filter(|&cloner| self.cloner.is_none() && !Race::knows(cloner)) {
            let text = format!(
                "{cloner} of the page cannot race, {} does: of the clones that remember their episode only history can.",
                self.cloner(app)
            );
            ui.label(RichText::new(text).small().color(Palette::of(ui).warning));
        }
        if let Some((_, batch)) = &mut self.batch {
            batch.show(ui, &mut app.pool);
        }
    }

    fn choose_expert(&mut self, ui: &mut Ui, experts: u32) {
        let name = |expert: Option<u32>| match expert.filter(|&expert| expert < experts) {
            None => "drawn anew each time".to_owned(),
            Some(expert) => format!("Expert {}", expert + 1),
        };
        ui.label("Expert");
        ComboBox::from_id_salt("race expert")
            .width(BOX)
            .selected_text(name(self.expert))
            .show_ui(ui, |ui| {
                for expert in std::iter::once(None).chain((0..experts).map(Some)) {
                    ui.selectable_value(&mut self.expert, expert, name(expert));
                }
            })
            .response
            .accessible_name("Which expert races");
    }

    fn choose_cloner(&mut self, ui: &mut Ui, app: &App) {
        let chosen = self.cloner(app);
        let mut choices: Vec<AttackerChoice> = AttackerChoice::usual();
        if !choices.contains(&chosen) {
            choices.insert(0, chosen);
        }
        ui.label("Clone");
        ComboBox::from_id_salt("race clone")
            .width(BOX)
            .height(MENU)
            .selected_text(RichText::new(chosen.to_string()).color(Palette::of(ui).clone))
            .show_ui(ui, |ui| {
                for choice in choices.into_iter().filter(|&choice| Race::knows(choice)) {
                    let text = format!("{choice}: {}", choice.model().title);
                    if ui.selectable_label(choice == chosen, text).on_hover_text(choice.model().summary).clicked() {
                        self.cloner = Some(choice);
                    }
                }
            })
            .response
            .accessible_name("Who clones in the race")
            .on_hover_text(chosen.model().summary);
    }

    /// The racers: their counters, and what many episodes come to, in this height.
    fn show_racers(&mut self, ui: &mut Ui, app: &App, grid: &Grid, height: f32) {
        let palette = Palette::of(ui);
        let top = ui.cursor().top();
        self.show_caption(ui, app, grid);
        let left = (height - (ui.cursor().top() - top)) / 3.0;
        for racer in Racer::ALL {
            let run = self.shown.as_ref().map(|shown| shown.raced.run(racer));
            let block = ui.cursor().top();
            figures::counter(ui, racer, &self.name(racer, app), run, self.replay.step);
            if let Some(held) = &self.figures {
                let sentence = figures::sentence(&held.raced, racer);
                let of_all = racer == Racer::Expert && held.subject.expert.is_none();
                let sentence = if of_all { format!("all experts: {sentence}") } else { sentence };
                ui.label(RichText::new(sentence).small().color(palette.muted));
                let rest = left - (ui.cursor().top() - block) - 6.0;
                figures::histogram(ui, &held.raced, racer, rest.clamp(HISTOGRAM[0], HISTOGRAM[1]));
            }
        }
    }

    /// What the figures are of, and whether that is still what is on the page.
    fn show_caption(&self, ui: &mut Ui, app: &App, grid: &Grid) {
        let palette = Palette::of(ui);
        let small = |text: String| RichText::new(text).small().color(palette.muted);
        let Some(held) = &self.figures else {
            ui.label(small("Nobody has raced yet: choose a start on the board, then Race.".to_owned()));
            return;
        };
        let Subject { moment, title, cloner, start, horizon, .. } = &held.subject;
        let (row, col) = grid.cell(*start);
        let what = if held.raced.episodes == 1 {
            "Lines: the exact share of episodes over their steps to the goal".to_owned()
        } else {
            let episodes = numbers::grouped(held.raced.episodes);
            format!("Bars: {episodes} episodes by their steps to the goal; lines: exact")
        };
        ui.label(small(format!(
            "{what}; lost: not there by T = {horizon}. {cloner} clone, from row {row}, column {col}, {title}."
        )));
        if !is_shown(app, *moment) {
            warn(ui, "The ensemble on the page has changed since: race again to see it.");
        }
    }

    /// A racer in the race on the board, or in the next one.
    fn name(&self, racer: Racer, app: &App) -> String {
        match (racer, &self.shown) {
            (Racer::Expert, Some(shown)) => format!("Expert {}", shown.raced.expert + 1),
            (Racer::Expert, None) => {
                self.expert.map_or("An expert, drawn anew".to_owned(), |expert| format!("Expert {}", expert + 1))
            }
            (Racer::Clone, Some(shown)) => format!("Clone ({})", shown.subject.cloner),
            (Racer::Clone, None) => format!("Clone ({})", self.cloner(app)),
            (Racer::Optimal, _) => "Optimal".to_owned(),
        }
    }
}

fn introduce_race(ui: &mut Ui) {
    introduce(
        ui,
        "Race",
        "From the same cell with the same luck: at every step all read the same random numbers, so who would act alike \
         does act alike.",
    );
}
