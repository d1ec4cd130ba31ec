//! Who an observer takes the actor to be: p(c|s), the probability that expert c acted at cell s.
//!
//! An observer model is one file here and one line in [`OBSERVERS`]; the page's menus, the command line and
//! the tests read that table.

mod occupancy;
mod replay;
mod uniform;

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use super::demonstrate::{Demonstrator, Episode};
use super::{Contexts, Ensemble};
use crate::mdp::Grid;

/// An observer model at work on one grid and one number of experts.
pub trait Observer: Send {
    /// An ensemble episode was played by `context`, through the cells `states`.
    fn saw(&mut self, _context: usize, _states: &[u32]) {}

    /// p(c|s) as the observer has it now.
    fn contexts(&mut self, grid: &Grid, ensemble: &Ensemble, horizon: u32) -> Contexts;
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
    build: fn(&Grid, usize, u32) -> Box<dyn Observer>,
}

pub struct Parameter {
    pub meaning: &'static str,
    pub default: u32,
    pub low: u32,
    pub high: u32,
}

/// Every observer model.
pub static OBSERVERS: [ObserverModel; 3] = [uniform::MODEL, occupancy::MODEL, replay::MODEL];

/// An observer model with its parameter, as `uniform`, `occupancy` or `replay(60)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct ObserverChoice {
    index: u32,
    parameter: u32,
}

impl ObserverChoice {
    /// Our default.
    pub const UNIFORM: ObserverChoice = ObserverChoice { index: 0, parameter: 0 };
    /// The honest cloner with infinite demonstrations.
    pub const OCCUPANCY: ObserverChoice = ObserverChoice { index: 1, parameter: 0 };
    /// The paper's estimate.
    pub const PAPER: ObserverChoice = ObserverChoice { index: 2, parameter: 60 };

    /// Every model, each with its default parameter.
    pub fn all() -> impl Iterator<Item = ObserverChoice> {
        OBSERVERS.iter().enumerate().map(|(index, model)| ObserverChoice {
            index: index as u32,
            parameter: model.parameter.as_ref().map_or(0, |parameter| parameter.default),
        })
    }

    pub fn model(&self) -> &'static ObserverModel {
        &OBSERVERS[self.index as usize]
    }

    /// The number in parentheses; 0 for a model that takes none.
    pub fn parameter(&self) -> u32 {
        self.parameter
    }

    /// The same model with another number, brought into its range; the same choice for a model without one.
    pub fn with_parameter(self, parameter: u32) -> ObserverChoice {
        match &self.model().parameter {
            Some(range) => ObserverChoice { parameter: parameter.clamp(range.low, range.high), ..self },
            None => self,
        }
    }

    pub fn build(&self, grid: &Grid, experts: usize) -> Box<dyn Observer> {
        (self.model().build)(grid, experts, self.parameter)
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
            for _ in 0..self.parameter as usize * grid.starts().len() {
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

impl std::fmt::Display for ObserverChoice {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self.model().parameter {
            Some(_) => write!(f, "{}({})", self.model().name, self.parameter),
            None => f.write_str(self.model().name),
        }
    }
}

impl From<ObserverChoice> for String {
    fn from(choice: ObserverChoice) -> String {
        choice.to_string()
    }
}

/// Text that names no observer model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("observer {text:?}: must be one of {known}")]
pub struct ObserverError {
    text: String,
    known: String,
}

impl std::str::FromStr for ObserverChoice {
    type Err = ObserverError;

    fn from_str(text: &str) -> Result<Self, ObserverError> {
        let (name, argument) = match text.strip_suffix(')').and_then(|text| text.split_once('(')) {
            Some((name, argument)) => (name, Some(argument)),
            None => (text, None),
        };
        let parse = || {
            let default = ObserverChoice::all().find(|choice| choice.model().name == name)?;
            match (&default.model().parameter, argument) {
                (_, None) => Some(default),
                (None, Some(_)) => None,
                (Some(range), Some(argument)) => {
                    let parameter = argument.parse().ok().filter(|value| (range.low..=range.high).contains(value))?;
                    Some(ObserverChoice { parameter, ..default })
                }
            }
        };
        parse().ok_or_else(|| {
            let known = OBSERVERS.iter().map(|model| match &model.parameter {
                Some(p) => format!("{}({}), {} to {}", model.name, p.meaning, p.low, p.high),
                None => model.name.to_owned(),
            });
            ObserverError { text: text.to_owned(), known: known.collect::<Vec<_>>().join("; ") }
        })
    }
}

impl TryFrom<String> for ObserverChoice {
    type Error = ObserverError;

    fn try_from(text: String) -> Result<Self, ObserverError> {
        text.parse()
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
                sentence.contains("uniform; occupancy; replay(contexts kept at each cell), 1 to 1000"),
                "{sentence}"
            );
        }
    }
}
