//! The timeline: every update of the run, to go back to and to go on from.

use egui::{Key, RichText, Slider, Ui};

use super::app::View;
use super::board::Shown;
use super::numbers;
use super::panels::Touched;
use super::theme::{self, Palette};
use super::widgets::{Icon, icon_button};
use crate::ape::{Config, Field};
use crate::lab::RunState;

/// Width from which the controls of a branch stand in one line.
const ONE_LINE: f32 = 400.0;

/// Height of the timeline; looking back it needs another line.
pub fn height(ui: &Ui, shown: &Shown) -> f32 {
    let line = ui.spacing().interact_size.y + ui.spacing().item_spacing.y;
    match shown.snapshot.state {
        RunState::Given => 0.0,
        _ if is_back(shown) && ui.available_width() < ONE_LINE => 3.0 * line,
        _ if is_back(shown) => 2.0 * line,
        _ => line,
    }
}

/// Whether the moment shown lies back.
fn is_back(shown: &Shown) -> bool {
    shown.snapshot.update < shown.snapshot.recorded && shown.snapshot.state != RunState::Playing
}

/// Draws it for the run shown, in the whole width.
pub fn show(ui: &mut Ui, shown: &Shown, view: &View, touched: &mut Touched) {
    let snapshot = &shown.snapshot;
    if snapshot.state == RunState::Given {
        return;
    }
    let palette = Palette::of(ui);
    let now = view.sought.unwrap_or(snapshot.update);
    let mut update = now;
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let text = format!("{now} of {}", snapshot.recorded);
        let buttons = 2.0 * (theme::icon_size(ui).x + 4.0);
        ui.spacing_mut().slider_width = (ui.available_width() - buttons - 100.0).max(60.0);
        if icon_button(ui, Icon::Earlier, "One update back", false).clicked() {
            update = now.saturating_sub(1);
        }
        let slider = Slider::new(&mut update, 0..=snapshot.recorded.max(1)).show_value(false);
        let help = "Every update of the run: drag, and everything on the page is as it was then (Left and Right; with Shift fifty)";
        let response = ui.add(slider).accessible_name("Timeline").on_hover_text(help);
        // The slider itself knows steps of one.
        let by = |key| ui.input(|input| if input.modifiers.shift && input.key_pressed(key) { 50 } else { 0 });
        if response.has_focus() {
            let (less, more) = (by(Key::ArrowLeft), by(Key::ArrowRight));
            if less + more > 0 {
                update = (now + more).saturating_sub(less).min(snapshot.recorded);
            }
        }
        if icon_button(ui, Icon::Later, "One update on", false).clicked() {
            update = (now + 1).min(snapshot.recorded);
        }
        ui.label(RichText::new(text).small().color(palette.muted));
    });
    if update != now {
        touched.update = Some(update);
    }
    if is_back(shown) {
        branch(ui, shown, touched);
    }
}

/// Going on from a moment that lies back.
fn branch(ui: &mut Ui, shown: &Shown, touched: &mut Touched) {
    let is_narrow = ui.available_width() < ONE_LINE;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        let id = egui::Id::unique("branch β");
        let run = shown.snapshot.run;
        // What was set for this run, or the β that it has.
        let drafted = ui.data(|data| data.get_temp::<(u32, f64)>(id)).filter(|(of, _)| *of == run);
        let mut beta = drafted.map_or(shown.snapshot.beta, |(_, beta)| beta);
        ui.label(RichText::new("from here with β").small().color(Palette::of(ui).muted));
        let drag = numbers::exact(&mut beta).range(0.0..=Config::MAX_BETA).speed(0.01);
        let response = ui.add(drag).accessible_name("β of the branch").on_hover_text(Field::named("beta").tip());
        if response.changed() {
            ui.data_mut(|data| data.insert_temp(id, (run, beta)));
        }
        if is_narrow {
            ui.end_row();
        }
        let help =
            "Trains on from this moment with this β, as a branch of its own; the run it leaves is kept to compare with";
        if ui.button("Continue from here").on_hover_text(help).clicked() {
            touched.continue_with = Some(beta);
        }
        let latest = shown.snapshot.recorded;
        if ui.button("To the end").on_hover_text("Shows the last update again").clicked() {
            touched.update = Some(latest);
        }
    });
}
