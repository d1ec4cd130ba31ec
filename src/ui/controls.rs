//! The controls: observer, number of experts, seed, and every other field of the configuration.

use egui::{CollapsingHeader, ComboBox, DragValue, RichText, Ui};

use super::app::App;
use super::numbers;
use super::theme::Palette;
use super::toolbar;
use super::widgets::{Icon, choose, icon_button, section};
use crate::ape::observer::ObserverChoice;
use crate::ape::{AlgorithmKind, Config, FIELDS, Field, Kind};

/// Fields that stand elsewhere on the page; the rest is under "advanced".
const ELSEWHERE: [&str; 5] = ["algorithm", "experts", "beta", "observer", "seed"];

pub fn show(ui: &mut Ui, app: &mut App) {
    let mut config = app.setup().config.clone();
    let is_given = app.setup().ensemble.is_some();
    let explains = app.preferences.explains;
    if is_given {
        let text = "This preset shows a given ensemble. Changing anything here trains one.";
        ui.label(RichText::new(text).small().color(Palette::of(ui).muted));
    }
    section(ui, "Algorithm");
    explain(ui, explains, Field::named("algorithm"));
    let options = [
        (AlgorithmKind::PgApe, "PG-APE", "The paper's Algorithm 1: policy gradient from sampled episodes"),
        (
            AlgorithmKind::Exact,
            "exact",
            "The exact gradient of J over T steps, nothing sampled (ours). It needs an observer with a formula: uniform or occupancy.",
        ),
    ];
    let before = config.clone();
    choose(ui, "Algorithm", &mut config.algorithm, &options);
    section(ui, "Observer");
    ui.label(RichText::new("Who do the experts expect to clone them?").small().color(Palette::of(ui).muted));
    for choice in ObserverChoice::all() {
        let is_chosen = config.observer.model().name == choice.model().name;
        let text = format!("{}: {}", choice.model().name, choice.model().title);
        let response = ui.radio(is_chosen, text).on_hover_text(choice.model().summary);
        if explains {
            ui.label(RichText::new(choice.model().summary).small().color(Palette::of(ui).muted));
        }
        if response.clicked() && !is_chosen {
            config.observer = choice;
        }
    }
    if let Some(range) = &config.observer.model().parameter {
        ui.horizontal(|ui| {
            let mut value = config.observer.parameter();
            let drag = DragValue::new(&mut value).range(range.low..=range.high).speed(0.3).update_while_editing(false);
            ui.add(drag).accessible_name(range.meaning).on_hover_text(Field::named("observer").tip());
            ui.label(RichText::new(range.meaning).small().color(Palette::of(ui).muted));
            config.observer = config.observer.with_parameter(value);
        });
    }
    // What is chosen last is what counts: the other gives way where the two do not go together.
    if config.check().is_err() && config.algorithm == AlgorithmKind::Exact {
        if config.observer == before.observer {
            config.observer = ObserverChoice::OCCUPANCY;
        } else {
            config.algorithm = AlgorithmKind::PgApe;
        }
    }
    section(ui, "Experts");
    explain(ui, explains, Field::named("experts"));
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = 1.0;
        ui.spacing_mut().button_padding.x = 2.0;
        // Wide enough for a finger on a narrow page, and all in one row elsewhere.
        let in_one_row = ((ui.available_width() - 7.0) / Config::MAX_EXPERTS as f32).floor().min(40.0);
        let is_narrow = ui.ctx().content_rect().width() < super::theme::NARROW;
        let width = if is_narrow { 40.0 } else { in_one_row };
        for n in 1..=Config::MAX_EXPERTS {
            let button = egui::Button::selectable(config.experts == n, n.to_string()).frame_when_inactive(true);
            let response = ui.add(button.min_size(egui::vec2(width, 0.0)));
            response.widget_info(|| {
                let name = if n == 1 { "1 expert".to_owned() } else { format!("{n} experts") };
                egui::WidgetInfo::selected(egui::Role::RadioButton, true, config.experts == n, name)
            });
            if response.on_hover_text(Field::named("experts").tip()).clicked() {
                config.experts = n;
            }
        }
    });
    section(ui, "Seed");
    explain(ui, explains, Field::named("seed"));
    ui.horizontal(|ui| {
        let drag = DragValue::new(&mut config.seed).speed(0.2).update_while_editing(false);
        ui.add(drag).accessible_name("Seed").on_hover_text(Field::named("seed").tip());
        if icon_button(ui, Icon::Dice, "Next seed", false).clicked() {
            config.seed = config.seed.wrapping_add(1);
        }
    });
    if ui.ctx().content_rect().width() < super::theme::NARROW {
        section(ui, "Speed");
        toolbar::speed(ui, app);
    }
    ui.add_space(6.0);
    CollapsingHeader::new("Advanced").show(ui, |ui| {
        let text =
            "Every other field of the configuration. Where it differs from the paper, the paper's value stands beside it.";
        ui.label(RichText::new(text).small().color(Palette::of(ui).muted));
        for field in FIELDS.iter().filter(|field| !ELSEWHERE.contains(&field.name)) {
            show_field(ui, field, explains, &mut config);
        }
        if ui.button("All as in the paper").clicked() {
            config = Config { seed: config.seed, ..Config::paper() };
        }
    });
    if config != app.setup().config {
        app.reconfigure(config);
    }
}

/// What a field is, under its name, where that is wished for.
fn explain(ui: &mut Ui, explains: bool, field: &Field) {
    if explains {
        ui.label(RichText::new(field.tip()).small().color(Palette::of(ui).muted));
    }
}

fn show_field(ui: &mut Ui, field: &Field, explains: bool, config: &mut Config) {
    let palette = Palette::of(ui);
    ui.add_space(2.0);
    ui.label(RichText::new(field.label).small());
    explain(ui, explains, field);
    ui.horizontal_wrapped(|ui| {
        let tip = format!("{} Expected: {}.", field.help, field.expected());
        match &field.kind {
            Kind::Real { low, high, get, set } => {
                let mut value = get(config);
                let speed = (value.abs() * 0.01).max(0.0005);
                let drag = numbers::exact(&mut value).range(*low..=*high).speed(speed);
                if ui.add(drag).accessible_name(field.label).on_hover_text(tip).changed() {
                    set(config, value);
                }
            }
            Kind::Whole { low, high, get, set } => {
                let mut value = get(config);
                let speed = (f64::from(value) * 0.01).max(0.2);
                let drag = DragValue::new(&mut value).range(*low..=*high).speed(speed).update_while_editing(false);
                if ui.add(drag).accessible_name(field.label).on_hover_text(tip).changed() {
                    set(config, value);
                }
            }
            Kind::Text { get, set, expected } => {
                // What is being typed, and what held before it; where something else holds now, it is out of date.
                let id = ui.scope_id().with(field.name);
                let now = get(config);
                let draft = ui.data(|data| data.get_temp::<(String, String)>(id)).filter(|(before, _)| *before == now);
                let mut text = draft.map_or_else(|| now.clone(), |(_, text)| text);
                let edit = egui::TextEdit::singleline(&mut text).desired_width(ui.available_width() - 8.0);
                let response = ui.add(edit).accessible_name(field.label).on_hover_text(tip);
                if response.changed() {
                    ui.data_mut(|data| data.insert_temp(id, (now.clone(), text.clone())));
                }
                if !response.has_focus() && text != now {
                    if set(config, text.trim()) {
                        ui.data_mut(|data| data.remove_temp::<(String, String)>(id));
                    } else {
                        ui.end_row();
                        let sentence = format!("{text:?}: expected {expected}.");
                        ui.label(RichText::new(sentence).small().color(palette.warning));
                        if ui.button("undo").clicked() {
                            ui.data_mut(|data| data.remove_temp::<(String, String)>(id));
                        }
                    }
                }
            }
            Kind::Word { options, get, set, .. } => {
                let chosen = get(config);
                let response = ComboBox::from_id_salt(field.name)
                    .selected_text(chosen.clone())
                    .show_ui(ui, |ui| {
                        for option in options() {
                            if ui.selectable_label(option == chosen, &option).clicked() {
                                set(config, &option);
                            }
                        }
                    })
                    .response;
                response.accessible_name(field.label).on_hover_text(tip);
            }
        }
        if let Some(value) = field.paper.filter(|_| !matches!(field.kind, Kind::Text { .. })) {
            let mut paper = Config::default();
            let is_papers = field.set(&mut paper, value).is_ok() && field.text(&paper) == field.text(config);
            let mark = if is_papers { "as paper".to_owned() } else { format!("paper: {value}") };
            let mark = RichText::new(mark).small().color(if is_papers { palette.muted } else { palette.warning });
            ui.add(egui::Label::new(mark).extend());
        }
    });
}
