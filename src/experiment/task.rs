//! Units of work: a long experiment is a list of tasks that know nothing of one another, so that any number of
//! workers comes to the same result.

use serde::{Deserialize, Serialize};

use super::bench::Attack;
use super::race::{Race, Raced};
use super::sweep::{self, SweepRun};
use super::table1::{self, MethodRun};
use super::{Clock, Setup};
use crate::ape::{Config, EnsembleFile};
use crate::attack::{AttackerChoice, Cloned, Progress, Target};

/// What one worker does in one go.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Task {
    /// One cloner against one ensemble.
    Attack { ensemble: Box<EnsembleFile>, attacker: AttackerChoice, horizon: u32, seed: u32 },
    /// One seed of Table 1: all methods.
    Table1 { setup: Box<Setup>, attackers: Vec<AttackerChoice> },
    /// One β and seed of the sweep.
    Sweep { setup: Box<Setup> },
    /// An expert, the clone and the optimal policy from one cell.
    Race(Box<Race>),
}

/// What comes of a task.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Outcome {
    Attack(Attack, Box<Cloned>),
    Table1(Vec<MethodRun>),
    Sweep(SweepRun),
    Race(Box<Raced>),
}

impl Task {
    /// Most cloners of one table.
    const MOST_ATTACKERS: usize = 100;

    /// Does it. Nothing when told to stop, an error when its input is no good.
    pub fn run(&self, clock: Clock, progress: &mut Progress) -> Result<Option<Outcome>, String> {
        Ok(match self {
            Task::Attack { ensemble, attacker, horizon, seed } => {
                let config = Config { horizon: *horizon, ..Config::default() };
                config.check().map_err(|error| error.to_string())?;
                let (grid, ensemble) = (**ensemble).clone().check().map_err(|error| error.to_string())?;
                let target = Target { grid: &grid, ensemble: &ensemble, horizon: *horizon, seed: *seed };
                Attack::run(&target, *attacker, clock, progress)
                    .map(|(attack, cloned)| Outcome::Attack(attack, Box::new(cloned)))
            }
            Task::Table1 { setup, attackers } => {
                setup.check().map_err(|error| error.to_string())?;
                table1::check(&setup.config)?;
                if attackers.len() > Self::MOST_ATTACKERS {
                    return Err(format!("{} attackers: must be at most {}", attackers.len(), Self::MOST_ATTACKERS));
                }
                table1::run_seed(setup, attackers, progress)?.map(Outcome::Table1)
            }
            Task::Sweep { setup } => {
                sweep::check(&setup.config)?;
                SweepRun::run(setup, progress)?.map(Outcome::Sweep)
            }
            Task::Race(race) => {
                race.run(progress).map_err(|error| error.to_string())?.map(|raced| Outcome::Race(Box::new(raced)))
            }
        })
    }
}
