//! `occupancy`: p(c|s) = d_c(s) / Σ d_c(s), the limit of an honest cloner's data.

use super::{Observer, ObserverModel};
use crate::ape::{Contexts, Ensemble};
use crate::mdp::{Grid, occupancy};

pub const MODEL: ObserverModel = ObserverModel {
    name: "occupancy",
    title: "clones the demonstrations",
    summary: "p(c|s) = d_c(s) / Σ d_c(s), d_c the expected visits in the first T steps (exact): behaviour \
              cloning with infinitely many demonstrations.",
    parameter: None,
    learns: false,
    remembers: false,
    build: |_, _, _| Box::new(OccupancyShare),
};

struct OccupancyShare;

impl Observer for OccupancyShare {
    fn boxed(&self) -> Box<dyn Observer> {
        Box::new(OccupancyShare)
    }

    fn contexts(&mut self, grid: &Grid, ensemble: &Ensemble, horizon: u32) -> Contexts {
        let visits: Vec<Vec<f64>> =
            ensemble.policies().iter().map(|policy| occupancy(grid, policy, horizon).visits).collect();
        Contexts::from_weights(grid.cells(), ensemble.experts(), |state, context| visits[context][state])
    }
}
