//! Table 1 on the page: adversarial ensembles and baselines against every cloner, over seeds.

use egui::{DragValue, RichText, Ui};

use super::{Batch, OTHER_SETTINGS, choose_cloners, exports, introduce, paper_cell, summary_cell, warn};
use crate::ape::Config;
use crate::attack::AttackerChoice;
use crate::experiment::{METHODS, Outcome, Setup, Table1, Task};
use crate::mdp::RETURN_KINDS;
use crate::ui::app::App;
use crate::ui::table::{Cell, Column, table};
use crate::ui::theme::Palette;

/// The tab: what is asked for and what has come of it.
pub struct Table1Tab {
    cloners: Vec<AttackerChoice>,
    seeds: u32,
    /// The cloners of the batch.
    columns: Vec<AttackerChoice>,
    pub batch: Option<Batch>,
    /// What the batch was made with.
    of: Option<Setup>,
}

impl Default for Table1Tab {
    fn default() -> Self {
        Table1Tab { cloners: AttackerChoice::usual(), seeds: 5, columns: Vec::new(), batch: None, of: None }
    }
}

impl Table1Tab {
    pub fn show(&mut self, ui: &mut Ui, app: &mut App) {
        introduce(
            ui,
            "Table 1",
            "The paper's comparison, with the settings at the side and every cloner as a column: adversarial ensembles, plain \
             policy gradient stopped early to return as much (near-optimal) or to have as bad a clone (random), and two that \
             are not trained. Mean ± standard deviation over seeds; point at a figure for its 95 % interval.",
        );
        choose_cloners(ui, &mut self.cloners);
        ui.horizontal_wrapped(|ui| {
            ui.label("Seeds");
            ui.add(DragValue::new(&mut self.seeds).range(1..=100).speed(0.1)).accessible_name("Seeds");
            let is_running = self.batch.as_ref().is_some_and(Batch::is_running);
            if ui.add_enabled(!is_running, egui::Button::new("Make Table 1")).clicked() {
                let setup = app.setup();
                self.of = Some(settings(setup));
                self.columns = self.cloners.clone();
                let task = |setup| Task::Table1 { setup: Box::new(setup), attackers: self.columns.clone() };
                let tasks = Table1::setups(setup, self.seeds).into_iter().map(task).collect();
                self.batch = Some(Batch::begin(&mut app.pool, tasks, ui.input(|input| input.time)));
            }
            let made = self.table();
            if !made.runs.is_empty() {
                let json = || serde_json::to_string_pretty(&made).unwrap_or_default();
                exports(ui, app, "ape-table1", || made.csv(), json);
            }
        });
        if let Some(batch) = &mut self.batch {
            batch.show(ui, &mut app.pool);
        }
        let made = self.table();
        if made.runs.is_empty() {
            ui.add_space(8.0);
            let text = "Not made yet. With all cloners it takes about ten seconds a seed.";
            ui.label(RichText::new(text).color(Palette::of(ui).muted));
            return;
        }
        ui.add_space(4.0);
        let is_papers = self.of.as_ref().is_some_and(Setup::is_papers_table);
        if self.of != Some(settings(app.setup())) {
            warn(ui, OTHER_SETTINGS);
        }
        show_table(ui, &made, app.view.kind, is_papers);
    }

    /// What has come so far.
    fn table(&self) -> Table1 {
        let mut made = Table1::new(self.columns.clone());
        for outcome in self.batch.iter().flat_map(Batch::outcomes) {
            if let Outcome::Table1(runs) = outcome {
                made.runs.extend(runs.iter().cloned());
            }
        }
        made
    }
}

/// What a table depends on: its seeds are its own, and β is that of the start.
fn settings(setup: &Setup) -> Setup {
    let config = Config { seed: 0, ..setup.config.clone() };
    Setup { grid: setup.grid.clone(), config, ..Setup::default() }
}

fn show_table(ui: &mut Ui, made: &Table1, kind: usize, is_papers: bool) {
    /// The return within T, which is known of every clone.
    const WITHIN_T: usize = 2;
    let palette = Palette::of(ui);
    let (rows, within) = (made.rows(kind), made.rows(WITHIN_T));
    let label = RETURN_KINDS[kind].label;
    let mut columns =
        vec![Column::new("method", "How the ensemble came about"), Column::new("ensemble", RETURN_KINDS[kind].help)];
    columns.push(Column::new("paper: ensemble", "The paper's Table 1"));
    columns.push(Column::new("paper: clone", "The paper's Table 1, by behaviour cloning"));
    columns.extend(made.attackers.iter().map(|cloner| Column::new(&cloner.to_string(), cloner.model().summary)));
    let is_steps = RETURN_KINDS[kind].is_steps;
    ui.label(RichText::new(format!("Return ({label}), mean ± sd over seeds")).small().color(palette.muted));
    let rows = rows.iter().zip(&within).map(|(row, within)| {
        let method = &METHODS[row.method];
        let paper = method.paper.as_ref().filter(|_| is_papers);
        let mut cells = vec![
            Cell::number(row.method as f64, method.title.to_owned()).hover(method.summary),
            summary_cell(&row.ensemble, is_steps),
        ];
        cells.push(paper_cell(paper.map(|paper| paper.ensemble), palette));
        cells.push(paper_cell(paper.map(|paper| paper.clone), palette));
        for (clone, within) in row.clones.iter().zip(&within.clones) {
            cells.push(match (clone, within) {
                (Some(clone), _) => {
                    let cell = summary_cell(clone, is_steps);
                    let is_lost = is_steps && clone.mean < row.ensemble.mean - 5.0;
                    if is_lost { cell.colored(palette.clone) } else { cell }
                }
                (None, Some(within)) => {
                    let cell = summary_cell(within, true).suffix(" in T");
                    cell.hover("A clone with a memory has no hitting times to cap: its return within T stands here.")
                }
                (None, None) => Cell::number(f64::NEG_INFINITY, "–".to_owned()),
            });
        }
        cells
    });
    let rows = rows.collect();
    table(ui, "table 1", &columns, rows);
}
