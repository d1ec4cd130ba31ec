//! `uniform`: p(c|s) = 1/n.

use super::{Observer, ObserverModel};
use crate::ape::{Contexts, Ensemble};
use crate::mdp::Grid;

pub const MODEL: ObserverModel = ObserverModel {
    name: "uniform",
    title: "weighs the experts equally",
    summary: "p(c|s) = 1/n everywhere: asks a random expert at each cell, as with equally many labels from each.",
    parameter: None,
    learns: false,
    remembers: false,
    build: |_, _, _| Box::new(Uniform),
};

struct Uniform;

impl Observer for Uniform {
    fn boxed(&self) -> Box<dyn Observer> {
        Box::new(Uniform)
    }

    fn contexts(&mut self, grid: &Grid, ensemble: &Ensemble, _horizon: u32) -> Contexts {
        Contexts::equal(grid.cells(), ensemble.experts())
    }
}
