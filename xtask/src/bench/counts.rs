//! The part `counts`: instructions of benches/counts.rs under callgrind, and how they changed.

use std::path::{Path, PathBuf};

use serde_json::{Value, json};

use super::native::CORE;
use super::{environment, part, rounded, table, target};
use crate::steps::say;
use crate::tools::{self, Tool};
use crate::{Failure, program};

pub fn measure() -> Result<Value, Failure> {
    tools::install(&[Tool::Valgrind])?;
    say("counting instructions (1 minute, and 3 more to compile at first)");
    let counts = build()?;
    let before = committed();
    let list = printed(&mut program(&counts.to_string_lossy(), &[]), false)?;
    let mut rows = Vec::new();
    let mut lines = Vec::new();
    for line in list.lines() {
        let [name, unit, units, times] = line.split('\t').collect::<Vec<_>>()[..] else {
            return Err(format!("the list of what to count has a line {line:?}"));
        };
        let number = |text: &str| text.parse::<f64>().map_err(|_| format!("{line:?}: {text} is no number"));
        let times = number(times)?;
        let (once, more) = (callgrind(&counts, name, 1)?, callgrind(&counts, name, 1 + times as u64)?);
        let instructions = rounded((more - once) / times / number(units)?, 1);
        rows.push(json!({ "name": name, "unit": unit, "value": instructions }));
        let old = before.as_ref().and_then(|part| super::row(part, name)).and_then(|row| row["value"].as_f64());
        let change = old.map_or("new".to_owned(), |old| format!("{:+.1} %", 100.0 * (instructions / old - 1.0)));
        let shown = |value: f64| super::grouped(value);
        lines.push(vec![
            name.to_owned(),
            unit.to_owned(),
            old.map_or(String::new(), shown),
            shown(instructions),
            change,
        ]);
    }
    println!("{}", table(&["work", "per", "committed", "now", "change"], &lines));
    Ok(part(environment::facts(&["rustc", "valgrind"]), rows))
}

/// What the repository has at its last commit.
fn committed() -> Option<Value> {
    let text = tools::output("git", &["show", &format!("HEAD:{}", super::relative("counts"))])?;
    serde_json::from_str(&text).ok()
}

/// Compiles benches/counts.rs; cargo says where it is.
fn build() -> Result<PathBuf, Failure> {
    let mut cargo = program("cargo", &["bench", "--quiet"]);
    cargo.args(CORE).args(["--bench", "counts", "--no-run", "--message-format=json-render-diagnostics"]);
    cargo.stderr(std::process::Stdio::inherit());
    let messages = printed(&mut cargo, false)?;
    let mut programs = messages.lines().filter_map(|line| {
        let message: Value = serde_json::from_str(line).ok()?;
        (message["target"]["name"] == "counts").then(|| Some(PathBuf::from(message["executable"].as_str()?)))?
    });
    programs.next_back().ok_or_else(|| "cargo did not say where it put the program `counts`".to_owned())
}

/// Instructions of the whole program when it does it so many times. What callgrind saw stays in a file, for
/// `callgrind_annotate`.
fn callgrind(counts: &Path, name: &str, times: u64) -> Result<f64, Failure> {
    let folder = target().join("callgrind");
    std::fs::create_dir_all(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    let file = folder.join(format!("{}.out", name.replace('/', "-")));
    let mut valgrind = program("valgrind", &["--tool=callgrind"]);
    valgrind.arg(format!("--callgrind-out-file={}", file.display())).arg(counts).args([name, &times.to_string()]);
    let said = printed(&mut valgrind, true)?;
    let collected = said.lines().find_map(|line| line.split_once("Collected :")?.1.trim().parse().ok());
    collected.ok_or_else(|| format!("callgrind did not say how many instructions {name} took"))
}

/// What a program prints, on stderr where asked so.
fn printed(command: &mut std::process::Command, is_error: bool) -> Result<String, Failure> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output = command.output().map_err(|error| format!("`{name}` could not be started: {error}"))?;
    let text = String::from_utf8_lossy(if is_error { &output.stderr } else { &output.stdout }).into_owned();
    if output.status.success() {
        Ok(text)
    } else {
        Err(format!("`{name}` ended with {}: {}", output.status, String::from_utf8_lossy(&output.stderr)))
    }
}
