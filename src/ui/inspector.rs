//! One cell in every panel: hitting time, π(·|s) and p(c|s) as numbers.

use egui::{Grid as Table, RichText, ScrollArea, Ui};

use super::numbers;
use super::panels::Panel;
use super::theme::{self, Palette};
use crate::mdp::Grid;

/// The table of a cell; a hint while none has been pointed at.
pub fn show(ui: &mut Ui, panels: &[Panel], grid: &Grid, cell: Option<usize>) {
    let palette = Palette::of(ui);
    let quiet = |text: &str| RichText::new(text).small().color(palette.muted);
    let Some(state) = cell.filter(|&state| state < grid.cells()) else {
        ui.label(quiet("Point at a cell, or tap it: its numbers in every panel will stand here."));
        return;
    };
    let (row, col) = grid.cell(state);
    let kind = match () {
        () if grid.is_wall(state) => ", a wall",
        () if state == grid.goal() => ", the goal",
        () => "",
    };
    ui.label(RichText::new(format!("Cell in row {row}, column {col}{kind}")).text_style(theme::strong()));
    if !kind.is_empty() {
        ui.label(quiet("No policy acts here."));
        return;
    }
    ScrollArea::both().auto_shrink([false, true]).show(ui, |ui| {
        Table::new("inspector").striped(false).spacing([10.0, 3.0]).min_col_width(0.0).show(ui, |ui| {
            ui.label("");
            ui.label(quiet("steps h(s)"));
            for sign in ["Up", "Down", "Left", "Right", "Stay"] {
                ui.label(quiet(sign));
            }
            ui.label(quiet("p(c|s)"));
            ui.end_row();
            for (panel, policy) in panels.iter().filter_map(|panel| Some((panel, panel.policy?))) {
                ui.label(RichText::new(&panel.title).small());
                ui.label(RichText::new(numbers::steps(f64::from(policy.hitting_time[state]))).small());
                for &p in &policy.policy[state] {
                    let text = RichText::new(numbers::decimal(f64::from(p), 2)).small();
                    ui.label(if p < 0.005 { text.color(palette.muted) } else { text });
                }
                if let Some((_, contexts)) = panel.clone {
                    let experts = contexts.len() / grid.cells();
                    let shares = &contexts[state * experts..][..experts];
                    let text: Vec<String> = shares.iter().map(|&p| numbers::decimal(f64::from(p), 2)).collect();
                    ui.label(RichText::new(text.join("  ")).small());
                }
                ui.end_row();
            }
        });
    });
}
