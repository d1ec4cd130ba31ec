//! `cargo xtask bench`: measures in parts, keeps each part's figures in docs/performance, and writes docs/PERFORMANCE.md
//! from the newest of all parts. The prose of that document is in performance.md beside this folder.

mod browser;
mod counts;
mod document;
mod environment;
mod native;
mod peers;

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use serde_json::{Value, json};

use crate::{Failure, root};

/// Something that is measured by itself.
pub struct Part {
    pub name: &'static str,
    /// Of its file in docs/performance.
    file: &'static str,
    /// Whether it is measured where no part is named.
    is_usual: bool,
    measure: fn() -> Result<Value, Failure>,
}

pub const PARTS: [Part; 4] = [
    Part { name: "native", file: "native.json", is_usual: true, measure: native::measure },
    Part { name: "counts", file: "instructions.json", is_usual: true, measure: counts::measure },
    Part { name: "browser", file: "browser.json", is_usual: true, measure: browser::measure },
    Part { name: "peers", file: "peers.json", is_usual: false, measure: peers::measure },
];

/// A load from which on times mean little.
const BUSY: f64 = 1.0;

/// Measures the named parts, or the usual ones; `document` only writes the document anew. A part that fails does not keep
/// the others from being measured.
pub fn bench(names: &[&str]) -> Result<(), Failure> {
    let is_known = |name: &&&str| **name == "document" || PARTS.iter().any(|part| part.name == **name);
    if let Some(unknown) = names.iter().find(|name| !is_known(name)) {
        let known: Vec<&str> = PARTS.iter().map(|part| part.name).collect();
        return Err(format!("nothing to measure is called {unknown}; there are: {}, document", known.join(", ")));
    }
    // Once: what is measured first is a load of its own.
    let load = environment::load();
    if let Some(load) = load.filter(|load| *load > BUSY && names != ["document"]) {
        println!("this machine has other work to do (load {load}): times will come out too long");
    }
    let mut failures = Vec::new();
    for part in PARTS {
        let is_wanted = if names.is_empty() { part.is_usual } else { names.contains(&part.name) };
        if !is_wanted {
            continue;
        }
        match (part.measure)() {
            Ok(mut figures) => {
                figures["environment"]["load before"] =
                    load.map_or("unknown".to_owned(), |load| load.to_string()).into();
                let text = serde_json::to_string_pretty(&figures).map_err(|error| error.to_string())?;
                write(&root().join(relative(part.name)), &(text + "\n"))?;
            }
            Err(failure) => {
                println!("{failure}");
                failures.push(format!("{}: {failure}", part.name));
            }
        }
    }
    document::write(&|name| read(&root().join(relative(name))).ok())?;
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) }
}

/// Where a part's figures are, seen from the root.
fn relative(name: &str) -> String {
    let part = PARTS.iter().find(|part| part.name == name).expect("asked for by a name in the table");
    format!("docs/performance/{}", part.file)
}

/// Where compiled and other passing things are.
fn target() -> PathBuf {
    root().join(std::env::var_os("CARGO_TARGET_DIR").unwrap_or_else(|| "target".into()))
}

/// What is kept of a part: what it was measured on, and its figures.
fn part(environment: Value, rows: Vec<Value>) -> Value {
    json!({ "environment": environment, "rows": rows })
}

/// A part's row of this name.
fn row<'p>(part: &'p Value, name: &str) -> Option<&'p Value> {
    part["rows"].as_array()?.iter().find(|row| row["name"] == name)
}

fn read(file: &Path) -> Result<Value, Failure> {
    let failed = |error: &dyn std::fmt::Display| format!("{}: {error}", file.display());
    let text = std::fs::read_to_string(file).map_err(|error| failed(&error))?;
    serde_json::from_str(&text).map_err(|error| failed(&error))
}

fn write(file: &Path, text: &str) -> Result<(), Failure> {
    let failed = |error: std::io::Error| format!("{}: {error}", file.display());
    if let Some(folder) = file.parent() {
        std::fs::create_dir_all(folder).map_err(failed)?;
    }
    std::fs::write(file, text).map_err(failed)
}

/// Runs a program to its end and returns the last line it printed; what it printed before goes to the terminal.
fn last_line(mut command: Command) -> Result<String, Failure> {
    let name = command.get_program().to_string_lossy().into_owned();
    let output =
        command.stderr(Stdio::inherit()).output().map_err(|error| format!("`{name}` could not be started: {error}"))?;
    let text = String::from_utf8_lossy(&output.stdout);
    let text = text.trim_end();
    let (before, last) = text.rsplit_once('\n').unwrap_or(("", text));
    if !before.is_empty() {
        println!("{before}");
    }
    if output.status.success() { Ok(last.to_owned()) } else { Err(format!("`{name}` ended with {}", output.status)) }
}

/// Least and greatest.
fn range(values: &[f64]) -> (f64, f64) {
    let low = values.iter().copied().fold(f64::INFINITY, f64::min);
    (low, values.iter().copied().fold(f64::NEG_INFINITY, f64::max))
}

/// With so many decimals.
fn rounded(value: f64, decimals: u32) -> f64 {
    let scale = f64::from(10u32.pow(decimals));
    (value * scale).round() / scale
}

/// A number as people read it: about three digits, all where it is large, in groups of three.
fn grouped(value: f64) -> String {
    let decimals = if value < 10.0 {
        2
    } else if value < 100.0 {
        1
    } else {
        0
    };
    let text = format!("{value:.decimals$}");
    let (whole, rest) = text.split_at(text.find('.').unwrap_or(text.len()));
    let mut grouped = String::new();
    for (index, digit) in whole.char_indices() {
        if index > 0 && (whole.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped + rest
}

/// A table that reads well on a terminal and is Markdown.
fn table(head: &[&str], rows: &[Vec<String>]) -> String {
    let width = |text: &str| text.chars().count();
    let widths: Vec<usize> = (0..head.len())
        .map(|column| rows.iter().map(|row| width(&row[column])).chain([width(head[column])]).max().unwrap_or(0))
        .collect();
    let line = |cells: &mut dyn Iterator<Item = &str>| {
        let cells = cells.zip(&widths).map(|(cell, wide)| format!("{cell}{}", " ".repeat(wide - width(cell))));
        format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
    };
    let rule = widths.iter().map(|wide| "-".repeat(*wide)).collect::<Vec<_>>();
    let mut text = line(&mut head.iter().copied());
    text += &line(&mut rule.iter().map(String::as_str));
    for row in rows {
        text += &line(&mut row.iter().map(String::as_str));
    }
    text
}
