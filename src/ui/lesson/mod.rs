//! The lesson: a few short steps beside the live page, which is their picture.
//!
//! steps.rs: what the steps say. live.rs: their figures, taken from the ensemble on the page.

mod live;
mod steps;

use egui::{Label, RichText, Ui, vec2};

pub use steps::STEPS;

use super::app::{App, Tab};
use super::math::math;
use super::theme::{self, Palette};
use super::widgets::heading;
use crate::attack::AttackerChoice;
use crate::experiment::{PRESETS, Setup};
use crate::lab::{Command, RunState};
use crate::mdp::RETURN_KINDS;

/// One step of the lesson.
pub struct Step {
    pub title: &'static str,
    /// What stands on the page while it is read.
    scene: Scene,
    blocks: &'static [Block],
}

/// What a step shows.
struct Scene {
    setup: fn() -> Setup,
    /// Who clones, by name.
    clones: &'static [&'static str],
    /// The name of the return that is shown.
    kind: &'static str,
    mark: Mark,
}

/// The cell that is marked in every panel.
enum Mark {
    None,
    Cell(u32, u32),
}

/// A part of a step.
enum Block {
    Text(&'static str),
    /// An equation, and how it is spoken.
    Math(&'static str, &'static str),
    /// What the ensemble on the page says to it.
    Live(fn(&App) -> Option<String>),
    /// Something to try.
    Try(&'static str),
    /// A button that leads to another tab.
    Go(Tab, &'static str),
}

/// Draws the step that is open, with the way to the others.
pub fn show(ui: &mut Ui, app: &mut App) {
    let palette = Palette::of(ui);
    // A setup of the visitor's own is not replaced before they ask for it.
    if app.view.staged != Some(app.view.step) && app.preset().is_some() {
        set_stage(app);
    }
    // A new step is read from its beginning.
    let id = egui::Id::unique("lesson step");
    let read = ui.data(|data| data.get_temp::<usize>(id));
    if read.is_some_and(|read| read != app.view.step) {
        ui.scroll_to_cursor(Some(egui::Align::TOP));
    }
    ui.data_mut(|data| data.insert_temp(id, app.view.step));
    let mut go_to = None;
    let step = app.view.step.min(STEPS.len() - 1);
    ui.spacing_mut().item_spacing.y = 8.0;
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 3.0;
        ui.spacing_mut().button_padding.x = 2.0;
        let least = if ui.ctx().content_rect().width() < theme::NARROW { 40.0 } else { 0.0 };
        let width = ((ui.available_width() - 3.0 * 9.0) / STEPS.len() as f32).floor().clamp(least, 40.0_f32.max(least));
        for (index, other) in STEPS.iter().enumerate() {
            let button = egui::Button::selectable(index == step, (index + 1).to_string()).frame_when_inactive(true);
            let response = ui.add(button.min_size(vec2(width, 0.0)));
            let name = format!("Step {}: {}", index + 1, other.title);
            response
                .widget_info(|| egui::WidgetInfo::selected(egui::Role::RadioButton, true, index == step, name.clone()));
            if response.on_hover_text(other.title).clicked() {
                go_to = Some(index);
            }
        }
    });
    let Step { title, blocks, .. } = &STEPS[step];
    heading(ui, 2, RichText::new(*title).heading());
    for block in *blocks {
        match block {
            Block::Text(text) => _ = ui.add(Label::new(*text).wrap()),
            Block::Math(tex, spoken) => {
                ui.add_space(2.0);
                math(ui, tex, spoken);
                ui.add_space(2.0);
            }
            Block::Live(figures) => {
                let text = figures(app).unwrap_or("The figures of this page will stand here …".to_owned());
                egui::Frame::new().fill(palette.raised).corner_radius(6).inner_margin(8).show(ui, |ui| {
                    ui.set_width(ui.available_width());
                    ui.label(RichText::new("On this page now").small().color(palette.muted));
                    ui.add(Label::new(text).wrap());
                });
            }
            Block::Try(text) => {
                ui.horizontal_top(|ui| {
                    ui.label(RichText::new("Try").text_style(theme::strong()).color(palette.accent));
                    ui.add(Label::new(*text).wrap());
                });
            }
            Block::Go(tab, text) => {
                if ui.button(*text).clicked() {
                    app.view.tab = *tab;
                }
            }
        }
    }
    ui.add_space(4.0);
    ui.horizontal_wrapped(|ui| {
        if ui.add_enabled(step > 0, egui::Button::new("Back")).clicked() {
            go_to = Some(step - 1);
        }
        let next = egui::Button::new(RichText::new("Next").color(palette.on_accent)).fill(palette.accent);
        if ui.add_enabled(step + 1 < STEPS.len(), next).clicked() {
            go_to = Some(step + 1);
        }
        ui.label(RichText::new(format!("{} of {}", step + 1, STEPS.len())).small().color(palette.muted));
        if !is_on_stage(app) {
            let help = "You have changed something, which is the idea. This brings back what the step talks about.";
            if ui.button("Show this step again").on_hover_text(help).clicked() {
                set_stage(app);
            }
        }
    });
    if let Some(step) = go_to {
        app.view.step = step;
        set_stage(app);
    }
}

/// Whether what the step talks about is there.
fn is_on_stage(app: &App) -> bool {
    let scene = &STEPS[app.view.step].scene;
    let is_back = app.shown().is_some_and(|(_, snapshot)| snapshot.state == RunState::Paused);
    *app.setup() == (scene.setup)() && app.view.clones == scene.clones() && app.view.kind == scene.kind() && !is_back
}

impl Scene {
    fn clones(&self) -> Vec<AttackerChoice> {
        self.clones.iter().filter_map(|name| name.parse().ok()).collect()
    }

    fn kind(&self) -> usize {
        RETURN_KINDS.iter().position(|kind| kind.name == self.kind).unwrap_or(0)
    }
}

/// Puts on the page what the step talks about; a run that is there already is not trained again.
fn set_stage(app: &mut App) {
    let scene = &STEPS[app.view.step].scene;
    let setup = (scene.setup)();
    let cols = setup.grid.cols;
    if setup != *app.setup() {
        let preset = PRESETS.iter().position(|preset| (preset.setup)() == setup);
        app.begin(setup, preset);
    } else if let Some((_, snapshot)) = app.shown().filter(|(_, snapshot)| snapshot.state == RunState::Paused) {
        // The visitor has looked back, or stopped on the way.
        let is_whole = snapshot.recorded >= snapshot.last_update;
        if is_whole { app.seek(u32::MAX) } else { app.send(Command::Play) }
    }
    app.show_clones(scene.clones());
    app.view.kind = scene.kind();
    app.view.cell = match scene.mark {
        Mark::None => None,
        Mark::Cell(row, col) => Some((row * cols + col) as usize),
    };
    app.view.beta_mode = super::app::BetaMode::Retrain;
    app.view.staged = Some(app.view.step);
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every step names cloners, returns, cells and equations that there are.
    #[test]
    fn every_step_can_be_shown() {
        assert!((8..=10).contains(&STEPS.len()));
        for Step { title, scene, blocks } in &STEPS {
            let setup = (scene.setup)();
            assert_eq!(setup.check().map_err(|error| error.to_string()), Ok(()), "{title}");
            assert!(scene.clones.iter().all(|name| name.parse::<AttackerChoice>().is_ok()), "{title}");
            assert!(RETURN_KINDS.iter().any(|kind| kind.name == scene.kind), "{title}");
            if let Mark::Cell(row, col) = scene.mark {
                assert!(row < setup.grid.rows && col < setup.grid.cols);
            }
            let mut words = 0;
            for block in *blocks {
                match block {
                    Block::Math(tex, spoken) => {
                        assert_eq!(super::super::math::check(tex), Ok(()), "{tex}");
                        assert!(!spoken.is_empty());
                    }
                    Block::Text(text) | Block::Try(text) => words += text.split_whitespace().count(),
                    Block::Live(_) | Block::Go(..) => {}
                }
            }
            // Short: a minute to read.
            assert!((40..=230).contains(&words), "{title}: {words} words");
        }
    }
}
