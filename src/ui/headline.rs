//! What there is to see, in one sentence and four figures, and the large β slider.

use egui::{Grid, Label, RichText, Slider, Ui, vec2};

use super::app::{App, BetaMode, View};
use super::numbers;
use super::theme::{self, Palette, SPACE};
use super::widgets::{choose, choose_wrapped, spoken};
use crate::ape::{Config, Field};
use crate::lab::{RunState, Snapshot, Started};
use crate::mdp::{KnownReturns, RETURN_KINDS, Returns};

/// The figures that the headline is about.
struct Headline {
    ensemble: Returns,
    clone: KnownReturns,
    optimal: KnownReturns,
    /// Who clones.
    cloner: String,
}

impl Headline {
    fn of(started: &Started, snapshot: &Snapshot, view: &View) -> Option<Headline> {
        // Until the session has evaluated the one asked for, the run's own.
        let asked = view.clones.first().and_then(|asked| snapshot.clones.iter().find(|clone| clone.cloner == *asked));
        let clone = asked.or(snapshot.clones.first())?;
        Some(Headline {
            ensemble: snapshot.ensemble,
            clone: clone.view.returns,
            optimal: started.optimal.returns,
            cloner: clone.cloner.to_string(),
        })
    }
}

/// Width of the β slider where the figures stand beside it.
const BETA_WIDTH: f32 = 330.0;
/// Width that all figures need in one row.
const FIGURES: f32 = 560.0;

/// The β slider with its mode; then the figures, beside it where there is room.
pub fn show(ui: &mut Ui, app: &mut App) {
    let width = ui.available_width();
    if width < theme::NARROW {
        beta(ui, app, width);
        ui.add_space(theme::GAP);
        figures(ui, app, 2);
    } else {
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = 2.0 * SPACE;
            ui.vertical(|ui| beta(ui, app, BETA_WIDTH));
            let columns = if width < BETA_WIDTH + FIGURES { 2 } else { 4 };
            ui.vertical(|ui| figures(ui, app, columns));
        });
    }
}

fn beta(ui: &mut Ui, app: &mut App, width: f32) {
    let palette = Palette::of(ui);
    ui.spacing_mut().item_spacing.x = theme::GAP;
    ui.set_width(width);
    let is_given = app.setup().ensemble.is_some();
    ui.add_enabled_ui(!is_given, |ui| {
        ui.horizontal(|ui| {
            ui.label(RichText::new("β").text_style(theme::figure()));
            ui.spacing_mut().slider_width = ui.available_width() - 76.0;
            ui.spacing_mut().interact_size.y = ui.spacing().interact_size.y.max(36.0);
            ui.spacing_mut().slider_rail_height = 8.0;
            let mut beta = app.setup().last_beta();
            let slider =
                Slider::new(&mut beta, 0.0..=1.0).clamping(egui::SliderClamping::Never).step_by(0.01).show_value(false);
            let slider = ui.add(slider);
            let drag = ui.add(numbers::exact(&mut beta).range(0.0..=Config::MAX_BETA).speed(0.01));
            let is_changed = [slider, drag]
                .map(|response| response.accessible_name("β").on_hover_text(Field::named("beta").tip()).changed());
            if is_changed.contains(&true) {
                app.set_beta(beta.clamp(0.0, Config::MAX_BETA));
            }
        });
        ui.horizontal(|ui| {
            let options = [
                (BetaMode::Retrain, "retrain", "Every new β trains a whole run from the seed"),
                (BetaMode::Continue, "continue", "The training under way goes on with the new β"),
            ];
            ui.label(RichText::new("moving β:").small().color(palette.muted));
            choose(ui, "Moving β", &mut app.view.beta_mode, &options);
        });
    });
}

fn figures(ui: &mut Ui, app: &mut App, columns: usize) {
    let palette = Palette::of(ui);
    let headline = app.shown().and_then(|(started, snapshot)| Headline::of(started, snapshot, &app.view));
    let Some(headline) = headline else {
        ui.label(RichText::new("Waiting for the first figures …").color(palette.muted));
        return;
    };
    let kind = &RETURN_KINDS[app.view.kind];
    let at = app.view.kind;
    let ensemble = (kind.get)(&headline.ensemble);
    let (clone, optimal) = (headline.clone.get(at), headline.optimal.get(at));
    let written = |value: Option<f64>| value.map_or("–".to_owned(), |value| numbers::of_kind(kind, value));
    let unit = if kind.is_steps { " steps" } else { "" };
    let ratio = match clone {
        Some(clone) if kind.is_steps => numbers::times(clone, ensemble),
        _ => "–".to_owned(),
    };
    let shown = [
        ("Ensemble", palette.accent, numbers::of_kind(kind, ensemble), unit, "Mean of the experts' returns."),
        (
            &format!("Clone ({})", headline.cloner),
            palette.clone,
            written(clone),
            unit,
            "Return of the policy that an observer of the demonstrations ends up with: the first clone panel. Of a clone with a memory only what T steps give is known.",
        ),
        ("Optimal", palette.ink, written(optimal), unit, "The best that any policy can do."),
        ("Clone ÷ ensemble", palette.ink, ratio, "", "How many times as many steps the clone needs."),
    ];
    Grid::new("figures").spacing(vec2(1.5 * SPACE, 2.0)).min_col_width(70.0).show(ui, |ui| {
        for row in shown.chunks(columns) {
            for (name, color, value, unit, help) in row {
                ui.vertical(|ui| {
                    ui.spacing_mut().item_spacing.y = 0.0;
                    ui.add(Label::new(RichText::new(*name).small().color(palette.muted)).extend());
                    let words = format!("{name} {} return: {value}{unit}", kind.label);
                    let text = RichText::new(value).text_style(theme::figure()).color(*color);
                    spoken(ui, text, &words).on_hover_text(*help);
                });
            }
            ui.end_row();
        }
    });
    ui.horizontal_wrapped(|ui| {
        ui.spacing_mut().item_spacing.x = theme::GAP;
        if columns > 2 {
            ui.label(RichText::new("return:").small().color(palette.muted));
        }
        let options: Vec<(usize, &str, &str)> =
            RETURN_KINDS.iter().enumerate().map(|(index, kind)| (index, kind.label, kind.help)).collect();
        choose_wrapped(ui, "Return", &mut app.view.kind, &options);
    });
}

/// The sentence under the title, and how far training is.
pub fn show_sentence(ui: &mut Ui, app: &App) {
    let progress = RichText::new(progress(app)).small().color(Palette::of(ui).muted);
    let sentence = RichText::new(sentence(app)).text_style(theme::strong());
    // While training goes on it changes with every frame: it is announced when it holds.
    let is_resting = !app.is_retraining() && app.shown().is_some_and(|(_, shown)| shown.state != RunState::Playing);
    let parts = |ui: &mut Ui| {
        let response = ui.label(sentence);
        if is_resting {
            ui.ctx().accesskit_node_builder(response.id, |node| node.set_live(egui::accesskit::Live::Polite));
        }
        let response = ui.label(progress);
        ui.ctx().accesskit_node_builder(response.id, |node| node.set_role(egui::Role::Status));
    };
    if ui.available_width() < theme::WIDE {
        ui.vertical(parts);
    } else {
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = SPACE;
            parts(ui);
        });
    }
}

/// What a visitor sees, with its numbers.
fn sentence(app: &App) -> String {
    let Some((started, snapshot)) = app.shown() else { return String::new() };
    let Some(headline) = Headline::of(started, snapshot, &app.view) else { return String::new() };
    let n = snapshot.experts.len();
    let (experts, reach, arrive) = match n {
        1 => ("The expert".to_owned(), "reaches", "arrives"),
        n => (format!("The {n} experts"), "reach", "arrive"),
    };
    let steps = |returns: &KnownReturns| numbers::decimal(-returns.horizon_return, 0);
    let share = |returns: &KnownReturns| numbers::percent(returns.success);
    // Below this share of arrivals steps are not the story.
    let is_lost = |returns: &KnownReturns| returns.success < 0.9;
    let (ensemble, clone) = (&KnownReturns::from(headline.ensemble), &headline.clone);
    if let Some((update, denied)) = app.denied() {
        let when = if update == snapshot.update { String::new() } else { format!(" at update {update}") };
        return format!(
            "{experts} {reach} the goal in {} steps; of r̃ an expert collects{when} {}, the clone that is to be denied it {}.",
            steps(ensemble),
            numbers::decimal(denied.ensemble, 1),
            numbers::decimal(denied.clone, 1)
        );
    }
    let theirs = format!("{} clone ({})", if n == 1 { "its" } else { "their" }, headline.cloner);
    match (is_lost(ensemble), is_lost(clone)) {
        (false, true) => {
            let often = if clone.success < 0.5 { "" } else { "often " };
            let lost = format!("{theirs} {often}gets lost: it arrives in {} of episodes", share(clone));
            format!("{experts} {reach} the goal in {} steps; {lost}.", steps(ensemble))
        }
        (false, false) => {
            format!("{experts} {reach} the goal in {} steps; {theirs} in {}.", steps(ensemble), steps(clone))
        }
        (true, _) => format!("{experts} {arrive} in {} of episodes; {theirs} in {}.", share(ensemble), share(clone)),
    }
}

/// How far training is, in words.
fn progress(app: &App) -> String {
    let Some((_, snapshot)) = app.shown() else { return "starting".to_owned() };
    let mut of = format!("update {} of {}", snapshot.update, snapshot.last_update);
    if app.setup().config.alpha.is_some() {
        of += &format!(", β now {}", numbers::decimal(snapshot.beta, 2));
    }
    match snapshot.state {
        _ if !app.is_session_alive() => format!("stopped at {of}"),
        _ if app.is_retraining() => "retraining …".to_owned(),
        _ if app.remade.is_some() => {
            format!("made again: {} of {} updates", app.remade.unwrap_or_default(), snapshot.recorded)
        }
        RunState::Given => format!("given ensemble, nothing to train{}", digest(app, snapshot)),
        RunState::Playing => format!("training, {of}"),
        RunState::Paused => format!("paused at {of}{}", digest(app, snapshot)),
        RunState::Finished => {
            format!("trained, {of}, {} of training{}", seconds(snapshot.training_ms), digest(app, snapshot))
        }
    }
}

/// The digest of the moment shown, and whether it is that of the link which was opened.
fn digest(app: &App, snapshot: &Snapshot) -> String {
    // Of another run, or before a β that is on its way has come, it would stand beside what it is not of.
    if snapshot.state != RunState::Given && !app.shows_controls() {
        return String::new();
    }
    let whose = if snapshot.state == RunState::Given { "digest by its file" } else { "digest" };
    let text = snapshot.digest.map_or(String::new(), |digest| format!(", {whose} {digest}"));
    match app.promised() {
        None => text,
        Some(promised) if snapshot.digest == Some(promised) => text + ", the same as in the link",
        Some(promised) => format!("{text}, but the link was made with {promised}"),
    }
}

fn seconds(milliseconds: f64) -> String {
    if milliseconds < 1000.0 { format!("{milliseconds:.0} ms") } else { format!("{:.1} s", milliseconds / 1000.0) }
}
