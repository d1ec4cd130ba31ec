//! docs/PERFORMANCE.md: the prose of performance.md with the newest figures of every part in it.
//!
//! `{{NAME}}` and `{{NAME ARGUMENT}}` in the prose stand for what [`fill`] makes of them.

use serde_json::Value;

use super::{PARTS, Part, grouped, range, rounded, row, table};
use crate::steps::say;
use crate::{Failure, root};

const PROSE: &str = include_str!("performance.md");
const FILE: &str = "docs/PERFORMANCE.md";
const MISSING: &str = "not measured yet";

/// What is wanted of a figure, in its unit: milliseconds of times, kilobytes of sizes.
#[derive(Clone, Copy)]
enum Goal {
    AtMost(f64),
    /// At most so many times what the default run takes.
    Times(f64),
}

/// Where a line's figure comes from: rows of the part `native`.
enum From {
    /// And what its throughput counts, where it has one.
    Time(&'static str, &'static str),
    /// What the first takes longer than the second.
    More(&'static str, &'static str),
    Bytes(&'static str),
    Ratio(&'static str),
}

/// A line of the table.
struct Line {
    what: &'static str,
    from: From,
    /// None where there is nothing that it must reach.
    goal: Option<Goal>,
}

/// The run that others are compared with.
const DEFAULT: &str = "training/default";

/// What is told of the part `native`, and what is wanted of it.
const LINES: [Line; 20] = [
    Line {
        what: "A whole run: 732 updates, two experts (the default)",
        from: From::Time(DEFAULT, "step"),
        goal: Some(Goal::AtMost(30.0)),
    },
    Line { what: "… with one joint baseline", from: From::Time("training/joint", "step"), goal: None },
    Line {
        what: "… against `replay(60)`", from: From::Time("training/replay", "step"), goal: Some(Goal::Times(2.0))
    },
    Line {
        what: "… against `occupancy`",
        from: From::Time("training/occupancy", "step"),
        goal: Some(Goal::Times(2.0)),
    },
    Line { what: "… against `history`", from: From::Time("training/history", "step"), goal: None },
    Line {
        what: "… with the gradient `mixture`",
        from: From::Time("training/mixture", "step"),
        goal: Some(Goal::Times(2.0)),
    },
    Line {
        what: "… with eight experts", from: From::Time("training/experts-8", "step"), goal: Some(Goal::Times(2.0))
    },
    Line {
        what: "… with another reward for the clone",
        from: From::Time("training/adversary-reward", "step"),
        goal: Some(Goal::Times(2.0)),
    },
    Line { what: "… on a slippery grid", from: From::Time("training/slip", "step"), goal: None },
    Line {
        what: "A whole run of exact APE: 1,500 updates",
        from: From::Time("training/exact", "update"),
        goal: Some(Goal::AtMost(250.0)),
    },
    Line {
        what: "The four returns of a policy, 10 × 10",
        from: From::Time("returns/100", ""),
        goal: Some(Goal::AtMost(0.06)),
    },
    Line {
        what: "The four returns of a policy, 32 × 32",
        from: From::Time("returns/1024", ""),
        goal: Some(Goal::AtMost(3.0)),
    },
    Line { what: "p(c\\|s) of `occupancy`", from: From::Time("contexts/occupancy", ""), goal: None },
    Line {
        what: "`bc(1000000)`: drawing a million pairs, 100 epochs, exact returns",
        from: From::Time("cloning/bc(1000000)", "pair"),
        goal: Some(Goal::AtMost(800.0)),
    },
    Line {
        what: "`bc_counts(1000000)`: drawing a million pairs, counting, exact returns",
        from: From::Time("cloning/bc_counts(1000000)", "pair"),
        goal: Some(Goal::AtMost(15.0)),
    },
    Line {
        what: "`bc(1000000)` without drawing: the one less the other",
        from: From::More("cloning/bc(1000000)", "cloning/bc_counts(1000000)"),
        goal: None,
    },
    Line {
        what: "Table 1: five seeds, every quick cloner, one core",
        from: From::Time("table1/5 seeds", ""),
        goal: None,
    },
    Line {
        what: "A snapshot for the page: evaluating and encoding",
        from: From::Time("snapshot/default", ""),
        goal: None,
    },
    Line { what: "A snapshot for the page: its size", from: From::Bytes("snapshot/default"), goal: None },
    Line { what: "A sweep on all cores, compared with one", from: From::Ratio("parallel"), goal: None },
];

/// Reads a part's figures, where there are any.
pub type Read<'a> = &'a dyn Fn(&str) -> Option<Value>;

/// Writes the document and prints its tables.
pub fn write(read: Read) -> Result<(), Failure> {
    let document = document(PROSE, read)?;
    say("what was measured");
    println!("{}\n{}", environments(read), figures(read));
    super::write(&root().join(FILE), &document)?;
    println!("{FILE} is written");
    Ok(())
}

/// The prose with everything filled in.
fn document(prose: &str, read: Read) -> Result<String, Failure> {
    let mut text = String::new();
    let mut rest = prose;
    while let Some((before, after)) = rest.split_once("{{") {
        let (name, after) = after.split_once("}}").ok_or("performance.md: {{ without }}")?;
        let (name, argument) = name.trim().split_once(' ').unwrap_or((name.trim(), ""));
        text += before;
        text += &fill(name, argument, read)
            .ok_or_else(|| format!("performance.md: nothing is called {{{{{name} {argument}}}}}"))?;
        rest = after;
    }
    Ok(text + rest)
}

/// What stands for a name in the prose; nothing where there is no such name.
fn fill(name: &str, argument: &str, read: Read) -> Option<String> {
    // A figure of one row, or that it is missing.
    let of = |part: &str, shown: &dyn Fn(&Value) -> Option<String>| {
        let part = read(part);
        let found = part.as_ref().and_then(|part| row(part, argument)).and_then(shown);
        Some(found.unwrap_or_else(|| MISSING.to_owned()))
    };
    match name {
        "environments" => Some(environments(read)),
        "figures" => Some(figures(read)),
        "instructions" => Some(instructions(read)),
        "growth" => growth(argument, read),
        "time" => of("native", &|row| Some(duration(row["value"].as_f64()?))),
        "step" => of("native", &step),
        "count" => of("counts", &|row| Some(grouped(row["value"].as_f64()?))),
        _ => None,
    }
}

/// A part a line: on what it was measured.
fn environments(read: Read) -> String {
    let line = |part: &Part| {
        let facts = read(part.name).map_or_else(
            || format!("{MISSING}: `cargo xtask bench {}`", part.name),
            |figures| {
                let text = |fact: &Value| fact.as_str().map_or_else(|| fact.to_string(), str::to_owned);
                let facts = figures["environment"].as_object().into_iter().flatten();
                facts.map(|(name, fact)| format!("{name}: {}", text(fact))).collect::<Vec<_>>().join("; ")
            },
        );
        vec![part.name.to_owned(), facts]
    };
    table(&["part", "measured on"], &PARTS.iter().map(line).collect::<Vec<_>>())
}

/// A line as it is shown.
#[derive(Default, PartialEq, Debug)]
struct Shown {
    part: &'static str,
    what: String,
    figure: String,
    shortest: String,
    spread: String,
    note: String,
    /// And whether it is met.
    goal: (String, String),
}

/// Every figure with its goal.
fn figures(read: Read) -> String {
    let rows = |name: &str| read(name).and_then(|part| part["rows"].as_array().cloned()).unwrap_or_default();
    let native = read("native")
        .into_iter()
        .flat_map(|part| LINES.iter().filter_map(|line| native_line(line, &part)).collect::<Vec<_>>());
    let browser = rows("browser").into_iter().filter_map(|row| browser_line(&row)).chain(compared(read));
    let peers = rows("peers").into_iter().filter_map(|row| peer_line(&row));
    let cells = |shown: Shown| {
        let Shown { part, what, figure, shortest, spread, note, goal: (goal, met) } = shown;
        vec![part.to_owned(), what, figure, shortest, spread, note, goal, met]
    };
    let lines: Vec<_> = native.chain(browser).chain(peers).map(cells).collect();
    table(&["where", "what", "figure", "shortest", "spread", "that is", "goal", "met"], &lines)
}

fn native_line(line: &Line, native: &Value) -> Option<Shown> {
    let find = |name: &str| row(native, name);
    let number = |row: &Value, name: &str| row[name].as_f64();
    let cores = native["environment"]["cores"].as_str().and_then(|cores| cores.parse().ok()).unwrap_or(1.0);
    let shown = Shown { part: "native", what: line.what.to_owned(), ..Shown::default() };
    let (value, unit, shown) = match line.from {
        From::Time(name, each) => {
            let row = find(name)?;
            let value = number(row, "value")?;
            let spread = format!("{} – {}", duration(number(row, "low")?), duration(number(row, "high")?));
            let shortest = duration(number(row, "shortest")?);
            let note = step(row).map_or(String::new(), |step| format!("{step} per {each}"));
            (value / 1e6, "ms", Shown { figure: duration(value), shortest, spread, note, ..shown })
        }
        From::More(name, less) => {
            let value = number(find(name)?, "value")? - number(find(less)?, "value")?;
            (value / 1e6, "ms", Shown { figure: duration(value), ..shown })
        }
        From::Bytes(name) => {
            let value = number(find(name)?, "bytes")? / 1000.0;
            (value, "kB", Shown { figure: format!("{} kB", grouped(value)), ..shown })
        }
        From::Ratio(name) => {
            let row = find(name)?;
            let value = number(row, "value")?;
            let spread = format!("{} – {}", grouped(number(row, "low")?), grouped(number(row, "high")?));
            let (figure, note) = (format!("{} ×", grouped(value)), format!("{cores} cores"));
            (value, "×", Shown { figure, spread, note, ..shown })
        }
    };
    let default = find(DEFAULT).and_then(|row| number(row, "value")).unwrap_or(f64::NAN) / 1e6;
    Some(Shown { goal: line.goal.map_or_else(Default::default, |goal| judged(goal, value, unit, default)), ..shown })
}

/// A goal in words, and whether it is met.
fn judged(goal: Goal, value: f64, unit: &str, default: f64) -> (String, String) {
    let (text, is_met) = match goal {
        Goal::AtMost(most) => (format!("≤ {most} {unit}"), value <= most),
        Goal::Times(most) => (format!("≤ {most} × the default"), value <= most * default),
    };
    (text, if is_met { "yes" } else { "**no**" }.to_owned())
}

/// A row as tests/e2e/bench.mjs has it: of the samples a median, a greatest or what 95 in 100 stay below.
fn browser_line(row: &Value) -> Option<Shown> {
    let text = |name: &str| row[name].as_str().unwrap_or_default().to_owned();
    let unit = text("unit");
    let value = row["value"].as_f64()?;
    let samples: Vec<f64> = row["samples"].as_array().into_iter().flatten().filter_map(Value::as_f64).collect();
    let (low, high) = range(&samples);
    let (shortest, spread) = match samples.len() {
        0 | 1 => (String::new(), String::new()),
        _ => (format!("{} {unit}", grouped(low)), format!("{} – {} {unit}", grouped(low), grouped(high))),
    };
    let (goal, met) =
        row["goal"].as_f64().map_or_else(Default::default, |most| judged(Goal::AtMost(most), value, &unit, f64::NAN));
    let goal = row["goal_text"].as_str().map_or(goal, str::to_owned);
    let figure = match text("figure").as_str() {
        "" | "median" => String::new(),
        figure => format!(" ({figure})"),
    };
    let figure = format!("{} {unit}{figure}", grouped(value));
    Some(Shown { part: "browser", what: text("name"), figure, shortest, spread, note: text("note"), goal: (goal, met) })
}

/// The worker's training as so many times that of the part `native`.
fn compared(read: Read) -> Option<Shown> {
    const MOST: f64 = 1.5;
    let value = |part: &str, name: &str| read(part).and_then(|part| row(&part, name)?["value"].as_f64());
    let ratio = value("browser", "default training run in the browser's worker")? * 1e6 / value("native", DEFAULT)?;
    let note = "The default run in the browser's worker, the page at rest, and the default run natively.".to_owned();
    let what = "the worker, compared with native".to_owned();
    let goal = judged(Goal::AtMost(MOST), ratio, "×", f64::NAN);
    Some(Shown { part: "browser", what, figure: format!("{} ×", grouped(ratio)), note, goal, ..Shown::default() })
}

fn peer_line(row: &Value) -> Option<Shown> {
    let ratio = row["ratio"].as_f64().map(|ratio| format!("{} × ours", grouped(ratio)));
    Some(Shown {
        part: "peers",
        what: format!("The default run by {}", row["name"].as_str()?),
        figure: row["value"].as_f64().map_or_else(String::new, |seconds| duration(1e9 * seconds)),
        note: ratio.or_else(|| row["failure"].as_str().map(str::to_owned)).unwrap_or_default(),
        ..Shown::default()
    })
}

fn instructions(read: Read) -> String {
    let Some(counts) = read("counts") else { return format!("{MISSING}\n") };
    let line = |row: &Value| {
        let text = |name: &str| Some(row[name].as_str()?.to_owned());
        Some(vec![text("name")?, text("unit")?, grouped(row["value"].as_f64()?)])
    };
    let lines: Vec<_> = counts["rows"].as_array().into_iter().flatten().filter_map(line).collect();
    table(&["work", "per", "instructions"], &lines)
}

/// A group of criterion's by its number. Nothing where no group is called so.
fn growth(group: &str, read: Read) -> Option<String> {
    /// The groups, and what their number is.
    const GROUPS: [(&str, &str); 4] = [
        ("training by states", "cells"),
        ("training by experts", "experts"),
        ("training by batch", "steps in a batch"),
        ("returns", "cells"),
    ];
    let (_, number) = GROUPS.iter().find(|(name, _)| *name == group)?;
    let Some(native) = read("native") else { return Some(format!("{MISSING}\n")) };
    let rows = native["rows"].as_array()?.iter();
    let mut points: Vec<(u32, f64, Option<String>)> = rows
        .filter_map(|row| {
            let parameter = row["name"].as_str()?.strip_prefix(group)?.strip_prefix('/')?;
            Some((parameter.parse().ok()?, row["value"].as_f64()?, step(row)))
        })
        .collect();
    points.sort_by_key(|(parameter, ..)| *parameter);
    let first = points.first().map_or(1.0, |(_, time, _)| *time);
    let line = |(parameter, time, step): &(u32, f64, Option<String>)| {
        let times = format!("{} ×", grouped(time / first));
        [vec![parameter.to_string(), duration(*time)], step.iter().cloned().collect(), vec![times]].concat()
    };
    let head: &[&str] = match points.first() {
        Some((.., Some(_))) => &[number, "time", "a step", "compared with the first"],
        _ => &[number, "time", "compared with the first"],
    };
    Some(table(head, &points.iter().map(line).collect::<Vec<_>>()))
}

/// What one element of a row takes: a step, an update, a pair.
fn step(row: &Value) -> Option<String> {
    Some(duration(row["value"].as_f64()? / row["elements"].as_f64()?))
}

/// Nanoseconds in the unit that suits them.
fn duration(ns: f64) -> String {
    let (value, unit) = match ns {
        _ if ns < 1e3 => (ns, "ns"),
        _ if ns < 1e6 => (ns / 1e3, "µs"),
        _ if ns < 1e9 => (ns / 1e6, "ms"),
        _ => (ns / 1e9, "s"),
    };
    format!("{} {unit}", grouped(rounded(value, 3)))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    /// Whatever was measured and whatever was not, the prose names nothing that there is not.
    #[test]
    fn every_name_in_the_prose_is_known() {
        let empty = json!({ "environment": {}, "rows": [] });
        assert!(document(PROSE, &|_| None).unwrap().contains(MISSING));
        let text = document(PROSE, &|_| Some(empty.clone())).unwrap();
        assert!(!text.contains("{{") && !text.contains("}}"));
        assert!(document("{{nonsense}}", &|_| None).is_err() && document("{{growth nonsense}}", &|_| None).is_err());
    }

    /// Every line of the table finds its figure in what was measured last.
    #[test]
    fn every_line_finds_its_figure() {
        let Ok(native) = super::super::read(&root().join(super::super::relative("native"))) else { return };
        for line in &LINES {
            assert!(native_line(line, &native).is_some(), "{}", line.what);
        }
    }

    #[test]
    fn goals_are_judged() {
        assert_eq!(judged(Goal::AtMost(45.0), 44.0, "ms", 30.0), ("≤ 45 ms".to_owned(), "yes".to_owned()));
        assert_eq!(judged(Goal::Times(2.0), 61.0, "ms", 30.0), ("≤ 2 × the default".to_owned(), "**no**".to_owned()));
        let row = json!({ "name": "First picture", "unit": "ms", "goal": 1500, "goal_text": null, "samples": [900, 1700],
            "figure": "p95", "value": 1700.0, "note": "cold" });
        let shown = browser_line(&row).unwrap();
        assert_eq!((shown.figure.as_str(), shown.spread.as_str()), ("1,700 ms (p95)", "900 – 1,700 ms"));
        assert_eq!(shown.goal, ("≤ 1500 ms".to_owned(), "**no**".to_owned()));
    }

    #[test]
    fn figures_are_short() {
        assert_eq!(duration(84_359_891.5), "84.4 ms");
        assert_eq!(duration(14.07), "14.1 ns");
        assert_eq!(duration(2.5e9), "2.50 s");
        assert_eq!(grouped(1_234_567.0), "1,234,567");
    }
}
