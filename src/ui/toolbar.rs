//! The bar on top: presets, play, step, reset, speed; keep, link, export, find, settings, help.

use egui::{Align, ComboBox, Layout, RichText, Slider, Ui};

use super::app::App;
use super::theme::{self, Palette};
use super::widgets::{Icon, heading, icon_button};
use super::{commands, settings};
use crate::experiment::PRESETS;
use crate::lab::{Command, RunState};

/// Speeds on offer, in updates per second; the last is as fast as it goes.
pub const SPEEDS: [Option<f32>; 9] =
    [Some(1.0), Some(5.0), Some(20.0), Some(60.0), Some(150.0), Some(300.0), Some(600.0), Some(1500.0), None];

/// The place in [`SPEEDS`] that the page opens with: a whole run of the paper in two and a half seconds.
pub const DEFAULT_SPEED: usize = 5;

/// Width of the page under which its name stands over its buttons.
const TINY: f32 = 360.0;

pub fn show(ui: &mut Ui, app: &mut App) {
    if ui.available_width() < theme::NARROW {
        if ui.available_width() < TINY {
            heading(ui, 1, RichText::new("ape-lab").heading());
            ui.horizontal(|ui| at_the_right(ui, app));
        } else {
            ui.horizontal(|ui| {
                heading(ui, 1, RichText::new("ape-lab").heading());
                at_the_right(ui, app);
            });
        }
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
        commands::button(ui, app, "help");
        settings_menu(ui, app);
        commands::button(ui, app, "palette");
        export_menu(ui, app);
        commands::button(ui, app, "link");
        commands::button(ui, app, "pin");
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
        let (icon, name) = match state {
            _ if app.is_playing() => (Icon::Pause, "Pause"),
            Some(RunState::Finished) => (Icon::Play, "Train on for another run"),
            _ => (Icon::Play, "Play"),
        };
        let play = commands::named("play");
        if icon_button(ui, icon, name, true).on_hover_text(play.tip()).clicked() {
            (play.run)(app, ui.ctx());
        }
        commands::button(ui, app, "step");
        commands::button(ui, app, "reset");
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

/// What can be taken away from the page, and brought to it.
fn export_menu(ui: &mut Ui, app: &mut App) {
    let button = icon_button(ui, Icon::Save, "Export and open", false);
    egui::Popup::menu(&button).show(|ui| {
        for name in ["figure", "figure png", "curve", "ensemble", "model"] {
            commands::menu_line(ui, app, name);
        }
        ui.separator();
        for name in ["open", "table"] {
            commands::menu_line(ui, app, name);
        }
    });
}

fn settings_menu(ui: &mut Ui, app: &mut App) {
    let button = icon_button(ui, Icon::Settings, "Settings", false);
    egui::Popup::from_toggle_button_response(&button)
        .close_behavior(egui::PopupCloseBehavior::CloseOnClickOutside)
        .show(|ui| settings::show(ui, app));
}
