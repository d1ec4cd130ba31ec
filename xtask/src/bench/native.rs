//! The part `native`: benches/core.rs by criterion, and a sweep on one core and on all.

use std::path::{Path, PathBuf};
use std::time::{Instant, SystemTime};

use serde_json::{Value, json};

use super::{environment, part, target};
use crate::steps::say;
use crate::{Failure, program, run_command};

/// What builds the core without the page.
pub const CORE: [&str; 3] = ["--no-default-features", "--features", "cli"];

pub fn measure() -> Result<Value, Failure> {
    say("timing the core (3 minutes, and 3 more to compile it at first)");
    let mut rows = criterion(None)?;
    rows.push(parallel()?);
    Ok(part(environment::facts(&["rustc"]), rows))
}

/// Runs benches/core.rs, or what of it is called so, and reads what criterion wrote.
pub fn criterion(only: Option<&str>) -> Result<Vec<Value>, Failure> {
    let home = target().join("criterion");
    let begin = SystemTime::now();
    let mut cargo = program("cargo", &["bench"]);
    cargo.args(CORE).args(["--bench", "core", "--", "--noplot"]).env("CRITERION_HOME", &home);
    if let Some(name) = only {
        cargo.args(["--exact", name]);
    }
    run_command(cargo)?;
    let mut files = Vec::new();
    collect(home, &mut files);
    // What was written before is of benchmarks that are no more.
    let is_new = |file: &PathBuf| {
        std::fs::metadata(file).and_then(|data| data.modified()).is_ok_and(|modified| modified >= begin)
    };
    let mut rows: Vec<Value> =
        files.iter().filter(|file| is_new(file)).map(|file| read(file)).collect::<Result<_, _>>()?;
    rows.sort_by_key(|row| row["name"].as_str().map(str::to_owned));
    if rows.is_empty() { Err("criterion wrote no figures".to_owned()) } else { Ok(rows) }
}

/// The newest estimates below a folder.
fn collect(folder: PathBuf, files: &mut Vec<PathBuf>) {
    let estimates = folder.join("new/estimates.json");
    if estimates.is_file() {
        files.push(estimates);
    }
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        if entry.path().is_dir() {
            collect(entry.path(), files);
        }
    }
}

/// A row from what criterion wrote: times in nanoseconds, and how much was done in them.
fn read(estimates: &Path) -> Result<Value, Failure> {
    let beside = |name: &str| super::read(&estimates.with_file_name(name));
    let (times, about, sample) = (super::read(estimates)?, beside("benchmark.json")?, beside("sample.json")?);
    let numbers = |name: &str| sample[name].as_array().into_iter().flatten().filter_map(Value::as_f64);
    let each: Vec<f64> = numbers("times").zip(numbers("iters")).map(|(time, iterations)| time / iterations).collect();
    let median = &times["median"];
    let short = |value: &Value| value.as_f64().map(|value| super::rounded(value, 1));
    let mut row = json!({
        "name": about["full_id"],
        "unit": "ns",
        "value": short(&median["point_estimate"]),
        "low": short(&median["confidence_interval"]["lower_bound"]),
        "high": short(&median["confidence_interval"]["upper_bound"]),
        "shortest": super::rounded(super::range(&each).0, 1),
        "deviation": short(&times["median_abs_dev"]["point_estimate"]),
    });
    for (throughput, name) in [("Elements", "elements"), ("Bytes", "bytes")] {
        if let Some(number) = about["throughput"][throughput].as_u64() {
            row[name] = json!(number);
        }
    }
    Ok(row)
}

/// How many times sooner all cores are done with a sweep than one.
fn parallel() -> Result<Value, Failure> {
    const TIMES: usize = 5;
    let cores = environment::cores();
    say("a sweep over β on one core and on all (a minute)");
    let ape = ["--bin", "ape"];
    let mut build = program("cargo", &["build", "--release", "--quiet"]);
    build.args(CORE).args(ape);
    run_command(build)?;
    // Long enough for what it takes to begin not to count.
    let seeds = (40 * cores).to_string();
    let built = target().join("release").join(format!("ape{}", std::env::consts::EXE_SUFFIX));
    let time = |threads: usize| -> Result<f64, Failure> {
        let mut sweep =
            program(&built.to_string_lossy(), &["sweep", "--betas", "0.3,0.6", "--seeds", &seeds, "--json"]);
        sweep.env("RAYON_NUM_THREADS", threads.to_string()).stdout(std::process::Stdio::null());
        let begin = Instant::now();
        run_command(sweep)?;
        Ok(begin.elapsed().as_secs_f64())
    };
    let (mut one, mut all, mut ratios) = (Vec::new(), Vec::new(), Vec::new());
    for _ in 0..TIMES {
        // One after the other, so that both meet the same weather.
        one.push(time(1)?);
        all.push(time(cores)?);
        let (one, all) = (one[one.len() - 1], all[all.len() - 1]);
        println!("one core {one:.2} s, {cores} cores {all:.2} s");
        ratios.push(one / all);
    }
    // What else the machine does makes a run longer, never shorter.
    let value = super::range(&one).0 / super::range(&all).0;
    let (low, high) = super::range(&ratios);
    let short = |value: f64| super::rounded(value, 2);
    Ok(json!({ "name": "parallel", "unit": "times", "value": short(value), "low": short(low), "high": short(high) }))
}
