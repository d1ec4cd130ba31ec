//! docs/RESULTS.md: every experiment at its full size, its tables, pictures and what follows from them.
//!
//! The numbers in the text are put in by the experiments; what is said about them is checked by the tests. A section
//! is a function that returns its text, and leaves its files in [`Document`].

use std::fmt::Write;
use std::time::Instant;

use rayon::prelude::*;

use crate::ape::observer::ObserverChoice;
use crate::ape::{AlgorithmKind, Config, Digest, Ensemble, EnsembleFile, Trainer};
use crate::attack::{AttackerChoice, Target};
use crate::experiment::{
    Attack, CurvePoint, METHODS, Outcome, PRESETS, Setup, Summary, Sweep, SweepRun, Table1, Task, ensemble_returns,
};
use crate::mdp::{Grid, GridSpec, HORIZON, KnownReturns, Solver, optimal_policy};
use crate::picture::{Axes, COLOR_MAPS, Mark, Panel, Series, chart, heatmaps};

/// Does tasks, their outcomes in order.
pub type Run<'a> = &'a dyn Fn(&[Task]) -> Result<Vec<Outcome>, String>;

const CAPPED: usize = 0;
const UNCAPPED: usize = 1;
const WITHIN_T: usize = 2;

const TEAL: [u8; 3] = [0x0b, 0x74, 0x70];
const PURPLE: [u8; 3] = [0x8a, 0x2d, 0x8f];
const ORANGE: [u8; 3] = [0xc0, 0x5a, 0x10];
const GREY: [u8; 3] = [0x6a, 0x70, 0x78];

/// The document and the files beside it: name, as seen from the document, and text.
struct Document {
    files: Vec<(String, String)>,
}

impl Document {
    /// Puts a picture beside the document and returns the line that shows it.
    fn picture(&mut self, name: &str, words: &str, svg: String) -> String {
        self.files.push((format!("results/{name}.svg"), svg));
        format!("![{words}](results/{name}.svg)\n")
    }

    fn csv(&mut self, name: &str, text: String) {
        self.files.push((format!("results/{name}.csv"), text));
    }
}

/// Makes everything; returns the files, RESULTS.md first.
pub fn results(run: Run) -> Result<Vec<(String, String)>, String> {
    let begin = Instant::now();
    let mut document = Document { files: Vec::new() };
    let sections = [
        pictures(&mut document)?,
        table1(&mut document, run)?,
        beta_table(&mut document, run)?,
        pareto(&mut document, run)?,
        benches(&mut document, run)?,
        learning_curve(&mut document, run)?,
        memory(&mut document, run)?,
        constraint(&mut document)?,
        semantics(&mut document)?,
        discussion(run)?,
    ];
    let text = format!(
        "# Results\n\n\
         Written by `cargo xtask results`, never by hand: every number below comes from a run of this repository's code, which \
         took {:.0} s on {} cores. What is computed and how the paper was read stands in [METHOD.md](METHOD.md). Returns are in \
         steps and exact, but for those of a clone by `gru`, which are simulated throughout; a run is one seed from 1 on; ± is the standard \
         deviation over seeds, brackets hold the 95 % percentile bootstrap interval of the mean, which is too narrow for so few (METHOD.md says how much). The paper is Zhan, Tiomkin and \
         Abbeel (2019).\n\n{}",
        begin.elapsed().as_secs_f64(),
        std::thread::available_parallelism().map_or(1, usize::from),
        sections.join("\n")
    );
    document.files.insert(0, ("RESULTS.md".to_owned(), text));
    Ok(document.files)
}

/// A number with a true minus.
fn number(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let is_zero = text.bytes().all(|byte| b"-0.".contains(&byte));
    if is_zero { text.replace('-', "") } else { text.replace('-', "−") }
}

fn steps(value: f64) -> String {
    if value.abs() < 99_999.5 { number(value, 2) } else { format!("{value:.1e}").replace('-', "−") }
}

fn summary(of: &Summary) -> String {
    let (low, high) = of.interval();
    format!("{} ± {}<br>[{}, {}]", steps(of.mean), steps(of.sd), steps(low), steps(high))
}

/// A probability in per cent; never 100 % for less than certainty.
fn percent(p: f64) -> String {
    if p < 1.0 - 1e-12 && p > 0.9995 { "> 99.9 %".to_owned() } else { format!("{} %", number(100.0 * p, 1)) }
}

/// A figure over seeds, where it is known.
fn known(of: &Option<Summary>) -> String {
    of.as_ref().map_or("–".to_owned(), summary)
}

fn plus_minus((mean, sd): (f64, f64)) -> String {
    format!("{} ± {}", number(mean, 2), number(sd, 2))
}

fn table(text: &mut String, head: &[String], rows: impl IntoIterator<Item = Vec<String>>) {
    let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
    *text += "\n";
    *text += &line(head);
    *text += &line(&vec!["---".to_owned(); head.len()]);
    rows.into_iter().for_each(|row| *text += &line(&row));
    *text += "\n";
}

fn words(text: &[&str]) -> Vec<String> {
    text.iter().map(|&word| word.to_owned()).collect()
}

fn grid() -> Grid {
    Grid::new(GridSpec::default()).expect("the paper's grid is valid")
}

/// What stands under a picture of a run: which it is.
fn caption(words: &str, digest: Digest) -> Vec<String> {
    vec![format!("ape-lab {}, {words}, seed 1, digest {digest}", env!("CARGO_PKG_VERSION"))]
}

/// A whole run.
fn train(config: Config) -> Result<Trainer, String> {
    let mut trainer = Trainer::new(grid(), config).map_err(|error| error.to_string())?;
    trainer.finish(&mut |_| true);
    Ok(trainer)
}

fn exact() -> Config {
    Config { algorithm: AlgorithmKind::Exact, ..Config::default() }
}

fn attack(ensemble: &Ensemble, attacker: &str) -> Result<KnownReturns, String> {
    let attacker: AttackerChoice = attacker.parse().map_err(|error| format!("{error}"))?;
    let grid = grid();
    let target = Target { grid: &grid, ensemble, horizon: HORIZON, seed: 1 };
    Ok(attacker.clone_of(&target, &mut |_| true).expect("it was not told to stop").returns)
}

/// The paper's figures 2 and 3, for its algorithm and for exact gradients.
fn pictures(document: &mut Document) -> Result<String, String> {
    let mut text =
        "## What it looks like\n\nColour is the expected number of steps from a cell to the flag, cut at 100; arrows \
                    are as long as a move is probable, a dot is Stay. β = 0.6, two experts, seed 1.\n\n"
            .to_owned();
    for (name, title, config) in [
        ("pg-ape", "PG-APE, 732 updates", Config::default()),
        ("exact-ape", "exact APE, 1,500 updates (ours)", exact()),
    ] {
        let trainer = train(config)?;
        let (ensemble, caption) = (trainer.ensemble(), caption(&format!("{title}, β = 0.6"), trainer.digest()));
        let grid = grid();
        let mut solver = Solver::new(&grid);
        let target = Target { grid: &grid, ensemble: &ensemble, horizon: HORIZON, seed: 1 };
        let mut policies = Vec::new();
        for (index, policy) in ensemble.policies().iter().enumerate() {
            let value = solver.evaluate(policy, HORIZON);
            policies.push((format!("Expert {}", index + 1), policy.clone(), value.hitting_time, value.returns.into()));
        }
        for cloner in ["uniform", "occupancy", "bc(1000000)"] {
            let choice: AttackerChoice = cloner.parse().map_err(|error| format!("{error}"))?;
            let clone = choice.clone_of(&target, &mut |_| true).expect("it was not told to stop");
            policies.push((format!("Clone, {cloner}"), clone.policy, clone.steps, clone.returns));
        }
        let best = optimal_policy(&grid);
        let value = solver.evaluate(&best, HORIZON);
        policies.push(("Optimal".to_owned(), best, value.hitting_time, KnownReturns::from(value.returns)));
        let panels: Vec<Panel> = policies
            .into_iter()
            .map(|(title, policy, steps, returns)| Panel {
                title,
                subtitle: format!(
                    "{} steps capped, {:.0} % arrive",
                    returns.capped_return.map_or(String::new(), |value| number(value, 1)),
                    (100.0 * returns.success).floor()
                ),
                policy,
                steps,
                rewards: Vec::new(),
            })
            .collect();
        let _ = writeln!(text, "**{title}**\n");
        text += &document.picture(name, title, heatmaps(&grid, &panels, &COLOR_MAPS[0], &caption));
        text += "\n";
    }
    text += "The experts go opposite ways where it hurts; the clone that weighs them equally undoes one with the other. Whoever \
             clones the demonstrations is in the places where each expert is, and acts as that expert.\n";
    Ok(text)
}

/// Table 1 for a setup, and the text of it for some cloners and one kind of return.
fn make_table1(config: Config, seeds: u32, run: Run) -> Result<Table1, String> {
    let setup = Setup { config, ..Setup::default() };
    let mut made = Table1::new(AttackerChoice::usual());
    let task = |setup| Task::Table1 { setup: Box::new(setup), attackers: made.attackers.clone() };
    let tasks: Vec<Task> = Table1::setups(&setup, seeds).into_iter().map(task).collect();
    for outcome in run(&tasks)? {
        if let Outcome::Table1(runs) = outcome {
            made.runs.extend(runs);
        }
    }
    Ok(made)
}

fn show_table1(text: &mut String, made: &Table1, kind: usize) {
    let rows = made.rows(kind);
    let is_known = |column: usize| rows.iter().all(|row| row.clones[column].is_some());
    let columns: Vec<usize> = (0..made.attackers.len()).filter(|&column| is_known(column)).collect();
    let mut head = words(&["method", "ensemble"]);
    head.extend(columns.iter().map(|&column| format!("`{}`", made.attackers[column])));
    if kind == CAPPED {
        head.extend(words(&["paper: ensemble", "paper: clone"]));
    }
    let line = |row: &crate::experiment::Row| {
        let method = &METHODS[row.method];
        let mut cells = vec![method.title.to_owned(), summary(&row.ensemble)];
        cells.extend(columns.iter().map(|&column| row.clones[column].as_ref().map_or(String::new(), summary)));
        if kind == CAPPED {
            let paper = method.paper.as_ref();
            cells.push(paper.map_or(String::new(), |paper| plus_minus(paper.ensemble)));
            cells.push(paper.map_or(String::new(), |paper| plus_minus(paper.clone)));
        }
        cells
    };
    table(text, &head, rows.iter().map(line));
}

fn table1(document: &mut Document, run: Run) -> Result<String, String> {
    let mut text = "## Table 1\n\nThe paper's comparison with every cloner as a column: `bc(1000000)` is the paper's (10⁶ pairs, \
                    Adam 0.01, 100 epochs). The baselines are plain policy gradient (β = 0) stopped when the ensemble returns what \
                    the PG-APE ensemble of that seed returns (*near-optimal*) or when its clone returns what the PG-APE clone \
                    returns (*random*); *noisy* is the optimal policy with actions replaced at random at the same cost to its owner.\n\n"
        .to_owned();
    let readings = [
        (
            "uniform",
            "### Trained against a clone that weighs the experts equally (`uniform`, our default)\n",
            Config::default(),
        ),
        ("replay", "### Trained as the paper's appendix says (`replay(60)`, one joint baseline)\n", Config::paper()),
    ];
    for (name, title, config) in readings {
        let made = make_table1(config, 5, run)?;
        let _ = writeln!(text, "{title}\nCapped return, the paper's figure, 5 seeds:");
        show_table1(&mut text, &made, CAPPED);
        text += "What an episode of at most 100 steps really costs, also for clones with a memory:\n";
        show_table1(&mut text, &made, WITHIN_T);
        document.csv(&format!("table1-{name}"), made.csv());
    }
    text += "Exact APE in the second table is trained against `occupancy`, the limit of `replay`, as it needs a formula. Every run: \
             [uniform](results/table1-uniform.csv), [replay](results/table1-replay.csv).\n\n\
             The *random* ensembles of the first table are hardly trained at all: the blind clone of an adversarial ensemble is \
             worse than a policy that has learned anything. In the paper its clone returns −44, and so do its random policies. \
             Who drops failed demonstrations (`filtered`) does better than they: what is left is the luck of the aimless.\n";
    Ok(text)
}

fn beta_table(document: &mut Document, run: Run) -> Result<String, String> {
    let mut text = "## The table of β in the paper's source\n\nA table that is commented out in the paper's LaTeX, 3 seeds; clones \
                    without a cap, as no capped return can be below −100. Ours are against `uniform`.\n"
        .to_owned();
    let betas: Vec<f64> = Sweep::PAPER.iter().map(|(beta, _)| *beta).collect();
    let long = Config { total_steps: 4000 * 4096, ..Config::default() };
    let runs = [
        ("PG-APE, 732 updates", "betas-732", Config::default()),
        ("PG-APE, 4,000 updates", "betas-4000", long),
        ("exact APE", "betas-exact", exact()),
    ];
    let mut head = words(&["", "β"]);
    head.extend(words(&["ensemble, capped", "clone, capped", "clone, uncapped", "clone within T"]));
    let mut rows: Vec<Vec<String>> = Vec::new();
    for (beta, paper) in &Sweep::PAPER {
        rows.push(vec![
            "the paper".to_owned(),
            beta.to_string(),
            plus_minus(paper.ensemble),
            String::new(),
            plus_minus(paper.clone),
            String::new(),
        ]);
    }
    for (title, file, config) in runs {
        let sweep = sweep(config, &betas, 3, run)?;
        document.csv(file, sweep.csv());
        let (capped, uncapped, within) = (sweep.points(CAPPED), sweep.points(UNCAPPED), sweep.points(WITHIN_T));
        for ((capped, uncapped), within) in capped.iter().zip(&uncapped).zip(&within) {
            rows.push(vec![
                title.to_owned(),
                capped.beta.to_string(),
                summary(&capped.ensemble),
                known(&capped.clone),
                known(&uncapped.clone),
                known(&within.clone),
            ]);
        }
    }
    table(&mut text, &head, rows);
    text += "The paper's figures and ours are of the same kind: the ensemble pays a step or two, the clone's uncut return falls by \
             hundreds. They are not the same figures. At the length of run that the paper gives, 732 updates, our policy gradient is \
             still some steps away from −9 even for β = 0, and the clone is hardly hurt below β = 0.3; after 4,000 updates the \
             ensembles are closer to the paper's, and the clone is lost from β = 0.2 or 0.3 on, more than the paper's. \
             Exact gradients part the experts already at β = 0.1. (Intervals of 3 seeds are no wider than their range.) Every run: \
             [732 updates](results/betas-732.csv), [4,000](results/betas-4000.csv), [exact](results/betas-exact.csv).\n";
    Ok(text)
}

fn sweep(config: Config, betas: &[f64], seeds: u32, run: Run) -> Result<Sweep, String> {
    let setup = Setup { config, ..Setup::default() };
    let task = |setup| Task::Sweep { setup: Box::new(setup) };
    let tasks: Vec<Task> = Sweep::setups(&setup, betas, seeds).into_iter().map(task).collect();
    let runs = run(&tasks)?.into_iter().filter_map(|outcome| match outcome {
        Outcome::Sweep(run) => Some(run),
        _ => None,
    });
    Ok(Sweep { runs: runs.collect() })
}

fn pareto(document: &mut Document, run: Run) -> Result<String, String> {
    let betas = Sweep::betas("0:1:0.05")?;
    let mut text = "## What protection costs\n\nβ from 0 to 1 in steps of 0.05. Right is good for the ensemble, down is bad for its \
                    clone; bars are 95 % intervals over seeds.\n\n"
        .to_owned();
    let mut series = Vec::new();
    let mut honest = String::new();
    let runs = [
        ("PG-APE (10 seeds)", "sweep-pg-ape", PURPLE, Config::default(), 10),
        ("exact APE (5 seeds)", "sweep-exact", TEAL, exact(), 5),
    ];
    for (name, file, color, config, seeds) in runs {
        let sweep = sweep(config, &betas, seeds, run)?;
        let points = sweep.points(WITHIN_T);
        // Within T a return is known of every clone.
        let clones: Vec<&Summary> = points.iter().filter_map(|point| point.clone.as_ref()).collect();
        // A word at every point would be a heap.
        let is_named =
            |beta: f64| if seeds == 10 { [0.0, 0.4, 0.5, 1.0].contains(&beta) } else { [0.1, 1.0].contains(&beta) };
        series.push(Series {
            name: name.to_owned(),
            color,
            points: points.iter().zip(&clones).map(|(point, clone)| (point.ensemble.mean, clone.mean)).collect(),
            mark: Mark::LineAndPoints,
            intervals: Some(clones.iter().map(|clone| clone.interval()).collect()),
            x_intervals: Some(points.iter().map(|point| point.ensemble.interval()).collect()),
            labels: Some(
                points
                    .iter()
                    .map(|point| if is_named(point.beta) { format!("β = {}", point.beta) } else { String::new() })
                    .collect(),
            ),
        });
        let gap = |run: &SweepRun| run.ensemble.horizon_return - run.occupancy.horizon_return;
        let is_hurt = |run: &&SweepRun| gap(run) > 1.0;
        let worst = sweep.runs.iter().max_by(|a, b| gap(a).total_cmp(&gap(b))).ok_or("a sweep has runs")?;
        let _ = writeln!(
            honest,
            "- {name}: in {} of {} runs it is more than a step worse than its ensemble; at most by {} steps within T (β = {}, seed {}: \
             ensemble {} with {:.0} % arriving, clone {}).",
            sweep.runs.iter().filter(is_hurt).count(),
            sweep.runs.len(),
            number(gap(worst), 1),
            worst.beta,
            worst.seed,
            number(worst.ensemble.horizon_return, 1),
            100.0 * worst.ensemble.success,
            number(worst.occupancy.horizon_return, 1),
        );
        document.csv(file, sweep.csv());
    }
    let axes = Axes {
        title: "Return within T: the blind clone over its ensemble".to_owned(),
        x: "ensemble (steps)".to_owned(),
        y: "clone (steps)".to_owned(),
        ..Axes::default()
    };
    text += &document.picture("pareto", "Clone over ensemble for many β", chart(&axes, &series));
    let _ = write!(
        text,
        "\nEvery run: [PG-APE](results/sweep-pg-ape.csv), [exact](results/sweep-exact.csv). The clone of whoever clones the \
         demonstrations is in them too (`occupancy`):\n\n{honest}\n\
         Where no demonstration is cut off it cannot be worse, as the identity says. Where it is, an expert of PG-APE has given up \
         under a large β: its demonstrations do not arrive, and the clone learns from them.\n"
    );
    Ok(text)
}

fn benches(document: &mut Document, run: Run) -> Result<String, String> {
    let mut text =
        "## Attack bench\n\nEvery cloner against one ensemble. *Drop* is what the clone loses against the ensemble by \
                    capped returns, *gap* the same within T; time is on one core.\n"
            .to_owned();
    let trained = |config: Config| -> Result<EnsembleFile, String> {
        let trainer = train(config)?;
        let file = EnsembleFile::new(trainer.grid(), &trainer.ensemble(), None);
        Ok(EnsembleFile { digest: Some(trainer.digest()), ..file })
    };
    let trap = PRESETS.iter().find(|preset| preset.name == "trap").and_then(|preset| (preset.setup)().ensemble);
    let subjects = [
        ("PG-APE against `uniform`, seed 1", "bench-blind", trained(Config::default())?),
        ("the preset `trap`: two experts drawn by hand", "bench-trap", trap.ok_or("the preset trap is an ensemble")?),
    ];
    for (title, name, file) in subjects {
        let (bench, attacks) = bench(&file, &AttackerChoice::usual(), 1, run)?;
        let _ = writeln!(
            text,
            "### {title}\n\nThe ensemble returns {} capped, {} within T; {} arrive.",
            number(bench.ensemble.capped_return, 2),
            number(bench.ensemble.horizon_return, 2),
            percent(bench.ensemble.success)
        );
        let head = words(&["cloner", "capped", "drop", "within T", "gap", "success", "pairs", "seconds"]);
        let steps = |value: Option<f64>| value.map_or("–".to_owned(), |value| number(value, 2));
        let row = |attack: &Attack| {
            let r = &attack.returns;
            let error = if r.horizon_error > 0.0 { format!(" ± {:.2}", r.horizon_error) } else { String::new() };
            vec![
                format!("`{}`", attack.attacker),
                steps(r.capped_return),
                steps(attack.drop),
                format!("{}{error}", number(r.horizon_return, 2)),
                number(attack.imitation_gap, 2),
                percent(r.success),
                attack.pairs.map_or("∞".to_owned(), |pairs| pairs.to_string()),
                format!("{:.2}", attack.seconds),
            ]
        };
        table(&mut text, &head, attacks.iter().map(row));
        document.csv(name, bench.csv());
    }
    text += "All that is said of `gru` is simulated, ± is its 95 % interval; the rest is exact for the clone that was made. The trap shows what the capped \
             return hides: one expert walks, rarely, into a cell where both stay for ever, and the clone inherits that from nearly \
             everywhere; cut cell by cell it looks ruined, yet within T it does as well as the ensemble. An attacker who drops the \
             demonstrations that were cut off (`filtered`) is not even touched by it. (`history` has exactly the ensemble's law; its capped figure differs from the ensemble's as hitting \
             times are cut after the mean over experts is taken, not before.)\n";
    Ok(text)
}

fn bench(
    file: &EnsembleFile,
    attackers: &[AttackerChoice],
    seed: u32,
    run: Run,
) -> Result<(crate::experiment::Bench, Vec<Attack>), String> {
    let task = |&attacker| Task::Attack { ensemble: Box::new(file.clone()), attacker, horizon: HORIZON, seed };
    let tasks: Vec<Task> = attackers.iter().map(task).collect();
    let attacks: Vec<Attack> = run(&tasks)?
        .into_iter()
        .filter_map(|outcome| match outcome {
            Outcome::Attack(attack, _) => Some(attack),
            _ => None,
        })
        .collect();
    let (grid, ensemble) = file.clone().check().map_err(|error| error.to_string())?;
    let ensemble = ensemble_returns(&grid, &ensemble, HORIZON);
    Ok((
        crate::experiment::Bench { horizon: HORIZON, seed, digest: file.digest, ensemble, attackers: attacks.clone() },
        attacks,
    ))
}

fn learning_curve(document: &mut Document, run: Run) -> Result<String, String> {
    const SEEDS: u32 = 5;
    let sizes: [u32; 9] = [100, 300, 1000, 3000, 10_000, 30_000, 100_000, 300_000, 1_000_000];
    let trainer = train(Config::default())?;
    let file = EnsembleFile::new(trainer.grid(), &trainer.ensemble(), None);
    let own = ensemble_returns(trainer.grid(), &trainer.ensemble(), HORIZON).horizon_return;
    let mut series = Vec::new();
    let mut csv = "attacker,pairs,seed,capped_return,horizon_return,success,digest\n".to_owned();
    let mut text = "## How much data a cloner needs\n\nBehaviour cloning of the ensemble above (PG-APE against `uniform`, seed 1) \
                    from ever more pairs, five sets of demonstrations each: trained as in the paper, and in closed form.\n\n"
        .to_owned();
    for (name, color) in [("bc", PURPLE), ("bc_counts", ORANGE)] {
        let attackers: Vec<AttackerChoice> =
            sizes.iter().filter_map(|size| format!("{name}({size})").parse().ok()).collect();
        let mut found: Vec<Vec<f64>> = vec![Vec::new(); sizes.len()];
        for seed in 1..=SEEDS {
            let (_, attacks) = bench(&file, &attackers, seed, run)?;
            for (found, attack) in found.iter_mut().zip(&attacks) {
                let r = &attack.returns;
                found.push(r.horizon_return);
                let _ = writeln!(
                    csv,
                    "{name},{},{seed},{},{},{},{}",
                    attack.attacker.parameter(),
                    r.capped_return.unwrap_or(f64::NAN),
                    r.horizon_return,
                    r.success,
                    trainer.digest()
                );
            }
        }
        let summaries: Vec<Summary> = found.iter().filter_map(|values| Summary::of(values)).collect();
        series.push(Series {
            name: name.to_owned(),
            color,
            points: sizes.iter().zip(&summaries).map(|(size, of)| (f64::from(*size), of.mean)).collect(),
            mark: Mark::LineAndPoints,
            intervals: Some(summaries.iter().map(Summary::interval).collect()),
            ..Series::default()
        });
    }
    series.push(Series {
        name: "ensemble".to_owned(),
        color: TEAL,
        points: vec![(100.0, own), (1e6, own)],
        mark: Mark::DashedLine,
        ..Series::default()
    });
    let axes = Axes {
        title: "Return within T of behaviour cloning".to_owned(),
        x: "state–action pairs".to_owned(),
        y: "steps".to_owned(),
        is_x_log: true,
        ..Axes::default()
    };
    let at = |size: f64| series[1].points.iter().find(|(x, _)| *x == size).map_or(f64::NAN, |(_, y)| *y);
    let (few, some) = (at(1000.0), at(10_000.0));
    text += &document.picture("learning-curve", "Return of behaviour cloning over pairs", chart(&axes, &series));
    let _ = write!(
        text,
        "\nA thousand pairs, some sixty episodes, already give a clone of {} steps, ten thousand one of {}; the ensemble's own \
         figure is {}. Nothing that the experts do keeps the data from saying where each of them goes. \
         [Every run](results/learning-curve.csv).\n",
        number(few, 1),
        number(some, 1),
        number(own, 1)
    );
    document.csv("learning-curve", csv);
    Ok(text)
}

/// Sequential observers: what they learn, and what training against one comes to.
fn memory(document: &mut Document, run: Run) -> Result<String, String> {
    let mut text = "## Observers with a memory\n\nThe paper's learned observer: p(c|τ) by a GRU over the episode's cells, its output \
                    concatenated with the cell, a dense layer of 128 and a softmax, trained on 5,000 labelled demonstrations; the \
                    clone acts by the mixture. Share of the gap between the blind clone and the ensemble that it gets back, \
                    PG-APE against `uniform`:\n"
        .to_owned();
    let head = words(&[
        "seed",
        "digest",
        "ensemble within T",
        "`uniform`",
        "`gru(1)`",
        "`gru(4)`",
        "`gru(16)`",
        "gap regained by `gru(4)`",
    ]);
    let runs: Vec<Vec<String>> = (1..=3u32)
        .into_par_iter()
        .map(|seed| {
            let trainer = train(Config { seed, ..Config::default() })?;
            let ensemble = trainer.ensemble();
            let own = ensemble_returns(&grid(), &ensemble, HORIZON).horizon_return;
            let blind = attack(&ensemble, "uniform")?.horizon_return;
            let learned = ["gru(1)", "gru(4)", "gru(16)"].map(|name| attack(&ensemble, name));
            let [one, four, sixteen] = learned;
            let (one, four, sixteen) = (one?, four?, sixteen?);
            let shown = |r: &KnownReturns| format!("{} ± {:.2}", number(r.horizon_return, 2), r.horizon_error);
            Ok(vec![
                seed.to_string(),
                format!("`{}`", trainer.digest()),
                number(own, 2),
                number(blind, 2),
                shown(&one),
                shown(&four),
                shown(&sixteen),
                format!("{} %", number(100.0 * (four.horizon_return - blind) / (own - blind), 1)),
            ])
        })
        .collect::<Result<_, String>>()?;
    table(&mut text, &head, runs);
    text += "All of it, to a tenth of a step or two, with one unit too. That is no feat of memory: `occupancy`, which has none, does as well. \
             Memory shows only in how sure the guess is.\n\n\
             **Training against a memory.** Exact Bayes over the episode (`history`) in the place of the clone while PG-APE \
             trains: the clone's episodes have the ensemble's law, so that J = (1 − β) E[ensemble], and for β < 1 experts should be \
             optimal, for β > 1 the worse the better. And the paper's own kind of observer, a GRU that learns along with the \
             experts (`gru(4)`). The paper reports “either optimal or crippled policies”, with a minor difference between \
             ensemble and clone. Returns within T after 732 updates, 3 seeds:\n";
    let betas = [0.0, 0.3, 0.6, 0.8, 0.9, 1.1, 1.5];
    let mut rows: Vec<Vec<String>> = betas.iter().map(|beta| vec![beta.to_string()]).collect();
    for observer in ["history", "gru(4)"] {
        let observer: ObserverChoice = observer.parse().map_err(|error| format!("{error}"))?;
        let found = sweep(Config { observer, ..Config::default() }, &betas, 3, run)?;
        for (row, point) in rows.iter_mut().zip(found.points(WITHIN_T)) {
            row.extend([summary(&point.ensemble), known(&point.clone)]);
        }
        document.csv(&format!("against-{}", observer.model().name), found.csv());
    }
    let head = words(&["β", "against `history`: ensemble", "its clone", "against `gru(4)`: ensemble", "its clone"]);
    table(&mut text, &head, rows);
    text += "So it is: at no β is a clone with a memory much worse than its ensemble. (Near β = 1 little is left of J to climb, and \
             PG-APE gets lost in its noise: it treats p(c|τ) as given, as the paper does, though it depends on the experts.) \
             Every run: [history](results/against-history.csv), [gru](results/against-gru.csv).\n";
    Ok(text)
}

/// The constrained form, and β's path.
fn constraint(document: &mut Document) -> Result<String, String> {
    let mut text = "## Eq. 2: the worst clone at a given price\n\nThe constrained form: minimise the clone's return while the ensemble's \
                    stays at least α, by dual ascent on β from 0.6 after the first 40 % of a run. Returns within T, against \
                    `uniform`, seed 1:\n"
        .to_owned();
    let alphas = [-10.5, -12.0, -14.0, -17.0, -20.0];
    let long = Config { total_steps: 9_000_000, ..Config::default() };
    let runs = [("PG-APE, 732 updates", Config::default()), ("PG-APE, 2,197 updates", long), ("exact APE", exact())];
    let cases: Vec<(&str, Config, f64)> =
        runs.iter().flat_map(|(title, config)| alphas.map(|alpha| (*title, config.clone(), alpha))).collect();
    let paths: Vec<(Vec<CurvePoint>, Digest)> = cases
        .par_iter()
        .map(|(_, config, alpha)| {
            let config = Config { alpha: Some(*alpha), ..config.clone() };
            let updates = config.updates();
            let mut trainer = Trainer::new(grid(), config).map_err(|error| error.to_string())?;
            let mut path = Vec::new();
            for update in 1..=updates {
                trainer.update();
                if update.is_multiple_of(updates.div_ceil(150)) || update == updates {
                    path.push(CurvePoint::of(&mut trainer));
                }
            }
            Ok((path, trainer.digest()))
        })
        .collect::<Result<_, String>>()?;
    let row = |((title, _, alpha), (path, digest)): (&(&str, Config, f64), &(Vec<CurvePoint>, Digest))| {
        let last = path.last()?;
        let is_kept = if last.ensemble.horizon_return >= alpha - 0.1 { "yes" } else { "no" };
        Some(vec![
            (*title).to_owned(),
            number(*alpha, 1),
            number(last.ensemble.horizon_return, 2),
            is_kept.to_owned(),
            number(last.ensemble.horizon_return - alpha, 2),
            number(last.clone.horizon_return, 2),
            number(last.beta, 3),
            format!("`{digest}`"),
        ])
    };
    let head = words(&["", "α", "ensemble", "kept (to 0.1)", "unused", "clone", "β at the end", "digest"]);
    table(&mut text, &head, cases.iter().zip(&paths).filter_map(row));
    let colors = [TEAL, PURPLE, ORANGE, GREY, [0x2b, 0x5f, 0xb0]];
    let of_exact = cases.iter().zip(&paths).filter(|((title, ..), _)| *title == "exact APE");
    let series: Vec<Series> = of_exact
        .zip(colors)
        .map(|(((_, _, alpha), (path, _)), color)| Series {
            name: format!("α = {}", number(*alpha, 1)),
            color,
            points: path.iter().map(|point| (f64::from(point.update), point.beta)).collect(),
            mark: Mark::Line,
            ..Series::default()
        })
        .collect();
    let axes = Axes {
        title: "β's path under dual ascent, exact APE".to_owned(),
        x: "update".to_owned(),
        y: "β".to_owned(),
        y_range: Some((0.0, 2.0)),
        ..Axes::default()
    };
    text += &document.picture("dual-ascent", "β over updates for five α", chart(&axes, &series));
    text += "\nExact gradients keep every constraint and use what it allows, unless β reaches the limit of 2 that it has here. PG-APE \
             is another matter: what it costs its ensemble is, besides β, the entropy bonus that falls until the end and the noise of its \
             gradient. While they cost too much β goes down to its floor, and where that is not enough α is not kept; a longer run \
             helps.\n";
    Ok(text)
}

/// Another reward for the clone.
fn semantics(document: &mut Document) -> Result<String, String> {
    let mut text = "## The semantics of reward\n\nUseless may mean something else than slow: here the clone is to be denied r̃ while the \
                    experts keep their reward, J = E[ensemble] − β E[Σ r̃]. Against `uniform`, seed 1, β = 1; Σ r̃ is exact, within T, \
                    undiscounted.\n"
        .to_owned();
    let cases = [
        ("lure it to the top right corner", "0,9=-1"),
        ("lure it to one corner, keep it off another", "0,9=-1 9,0=1"),
        ("make it stand still", "stay=-1"),
        ("keep it from standing still", "stay=1"),
    ];
    let kinds = [("PG-APE", AlgorithmKind::PgApe), ("exact", AlgorithmKind::Exact)];
    let cases: Vec<_> = cases.iter().flat_map(|case| kinds.map(|kind| (*case, kind))).collect();
    let found: Vec<(CurvePoint, Ensemble, Digest)> = cases
        .par_iter()
        .map(|((_, reward), (_, algorithm))| {
            let adversary_reward = Some(reward.parse().map_err(|error| format!("{error}"))?);
            let config = Config { beta: 1.0, algorithm: *algorithm, adversary_reward, ..Config::default() };
            let mut trainer = train(config)?;
            Ok((CurvePoint::of(&mut trainer), trainer.ensemble(), trainer.digest()))
        })
        .collect::<Result<_, String>>()?;
    let rows = cases.iter().zip(&found).map(|(((aim, reward), (algorithm, _)), (point, _, digest))| {
        let denied = point.denied.unwrap_or(crate::experiment::Denied { ensemble: f64::NAN, clone: f64::NAN });
        vec![
            (*aim).to_owned(),
            format!("`{reward}`"),
            (*algorithm).to_owned(),
            number(point.ensemble.horizon_return, 2),
            number(denied.ensemble, 2),
            number(denied.clone, 2),
            format!("`{digest}`"),
        ]
    });
    let head = words(&["aim", "r̃", "algorithm", "ensemble within T", "Σ r̃ of an expert", "Σ r̃ of the clone", "digest"]);
    table(&mut text, &head, rows);
    let grid = grid();
    let mut solver = Solver::new(&grid);
    let (_, ensemble, digest) = &found[1];
    let mut policies = Vec::new();
    for (index, policy) in ensemble.policies().iter().enumerate() {
        policies.push((format!("Expert {}", index + 1), policy.clone(), solver.evaluate(policy, HORIZON)));
    }
    let target = Target { grid: &grid, ensemble, horizon: HORIZON, seed: 1 };
    let clone = AttackerChoice::UNIFORM.clone_of(&target, &mut |_| true).expect("it was not told to stop").policy;
    let value = solver.evaluate(&clone, HORIZON);
    policies.push(("Clone, uniform".to_owned(), clone, value));
    let panels: Vec<Panel> = policies
        .into_iter()
        .map(|(title, policy, value)| Panel {
            title,
            subtitle: format!("{} steps within T", number(value.returns.horizon_return, 1)),
            policy,
            steps: value.hitting_time,
            rewards: Vec::new(),
        })
        .collect();
    text += &document.picture(
        "lured",
        "Experts and the clone that they lure to the top right corner",
        heatmaps(&grid, &panels, &COLOR_MAPS[0], &caption("exact APE, β = 1, r̃ 0,9=-1", *digest)),
    );
    text += "\nThe first row of the table, exact: the clone is led to the top right corner and stays there.\n";
    Ok(text)
}

/// What follows; the figures in it that are ours come from runs.
fn discussion(run: Run) -> Result<String, String> {
    let mean = |sweep: &Sweep| {
        let point = sweep.points(CAPPED).into_iter().next()?;
        Some((point.ensemble.mean, point.clone?.mean))
    };
    let replay = mean(&sweep(Config::paper(), &[0.6], 5, run)?).ok_or("a sweep has points")?;
    let split = sweep(Config::default(), &[0.3, 0.35, 0.4], 10, run)?;
    let clones: Vec<Summary> = split.points(CAPPED).into_iter().filter_map(|point| point.clone).collect();
    let spread = clones.first().zip(clones.last()).ok_or("a sweep has points")?;
    Ok(DISCUSSION
        .replace("{replay ensemble}", &number(replay.0, 2))
        .replace("{replay clone}", &number(replay.1, 2))
        .replace("{spread low}", &plus_minus((spread.0.mean, spread.0.sd)))
        .replace("{spread high}", &plus_minus((spread.1.mean, spread.1.sd))))
}

const DISCUSSION: &str = "## Where we agree with the paper, where not, and why

**Agreement.** An ensemble can be trained by PG-APE that costs its owner a few steps and ruins the policy of Eq. 1, if p(c|s) is
taken to be 1/n. Plain ensembles of the same return, and noisy ones, are cloned without loss (the paper: +0.07). A larger β costs the
ensemble more and the clone much more. Observers with a memory cannot be kept out, and training against one ends in optimal or
crippled experts.

**Disagreement.** The paper reports a clone at −44.27 ± 1.07, made by behaviour cloning from a million pairs, beside an ensemble at
−16.24 ± 1.20. In both readings above behaviour cloning of a trained ensemble loses no more than the noise of its data: `bc`
returns what the ensemble returns, in every row of Table 1. (Only where β is so large that an expert gives up is there more, see
“What protection costs”.) That is no accident of training. For whoever clones the demonstrations
themselves, with infinitely many of them,

    E[steps of the clone] = D + Σ_s m(s) · h_clone(s),

D the length of a demonstration, m(s) the share of demonstrations that T cuts off at s ([METHOD.md](METHOD.md) has the proof).
Where none is cut off, the clone is exactly as good as the ensemble, whatever the experts do. A clone at −44 beside an ensemble at
−16 needs demonstrations that are cut off, or a clone that is not made of the demonstrations.

**What may explain it.** (1) *The observer model.* The paper leaves p(c|s) open where it matters: the appendix estimates it from a
buffer of the last 60 contexts at each state, with which PG-APE ends at {replay ensemble} for the ensemble and {replay clone} for the clone. Its commented-out
table of β is of the kind, though not of the size, that the reading p(c|s) = 1/n gives at a longer run, and no other of ours does. (2) *Capping.* Hitting times are cut at 100 cell by cell, after the
mean over luck is taken, so a clone that gets lost once in a hundred runs may look ruined; the preset `trap` does so, above,
while it arrives as often as its experts. The paper's figure 2 shows such cells: “two purple squares at the top-left near the goal”,
from which demonstrations are cut off. (3) *A β between.* Against `uniform`
the clone returns {spread low} at β = 0.3 and {spread high} at β = 0.4 (10 seeds): figures like −44 are means of runs that protect and runs
that do not, and spread accordingly; the paper's small spread of 1.07 at β = 0.6 speaks against that.

**What follows.** The protection is real against an observer who does not know, or does not use, where each expert goes: one who asks
a random expert at each cell, say, or learns from equally many labels of each. It is none against one who clones demonstrations as
they come, who needs about a thousand pairs for it here, nor against one with any memory. Capped returns alone do not tell the two apart:
look at the return within T and at success.
";
