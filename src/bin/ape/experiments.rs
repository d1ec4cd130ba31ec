//! The experiments as commands: `attack`, `table1`, `sweep`, `results`. Tasks run on all cores; how many there are
//! does not change the outcome.

use std::io::IsTerminal;
use std::path::Path;
use std::sync::Mutex;
use std::time::Instant;

use ape_lab::ape::EnsembleFile;
use ape_lab::attack::AttackerChoice;
use ape_lab::experiment::{Bench, METHODS, Outcome, Setup, Summary, Sweep, Table1, Task, ensemble_returns};
use ape_lab::files;
use ape_lab::mdp::RETURN_KINDS;
use clap::{Arg, ArgAction, ArgMatches, Command};
use rayon::prelude::*;

use super::{Opened, check_out, ensemble_file, print, setup, shards, with_setup, write};

/// Every command of this file.
pub fn commands() -> [Command; 5] {
    let attackers = || {
        Arg::new("attackers")
            .long("attackers")
            .value_name("LIST")
            .default_value("all")
            .help("Cloners with commas between, as uniform,bc(1000),history; or all")
    };
    let json = || Arg::new("json").long("json").action(ArgAction::SetTrue).help("Print JSON");
    let out = |help: &'static str| Arg::new("out").short('o').long("out").value_name("FILE").help(help);
    let seeds = |default: &'static str| {
        let arg = Arg::new("seeds").long("seeds").value_name("N").default_value(default).allow_hyphen_values(true);
        arg.help("Number of seeds, from 1 on")
    };
    [
        Command::new("attack")
            .about("Every cloner against an ensemble file")
            .arg(Arg::new("file").value_name("FILE").required(true))
            .arg(attackers())
            .arg(
                Arg::new("seed")
                    .long("seed")
                    .value_name("N")
                    .default_value("1")
                    .allow_hyphen_values(true)
                    .help("Seed of the attacks"),
            )
            .arg(json())
            .arg(out("Write the table to this CSV file")),
        with_setup(
            Command::new("table1").about("The paper's Table 1, with every cloner as a column"),
            &["seed", "algorithm"],
        )
        .arg(seeds("5"))
        .arg(attackers())
        .arg(json())
        .arg(out("Write every run to this CSV file")),
        with_setup(Command::new("sweep").about("Ensemble and clone for many β"), &["seed", "beta"])
            .arg(
                Arg::new("betas")
                    .long("betas")
                    .value_name("LIST")
                    .default_value("0:1:0.05")
                    .allow_hyphen_values(true)
                    .help("FIRST:LAST:STEP, or a list with commas"),
            )
            .arg(seeds("3"))
            .arg(json())
            .arg(out("Write every run to this CSV file; with --shard, the shard to this JSON file"))
            .arg(Arg::new("shard").long("shard").value_name("I/K").conflicts_with("json").help(
                "Only the I-th of K shards of the runs, into a file of its own that ape merge joins with the others. \
                 Run again after a stop, it goes on from that file",
            )),
        Command::new("merge")
            .about("Join the shards of a sweep: prints and writes what ape sweep does of the whole")
            .arg(
                Arg::new("files")
                    .value_name("FILES")
                    .required(true)
                    .num_args(1..)
                    .help("The files of all shards, in any order"),
            )
            .arg(json())
            .arg(out("Write every run to this CSV file")),
        Command::new("results").about("Every table and picture of docs/RESULTS.md").arg(
            Arg::new("folder").value_name("FOLDER").default_value("docs").help("Where RESULTS.md and results/ go"),
        ),
    ]
}

/// Runs tasks on all cores; outcomes come in the order of the tasks. Says on a terminal how far it is.
pub fn run_all(tasks: &[Task]) -> Result<Vec<Outcome>, String> {
    run_each(tasks.len(), &|index| tasks[index].clone(), &|_, outcome| Ok(outcome))
}

/// Runs so many tasks, each made when its turn has come; `keep` takes each outcome as it comes, with the index of its
/// task, and what it makes of it is returned.
pub fn run_each<T: Send>(
    tasks: usize,
    task: &(impl Fn(usize) -> Task + Sync),
    keep: &(impl Fn(usize, Outcome) -> Result<T, String> + Sync),
) -> Result<Vec<T>, String> {
    let begin = Instant::now();
    let clock = || begin.elapsed().as_secs_f64() * 1000.0;
    let is_shown = std::io::stderr().is_terminal();
    let done = Mutex::new((vec![0.0; tasks], begin));
    let show = |index: usize, part: f64| {
        let Ok(mut done) = done.lock() else { return };
        done.0[index] = part;
        if !is_shown || done.1.elapsed().as_millis() < 200 {
            return;
        }
        done.1 = Instant::now();
        let share = done.0.iter().sum::<f64>() / tasks as f64;
        let left = begin.elapsed().as_secs_f64() * (1.0 / share.max(1e-3) - 1.0);
        mutter!("\r{:3.0} % done, about {left:.0} s left   ", 100.0 * share);
    };
    let run = |index: usize| {
        let mut progress = |part| {
            show(index, part);
            true
        };
        let outcome = task(index).run(&clock, &mut progress)?;
        show(index, 1.0);
        keep(index, outcome.ok_or_else(|| "stopped".to_owned())?)
    };
    let outcomes = (0..tasks).into_par_iter().map(run).collect();
    if is_shown {
        mutter!("\r{:40}\r", "");
    }
    outcomes
}

fn number(matches: &ArgMatches, name: &str, low: u32, high: u32) -> Result<u32, String> {
    let text = matches.get_one::<String>(name).expect("it has a default");
    let number = text.parse().ok().filter(|number| (low..=high).contains(number));
    number.ok_or_else(|| format!("--{name} {text}: must be a whole number from {low} to {high}"))
}

/// Each has the ensemble for itself.
const MOST_ATTACKERS: usize = 100;

fn attackers(matches: &ArgMatches) -> Result<Vec<AttackerChoice>, String> {
    match matches.get_one::<String>("attackers").expect("it has a default").as_str() {
        "all" => Ok(AttackerChoice::usual()),
        list if list.split(',').count() > MOST_ATTACKERS => {
            Err(format!("--attackers: {} of them, expected at most {MOST_ATTACKERS}", list.split(',').count()))
        }
        list => list
            .split(',')
            .map(|name| name.trim().parse().map_err(|error| format!("--attackers: {error}; or all")))
            .collect(),
    }
}

pub fn attack(matches: &ArgMatches) -> Result<(), String> {
    check_out(matches, &["out"])?;
    let Opened { grid, ensemble, horizon, digest } = ensemble_file(matches)?;
    let seed = number(matches, "seed", 0, u32::MAX)?;
    let file = Box::new(EnsembleFile::new(&grid, &ensemble, None));
    let task = |attacker| Task::Attack { ensemble: file.clone(), attacker, horizon, seed };
    let tasks: Vec<Task> = attackers(matches)?.into_iter().map(task).collect();
    let attackers = run_all(&tasks)?.into_iter().filter_map(|outcome| match outcome {
        Outcome::Attack(attack, _) => Some(attack),
        _ => None,
    });
    let ensemble = ensemble_returns(&grid, &ensemble, horizon);
    let bench = Bench { horizon, seed, digest, ensemble, attackers: attackers.collect() };
    if let Some(file) = matches.get_one::<String>("out") {
        write(file, &bench.csv())?;
    }
    if matches.get_flag("json") {
        return print(&bench);
    }
    let known = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.2}"));
    let with_error = |value: f64, error: f64, decimals: usize| {
        if error > 0.0 { format!("{value:.decimals$} ± {error:.decimals$}") } else { format!("{value:.decimals$}") }
    };
    let r = &bench.ensemble;
    say!(
        "ensemble: capped return {:.2}, within T = {horizon} steps {:.2}, success {:.3}",
        r.capped_return,
        r.horizon_return,
        r.success
    );
    say!(
        "\n{:<20} {:>9} {:>9} {:>16} {:>16} {:>9} {:>10} {:>8}",
        "attacker",
        "capped",
        "drop",
        "within T",
        "success",
        "gap",
        "pairs",
        "seconds"
    );
    for attack in &bench.attackers {
        let r = &attack.returns;
        say!(
            "{:<20} {:>9} {:>9} {:>16} {:>16} {:>9.2} {:>10} {:>8.2}",
            attack.attacker.to_string(),
            known(r.capped_return),
            known(attack.drop),
            with_error(r.horizon_return, r.horizon_error, 2),
            with_error(r.success, r.success_error, 3),
            attack.imitation_gap,
            attack.pairs.map_or("infinite".to_owned(), |pairs| pairs.to_string()),
            attack.seconds
        );
    }
    say!(
        "\ncapped, drop: mean hitting times cut at 100 steps a cell, and what the clone loses by them (unknown of clones with a memory but history); gap: the same of returns within T."
    );
    Ok(())
}

/// Table 1 of a setup.
pub fn make_table1(setup: &Setup, seeds: u32, attackers: Vec<AttackerChoice>) -> Result<Table1, String> {
    let mut table = Table1::new(attackers);
    let task = |setup| Task::Table1 { setup: Box::new(setup), attackers: table.attackers.clone() };
    let tasks: Vec<Task> = Table1::setups(setup, seeds).into_iter().map(task).collect();
    for outcome in run_all(&tasks)? {
        if let Outcome::Table1(runs) = outcome {
            table.runs.extend(runs);
        }
    }
    Ok(table)
}

pub fn table1(matches: &ArgMatches) -> Result<(), String> {
    check_out(matches, &["out"])?;
    let setup = setup(matches)?;
    let table = make_table1(&setup, number(matches, "seeds", 1, 1000)?, attackers(matches)?)?;
    if let Some(file) = matches.get_one::<String>("out") {
        write(file, &table.csv())?;
    }
    if matches.get_flag("json") {
        return print(&table);
    }
    for kind in [0, 2] {
        say!(
            "{} ({}), mean ± sd [95 % bootstrap interval] over seeds",
            RETURN_KINDS[kind].name,
            RETURN_KINDS[kind].label
        );
        let with_paper = |value: Option<(f64, f64)>| {
            value
                .filter(|_| kind == 0 && setup.is_papers_table())
                .map_or(String::new(), |(mean, sd)| format!("  (paper {mean:.2} ± {sd:.2})"))
        };
        for row in table.rows(kind) {
            let method = &METHODS[row.method];
            let paper = method.paper.as_ref();
            say!("{}", method.title);
            say!("  {:<18} {}{}", "ensemble", shown(&row.ensemble), with_paper(paper.map(|paper| paper.ensemble)));
            for (attacker, clone) in table.attackers.iter().zip(&row.clones) {
                let Some(clone) = clone else { continue };
                // The paper's clone is of a million pairs.
                let bc = attacker.model().name == "bc" && attacker.parameter() == 1_000_000;
                say!(
                    "  {:<18} {}{}",
                    attacker.to_string(),
                    shown(clone),
                    with_paper(paper.filter(|_| bc).map(|paper| paper.clone))
                );
            }
        }
        say!("");
    }
    Ok(())
}

fn shown(summary: &Summary) -> String {
    let Summary { mean, sd, values } = summary;
    if values.len() == 1 {
        return format!("{mean:8.2}");
    }
    let (low, high) = summary.interval();
    format!("{mean:8.2} ± {sd:5.2}  [{low:.2}, {high:.2}]")
}

/// The sweep of a setup.
pub fn make_sweep(setup: &Setup, betas: &[f64], seeds: u32) -> Result<Sweep, String> {
    let task = |index| Task::Sweep { setup: Box::new(Sweep::setup(setup, betas, seeds, index)) };
    let run = |_, outcome| match outcome {
        Outcome::Sweep(run) => Ok(run),
        _ => Err("an outcome of another kind of task".to_owned()),
    };
    Ok(Sweep { runs: run_each(betas.len() * seeds as usize, &task, &run)? })
}

pub fn sweep(matches: &ArgMatches) -> Result<(), String> {
    check_out(matches, &["out"])?;
    let betas = matches.get_one::<String>("betas").expect("it has a default");
    let betas = Sweep::betas(betas).map_err(|error| format!("--{error}"))?;
    let (setup, seeds) = (setup(matches)?, number(matches, "seeds", 1, 1000)?);
    if let Some(which) = matches.get_one::<String>("shard") {
        return shards::sweep(matches, which, &setup, betas, seeds);
    }
    show_sweep(matches, &make_sweep(&setup, &betas, seeds)?)
}

/// Prints and writes a whole sweep as the flags say.
pub fn show_sweep(matches: &ArgMatches, sweep: &Sweep) -> Result<(), String> {
    if let Some(file) = matches.get_one::<String>("out") {
        write(file, &sweep.csv())?;
    }
    if matches.get_flag("json") {
        return print(sweep);
    }
    for kind in [0, 2] {
        say!("{}, mean ± sd [95 % bootstrap interval] over seeds", RETURN_KINDS[kind].name);
        for point in sweep.points(kind) {
            let clone = point.clone.as_ref().map_or("not known of one that remembers".to_owned(), shown);
            say!("  β = {:<5} ensemble {}   clone {clone}", point.beta, shown(&point.ensemble));
        }
    }
    Ok(())
}

pub fn results(matches: &ArgMatches) -> Result<(), String> {
    let folder = Path::new(matches.get_one::<String>("folder").expect("it has a default"));
    let pictures = folder.join("results");
    std::fs::create_dir_all(&pictures).map_err(|error| format!("{}: {error}", pictures.display()))?;
    // What cannot be written is found out before all the work.
    for file in [folder.join("RESULTS.md"), pictures.join("pg-ape.svg")] {
        files::check(&file).map_err(|error| format!("{}: {error}", file.display()))?;
    }
    let files = ape_lab::report::results(&|tasks| run_all(tasks))?;
    for (name, text) in &files {
        let path = folder.join(name);
        write(&path.to_string_lossy(), text)?;
        say!("{}: {} bytes", path.display(), text.len());
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use ape_lab::ape::Config;

    use super::*;

    /// A sweep may have a million runs: no more of them stand ready than are being made.
    #[test]
    fn a_task_is_made_when_its_turn_has_come() {
        let config = Config { batch_steps: 1, total_steps: 1, horizon: 1, ..Config::default() };
        let setup = Setup { config, ..Setup::default() };
        let (made, kept, most) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(0));
        let task = |_| {
            let made = made.fetch_add(1, Ordering::SeqCst) + 1;
            most.fetch_max(made - kept.load(Ordering::SeqCst), Ordering::SeqCst);
            Task::Sweep { setup: Box::new(setup.clone()) }
        };
        let keep = |_, _| {
            kept.fetch_add(1, Ordering::SeqCst);
            Ok(())
        };
        assert_eq!(run_each(1000, &task, &keep).unwrap().len(), 1000);
        let at_once = most.into_inner();
        assert!(at_once <= rayon::current_num_threads(), "{at_once}");
    }
}
