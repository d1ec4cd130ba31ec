//! How many instructions the core takes. Unlike times they hardly differ from one run to the next, so that a change
//! of one in a hundred is seen.
//!
//! `counts` lists what can be counted, `counts NAME TIMES` does it so many times. `cargo xtask bench counts` runs each under
//! callgrind, once with few and once with more times: the difference is free of what it takes to begin.

mod workload;

use std::hint::black_box;
use std::process::ExitCode;

use ape_lab::ape::observer::ObserverChoice;
use ape_lab::ape::{AlgorithmKind, Config};
use ape_lab::attack::AttackerChoice;
use ape_lab::experiment::Setup;
use ape_lab::mdp::{Grid, Solver};
use workload::{Desk, TRAININGS};

/// Something to count.
struct Counted {
    name: String,
    /// What is counted per: `step`, `update`, …
    unit: &'static str,
    /// How many of these it has each time.
    units: u64,
    /// How many times are enough.
    times: u32,
    /// Begins, and does it so many times.
    work: Box<dyn Fn(u32)>,
}

fn all() -> Vec<Counted> {
    let mut all = Vec::new();
    for training in &TRAININGS {
        let setup = training.setup();
        let (unit, units) = match setup.config.algorithm {
            AlgorithmKind::PgApe => ("step", workload::steps_of_update(&setup.config)),
            AlgorithmKind::Exact => ("update", 1),
        };
        let work = move |times| {
            let mut trainer = workload::trainer(&setup);
            for _ in 0..times {
                trainer.update();
            }
            black_box(trainer.digest());
        };
        all.push(Counted {
            name: format!("training/{}", training.name),
            unit,
            units,
            times: 128,
            work: Box::new(work),
        });
    }
    for side in [workload::side(), Grid::MAX_SIDE] {
        let work = move |times| {
            let setup = Setup { grid: workload::square(side), ..Setup::default() };
            let (grid, ensemble) = (workload::grid(&setup.grid), workload::experts(&setup));
            let mut solver = Solver::new(&grid);
            for _ in 0..times {
                black_box(solver.evaluate(black_box(&ensemble.policies()[0]), setup.config.horizon));
            }
        };
        let name = format!("returns/{}", side * side);
        all.push(Counted { name, unit: "policy", units: 1, times: 32, work: Box::new(work) });
    }
    let work = |times| {
        let setup = Setup::default();
        let (grid, ensemble) = (workload::grid(&setup.grid), workload::experts(&setup));
        let Config { horizon, seed, .. } = setup.config;
        for _ in 0..times {
            black_box(ObserverChoice::OCCUPANCY.contexts(&grid, black_box(&ensemble), horizon, seed));
        }
    };
    let name = format!("contexts/{}", ObserverChoice::OCCUPANCY);
    all.push(Counted { name, unit: "ensemble", units: 1, times: 32, work: Box::new(work) });
    // Fewer pairs than the paper's million: under callgrind everything takes fifty times as long.
    for name in ["bc(10000)", "bc_counts(100000)"] {
        let attacker: AttackerChoice = name.parse().expect("it is one of the table");
        let work = move |times| {
            let setup = Setup::default();
            let ensemble = workload::experts(&setup);
            for _ in 0..times {
                black_box(workload::clone(&setup, black_box(&ensemble), attacker));
            }
        };
        let units = u64::from(attacker.parameter());
        all.push(Counted { name: format!("cloning/{name}"), unit: "pair", units, times: 2, work: Box::new(work) });
    }
    let work = |times| {
        let mut setup = Setup::default();
        // What a snapshot costs does not depend on how long the run was.
        setup.config.total_steps = 16 * setup.config.batch_steps;
        let mut desk = Desk::new(setup);
        for _ in 0..times {
            black_box(desk.snapshot());
        }
    };
    all.push(Counted { name: "snapshot".to_owned(), unit: "snapshot", units: 1, times: 32, work: Box::new(work) });
    all
}

fn main() -> ExitCode {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    match &arguments[..] {
        [] => {
            for Counted { name, unit, units, times, .. } in all() {
                println!("{name}\t{unit}\t{units}\t{times}");
            }
        }
        [name, times] => {
            let found = all().into_iter().find(|counted| counted.name == *name);
            let (Some(counted), Ok(times)) = (found, times.parse()) else {
                eprintln!("expected a name of the list and a number of times");
                return ExitCode::FAILURE;
            };
            (counted.work)(times);
        }
        _ => {
            eprintln!("usage: counts [NAME TIMES]");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}
