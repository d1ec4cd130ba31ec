//! Runs that stay on the page: their figures stand under those of the run shown, their curves behind its curve.

use egui::{Color32, Grid, RichText, Ui};

use super::app::{App, Opened};
use super::board::Shown;
use super::numbers;
use super::theme::{self, Palette};
use super::widgets::{Icon, icon_button};
use crate::experiment::address::shown as shorten;
use crate::experiment::{PRESETS, Setup};
use crate::mdp::RETURN_KINDS;

/// A run that is kept as it was last seen.
pub struct Kept {
    pub shown: Shown,
    /// What tells it from the others.
    pub name: String,
    /// The file that its ensemble is from.
    file: Option<Opened>,
}

/// Most runs that are kept; the oldest gives way.
const MOST: usize = 5;

impl App {
    /// Keeps the run shown, to lay the next beside it.
    pub fn pin(&mut self) {
        if let Some(shown) = self.shown.clone() {
            self.keep(shown);
        }
    }

    pub(super) fn keep(&mut self, shown: Shown) {
        let file = self.opened.clone().filter(|_| shown.started.setup.ensemble.is_some());
        let name = name(&shown, file.as_ref().map(|file| &*file.name));
        // The same moment of the same run twice says nothing.
        self.kept.retain(|kept| !is_same(&kept.shown, &shown));
        self.kept.push(Kept { shown, name, file });
        if self.kept.len() > MOST {
            self.kept.remove(0);
        }
    }

    /// Brings a kept run back: it is trained again, to the same digest.
    fn bring_back(&mut self, index: usize) {
        let Kept { shown, file, .. } = &self.kept[index];
        let file = file.clone();
        let snapshot = &shown.snapshot;
        let mut setup = shown.started.setup.clone();
        setup.course = snapshot.course.clone();
        let promise = super::app::Promise { update: Some(snapshot.update), digest: snapshot.digest, leads: true };
        let is_trained = setup.ensemble.is_none();
        let text = setup.ensemble.as_ref().and_then(|ensemble| serde_json::to_string(ensemble).ok());
        let preset = PRESETS.iter().position(|preset| (preset.setup)() == setup);
        self.begin(setup, preset);
        // Where another run was on its way when it was kept, the name of its file was gone.
        let name = file.map(|file| file.name).or(preset.is_none().then(|| "ape-ensemble.json".to_owned()));
        if let (Some(name), Some(text)) = (name, text) {
            self.notice = self.keep_file(&name, &text).err();
            self.opened = Some(Opened::new(name, &text));
        }
        self.promise = Some(promise).filter(|_| is_trained);
    }
}

/// Whether both are the same moment of the same run.
fn is_same(one: &Shown, other: &Shown) -> bool {
    let of = |shown: &Shown| {
        let Setup { grid, config, ensemble, .. } = shown.started.setup.clone();
        (grid, config, ensemble, shown.snapshot.course.clone(), shown.snapshot.update)
    };
    of(one) == of(other)
}

/// What a run is called: what it differs in from others. A given ensemble has the name of its preset or file.
fn name(shown: &Shown, file: Option<&str>) -> String {
    let (setup, snapshot) = (&shown.started.setup, &shown.snapshot);
    let config = &setup.config;
    let turns = &snapshot.course.turns;
    let turned = |(update, beta): &(u32, f64)| format!(", from {update} on {}", numbers::as_set(*beta));
    let beta = match turns.len() {
        0..=3 => format!("β {}{}", numbers::as_set(config.beta), turns.iter().map(turned).collect::<String>()),
        _ => "β on a course".to_owned(),
    };
    match setup.ensemble {
        Some(_) => {
            let preset = PRESETS.iter().find(|preset| (preset.setup)() == *setup).map(|preset| preset.title);
            file.or(preset).map_or_else(|| "given ensemble".to_owned(), |name| format!("given: {}", shorten(name)))
        }
        None => format!("{beta} · {} · n {} · seed {}", config.observer, config.experts, config.seed),
    }
}

/// The figures of the kept runs, each with its colour on the chart.
pub fn show(ui: &mut Ui, app: &mut App) {
    if app.kept.is_empty() {
        return;
    }
    let (mut dropped, mut brought) = (None, None);
    let is_narrow = ui.available_width() < theme::NARROW;
    ui.add_space(4.0);
    let lines: Vec<Line> = app.kept.iter().map(|kept| Line::of(kept, app.view.kind)).collect();
    let palette = Palette::of(ui);
    let small = |ui: &mut Ui, text: &str, color: Color32| {
        ui.add(egui::Label::new(RichText::new(text).small().color(color)).extend());
    };
    let mut buttons = |ui: &mut Ui, index: usize, name: &str| {
        let button = egui::Button::new("Show again");
        let response = ui
            .add(if is_narrow { button } else { button.small() })
            .on_hover_text("Trains it again, to the same digest");
        if response.accessible_name(format!("Show again: {name}")).clicked() {
            brought = Some(index);
        }
        if icon_button(ui, Icon::Remove, &format!("Drop: {name}"), false).clicked() {
            dropped = Some(index);
        }
    };
    if is_narrow {
        small(ui, "Kept to compare", palette.muted);
        for (index, line) in lines.iter().enumerate() {
            let [ensemble, clone, ratio, update, _] = &line.figures;
            ui.add(
                egui::Label::new(RichText::new(format!("— {}", line.name)).small().color(palette.kept(index))).wrap(),
            );
            small(ui, &format!("ensemble {ensemble}, clone {clone}, {ratio}, update {update}"), palette.ink);
            ui.horizontal(|ui| buttons(ui, index, &line.name));
        }
    } else {
        Grid::new("kept").spacing([14.0, 0.0]).min_col_width(0.0).show(ui, |ui| {
            for head in ["Kept to compare", "ensemble", "clone", "clone ÷ ensemble", "update", "digest", ""] {
                small(ui, head, palette.muted);
            }
            ui.end_row();
            for (index, line) in lines.iter().enumerate() {
                ui.spacing_mut().interact_size.y = 22.0;
                small(ui, &format!("— {}", line.name), palette.kept(index));
                for (column, figure) in line.figures.iter().enumerate() {
                    small(ui, figure, if column == 4 { palette.muted } else { palette.ink });
                }
                ui.horizontal(|ui| buttons(ui, index, &line.name));
                ui.end_row();
            }
        });
    }
    if let Some(index) = brought {
        app.bring_back(index);
    }
    if let Some(index) = dropped {
        app.kept.remove(index);
    }
}

/// A kept run in words.
struct Line {
    name: String,
    /// Ensemble, clone, their ratio, update, digest.
    figures: [String; 5],
}

impl Line {
    fn of(kept: &Kept, at: usize) -> Line {
        let kind = &RETURN_KINDS[at];
        let snapshot = &kept.shown.snapshot;
        let clone = snapshot.clones.first().and_then(|clone| clone.view.returns.get(at));
        let ensemble = (kind.get)(&snapshot.ensemble);
        let ratio = clone.filter(|_| kind.is_steps).map(|clone| numbers::times(clone, ensemble));
        let dash = || "–".to_owned();
        Line {
            name: kept.name.clone(),
            figures: [
                numbers::of_kind(kind, ensemble),
                clone.map_or_else(dash, |clone| numbers::of_kind(kind, clone)),
                ratio.unwrap_or_else(dash),
                snapshot.update.to_string(),
                snapshot.digest.map_or_else(dash, |digest| digest.to_string()),
            ],
        }
    }
}
