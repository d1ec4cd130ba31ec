//! Made-up input for everything that strangers may hand to the program: fuzz/ says what, this runs each for a while.

use std::path::Path;
use std::process::Stdio;

use crate::steps::say;
use crate::tools::{self, Tool};
use crate::{Failure, USAGE, program, root, run};

/// As in fuzz/Cargo.toml; whether the input is text, made of words.
const TARGETS: [(&str, bool); 7] = [
    ("address", true),
    ("ensemble", true),
    ("shard", true),
    ("stored", true),
    ("commands", false),
    ("events", false),
    ("tasks", false),
];
const SECONDS: u32 = 60;

/// Runs every target for so many seconds, and tells how many inputs that were. The first that fails ends it.
pub fn fuzz(arguments: &[&str]) -> Result<(), Failure> {
    let seconds = match arguments {
        [] => SECONDS,
        [seconds] => seconds.parse().map_err(|_| format!("{seconds}: expected a number of seconds"))?,
        _ => return Err(USAGE.trim_end().to_owned()),
    };
    tools::install(&[Tool::CargoFuzz])?;
    lock()?;
    say("building the fuzz targets (5 minutes at first)");
    run("cargo", &["fuzz", "build", "--sanitizer", "none"])?;
    let mut executions = Vec::new();
    for (name, is_text) in TARGETS {
        say(&format!("fuzzing {name} for {seconds} s"));
        executions.push((name, run_target(name, is_text, seconds)?));
    }
    executions.iter().for_each(|(name, executions)| println!("  {name:<12} {executions:>12} inputs"));
    Ok(())
}

/// Whether what makes the input up still fits the program. Its crate has a library of C++ below it.
pub fn check() -> Result<(), Failure> {
    run("cargo", &["fmt", "--manifest-path", "fuzz/Cargo.toml", "--check"])?;
    if ["c++", "g++", "clang++"].iter().all(|name| tools::output(name, &["--version"]).is_none()) {
        println!("The fuzz targets were not compiled: there is no C++ compiler.");
        return Ok(());
    }
    lock()?;
    run("cargo", &["clippy", "--manifest-path", "fuzz/Cargo.toml", "--target-dir", "target", "--", "-D", "warnings"])
}

/// The crates of the page in the versions of the page; cargo adds the few that only the fuzzer has.
fn lock() -> Result<(), Failure> {
    let (ours, lock) = (root().join("Cargo.lock"), root().join("fuzz/Cargo.lock"));
    let modified = |file: &Path| std::fs::metadata(file).and_then(|data| data.modified()).ok();
    if modified(&lock) < modified(&ours) {
        std::fs::copy(&ours, &lock).map_err(|error| format!("{}: {error}", lock.display()))?;
    }
    Ok(())
}

/// Runs one target; its number of inputs.
fn run_target(name: &str, is_text: bool, seconds: u32) -> Result<u64, Failure> {
    const COUNT: &str = "stat::number_of_executed_units:";
    let words = format!("-dict={}", root().join("fuzz/corpus/words.dict").display());
    let time = format!("-max_total_time={seconds}");
    // The code is safe Rust: what there is to find are panics, long loops and large memory, not what sanitizers see.
    let mut command = program("cargo", &["fuzz", "run", "--sanitizer", "none", name, "--", &time]);
    command.args(["-timeout=60", "-rss_limit_mb=1024", "-max_len=20000", "-print_final_stats=1"]);
    if is_text {
        command.arg(words);
    }
    let output = command.stderr(Stdio::piped()).output().map_err(|error| format!("cargo fuzz: {error}"))?;
    let said = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        let lines: Vec<&str> = said.lines().filter(|line| !line.starts_with('#')).collect();
        let last = lines[lines.len().saturating_sub(60)..].join("\n");
        return Err(format!("{last}\nthe fuzz target {name} has failed; the input is in fuzz/artifacts/{name}"));
    }
    let count = said.lines().find_map(|line| line.strip_prefix(COUNT)?.trim().parse().ok());
    count.ok_or_else(|| format!("the fuzz target {name} did not say how many inputs it has tried"))
}
