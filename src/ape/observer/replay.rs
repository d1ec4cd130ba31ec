//! `replay(k)`: p(c|s) = share of c among the last k contexts that ensemble episodes left at s.

use super::{Observer, ObserverModel};
use crate::ape::choice::Parameter;
use crate::ape::{Contexts, Ensemble};
use crate::mdp::Grid;

pub const MODEL: ObserverModel = ObserverModel {
    name: "replay",
    title: "remembers recent demonstrations",
    summary: "p(c|s) = share of c among the last contexts that ensemble episodes left at s (60 in the paper's \
              appendix); 1/n where there are none yet.",
    parameter: Some(KEPT),
    learns: true,
    remembers: false,
    build: |grid, experts, kept| Box::new(Replay::new(grid.cells(), experts, kept as usize)),
};

pub const KEPT: Parameter = Parameter { meaning: "contexts kept at each cell", default: 60, low: 1, high: 1000 };

#[derive(Clone)]
struct Replay {
    experts: usize,
    kept: usize,
    /// `[S][kept]`: the contexts, each cell's a ring.
    rings: Vec<u8>,
    /// `[S]`: the next place of a cell's ring, and how many of its places are taken.
    places: Vec<(u32, u32)>,
    /// `[S][n]`: how often each context is in a cell's ring.
    counts: Vec<u32>,
}

impl Replay {
    fn new(cells: usize, experts: usize, kept: usize) -> Self {
        Replay {
            experts,
            kept,
            rings: vec![0; cells * kept],
            places: vec![(0, 0); cells],
            counts: vec![0; cells * experts],
        }
    }
}

impl Observer for Replay {
    fn boxed(&self) -> Box<dyn Observer> {
        Box::new(self.clone())
    }

    fn bytes(&self) -> usize {
        self.rings.len() + 8 * self.places.len() + 4 * self.counts.len()
    }

    fn saw(&mut self, context: usize, states: &[u32]) {
        for &state in states {
            let state = state as usize;
            let (next, taken) = &mut self.places[state];
            let kept = &mut self.rings[state * self.kept + *next as usize];
            let counts = &mut self.counts[state * self.experts..][..self.experts];
            if *taken == self.kept as u32 {
                counts[*kept as usize] -= 1;
            } else {
                *taken += 1;
            }
            *kept = context as u8;
            counts[context] += 1;
            *next = if *next + 1 == self.kept as u32 { 0 } else { *next + 1 };
        }
    }

    fn contexts(&mut self, grid: &Grid, _ensemble: &Ensemble, _horizon: u32) -> Contexts {
        Contexts::from_weights(grid.cells(), self.experts, |state, context| {
            f64::from(self.counts[state * self.experts + context])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::{GridSpec, Policy};

    #[test]
    fn only_the_last_contexts_count() {
        let grid = Grid::new(GridSpec { rows: 2, cols: 2, ..GridSpec::default() }).unwrap();
        let ensemble = Ensemble::new(vec![Policy::from_rows(vec![[0.2; 5]; 4]); 2]);
        let mut replay = Replay::new(4, 2, 3);
        let share = |replay: &mut Replay, state| replay.contexts(&grid, &ensemble, 100).row(state).to_vec();
        assert_eq!(share(&mut replay, 1), [0.5, 0.5]);
        replay.saw(0, &[1, 1, 2]);
        assert_eq!(share(&mut replay, 1), [1.0, 0.0]);
        replay.saw(1, &[1, 1]);
        assert_eq!(share(&mut replay, 1), [1.0 / 3.0, 2.0 / 3.0]);
        replay.saw(1, &[1]);
        assert_eq!(share(&mut replay, 1), [0.0, 1.0]);
        assert_eq!(share(&mut replay, 2), [1.0, 0.0]);
        assert_eq!(share(&mut replay, 3), [0.5, 0.5]);
    }
}
