//! The policies as a table of text: what the heatmaps show, for reading, searching and screen readers.

use egui::{Frame, Id, Label, Modal, RichText, Role, ScrollArea, Ui};

use super::app::App;
use super::numbers;
use super::panels;
use super::table::{self, row};
use super::theme::{self, Palette};
use super::widgets::{choose_wrapped, dialog, heading};
use crate::mdp::Action;

/// Height of a line.
const ROW: f32 = 20.0;

/// Shows the window over the page.
pub fn show(ui: &mut Ui, app: &mut App) {
    let Some(shown) = &app.shown else { return };
    let list = panels::list(&shown.started, &shown.snapshot, &app.view);
    let id = egui::Id::unique("policy table");
    let mut chosen = ui.data(|data| data.get_temp::<usize>(id)).unwrap_or(0).min(list.len() - 1);
    let screen = ui.ctx().content_rect().size();
    let frame = Frame::popup(ui.style()).inner_margin(16);
    let response = Modal::new(id).frame(frame).show(ui.ctx(), |ui| {
        let palette = Palette::of(ui);
        dialog(ui, "Policies as a table");
        ui.set_width(640.0_f32.min(screen.x - 48.0));
        heading(ui, 2, RichText::new("Policies as a table").heading());
        ui.horizontal_wrapped(|ui| {
            let options: Vec<(usize, &str, &str)> =
                list.iter().enumerate().map(|(index, panel)| (index, &*panel.title, "Its table")).collect();
            choose_wrapped(ui, "Policy", &mut chosen, &options);
        });
        let Some(policy) = list[chosen].policy else {
            ui.label(RichText::new(&list[chosen].waiting).color(palette.muted));
            return ui.button("Close").clicked();
        };
        let heads = ["row", "column", "steps"].into_iter().chain(Action::ALL.map(Action::name));
        let width = (ui.available_width() - 16.0) / 8.0;
        let cell = |ui: &mut Ui, row: Id, role: Role, text: RichText| {
            let label = Label::new(text.small()).extend();
            table::cell(ui, row, role, |ui| ui.add_sized([width - 4.0, ROW - 4.0], label));
        };
        ui.spacing_mut().item_spacing = egui::vec2(4.0, 0.0);
        ui.spacing_mut().interact_size.y = ROW;
        ui.scope(|ui| {
            table::describe(ui, &list[chosen].title);
            ui.horizontal(|ui| {
                let row = row(ui);
                heads.for_each(|head| {
                    cell(ui, row, Role::ColumnHeader, RichText::new(head).text_style(theme::strong()))
                });
            });
            let states: Vec<usize> = (0..shown.grid.cells()).filter(|&state| !shown.grid.is_wall(state)).collect();
            let area = ScrollArea::vertical().max_height(screen.y - 260.0).auto_shrink([false, true]);
            area.show_rows(ui, ROW, states.len(), |ui, rows| {
                for &state in &states[rows] {
                    let at = shown.grid.cell(state);
                    let steps = numbers::steps(f64::from(policy.hitting_time[state]));
                    ui.horizontal(|ui| {
                        let row = row(ui);
                        cell(ui, row, Role::RowHeader, RichText::new(at.0.to_string()));
                        cell(ui, row, Role::RowHeader, RichText::new(at.1.to_string()));
                        cell(ui, row, Role::Cell, RichText::new(steps));
                        if state == shown.grid.goal() {
                            return cell(ui, row, Role::Cell, RichText::new("the goal").color(palette.muted));
                        }
                        for p in policy.policy[state] {
                            let text = RichText::new(numbers::decimal(f64::from(p), 3));
                            cell(ui, row, Role::Cell, if p < 0.0005 { text.color(palette.muted) } else { text });
                        }
                    });
                }
            });
        });
        ui.add_space(8.0);
        ui.button("Close").clicked()
    });
    ui.data_mut(|data| data.insert_temp(id, chosen));
    if response.inner || response.should_close() {
        app.view.is_table_open = false;
    }
}
