//! The sweep over β on the page: returns over β, the Pareto picture, and the paper's table of β.

use egui::{DragValue, RichText, TextEdit, Ui, vec2};

use super::{Batch, OTHER_SETTINGS, exports, introduce, paper_cell, summary_cell, warn};
use crate::ape::Config;
use crate::experiment::{Outcome, Setup, Summary, Sweep, SweepPoint, Task};
use crate::mdp::RETURN_KINDS;
use crate::ui::app::App;
use crate::ui::chart::{self, Axes, Curve, Style};
use crate::ui::numbers;
use crate::ui::table::{Cell, Column, table};
use crate::ui::theme::Palette;
use crate::ui::widgets::choose;

/// The tab: what is asked for and what has come of it.
pub struct SweepTab {
    betas: String,
    seeds: u32,
    is_pareto: bool,
    pub batch: Option<Batch>,
    refusal: Option<String>,
    /// What the batch was made with.
    of: Option<Setup>,
}

impl Default for SweepTab {
    fn default() -> Self {
        SweepTab { betas: "0:1:0.1".to_owned(), seeds: 3, is_pareto: false, batch: None, refusal: None, of: None }
    }
}

impl SweepTab {
    pub fn show(&mut self, ui: &mut Ui, app: &mut App) {
        introduce(
            ui,
            "β sweep",
            "Whole runs for many β, with the settings at the side: what the ensemble pays, and what its clone loses. Bad \
             for the clone and good for the ensemble is down at the right of the Pareto picture.",
        );
        let mut is_asked = false;
        ui.horizontal_wrapped(|ui| {
            ui.label("β");
            let help = "FIRST:LAST:STEP, or a list with commas";
            let edit = TextEdit::singleline(&mut self.betas).desired_width(130.0);
            ui.add(edit).accessible_name("Values of β").on_hover_text(help);
            if ui
                .button("Paper's table")
                .on_hover_text("0, 0.1, 0.2 and 0.3: a table commented out in the paper's source")
                .clicked()
            {
                self.betas = "0,0.1,0.2,0.3".to_owned();
                is_asked = true;
            }
            ui.label("Seeds");
            ui.add(DragValue::new(&mut self.seeds).range(1..=100).speed(0.1)).accessible_name("Seeds of the sweep");
            let is_running = self.batch.as_ref().is_some_and(Batch::is_running);
            is_asked |= ui.add_enabled(!is_running, egui::Button::new("Sweep")).clicked();
            let sweep = self.sweep();
            if !sweep.runs.is_empty() {
                let json = || serde_json::to_string_pretty(&sweep).unwrap_or_default();
                exports(ui, app, "ape-sweep", || sweep.csv(), json);
            }
        });
        if is_asked {
            self.begin(app, ui.input(|input| input.time));
        }
        let palette = Palette::of(ui);
        if let Some(sentence) = &self.refusal {
            ui.label(RichText::new(sentence).color(palette.warning));
        }
        if let Some(batch) = &mut self.batch {
            batch.show(ui, &mut app.pool);
        }
        let sweep = self.sweep();
        if sweep.runs.is_empty() {
            ui.add_space(8.0);
            ui.label(RichText::new("Nothing has been swept yet.").color(palette.muted));
            return;
        }
        let kind = app.view.kind;
        let points = sweep.points(kind);
        ui.add_space(4.0);
        let options = [
            (false, "over β", "Returns over β"),
            (true, "Pareto", "Return of the clone over that of the ensemble, a point for each β"),
        ];
        choose(ui, "Picture", &mut self.is_pareto, &options);
        if points.iter().any(|point| point.clone.is_none()) {
            let text = "This return is not known of a clone that remembers: choose within T or success.";
            ui.label(RichText::new(text).color(palette.warning));
        }
        if self.is_pareto {
            show_pareto(ui, &points, kind)
        } else {
            show_over_beta(ui, &points, kind)
        }
        if self.of != Some(settings(app.setup())) {
            warn(ui, OTHER_SETTINGS);
        }
        show_table(ui, &sweep, kind, self.of.as_ref().is_some_and(Setup::is_papers));
    }

    fn begin(&mut self, app: &mut App, now: f64) {
        match self.asked() {
            Err(sentence) => self.refusal = Some(sentence),
            Ok(betas) => {
                self.refusal = None;
                if let Some(batch) = self.batch.as_mut().filter(|batch| batch.is_running()) {
                    batch.cancel(&mut app.pool, now);
                }
                let setup = app.setup();
                self.of = Some(settings(setup));
                let task = |setup| Task::Sweep { setup: Box::new(setup) };
                let tasks = Sweep::setups(setup, &betas, self.seeds).into_iter().map(task).collect();
                self.batch = Some(Batch::begin(&mut app.pool, tasks, now));
            }
        }
    }

    /// The β that are asked for, if they are not too many for a page to show.
    fn asked(&self) -> Result<Vec<f64>, String> {
        const MOST_BETAS: usize = 200;
        const MOST_RUNS: usize = 2000;
        let betas = Sweep::betas(&self.betas)?;
        let (count, seeds) = (betas.len(), self.seeds as usize);
        if count > MOST_BETAS || count * seeds > MOST_RUNS {
            return Err(format!(
                "{count} values of β, {seeds} seeds: expected at most {MOST_BETAS} values and {MOST_RUNS} runs in all here; the command ape sweep takes more"
            ));
        }
        Ok(betas)
    }

    /// What has come so far.
    fn sweep(&self) -> Sweep {
        let runs = self.batch.iter().flat_map(Batch::outcomes).filter_map(|outcome| match outcome {
            Outcome::Sweep(run) => Some(run.clone()),
            _ => None,
        });
        Sweep { runs: runs.collect() }
    }
}

/// What a sweep depends on: its β and seeds are its own.
fn settings(setup: &Setup) -> Setup {
    let config = Config { beta: 0.0, seed: 0, ..setup.config.clone() };
    Setup { grid: setup.grid.clone(), config, ..Setup::default() }
}

fn show_over_beta(ui: &mut Ui, points: &[SweepPoint], kind: usize) {
    let palette = Palette::of(ui);
    let curve = |name: &str, color, of: fn(&SweepPoint) -> Option<&Summary>| Curve {
        name: name.to_owned(),
        color,
        points: points.iter().filter_map(|point| Some([point.beta, of(point)?.mean])).collect(),
        style: Style::Marked,
    };
    let curves = vec![
        curve("ensemble", palette.accent, |point| Some(&point.ensemble)),
        curve("clone", palette.clone, |point| point.clone.as_ref()),
        curve("occupancy clone", palette.warning, |point| point.occupancy.as_ref()),
    ];
    draw(ui, kind, "Over β", curves, Vec::new(), |beta| numbers::decimal(beta, 2));
}

fn show_pareto(ui: &mut Ui, points: &[SweepPoint], kind: usize) {
    let palette = Palette::of(ui);
    let at = |point: &SweepPoint| Some([point.ensemble.mean, point.clone.as_ref()?.mean]);
    let curves = vec![Curve {
        name: "clone over ensemble".to_owned(),
        color: palette.clone,
        points: points.iter().filter_map(at).collect(),
        style: Style::Marked,
    }];
    let labels = points.iter().filter_map(|point| Some((at(point)?, format!(" β = {}", point.beta)))).collect();
    draw(ui, kind, "Pareto", curves, labels, chart::in_steps);
}

fn draw(
    ui: &mut Ui,
    kind: usize,
    title: &str,
    curves: Vec<Curve>,
    labels: Vec<([f64; 2], String)>,
    x: fn(f64) -> String,
) {
    let kind = &RETURN_KINDS[kind];
    let title = format!("{title}, {} return:", kind.label);
    chart::legend(ui, &title, curves.iter().map(|curve| (&*curve.name, curve.color)));
    let y = if kind.is_steps { chart::in_steps } else { |value| numbers::decimal(value, 2) };
    let size = vec2(ui.available_width(), 260.0);
    chart::plot(ui, Axes { id: "sweep", size, include: Vec::new(), x, y, labels, cursor: None }, curves);
}

fn show_table(ui: &mut Ui, sweep: &Sweep, kind: usize, is_papers: bool) {
    let palette = Palette::of(ui);
    let columns = [
        Column::new("β", "Weight of the clone's return"),
        Column::new("ensemble", RETURN_KINDS[kind].help),
        Column::new("clone", "By the run's own observer"),
        Column::new("occupancy clone", "Of whoever clones the demonstrations"),
        Column::new("paper: ensemble", "A table commented out in the paper's source, 3 seeds"),
        Column::new("paper: clone, uncapped", "The same table; only hitting times without a cut can be so long"),
    ];
    let is_steps = RETURN_KINDS[kind].is_steps;
    let known = |summary: Option<&Summary>| {
        summary.map_or_else(|| Cell::number(f64::NEG_INFINITY, "–".to_owned()), |of| summary_cell(of, is_steps))
    };
    let rows = sweep.points(kind).into_iter().map(|point| {
        let paper = Sweep::PAPER.iter().find(|(beta, _)| is_papers && *beta == point.beta);
        vec![
            Cell::number(point.beta, point.beta.to_string()),
            summary_cell(&point.ensemble, is_steps),
            known(point.clone.as_ref()),
            known(point.occupancy.as_ref()),
            paper_cell(paper.map(|(_, paper)| paper.ensemble), palette),
            paper_cell(paper.map(|(_, paper)| paper.clone), palette),
        ]
    });
    let rows = rows.collect();
    table(ui, "sweep table", &columns, rows);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_sweeps_as_much_as_it_can_show() {
        let asked = |betas: &str, seeds| SweepTab { betas: betas.to_owned(), seeds, ..SweepTab::default() }.asked();
        assert_eq!(asked("0:1:0.05", 95).unwrap().len(), 21);
        for (betas, seeds) in [("0:1:0.05", 96), ("0:0.2:0.001", 1)] {
            assert!(asked(betas, seeds).unwrap_err().contains("at most 200 values and 2000 runs"));
        }
    }
}
