//! One cell in every panel: hitting time, π(·|s) and p(c|s) as numbers. A column a panel.

use egui::{Grid as Table, Id, RichText, Role, ScrollArea, Ui};

use super::numbers;
use super::panels::Panel;
use super::table;
use super::theme::{self, Palette};
use super::widgets::heading;
use crate::mdp::{Action, Grid};

/// Height that the table needs for so many experts.
pub fn height(experts: usize) -> f32 {
    // The title, the heads, h(s), five actions and p(c|s).
    24.0 + ROW * (7 + experts) as f32
}

const ROW: f32 = 19.0;

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
    let title = format!("Cell in row {row}, column {col}{kind}");
    heading(ui, 2, RichText::new(title).text_style(theme::strong()));
    if !kind.is_empty() {
        ui.label(quiet("No policy acts here."));
        return;
    }
    ui.spacing_mut().interact_size.y = ROW - 3.0;
    let panels: Vec<_> = panels.iter().filter_map(|panel| Some((panel, panel.policy?))).collect();
    let experts =
        panels.iter().filter_map(|(panel, _)| panel.clone).map(|(_, p)| p.len() / grid.cells()).max().unwrap_or(0);
    ScrollArea::both().auto_shrink([false, true]).min_scrolled_height(height(experts)).show(ui, |ui| {
        Table::new("inspector").striped(false).spacing([8.0, 3.0]).min_col_width(0.0).show(ui, |ui| {
            table::describe(ui, "The cell in every panel");
            let label = |ui: &mut Ui, row: Id, role: Role, text: RichText| {
                table::cell(ui, row, role, |ui| ui.label(text));
            };
            let head = table::row(ui);
            label(ui, head, Role::Cell, RichText::new(""));
            for (panel, _) in &panels {
                label(ui, head, Role::ColumnHeader, RichText::new(&panel.short).small().strong());
            }
            ui.end_row();
            let row = table::row(ui);
            label(ui, row, Role::RowHeader, quiet("steps"));
            for (_, policy) in &panels {
                let steps = numbers::steps(f64::from(policy.hitting_time[state]));
                label(ui, row, Role::Cell, RichText::new(steps).small());
            }
            ui.end_row();
            let probability = |p: f32| {
                let text = RichText::new(numbers::decimal(f64::from(p), 2)).small();
                if p < 0.005 { text.color(palette.muted) } else { text }
            };
            for action in Action::ALL {
                let row = table::row(ui);
                label(ui, row, Role::RowHeader, quiet(action.name()));
                for (_, policy) in &panels {
                    label(ui, row, Role::Cell, probability(policy.policy[state][action as usize]));
                }
                ui.end_row();
            }
            for expert in 0..experts {
                let row = table::row(ui);
                label(ui, row, Role::RowHeader, quiet(&format!("p({}|s)", expert + 1)));
                for (panel, _) in &panels {
                    let text = match panel.clone {
                        Some((_, p)) => {
                            // As many as it has contexts: a clone that tells nobody apart has none.
                            let here = p.chunks_exact((p.len() / grid.cells()).max(1)).nth(state);
                            let known = here.and_then(|here| here.get(expert));
                            known.map_or(RichText::new("–").small(), |&p| probability(p))
                        }
                        None => RichText::new(""),
                    };
                    label(ui, row, Role::Cell, text);
                }
                ui.end_row();
            }
        });
    });
}
