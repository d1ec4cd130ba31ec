//! Who an observer takes the actor to be: p(c|s), the probability that expert c acted at cell s.
//!
//! An observer model is one file here and one line in [`OBSERVERS`]; the page's menus, the command line and
//! the tests read that table.

mod gru;
mod history;
mod occupancy;
mod replay;
mod uniform;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

pub use gru::UNITS;
pub use history::Posterior;
pub use replay::KEPT;

use super::choice::{Choice, Model, Parameter};
use super::demonstrate::{Demonstrator, Episode};
use super::{Contexts, Ensemble};
use crate::mdp::Grid;

/// An observer model at work on one grid and one number of experts.
pub trait Observer: Send {
    /// A copy with all it has seen, and about how many bytes it takes.
    fn boxed(&self) -> Box<dyn Observer>;

    fn bytes(&self) -> usize {
        0
    }

    /// An ensemble episode was played by `context`, through the cells `states`.
    fn saw(&mut self, _context: usize, _states: &[u32]) {}

    /// p(c|s) as the observer has it now; of one with a memory, at the start of an episode.
    fn contexts(&mut self, grid: &Grid, ensemble: &Ensemble, horizon: u32) -> Contexts;

    /// What it makes of the clone's own episode, where it has a memory.
    fn memory(&self, _ensemble: &Ensemble) -> Option<Box<dyn Memory>> {
        None
    }
}

impl Clone for Box<dyn Observer> {
    fn clone(&self) -> Self {
        self.boxed()
    }
}

/// p(c|τ): who is taken to act, given the episode so far (paper, Eq. 8). What is
/// remembered between two steps is a row of numbers.
pub trait Memory: Send + Sync {
    /// What is remembered before an episode's first cell.
    fn start(&self) -> Vec<f64>;

    /// Takes a cell in and writes p(c|τ), `[n]`.
    fn see(&self, memory: &mut [f64], state: usize, p: &mut [f64]);

    /// Takes in the action that followed.
    fn act(&self, _memory: &mut [f64], _state: usize, _action: usize) {}
}

/// A line of the table: an observer model and what is said of it.
pub struct ObserverModel {
    /// Its name in files, addresses and on the command line.
    pub name: &'static str,
    /// Who it is, in a few words.
    pub title: &'static str,
    /// How it comes to its p(c|s).
    pub summary: &'static str,
    /// What the number in parentheses means, where the model takes one, with its default and range.
    pub parameter: Option<Parameter>,
    /// Whether it must see ensemble episodes before it knows anything.
    pub learns: bool,
    /// Whether p(c|·) depends on the episode so far, not on the cell alone.
    pub remembers: bool,
    build: fn(&Grid, usize, u32) -> Box<dyn Observer>,
}

/// Every observer model.
pub static OBSERVERS: [ObserverModel; 5] =
    [uniform::MODEL, occupancy::MODEL, replay::MODEL, history::MODEL, gru::MODEL];

impl Model for ObserverModel {
    const WHAT: &'static str = "observer";

    fn table() -> &'static [Self] {
        &OBSERVERS
    }

    fn name(&self) -> &'static str {
        self.name
    }

    fn parameter(&self) -> Option<&Parameter> {
        self.parameter.as_ref()
    }
}

/// An observer model with its parameter, as `uniform`, `occupancy` or `replay(60)`.
pub type ObserverChoice = Choice<ObserverModel>;

impl ObserverChoice {
    /// Our default.
    pub const UNIFORM: ObserverChoice = Choice::at(0, 0);
    /// The honest cloner with infinite demonstrations.
    pub const OCCUPANCY: ObserverChoice = Choice::at(1, 0);
    /// The paper's estimate.
    pub const PAPER: ObserverChoice = Choice::at(2, 60);

    pub fn build(&self, grid: &Grid, experts: usize) -> Box<dyn Observer> {
        (self.model().build)(grid, experts, self.parameter())
    }

    /// p(c|s) of this observer for an ensemble that changes no more. A model that learns watches fresh
    /// episodes first, `parameter` from every start in the mean, though no more than half a million steps.
    pub fn contexts(&self, grid: &Grid, ensemble: &Ensemble, horizon: u32, seed: u32) -> Contexts {
        const MOST_STEPS: usize = 500_000;
        let mut observer = self.build(grid, ensemble.experts());
        if self.model().learns {
            let demonstrator = Demonstrator::new(grid, ensemble, horizon);
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(u64::from(seed));
            let mut episode = Episode::default();
            let mut steps = 0;
            for _ in 0..self.parameter() as usize * grid.starts().len() {
                let context = demonstrator.play(&mut episode, &mut rng);
                observer.saw(context, &episode.states);
                steps += episode.states.len();
                if steps >= MOST_STEPS {
                    break;
                }
            }
        }
        observer.contexts(grid, ensemble, horizon)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_read_back_as_they_are_written() {
        for choice in ObserverChoice::all() {
            assert_eq!(choice.to_string().parse(), Ok(choice));
        }
        assert_eq!("replay".parse(), Ok(ObserverChoice::PAPER));
        assert_eq!("replay(5)".parse::<ObserverChoice>().unwrap().to_string(), "replay(5)");
        assert_eq!(ObserverChoice::OCCUPANCY.to_string(), "occupancy");
        assert_eq!(ObserverChoice::UNIFORM.to_string(), "uniform");
    }

    #[test]
    fn a_name_that_is_none_gets_the_list() {
        for bad in ["", "bayes", "replay(0)", "replay(x)", "uniform(3)", "replay(60", "replay(99999)"] {
            let sentence = bad.parse::<ObserverChoice>().unwrap_err().to_string();
            assert!(
                sentence.contains("uniform; occupancy; replay(contexts kept at each cell), 1 to 1000; history; gru(recurrent units), 1 to 32"),
                "{sentence}"
            );
        }
    }
}
