//! The bar on top: presets, play, step, reset, speed, theme, help.

use egui::{Align, ComboBox, Layout, RichText, Slider, ThemePreference, Ui};

use super::app::App;
use super::theme::{self, Palette};
use super::widgets::{Icon, heading, icon_button};
use crate::experiment::PRESETS;
use crate::lab::{Command, RunState};

/// Speeds on offer, in updates per second; the last is as fast as it goes.
pub const SPEEDS: [Option<f32>; 9] =
    [Some(1.0), Some(5.0), Some(20.0), Some(60.0), Some(150.0), Some(300.0), Some(600.0), Some(1500.0), None];

pub fn show(ui: &mut Ui, app: &mut App) {
    if ui.available_width() < theme::NARROW {
        ui.horizontal(|ui| {
            heading(ui, 1, RichText::new("ape-lab").heading());
            at_the_right(ui, app);
        });
        ui.horizontal(|ui| {
            presets(ui, app);
            transport(ui, app);
        });
    } else {
        ui.spacing_mut().interact_size.y = 34.0;
        ui.horizontal(|ui| {
            heading(ui, 1, RichText::new("ape-lab").heading());
            presets(ui, app);
            transport(ui, app);
            speed(ui, app);
            at_the_right(ui, app);
        });
    }
}

fn at_the_right(ui: &mut Ui, app: &mut App) {
    ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
        if icon_button(ui, Icon::Help, "What is this?", false).clicked() {
            app.view.is_help_open = !app.view.is_help_open;
        }
        theme_button(ui);
    });
}

fn presets(ui: &mut Ui, app: &mut App) {
    let chosen = app.preset();
    let title = chosen.map_or("own settings", |index| PRESETS[index].title);
    ComboBox::from_id_salt("preset")
        .width(150.0)
        .height(theme::MENU)
        .selected_text(title)
        .show_ui(ui, |ui| {
            for (index, preset) in PRESETS.iter().enumerate() {
                let is_chosen = chosen == Some(index);
                if ui.selectable_label(is_chosen, preset.title).on_hover_text(preset.summary).clicked() {
                    app.load_preset(index);
                }
            }
        })
        .response
        .accessible_name("Preset")
        .on_hover_text(chosen.map_or("Settings of your own", |index| PRESETS[index].summary));
}

fn transport(ui: &mut Ui, app: &mut App) {
    let state = app.shown().map(|(_, snapshot)| snapshot.state);
    let can_train = app.setup().ensemble.is_none() && state.is_some() && app.is_session_alive();
    ui.add_enabled_ui(can_train, |ui| {
        ui.spacing_mut().item_spacing.x = 4.0;
        let is_playing = state == Some(RunState::Playing) || app.is_retraining();
        let (icon, name) = match state {
            _ if is_playing => (Icon::Pause, "Pause"),
            Some(RunState::Finished) => (Icon::Play, "Train on for another run"),
            _ => (Icon::Play, "Play"),
        };
        if icon_button(ui, icon, name, true).clicked() {
            app.send(if is_playing { Command::Pause } else { Command::Play });
        }
        if icon_button(ui, Icon::Step, "One update", false).clicked() {
            app.send(Command::Step);
        }
        if icon_button(ui, Icon::Reset, "Back to the start", false).clicked() {
            app.send(Command::Reset);
        }
    });
}

/// The speed of training, from one update a second to as fast as it goes.
pub fn speed(ui: &mut Ui, app: &mut App) {
    let palette = Palette::of(ui);
    let mut speed = app.view.speed;
    ui.horizontal(|ui| {
        ui.spacing_mut().slider_width = 110.0;
        let slider = Slider::new(&mut speed, 0..=SPEEDS.len() - 1).show_value(false);
        let response = ui.add(slider).accessible_name("Speed").on_hover_text("Updates per second");
        if response.changed() {
            app.view.speed = speed;
            app.send(Command::Speed(SPEEDS[speed]));
        }
        let text = SPEEDS[speed].map_or("as fast as it goes".to_owned(), |speed| format!("{speed} updates/s"));
        ui.label(RichText::new(text).small().color(palette.muted));
    });
}

fn theme_button(ui: &mut Ui) {
    let now = ui.ctx().options(|options| options.theme_preference);
    let (icon, name, next) = match now {
        ThemePreference::System => (Icon::Auto, "Theme: as the system. Switch to light", ThemePreference::Light),
        ThemePreference::Light => (Icon::Sun, "Theme: light. Switch to dark", ThemePreference::Dark),
        ThemePreference::Dark => (Icon::Moon, "Theme: dark. Switch to the system's", ThemePreference::System),
    };
    if icon_button(ui, icon, name, false).clicked() {
        ui.ctx().set_theme(next);
    }
}
