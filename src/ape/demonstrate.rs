//! Playing episodes with an ensemble: what an observer gets to see.

use rand::Rng;

use super::Ensemble;
use crate::mdp::{ACTIONS, ActionDraw, Grid, Policy, Starts, one_of};

/// Plays an ensemble's episodes on a grid.
pub struct Demonstrator<'g> {
    grid: &'g Grid,
    starts: Starts<'g>,
    draws: Vec<ActionDraw>,
    experts: usize,
    horizon: usize,
}

/// One episode; its buffers are used again for the next.
#[derive(Clone, Default)]
pub struct Episode {
    /// The cells it went through, the goal left out.
    pub states: Vec<u32>,
    /// For each step the number of its (context, state, action): `(c · S + s) · 5 + a`.
    pub entries: Vec<u32>,
}

impl<'g> Demonstrator<'g> {
    pub fn new(grid: &'g Grid, ensemble: &Ensemble, horizon: u32) -> Self {
        Demonstrator {
            grid,
            starts: Starts::new(grid),
            draws: ensemble.policies().iter().flat_map(Policy::rows).map(|row| ActionDraw::new(row)).collect(),
            experts: ensemble.experts(),
            horizon: horizon as usize,
        }
    }

    /// Plays one episode and returns its context: an expert is drawn and acts for all of it.
    pub fn play(&self, episode: &mut Episode, rng: &mut impl Rng) -> usize {
        let bits = rng.next_u64();
        let context = one_of(self.experts, (bits >> 32) as u32);
        let mut state = self.starts.start(bits as u32);
        episode.states.clear();
        episode.entries.clear();
        while state != self.grid.goal() && episode.entries.len() < self.horizon {
            let pair = context * self.grid.cells() + state;
            let action = self.draws[pair].outcome(rng.next_u32());
            episode.states.push(state as u32);
            episode.entries.push((pair * ACTIONS + action) as u32);
            state = self.starts.step(state, action, rng);
        }
        context
    }
}
