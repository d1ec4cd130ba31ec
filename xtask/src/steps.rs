//! Runs named steps one after another, goes on when one fails, and sums up at the end.

use std::io::Write;
use std::time::Instant;

use crate::Failure;
use crate::tools::{self, Tool};

/// A line that says what comes next.
pub fn say(line: &str) {
    println!("\n\x1b[1m[xtask] {line}\x1b[0m");
    // What programs print after it goes to the same terminal by another way.
    let _ = std::io::stdout().flush();
}

pub struct Steps<'a> {
    only: &'a [&'a str],
    known: Vec<&'static str>,
    done: Vec<(&'static str, f64, Result<(), Failure>)>,
}

impl<'a> Steps<'a> {
    /// `only`: the names of the steps to run; empty means all.
    pub fn new(only: &'a [&'a str]) -> Self {
        Steps { only, known: Vec::new(), done: Vec::new() }
    }

    /// Installs what a step needs, then does it; a failure of either is the step's own.
    pub fn step(
        &mut self,
        name: &'static str,
        usual: &str,
        needs: &[Tool],
        work: impl FnOnce() -> Result<(), Failure>,
    ) {
        self.known.push(name);
        if !self.only.is_empty() && !self.only.contains(&name) {
            return;
        }
        say(&format!("{name} (usually {usual})"));
        let start = Instant::now();
        let outcome = tools::install(needs).and_then(|()| work());
        if let Err(sentence) = &outcome {
            println!("{sentence}");
        }
        self.done.push((name, start.elapsed().as_secs_f64(), outcome));
    }

    /// Prints every step with its time; fails when one of them did.
    pub fn sum_up(self) -> Result<(), Failure> {
        if let Some(unknown) = self.only.iter().find(|name| !self.known.contains(*name)) {
            return Err(format!("no step is called {unknown}; the steps are: {}", self.known.join(", ")));
        }
        say("summary");
        for (name, seconds, outcome) in &self.done {
            let verdict = if outcome.is_ok() { "ok" } else { "FAILED" };
            println!("  {name:<12} {verdict:<7} {seconds:6.1} s");
        }
        let failed = self.done.iter().filter(|(_, _, outcome)| outcome.is_err()).count();
        println!("\n{} passed, {failed} failed", self.done.len() - failed);
        if failed == 0 { Ok(()) } else { Err(format!("{failed} of {} steps failed", self.done.len())) }
    }
}
