//! The attack bench: every cloner against the ensemble on the page, and how much data a cloner needs.

use egui::{RichText, Ui, vec2};

use super::{Batch, Moment, choose_cloners, exports, introduce, is_shown, title_of, warn};
use crate::ape::EnsembleFile;
use crate::attack::AttackerChoice;
use crate::experiment::{Attack, Bench, Outcome, Task, ensemble_returns};
use crate::lab::Exported;
use crate::mdp::{RETURN_KINDS, Returns};
use crate::ui::app::{App, Wanted};
use crate::ui::chart::{self, Axes, Curve, Style};
use crate::ui::numbers;
use crate::ui::table::{Cell, Column, table};
use crate::ui::theme::{self, Palette};

/// The tab: what is asked for and what has come of it.
pub struct BenchTab {
    cloners: Vec<AttackerChoice>,
    /// Whether behaviour cloning is also tried with less data.
    has_learning_curve: bool,
    subject: Option<Subject>,
    pub batch: Option<Batch>,
}

/// What was attacked.
struct Subject {
    title: String,
    moment: Moment,
    horizon: u32,
    seed: u32,
    ensemble: Returns,
}

impl Default for BenchTab {
    fn default() -> Self {
        BenchTab { cloners: AttackerChoice::usual(), has_learning_curve: true, subject: None, batch: None }
    }
}

/// Numbers of pairs along the learning curve.
const PAIRS: [u32; 5] = [100, 1000, 10_000, 100_000, 1_000_000];

impl BenchTab {
    /// The ensemble has come that was asked for.
    pub fn attack(&mut self, exported: Exported, app: &mut App, now: f64) {
        let Ok((grid, ensemble)) = exported.file.clone().check() else { return };
        let config = &app.setup().config;
        let (horizon, seed) = (config.horizon, config.seed);
        let title = title_of(&exported, app);
        let moment = (exported.run, exported.update, exported.file.digest);
        // What the worker has said already need not be computed here: that takes a while on a large grid.
        let known = app.shown().filter(|(started, snapshot)| {
            (snapshot.run, snapshot.update, started.setup.config.horizon) == (exported.run, exported.update, horizon)
        });
        let computed = || ensemble_returns(&grid, &ensemble, horizon);
        let ensemble = known.map_or_else(computed, |(_, snapshot)| snapshot.ensemble);
        self.subject = Some(Subject { title, moment, horizon, seed, ensemble });
        // What it came from does not matter to whoever attacks it.
        let file = Box::new(EnsembleFile { config: None, ..exported.file });
        let mut cloners = self.cloners.clone();
        if self.has_learning_curve {
            for cloner in ["bc", "bc_counts"].map(|name| name.parse::<AttackerChoice>()) {
                let with = |pairs| cloner.clone().ok().map(|cloner| cloner.with_parameter(pairs));
                cloners.extend(PAIRS.into_iter().filter_map(with).filter(|cloner| !self.cloners.contains(cloner)));
            }
        }
        let task = |attacker| Task::Attack { ensemble: file.clone(), attacker, horizon, seed };
        self.batch = Some(Batch::begin(&mut app.pool, cloners.into_iter().map(task).collect(), now));
    }

    pub fn show(&mut self, ui: &mut Ui, app: &mut App) {
        introduce(
            ui,
            "Attack bench",
            "Every cloner against the ensemble that is shown. Some only count, one learns as in the paper, some remember their \
             episode. Drop is what the clone loses against the ensemble; the imitation gap is the same within T steps.",
        );
        choose_cloners(ui, &mut self.cloners);
        ui.checkbox(&mut self.has_learning_curve, "learning curve: behaviour cloning from 100 to 1,000,000 pairs");
        ui.horizontal_wrapped(|ui| {
            let is_running = self.batch.as_ref().is_some_and(Batch::is_running);
            let has_cloners = !self.cloners.is_empty() || self.has_learning_curve;
            let can_run = !is_running && has_cloners && app.can_export();
            if ui.add_enabled(can_run, egui::Button::new("Attack the ensemble shown")).clicked() {
                app.want(Wanted::Bench);
            }
            if ui
                .button("Open an ensemble …")
                .on_hover_text("A JSON file; dropping it on the page does the same")
                .clicked()
            {
                app.ask_for_file();
            }
            if ui.add_enabled(app.can_export(), egui::Button::new("Save the ensemble")).clicked() {
                app.want(Wanted::Save);
            }
            let bench = self.bench();
            if let Some(bench) = bench.filter(|bench| !bench.attackers.is_empty()) {
                let json = || serde_json::to_string_pretty(&bench).unwrap_or_default();
                exports(ui, app, "ape-attack", || bench.csv(), json);
            }
        });
        if let Some(batch) = &mut self.batch {
            batch.show(ui, &mut app.pool);
        }
        let (Some(bench), Some(subject)) = (self.bench(), &self.subject) else {
            ui.add_space(8.0);
            ui.label(RichText::new("Nothing has been attacked yet.").color(Palette::of(ui).muted));
            return;
        };
        ui.add_space(4.0);
        let r = &subject.ensemble;
        let text = format!(
            "{} returns {} steps capped, {} within T = {}; {} arrive.",
            capitalised(&subject.title),
            numbers::decimal(r.capped_return, 2),
            numbers::decimal(r.horizon_return, 2),
            subject.horizon,
            numbers::percent(r.success)
        );
        ui.label(RichText::new(text).text_style(theme::strong()));
        if !is_shown(app, subject.moment) {
            warn(ui, "The ensemble on the page has changed since: attack again to see it.");
        }
        show_table(ui, &bench);
        show_learning_curve(ui, &bench, app.view.kind);
    }

    /// What has been attacked so far.
    fn bench(&self) -> Option<Bench> {
        let (batch, subject) = (self.batch.as_ref()?, self.subject.as_ref()?);
        let attackers = batch.outcomes().filter_map(|outcome| match outcome {
            Outcome::Attack(attack, _) => Some(attack.clone()),
            _ => None,
        });
        let Subject { moment: (.., digest), horizon, seed, ensemble, .. } = *subject;
        Some(Bench { horizon, seed, digest, ensemble, attackers: attackers.collect() })
    }
}

fn capitalised(text: &str) -> String {
    let mut chars = text.chars();
    chars.next().map_or(String::new(), |first| first.to_uppercase().chain(chars).collect())
}

fn show_table(ui: &mut Ui, bench: &Bench) {
    let columns = [
        Column::new("cloner", "Who clones"),
        Column::new("capped", RETURN_KINDS[0].help),
        Column::new("drop", "Capped return of the ensemble less that of the clone, in steps"),
        Column::new("within T", RETURN_KINDS[2].help),
        Column::new("gap", "Imitation gap: return within T of the ensemble less that of the clone, in steps"),
        Column::new("success", RETURN_KINDS[3].help),
        Column::new("pairs", "State–action pairs used; ∞ where the limit is computed"),
        Column::new("time", "To make and evaluate the clone, on this machine"),
    ];
    let palette = Palette::of(ui);
    let row = |(index, attack): (usize, &Attack)| {
        let r = &attack.returns;
        let model = attack.attacker.model();
        let steps = |value: Option<f64>| match value {
            Some(value) => Cell::number(value, numbers::decimal(value, 2)),
            None => Cell::number(f64::NEG_INFINITY, "–".to_owned())
                .hover("A clone with a memory has no hitting times to cap."),
        };
        let lost = |cell: Cell, loss: f64| if loss > 5.0 { cell.colored(palette.clone) } else { cell };
        let within = Cell::number(r.horizon_return, with_error(r.horizon_return, r.horizon_error));
        vec![
            Cell::number(index as f64, attack.attacker.to_string())
                .hover(&format!("{}. {}", model.title, model.summary)),
            steps(r.capped_return),
            lost(steps(attack.drop), attack.drop.unwrap_or(0.0)),
            within,
            lost(Cell::number(attack.imitation_gap, numbers::decimal(attack.imitation_gap, 2)), attack.imitation_gap),
            Cell::number(r.success, numbers::percent(r.success)),
            Cell::number(
                attack.pairs.map_or(f64::INFINITY, f64::from),
                attack.pairs.map_or("∞".to_owned(), numbers::grouped),
            ),
            Cell::number(attack.seconds, format!("{:.2} s", attack.seconds)),
        ]
    };
    table(ui, "bench", &columns, bench.attackers.iter().enumerate().map(row).collect());
}

fn with_error(value: f64, error: f64) -> String {
    let value = numbers::decimal(value, 2);
    if error > 0.0 { format!("{value} ± {error:.2}") } else { value }
}

/// Return of behaviour cloning over the number of pairs.
fn show_learning_curve(ui: &mut Ui, bench: &Bench, kind: usize) {
    let palette = Palette::of(ui);
    let curve = |name: &str, color, style| {
        let points: Vec<[f64; 2]> = bench
            .attackers
            .iter()
            .filter(|attack| attack.attacker.model().name == name)
            .filter_map(|attack| Some([libm::log10(f64::from(attack.pairs?)), attack.returns.get(kind)?]))
            .collect();
        let mut points = points;
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Curve { name: name.to_owned(), color, points, style }
    };
    let ensemble = (RETURN_KINDS[kind].get)(&bench.ensemble);
    let mut curves =
        vec![curve("bc", palette.clone, Style::Marked), curve("bc_counts", palette.warning, Style::Marked)];
    if curves.iter().all(|curve| curve.points.len() < 2) {
        return;
    }
    curves.push(Curve {
        name: "ensemble".to_owned(),
        color: palette.accent,
        points: vec![[2.0, ensemble], [6.0, ensemble]],
        style: Style::Dashed,
    });
    ui.add_space(8.0);
    let title = format!("Learning curve, {} return over state–action pairs:", RETURN_KINDS[kind].label);
    chart::legend(ui, &title, curves.iter().map(|curve| (&*curve.name, curve.color)));
    let size = vec2(ui.available_width(), 220.0);
    let axes = Axes {
        id: "learning curve",
        size,
        include: vec![[2.0, 0.0], [6.0, 0.0]],
        x: |log| if log.fract().abs() < 1e-6 { numbers::grouped(libm::pow(10.0, log) as u32) } else { String::new() },
        y: chart::in_steps,
        labels: Vec::new(),
        cursor: None,
    };
    chart::plot(ui, axes, curves);
}
