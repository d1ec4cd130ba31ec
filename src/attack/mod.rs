//! The cloners: what an observer of an ensemble can make of its demonstrations, and what that returns.
//!
//! A cloner is one file here and one line in [`ATTACKERS`]; the page's menus, the command line, the tables and
//! the tests read that table. Most end in a stationary policy, whose four returns are exact. Some remember
//! their episode ([`crate::ape::observer::Memory`]); what they return within T steps is exact where it can be and otherwise
//! simulated, with a confidence interval.

mod bc;
mod bc_counts;
mod demonstrations;
mod filtered;
mod gru;
mod history;
mod history_k;
mod limits;
mod simulate;

use serde::{Deserialize, Serialize};

pub use simulate::{FEW_TRIALS, TRIALS, simulate};

use crate::ape::observer::ObserverChoice;
use crate::ape::{Choice, Contexts, Ensemble, Model, Parameter, Trainer};
use crate::mdp::{Grid, KnownReturns, Policy, Solver, Value};

/// What is attacked.
#[derive(Clone, Copy)]
pub struct Target<'a> {
    pub grid: &'a Grid,
    pub ensemble: &'a Ensemble,
    /// T, longest demonstration and longest trial of the clone, in steps.
    pub horizon: u32,
    /// Everything random in the attack comes from it.
    pub seed: u32,
}

/// What an attack ends in.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Cloned {
    /// π(a|s); of a clone with a memory, what it does where an episode starts.
    pub policy: Policy,
    /// p(c|s), `[S][n]`, where the clone is a mixture of the experts.
    pub contexts: Option<Contexts>,
    /// Expected steps to the goal from each cell, `[S]`: hitting times; of a clone with a memory steps within T,
    /// but of `history`, whose law is that of the ensemble.
    pub steps: Vec<f64>,
    pub returns: KnownReturns,
    /// State–action pairs that it was made of; none for a limit of infinitely many.
    pub pairs: Option<u32>,
}

impl Cloned {
    /// A stationary clone, evaluated exactly.
    fn stationary(target: &Target, policy: Policy, contexts: Option<Contexts>, pairs: Option<u32>) -> Cloned {
        let Value { hitting_time, returns } = Solver::new(target.grid).evaluate(&policy, target.horizon);
        Cloned { policy, contexts, steps: hitting_time, returns: returns.into(), pairs }
    }

    /// The clone of p(c|s), evaluated exactly.
    pub fn mixture(target: &Target, contexts: Contexts) -> Cloned {
        Cloned::stationary(target, target.ensemble.cloned(&contexts), Some(contexts), None)
    }
}

/// The clone by a run's own observer, who has watched the training and so knows more than one that begins now. One that
/// learns to remember is tried in so many episodes.
pub fn own_clone(trainer: &mut Trainer, trials: usize) -> Cloned {
    let (ensemble, contexts) = (trainer.ensemble(), trainer.contexts());
    let config = trainer.config();
    let target = Target { grid: trainer.grid(), ensemble: &ensemble, horizon: config.horizon, seed: config.seed };
    let own = AttackerChoice::of(config.observer);
    match trainer.memory() {
        None => Cloned::mixture(&target, contexts),
        Some(_) if own.model().is_quick => own.clone_of(&target, &mut |_| true).expect("it was not told to stop"),
        Some(memory) => {
            let tried = simulate(&target, &*memory, trials, &mut |_| true);
            let (steps, returns) = tried.expect("it was not told to stop");
            Cloned { policy: ensemble.cloned(&contexts), contexts: Some(contexts), steps, returns, pairs: None }
        }
    }
}

/// Hears how much of an attack is done, 0..=1; returns whether to go on.
pub type Progress<'a> = dyn FnMut(f64) -> bool + 'a;

/// A line of the table: a cloner and what is said of it.
pub struct Attacker {
    /// Its name in files, addresses and on the command line.
    pub name: &'static str,
    /// Who it is, in a few words.
    pub title: &'static str,
    /// How it comes to its policy.
    pub summary: &'static str,
    pub parameter: Option<Parameter>,
    /// The numbers with which it takes part in a comparison of all; empty without a parameter.
    pub usual: &'static [u32],
    /// Whether it is fast enough to be made anew while training goes on; [`AttackerChoice::is_quick`] knows its number too.
    pub is_quick: bool,
    pub remembers: bool,
    /// Makes the clone; nothing when it was told to stop.
    clone: fn(&Target, u32, &mut Progress) -> Option<Cloned>,
}

/// Every cloner.
pub static ATTACKERS: [Attacker; 9] = [
    limits::UNIFORM,
    limits::OCCUPANCY,
    limits::REPLAY,
    bc::ATTACKER,
    bc_counts::ATTACKER,
    filtered::ATTACKER,
    history_k::ATTACKER,
    history::ATTACKER,
    gru::ATTACKER,
];

impl Model for Attacker {
    const WHAT: &'static str = "attacker";

    fn table() -> &'static [Self] {
        &ATTACKERS
    }

    fn name(&self) -> &'static str {
        self.name
    }

    fn parameter(&self) -> Option<&Parameter> {
        self.parameter.as_ref()
    }
}

/// A cloner with its number, as `uniform`, `bc(1000000)` or `history_k(2)`.
pub type AttackerChoice = Choice<Attacker>;

impl AttackerChoice {
    pub const UNIFORM: AttackerChoice = Choice::at(0, 0);
    pub const OCCUPANCY: AttackerChoice = Choice::at(1, 0);

    /// The cloner that an observer model stands for: they share their names.
    pub fn of(observer: ObserverChoice) -> AttackerChoice {
        observer.to_string().parse().expect("every observer model has a cloner of its name")
    }

    /// Every cloner with the numbers that a comparison of all takes.
    pub fn usual() -> Vec<AttackerChoice> {
        let with = |choice: AttackerChoice| {
            let usual = choice.model().usual;
            if usual.is_empty() { vec![choice] } else { usual.iter().map(|&n| choice.with_parameter(n)).collect() }
        };
        AttackerChoice::all().flat_map(with).collect()
    }

    /// Whether it is fast enough to be made anew while training goes on, on so many cells within so many steps.
    pub fn is_quick(&self, cells: usize, horizon: u32) -> bool {
        let model = self.model();
        model.is_quick
            && (model.name != history_k::ATTACKER.name || history_k::is_quick(self.parameter(), cells, horizon))
    }

    /// Makes the clone; nothing when `progress` said to stop.
    pub fn clone_of(&self, target: &Target, progress: &mut Progress) -> Option<Cloned> {
        (self.model().clone)(target, self.parameter(), progress)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every observer model has its cloner, over the whole range of its number.
    #[test]
    fn observers_are_cloners() {
        for observer in ObserverChoice::all() {
            for number in [0, u32::MAX] {
                let observer = observer.with_parameter(number);
                assert_eq!(AttackerChoice::of(observer).to_string(), observer.to_string());
            }
        }
    }

    #[test]
    fn names_read_back_as_they_are_written() {
        for cloner in AttackerChoice::usual() {
            assert_eq!(cloner.to_string().parse(), Ok(cloner));
        }
        assert!(
            "bc(0)"
                .parse::<AttackerChoice>()
                .unwrap_err()
                .to_string()
                .starts_with("attacker \"bc(0)\": must be one of")
        );
    }
}
