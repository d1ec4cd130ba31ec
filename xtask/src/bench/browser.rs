//! The part `browser`: tests/e2e/bench.mjs on the page as it is published.

use serde_json::Value;

use super::{environment, last_line, part};
use crate::steps::say;
use crate::tools::{self, Tool};
use crate::{Failure, build, program, root};

const SCRIPT: &str = "tests/e2e/bench.mjs";

/// What all parts say of the machine in the same words, and what nobody need know.
const MACHINE: [&str; 8] = ["cpu", "cores", "memory", "os", "chromium", "host", "hostname", "platform"];

pub fn measure() -> Result<Value, Failure> {
    if !root().join(SCRIPT).is_file() {
        return Err(format!("{SCRIPT} is missing"));
    }
    tools::install(&[Tool::Chromium, Tool::Node, Tool::NodePackages])?;
    build()?;
    say("timing the page in Chromium");
    let chromium = tools::chromium()?;
    let mut node = program("node", &[SCRIPT]);
    node.env("CHROMIUM", &chromium);
    let line = last_line(node)?;
    let said: Value = serde_json::from_str(&line).map_err(|error| format!("the last line of {SCRIPT}: {error}"))?;
    let rows = said["rows"].as_array().ok_or_else(|| format!("the last line of {SCRIPT} has no rows"))?;
    let mut facts = environment::facts(&[]);
    facts["chromium"] = environment::version(&chromium.to_string_lossy()).into();
    let of_page = said["environment"].as_object().into_iter().flatten();
    for (name, fact) in of_page.filter(|(name, _)| !MACHINE.contains(&name.as_str())) {
        facts[name] = fact.clone();
    }
    Ok(part(facts, rows.clone()))
}
