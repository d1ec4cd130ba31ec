//! The run that is shown: its panels, chart and inspector, and where they stand.

use egui::{Ui, UiBuilder, vec2};

use super::app::View;
use super::compare::Kept;
use super::heatmap::{self, Pictures};
use super::panels::{self, Ground, Panel, Plan, Touched};
use super::theme::{self, GAP, NARROW};
use super::{chart, inspector, timeline};
use crate::experiment::{CurvePoint, Setup};
use crate::lab::{RunState, Snapshot, Started};
use crate::mdp::Grid;

/// A run as it is shown: its grid, its latest snapshot and its curve so far.
#[derive(Clone)]
pub struct Shown {
    pub started: Started,
    pub snapshot: Snapshot,
    pub curve: Vec<CurvePoint>,
    /// The run at its last update, where an earlier one is shown.
    pub end: Option<Box<Snapshot>>,
    /// Another one for every snapshot there ever was on the page; and that of the first of this run.
    pub version: u64,
    pub run_version: u64,
    pub grid: Grid,
}

/// What a card adds to the height of its contents.
const CARD: f32 = 22.0;

impl Shown {
    /// Nothing when the run's grid is no good, which a session does not let happen.
    pub fn new(started: Started, snapshot: Snapshot, curve: Vec<CurvePoint>, version: u64) -> Option<Shown> {
        let given = started.setup.ensemble.as_ref().map(|ensemble| &ensemble.grid);
        let grid = Grid::new(given.unwrap_or(&started.setup.grid).clone()).ok()?;
        Some(Shown { started, snapshot, curve, end: None, version, run_version: version, grid })
    }

    /// Keeps the snapshot for when another moment is shown, where it is the last there is.
    pub fn remember_end(&mut self) {
        if self.snapshot.update == self.snapshot.recorded && self.snapshot.state != RunState::Playing {
            self.end = Some(Box::new(self.snapshot.clone()));
        }
    }

    /// Whether it is a run of this setup, with all that it says of β.
    pub fn is_of(&self, setup: &Setup) -> bool {
        let own = &self.started.setup;
        (&own.grid, &own.config, &own.ensemble) == (&setup.grid, &setup.config, &setup.ensemble)
            && self.snapshot.course == setup.course
    }

    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Cells with a reward r̃ of their own that the clone is to be denied, and the reward.
    pub fn rewards(&self) -> Vec<(usize, f64)> {
        let Some(reward) = &self.started.setup.config.adversary_reward else { return Vec::new() };
        let of_cells = self.grid.starts().iter().map(|&s| (s as usize, reward.of_cell(self.grid.cell(s as usize))));
        of_cells.filter(|(_, reward)| *reward != 0.0).collect()
    }

    /// Everything below one another, for narrow pages.
    pub fn show_stacked(&self, ui: &mut Ui, view: &View, kept: &[Kept], pictures: &mut Pictures) -> Touched {
        ui.add_space(GAP);
        heatmap::color_bar(ui, view.color_map);
        let width = ui.available_width();
        let columns = if width < NARROW { 2 } else { 3 };
        let plan = Plan::stacked(width, columns, &self.grid);
        let panels = panels::list(&self.started, &self.snapshot, view);
        let mut touched = self.show_panels(ui, &panels, &plan, view, pictures);
        ui.add_space(GAP);
        theme::card(ui).show(ui, |ui| {
            ui.set_width(ui.available_width());
            inspector::show(ui, &panels, &self.grid, view.cell);
        });
        ui.add_space(GAP);
        theme::card(ui).show(ui, |ui| {
            ui.set_height(240.0 + timeline::height(ui, self));
            self.show_chart(ui, view, kept, &mut touched);
        });
        touched
    }

    /// Panels as large as the page allows, with chart and inspector beside or below them.
    pub fn show_planned(&self, ui: &mut Ui, view: &View, kept: &[Kept], pictures: &mut Pictures) -> Touched {
        let panels = panels::list(&self.started, &self.snapshot, view);
        let area = ui.available_rect_before_wrap();
        let plan = Plan::new(ui, area.size(), panels.len(), &self.grid);
        let mut touched = self.show_panels(ui, &panels, &plan, view, pictures);
        let (first, second) = if plan.is_rest_right {
            let rest = area.with_min_x(area.left() + plan.width() + 2.0 * GAP);
            let height = (inspector::height(self.snapshot.experts.len()) + CARD).min(rest.height() / 2.0);
            let (above, below) = rest.split_top_bottom_at_y(rest.bottom() - height);
            (above.with_max_y(above.bottom() - GAP), below)
        } else {
            let (left, right) = ui.available_rect_before_wrap().split_left_right_at_fraction(0.5);
            (left.with_max_x(left.right() - GAP), right)
        };
        let card = |ui: &mut Ui, place, contents: &mut dyn FnMut(&mut Ui)| {
            ui.scope_builder(UiBuilder::new().max_rect(place), |ui| {
                theme::card(ui).show(ui, |ui| {
                    ui.set_min_size(ui.available_size());
                    contents(ui);
                });
            });
        };
        card(ui, first, &mut |ui| self.show_chart(ui, view, kept, &mut touched));
        card(ui, second, &mut |ui| inspector::show(ui, &panels, &self.grid, view.cell));
        touched
    }

    pub fn show_panels(
        &self,
        ui: &mut Ui,
        panels: &[Panel],
        plan: &Plan,
        view: &View,
        pictures: &mut Pictures,
    ) -> Touched {
        let rewards = self.rewards();
        let ground =
            Ground { grid: &self.grid, version: self.version, run_version: self.run_version, rewards: &rewards };
        panels::show(ui, panels, plan, &ground, view, pictures)
    }

    /// The chart, and below it the timeline.
    fn show_chart(&self, ui: &mut Ui, view: &View, kept: &[Kept], touched: &mut Touched) {
        let below = timeline::height(ui, self);
        let size = ui.available_size() - vec2(0.0, below);
        ui.scope(|ui| touched.update = touched.update.or(chart::show(ui, size, self, kept, view)));
        timeline::show(ui, self, view, touched);
    }
}
