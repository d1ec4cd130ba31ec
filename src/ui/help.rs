//! What this page is, in a few paragraphs.

use egui::{Frame, Grid, Modal, RichText, Ui};

use super::commands;
use super::theme::{self, Palette};
use super::widgets::{dialog, heading};

const PARAGRAPHS: [(&str, &str); 5] = [
    (
        "What is trained",
        "A few expert policies learn to cross a grid to the flag. One of them, drawn at random, acts for a whole \
         episode. They are rewarded for arriving soon, and for the failure of whoever clones them: they climb \
         J = E[ensemble] − β E[clone] (Zhan, Tiomkin and Abbeel, 2019).",
    ),
    (
        "What the clone is",
        "An observer sees cells and actions, not which expert acted, and learns at each cell a mixture of the \
         experts, each weighed by p(c|s). That guess is the observer.",
    ),
    (
        "What you see",
        "Colour is the expected number of steps from a cell to the flag, cut at 100; arrows are the probability of each \
         move, a dot that of staying. All figures are exact, but for \
         those of a learned memory, which are simulated and say so. Only training plays episodes, and who has to learn from some.",
    ),
    (
        "What to try",
        "Move β to 0: the experts agree, and the clone is as good as they are. Move it up: they disagree where it hurts, \
         and the blind clone gets lost. Then choose the observer “occupancy”, who clones the demonstrations \
         themselves: the protection is gone, whatever β is. The tabs hold a lesson, a race, a world to draw, the paper's tables and every cloner.",
    ),
    (
        "Why that must be",
        "Such a clone takes D + Σ m(s) h(s) steps, where D is the length of the demonstrations and m(s) the share of them \
         cut off at s. Where none is cut off, the clone is exactly as good as the ensemble.",
    ),
];

/// Shows the window; returns whether it was closed.
pub fn show(ui: &mut Ui) -> bool {
    let frame = Frame::popup(ui.style()).inner_margin(20);
    let response = Modal::new(egui::Id::unique("help")).frame(frame).show(ui.ctx(), |ui| {
        ui.set_max_width(520.0_f32.min(ui.ctx().content_rect().width() - 48.0));
        dialog(ui, "What is this?");
        heading(ui, 2, RichText::new("ape-lab").heading());
        ui.label(
            RichText::new("Policies that reach the goal and cannot be cloned. Or can they?")
                .color(Palette::of(ui).muted),
        );
        let version = concat!("Version ", env!("CARGO_PKG_VERSION"));
        ui.label(RichText::new(version).small().color(Palette::of(ui).muted));
        egui::ScrollArea::vertical().max_height(ui.ctx().content_rect().height() - 200.0).show(ui, |ui| {
            for (title, text) in PARAGRAPHS {
                ui.add_space(6.0);
                heading(ui, 3, RichText::new(title).text_style(theme::strong()));
                ui.label(text);
            }
            ui.add_space(6.0);
            heading(ui, 3, RichText::new("Keys").text_style(theme::strong()));
            Grid::new("keys").num_columns(4).spacing([10.0, 2.0]).show(ui, |ui| {
                for (index, (key, title)) in commands::shortcuts().enumerate() {
                    ui.label(RichText::new(key).text_style(theme::strong()));
                    ui.label(title);
                    if index % 2 == 1 {
                        ui.end_row();
                    }
                }
            });
        });
        ui.add_space(8.0);
        ui.button("Close").clicked()
    });
    response.inner || response.should_close()
}
