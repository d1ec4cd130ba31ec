//! What a visitor takes away from the page: a picture of the panels, the curve, the transition model. Here they are
//! made from what is shown; how a file gets to the visitor is the host's.

use super::app::{App, View};
use super::board::Shown;
use super::numbers;
use super::panels;
use crate::ape::{AlgorithmKind, Config, FIELDS};
use crate::experiment::{CurvePoint, PRESETS, Setup};
use crate::lab::{CloneView, RunState};
use crate::mdp::{CAP, Grid, KnownReturns, Policy, RETURN_KINDS, transition_model};
use crate::picture::{self, COLOR_MAPS, heatmaps};

impl App {
    /// Gives the panels to the visitor as `ape-panels.svg`.
    pub fn export_picture(&mut self) {
        if let Some(svg) = self.board().map(|shown| picture(shown, &self.view)) {
            self.save("ape-panels.svg", &svg);
        }
    }

    /// The same as pixels, `ape-panels.png`.
    pub fn export_png(&mut self) {
        if let Some(svg) = self.board().map(|shown| picture(shown, &self.view)) {
            self.save_picture("ape-panels.png", &svg);
        }
    }

    /// Whether the run on the page has a curve; a given ensemble has none.
    pub fn has_curve(&self) -> bool {
        self.board().is_some_and(|shown| !shown.curve.is_empty())
    }

    /// Gives the curve so far to the visitor as `ape-curve.csv`, where there is one.
    pub fn export_curve(&mut self) {
        if let Some(csv) = self.board().filter(|shown| !shown.curve.is_empty()).map(curve_csv) {
            self.save("ape-curve.csv", &csv);
        }
    }

    /// Gives the grid's transition model to the visitor as `ape-model.json`.
    pub fn export_model(&mut self) {
        if let Some(json) = self.board().map(|shown| model_json(shown.grid())) {
            self.save("ape-model.json", &json);
        }
    }
}

/// All panels that have a policy, in the page's order, as an SVG with a caption that says how they came about.
pub fn picture(shown: &Shown, view: &View) -> String {
    let rewards = shown.rewards();
    let panels: Vec<picture::Panel> = panels::list(&shown.started, &shown.snapshot, view)
        .into_iter()
        .filter_map(|panel| {
            let policy = panel.policy?;
            Some(picture::Panel {
                subtitle: panel.figures(view),
                policy: Policy::from_rows(policy.policy.iter().map(|row| row.map(f64::from)).collect()),
                steps: policy.hitting_time.iter().map(|&steps| f64::from(steps)).collect(),
                rewards: if panel.clone.is_some() { rewards.clone() } else { Vec::new() },
                title: panel.title,
            })
        })
        .collect();
    let caption = [
        format!("{} {}", origin(shown), ground(shown)),
        returns(shown, view),
        format!("{} {}", legend(shown, view), source(shown)),
    ];
    heatmaps(shown.grid(), &panels, &COLOR_MAPS[view.color_map], &caption)
}

/// The curve so far: a line for every update that was looked at.
pub fn curve_csv(shown: &Shown) -> String {
    let lines = shown.curve.iter().map(CurvePoint::csv_line);
    std::iter::once(CurvePoint::csv_head()).chain(lines).map(|line| line + "\n").collect()
}

/// The grid's [`crate::mdp::TransitionModel`] as JSON.
pub fn model_json(grid: &Grid) -> String {
    serde_json::to_string(&transition_model(grid)).expect("a model is plain data with numbers as keys") + "\n"
}

/// How the experts came about.
fn origin(shown: &Shown) -> String {
    let (setup, snapshot) = (&shown.started.setup, &shown.snapshot);
    let experts = match snapshot.experts.len() {
        1 => "1 expert".to_owned(),
        n => format!("{n} experts"),
    };
    let preset = PRESETS.iter().find(|preset| (preset.setup)() == *setup);
    let preset = preset.map_or(String::new(), |preset| format!(" (preset “{}”)", preset.title));
    if snapshot.state == RunState::Given {
        let file = setup.ensemble.as_ref();
        let config = file.and_then(|file| file.config.as_ref());
        let trained = config.map_or(String::new(), |config| {
            let moment = file.and_then(|file| file.moment.as_ref());
            let last_turn = moment.and_then(|moment| moment.turns.last());
            let turned = last_turn.map_or(String::new(), |(_, beta)| format!(", then {}", numbers::as_set(*beta)));
            let update = moment.map_or(String::new(), |moment| format!(", update {}", numbers::grouped(moment.update)));
            let Config { beta, seed, .. } = config;
            format!(" Its file says: {}, β = {beta}{turned}, seed {seed}{update}.", method(config))
        });
        return format!("A given ensemble of {experts}{preset}.{trained}");
    }
    let Config { beta: first, seed, alpha, .. } = setup.config;
    let beta = numbers::as_set(snapshot.beta);
    let beta = match alpha {
        Some(alpha) => {
            let price = numbers::as_set(alpha);
            format!("β = {beta} by dual ascent, for an ensemble that returns at least {price} within T")
        }
        None if snapshot.beta != first => format!("β = {beta}, moved by hand from {}", numbers::as_set(first)),
        None => format!("β = {beta}"),
    };
    let (update, last) = (numbers::grouped(snapshot.update), numbers::grouped(snapshot.last_update));
    format!(
        "{experts} by {}{preset}: {beta}, seed {seed}, update {update} of\u{a0}{last}.{}",
        method(&setup.config),
        others(setup)
    )
}

fn method(config: &Config) -> String {
    let algorithm = match config.algorithm {
        AlgorithmKind::PgApe => "PG-APE",
        AlgorithmKind::Exact => "exact APE",
    };
    format!("{algorithm} against the observer {}", config.observer)
}

/// Fields that differ from the defaults and are not said elsewhere.
fn others(setup: &Setup) -> String {
    let said = ["experts", "beta", "algorithm", "observer", "horizon", "adversary_reward", "alpha", "seed"];
    let default = Config::default();
    let others: Vec<String> = FIELDS
        .iter()
        .filter(|field| !said.contains(&field.name) && field.text(&setup.config) != field.text(&default))
        .map(|field| format!("{} {}", field.name, field.text(&setup.config)))
        .collect();
    if others.is_empty() { String::new() } else { format!(" Not as by default: {}.", others.join(", ")) }
}

/// The grid, and what is paid on it.
fn ground(shown: &Shown) -> String {
    let grid = shown.grid();
    let (row, col) = grid.cell(grid.goal());
    let walls = match grid.cells() - grid.free_cells() {
        0 => "no walls".to_owned(),
        1 => "1 wall".to_owned(),
        walls => format!("{walls} walls"),
    };
    let Config { horizon, adversary_reward, .. } = &shown.started.setup.config;
    let denied =
        adversary_reward.as_ref().map_or(String::new(), |reward| format!(" The clone is to be denied r̃: {reward}."));
    format!(
        "Grid of {}\u{a0}×\u{a0}{} cells, goal in row {row}, column {col}, {walls}, slip {}. T = {horizon} steps.{denied}",
        grid.rows(),
        grid.cols(),
        grid.slip()
    )
}

/// The chosen return of the ensemble, of each clone and of the optimal policy.
fn returns(shown: &Shown, view: &View) -> String {
    let kind = &RETURN_KINDS[view.kind];
    let number = |value: f64| if kind.is_steps { numbers::short(value) } else { numbers::percent(value) };
    let written = |returns: &KnownReturns| match returns.get(view.kind) {
        Some(value) => number(value),
        // Of a clone with a memory no hitting times are known.
        None => format!("{} within T", numbers::short(returns.horizon_return)),
    };
    let mut figures = vec![format!("ensemble {}", number((kind.get)(&shown.snapshot.ensemble)))];
    for cloner in &view.clones {
        let clone = shown.snapshot.clones.iter().find(|clone| clone.cloner == *cloner);
        figures.extend(clone.map(|clone| format!("clone ({cloner}) {}", written(&clone.view.returns))));
    }
    figures.push(format!("optimal {}", written(&shown.started.optimal.returns)));
    let name = match kind.is_steps {
        true => format!("Return, {}, in steps", kind.label),
        false => "Success".to_owned(),
    };
    let meaning = kind.help.split(". ").next().unwrap_or_default().trim_end_matches('.');
    format!("{name}: {}. ({meaning}.)", figures.join(", "))
}

/// How the heat maps are read.
fn legend(shown: &Shown, view: &View) -> String {
    let mut legend = format!(
        "Colour: expected steps to the flag, cut at {CAP}. Length of an arrow: probability of the move; dot: of Stay."
    );
    let is_within_t =
        |clone: &CloneView| view.clones.contains(&clone.cloner) && clone.view.returns.capped_return.is_none();
    if shown.snapshot.clones.iter().any(is_within_t) {
        legend += " Of a clone that remembers: expected steps within T, from the start of an episode.";
    }
    if shown.grid().free_cells() < shown.grid().cells() {
        legend += " Struck through: walls.";
    }
    if !shown.rewards().is_empty() {
        legend += " Framed: cells of r̃, white where it is negative, black where it is positive.";
    }
    legend
}

fn source(shown: &Shown) -> String {
    // Of a given ensemble its file says so, and policies alone do not give it back.
    let whose = if shown.snapshot.state == RunState::Given { "digest by its file" } else { "digest" };
    let digest = shown.snapshot.digest.map_or(String::new(), |digest| format!(", {whose} {digest}"));
    format!("ape-lab {}{digest}.", env!("CARGO_PKG_VERSION"))
}
