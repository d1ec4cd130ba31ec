//! `gru(H)`: the paper's learned sequential observer: a recurrent network that learns, while the experts train, to
//! tell from the cells of an episode who acts.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Memory, Observer, ObserverModel};
use crate::ape::choice::Parameter;
use crate::ape::recurrent::{Labelled, Learner, Network};
use crate::ape::{Contexts, Ensemble};
use crate::mdp::Grid;

pub const MODEL: ObserverModel = ObserverModel {
    name: "gru",
    title: "learns to tell who acts",
    summary: "p(c|τ) by a GRU over its episode's cells, concatenated with the cell, a dense layer of 128 and a softmax; it learns \
              from every batch of ensemble episodes (the paper's discussion).",
    parameter: Some(UNITS),
    learns: true,
    remembers: true,
    build: |grid, experts, units| Box::new(Recurrent::new(grid, experts, units)),
};

pub const UNITS: Parameter = Parameter { meaning: "recurrent units", default: 4, low: 1, high: 32 };

#[derive(Clone)]
struct Recurrent {
    network: Network,
    learner: Learner,
    /// Episodes that it has not learned from yet.
    seen: Vec<Labelled>,
}

impl Recurrent {
    /// Adam's step size: a quarter of what a network takes that learns once, from an ensemble that stands still.
    const LEARNING_RATE: f64 = 0.005;

    /// Its weights at the start are always the same.
    fn new(grid: &Grid, experts: usize, units: u32) -> Recurrent {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(u64::from(units));
        let network = Network::new(grid.cells(), experts, units as usize, &mut rng);
        Recurrent { learner: Learner::new(&network), network, seen: Vec::new() }
    }
}

impl Observer for Recurrent {
    fn boxed(&self) -> Box<dyn Observer> {
        Box::new(self.clone())
    }

    fn bytes(&self) -> usize {
        // The network, its gradient, and two moments of Adam for each of its numbers.
        4 * 8 * self.network.parameters()
    }

    fn saw(&mut self, context: usize, states: &[u32]) {
        self.seen.push(Labelled { context: context as u8, states: states.to_vec() });
    }

    fn contexts(&mut self, grid: &Grid, ensemble: &Ensemble, _horizon: u32) -> Contexts {
        let seen = std::mem::take(&mut self.seen);
        for minibatch in seen.iter().collect::<Vec<_>>().chunks(Learner::MINIBATCH) {
            self.learner.step(&mut self.network, minibatch, Self::LEARNING_RATE);
        }
        self.network.at_start(grid.cells(), ensemble.experts())
    }

    fn memory(&self, _ensemble: &Ensemble) -> Option<Box<dyn Memory>> {
        Some(Box::new(self.network.clone()))
    }
}
