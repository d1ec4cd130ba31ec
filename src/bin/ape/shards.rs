//! A sweep on many machines: `ape sweep --shard` writes one shard, `ape merge` joins them all.

use std::sync::mpsc::{Receiver, channel};
use std::thread;
use std::time::{Duration, Instant};

use ape_lab::experiment::{Outcome, Setup, Shard, ShardError, ShardNumber, SweepPlan, SweepRun, Task, merge_shards};
use clap::ArgMatches;

use super::experiments::{run_each, show_sweep};
use super::{check_out, read, write};

/// A run that is done is in the file after so long, and the time of writing it: a stop loses no more of them.
const SAVED_WITHIN: Duration = Duration::from_secs(5);

fn read_shard(file: &str) -> Result<Shard, String> {
    Shard::parse(&read(file, Shard::LONGEST)?).map_err(|error| format!("{file}: {error}"))
}

fn save(file: &str, shard: &Shard) -> Result<(), String> {
    write(file, &shard.text().map_err(|error| error.to_string())?)
}

/// Adds runs to a shard, and keeps its file up to date, until no more can come.
fn save_as_they_come(file: &str, mut shard: Shard, done: Receiver<(usize, SweepRun)>) -> Result<(), String> {
    while let Ok(first) = done.recv() {
        let saved_by = Instant::now() + SAVED_WITHIN;
        let next = || done.recv_timeout(saved_by.checked_duration_since(Instant::now())?).ok();
        // All that come meanwhile are saved at once.
        let added = std::iter::successors(Some(first), |_| next())
            .try_for_each(|(index, run)| shard.add(index, run).map_err(|error| error.to_string()));
        save(file, &shard)?;
        added?;
    }
    Ok(())
}

/// One shard of a sweep into its file, going on from what the file has.
pub fn sweep(matches: &ArgMatches, which: &str, setup: &Setup, betas: Vec<f64>, seeds: u32) -> Result<(), String> {
    let flag = |error: ShardError| format!("--shard {error}");
    let which: ShardNumber = which.parse().map_err(flag)?;
    let Some(file) = matches.get_one::<String>("out") else {
        return Err(format!("--shard {which}: expected --out FILE with it, the file of this shard"));
    };
    let plan = SweepPlan::new(setup, betas, seeds).map_err(|error| error.to_string())?;
    let mut shard = Shard::new(plan, which).map_err(flag)?;
    if std::fs::exists(file).map_err(|error| format!("{file}: {error}"))? {
        if !std::path::Path::new(file).is_file() {
            return Err(format!("--out {file}: is no file, expected one that --shard can go on from"));
        }
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
    let plan = shard.sweep().clone();
    let task = |task: usize| Task::Sweep { setup: Box::new(plan.setup(missing[task])) };
    thread::scope(|scope| {
        let (sender, done) = channel();
        let saver = scope.spawn(|| save_as_they_come(file, shard, done));
        let keep = |task: usize, outcome| match outcome {
            // Nobody listens any more when the file could not be written.
            Outcome::Sweep(run) => sender.send((missing[task], run)).map_err(|_| "stopped".to_owned()),
            _ => Ok(()),
        };
        let computed = run_each(missing.len(), &task, &keep);
        drop(sender);
        let saved = saver.join().map_err(|_| "the shard was not saved".to_owned())?;
        saved.and(computed)
    })?;
    let kept = runs - missing.len();
    say!("{file}: shard {which} is complete (runs: {runs}, kept from before: {kept})");
    Ok(())
}

/// Joins the files of all shards.
pub fn merge(matches: &ArgMatches) -> Result<(), String> {
    check_out(matches, &["out"])?;
    let files = matches.get_many::<String>("files").expect("clap requires it");
    let shards = files.map(|file| Ok((file.clone(), read_shard(file)?)));
    let sweep = merge_shards(shards.collect::<Result<_, String>>()?);
    show_sweep(matches, &sweep.map_err(|error| error.to_string())?)
}
