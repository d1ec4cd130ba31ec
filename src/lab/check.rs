//! What a worker's message must be before a page shows it: of the shapes that its grid has, and made of numbers.
//!
//! A page indexes by cell and by expert, and divides. Messages come from a worker of the same origin, but an old cached
//! one, or one that was tampered with, must not bring the page down.

use super::{CloneView, Exported, PolicyView, Snapshot, Started};
use crate::ape::{Config, Contexts};
use crate::attack::Cloned;
use crate::experiment::{Attack, Course, CurvePoint, Denied, MethodRun, Outcome, Race, Raced, SweepRun, Task};
use crate::mdp::{ACTIONS, Grid, KnownReturns, Policy};

/// Nothing, or a sentence about what is wrong.
type Checked = Result<(), String>;

/// Most points of the curve in one snapshot.
const MOST_POINTS: usize = 10_000;

fn count(what: &str, found: usize, expected: usize) -> Checked {
    if found == expected { Ok(()) } else { Err(format!("{found} {what}: expected {expected}")) }
}

fn at_most(what: &str, found: usize, most: usize) -> Checked {
    if found <= most { Ok(()) } else { Err(format!("{found} {what}: expected at most {most}")) }
}

fn finite(what: &str, mut values: impl Iterator<Item = f64>) -> Checked {
    values.find(|value| !value.is_finite()).map_or(Ok(()), |value| Err(format!("{what} {value}: expected a number")))
}

/// Values from `low` to `high`.
fn within(what: &str, low: f64, high: f64, mut values: impl Iterator<Item = f64>) -> Checked {
    let outside = values.find(|value| !(low..=high).contains(value));
    outside.map_or(Ok(()), |value| Err(format!("{what} {value}: expected a number from {low} to {high}")))
}

fn returns(returns: impl Into<KnownReturns>) -> Checked {
    returns.into().check(Config::MAX_HORIZON)
}

fn policy(rows: &[[f64; ACTIONS]], grid: &Grid) -> Checked {
    count("rows of a policy", rows.len(), grid.cells())?;
    within("a probability of", 0.0, 1.0 + Policy::TOLERANCE, rows.as_flattened().iter().copied())
}

fn steps(steps: &[f64], grid: &Grid) -> Checked {
    count("hitting times", steps.len(), grid.cells())?;
    within("a hitting time of", 0.0, f64::MAX, steps.iter().copied())
}

/// p(c|s) of n experts; none where a clone is no mixture.
fn contexts(p: &[f64], grid: &Grid, experts: usize) -> Checked {
    if !p.is_empty() {
        count("probabilities of contexts", p.len(), grid.cells() * experts)?;
    }
    within("a p(c|s) of", 0.0, 1.0 + Policy::TOLERANCE, p.iter().copied())
}

fn widened(values: &[f32]) -> Vec<f64> {
    values.iter().map(|&value| f64::from(value)).collect()
}

impl Started {
    /// The grid of the run, where everything fits it.
    pub fn check(&self) -> Result<Grid, String> {
        self.setup.check().map_err(|error| error.to_string())?;
        let grid = Grid::new(self.setup.grid.clone()).map_err(|error| error.to_string())?;
        self.optimal.check(&grid)?;
        Ok(grid)
    }
}

impl Snapshot {
    /// Whether it is one of a run on this grid.
    pub fn check(&self, grid: &Grid) -> Checked {
        let n = self.experts.len();
        if !(1..=Config::MAX_EXPERTS as usize).contains(&n) {
            return Err(format!("{n} experts: expected 1 to {}", Config::MAX_EXPERTS));
        }
        self.experts.iter().try_for_each(|expert| expert.check(grid))?;
        self.clones.iter().try_for_each(|clone| clone.check(grid, n))?;
        returns(self.ensemble)?;
        at_most("turns of β", self.course.turns.len(), Course::MOST_TURNS)?;
        self.course.check(self.last_update).map_err(|error| error.to_string())?;
        at_most("updates shown", self.update as usize, self.recorded as usize)?;
        let betas = self.course.turns.iter().map(|(_, beta)| *beta).chain([self.beta]);
        within("β", 0.0, Config::MAX_BETA, betas)?;
        within("milliseconds of training", 0.0, f64::MAX, [self.training_ms].into_iter())?;
        at_most("points of the curve", self.curve.len(), MOST_POINTS)?;
        self.curve.iter().try_for_each(CurvePoint::check)
    }
}

impl CurvePoint {
    fn check(&self) -> Checked {
        returns(self.ensemble)?;
        returns(self.clone)?;
        within("β", 0.0, Config::MAX_BETA, [self.beta].into_iter())?;
        let denied = self.denied.map_or([0.0; 2], |Denied { ensemble, clone }| [ensemble, clone]);
        finite("a reward of", denied.into_iter())
    }
}

impl PolicyView {
    fn check(&self, grid: &Grid) -> Checked {
        let rows: Vec<[f64; ACTIONS]> = self.policy.iter().map(|row| row.map(f64::from)).collect();
        policy(&rows, grid)?;
        steps(&widened(&self.hitting_time), grid)?;
        returns(self.returns)
    }
}

impl CloneView {
    fn check(&self, grid: &Grid, experts: usize) -> Checked {
        contexts(&widened(&self.contexts), grid, experts)?;
        self.view.check(grid)
    }
}

impl Exported {
    /// Whether its file holds an ensemble.
    pub fn check(&self) -> Checked {
        self.file.clone().check().map(|_| ()).map_err(|error| error.to_string())
    }
}

impl Outcome {
    /// Whether this can have come of a task.
    pub fn check(&self, task: &Task) -> Checked {
        match (self, task) {
            (Outcome::Attack(attack, cloned), Task::Attack { ensemble, attacker, .. }) => {
                if attack.attacker != *attacker {
                    return Err(format!("{}: expected {attacker}", attack.attacker));
                }
                let (grid, ensemble) = (**ensemble).clone().check().map_err(|error| error.to_string())?;
                attack.check()?;
                cloned.check(&grid, ensemble.experts())
            }
            (Outcome::Table1(runs), Task::Table1 { attackers, .. }) => {
                let check = |run: &MethodRun| {
                    count("clones", run.clones.len(), attackers.len())?;
                    returns(run.ensemble)?;
                    run.clones.iter().try_for_each(|clone| returns(*clone))
                };
                runs.iter().try_for_each(check)
            }
            (Outcome::Sweep(run), Task::Sweep { .. }) => run.check(),
            (Outcome::Race(raced), Task::Race(race)) => raced.check(race),
            _ => Err("an outcome of another kind of task".to_owned()),
        }
    }
}

impl Attack {
    fn check(&self) -> Checked {
        returns(self.returns)?;
        finite("a figure of", [self.drop.unwrap_or(0.0), self.imitation_gap, self.seconds].into_iter())
    }
}

impl Cloned {
    fn check(&self, grid: &Grid, experts: usize) -> Checked {
        policy(self.policy.rows(), grid)?;
        steps(&self.steps, grid)?;
        contexts(self.contexts.as_ref().map_or(&[], Contexts::as_slice), grid, experts)?;
        returns(self.returns)
    }
}

impl SweepRun {
    fn check(&self) -> Checked {
        within("β", 0.0, Config::MAX_BETA, [self.beta].into_iter())?;
        returns(self.ensemble)?;
        returns(self.clone)?;
        returns(self.occupancy)
    }
}

impl Raced {
    fn check(&self, race: &Race) -> Checked {
        let grid = &race.ensemble.grid;
        let (cells, steps) = (grid.rows.saturating_mul(grid.cols), race.horizon as usize + 1);
        if self.expert as usize >= race.ensemble.experts.len() {
            return Err(format!("expert {}: expected one of the race", self.expert));
        }
        count("episodes", self.episodes as usize, race.episodes as usize)?;
        for run in &self.runs {
            if run.path.is_empty() || run.path.len() > steps {
                return Err(format!("a path of {} cells: expected 1 to {steps}", run.path.len()));
            }
            if let Some(cell) = run.path.iter().find(|cell| **cell >= cells) {
                return Err(format!("cell {cell} of a path: expected one below {cells}"));
            }
            count("numbers of arrivals", run.arrivals.len(), steps)?;
            count("probabilities of arrival", run.exact.len(), steps)?;
            within("a probability of", 0.0, 1.0 + 1e-9, run.exact.iter().copied())?;
        }
        Ok(())
    }
}
