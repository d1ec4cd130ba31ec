//! A sweep on many machines: `ape sweep --shard` writes one shard, `ape merge` joins them all.

use std::sync::Mutex;
use std::time::{Duration, Instant};

use ape_lab::experiment::{Outcome, Setup, Shard, ShardError, SweepPlan, Task, Which};
use clap::ArgMatches;

use super::experiments::{run_each, show_sweep};
use super::{check_out, read, write};

/// A stop loses at most the runs of so long.
const SAVED_EVERY: Duration = Duration::from_secs(5);

fn read_shard(file: &str) -> Result<Shard, String> {
    Shard::parse(&read(file, Shard::LONGEST)?).map_err(|error| format!("{file}: {error}"))
}

fn save(file: &str, shard: &Shard) -> Result<(), String> {
    write(file, &shard.text().map_err(|error| error.to_string())?)
}

/// One shard of a sweep into its file, going on from what the file has.
pub fn sweep(matches: &ArgMatches, which: &str, setup: &Setup, betas: Vec<f64>, seeds: u32) -> Result<(), String> {
    let flag = |error: ShardError| format!("--shard {error}");
    let which: Which = which.parse().map_err(flag)?;
    let Some(file) = matches.get_one::<String>("out") else {
        return Err(format!("--shard {which}: expected --out FILE with it, the file of this shard"));
    };
    let plan = SweepPlan::new(setup, betas, seeds).map_err(|error| error.to_string())?;
    let mut shard = Shard::new(plan, which).map_err(flag)?;
    if std::fs::exists(file).map_err(|error| format!("{file}: {error}"))? {
        let is_kept = |sentence: String| format!("{sentence}; the file is left as it is");
        let earlier = read_shard(file).map_err(is_kept)?;
        shard.resume(earlier).map_err(|error| is_kept(format!("{file}: {error}")))?;
    }
    let (missing, runs) = (shard.missing(), shard.size());
    if missing.is_empty() {
        say!("{file}: shard {which} is complete already (runs: {runs}), nothing to do");
        return Ok(());
    }
    // A file that cannot be written is found out before anything is computed for it.
    save(file, &shard)?;
    let setups = missing.iter().map(|&index| Box::new(shard.sweep().setup(index)));
    let tasks: Vec<Task> = setups.map(|setup| Task::Sweep { setup }).collect();
    let state = Mutex::new((shard, Instant::now() + SAVED_EVERY));
    let keep = |task: usize, outcome| {
        let Outcome::Sweep(run) = outcome else { return Ok(()) };
        let mut state = state.lock().map_err(|_| "another run was stopped by a fault".to_owned())?;
        let (shard, next) = &mut *state;
        shard.add(missing[task], run).map_err(|error| error.to_string())?;
        let begin = Instant::now();
        if begin >= *next {
            save(file, shard)?;
            // Large files on slow disks are saved less often.
            *next = Instant::now() + SAVED_EVERY.max(20 * begin.elapsed());
        }
        Ok(())
    };
    let outcome = run_each(&tasks, &keep);
    let (shard, _) = state.into_inner().map_err(|error| error.to_string())?;
    // What is done is kept also where something went wrong.
    let saved = save(file, &shard);
    outcome.and(saved)?;
    let kept = runs - missing.len();
    say!("{file}: shard {which} is complete (runs: {runs}, kept from before: {kept})");
    Ok(())
}

/// Joins the files of all shards.
pub fn merge(matches: &ArgMatches) -> Result<(), String> {
    check_out(matches, "out")?;
    let files = matches.get_many::<String>("files").expect("clap requires it");
    let shards = files.map(|file| Ok((file.clone(), read_shard(file)?)));
    let sweep = ape_lab::experiment::merge(shards.collect::<Result<_, String>>()?);
    show_sweep(matches, &sweep.map_err(|error| error.to_string())?)
}
