//! Playing episodes with an ensemble: what an observer gets to see.

use rand::{Rng, RngExt};

use super::{Config, Ensemble};
use crate::mdp::{ACTIONS, Draw, Grid, Starts};

/// Plays an ensemble's episodes on a grid.
pub struct Demonstrator<'g> {
    grid: &'g Grid,
    starts: Starts<'g>,
    draws: Vec<Draw<ACTIONS>>,
    experts: u32,
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
            draws: action_draws(ensemble),
            experts: ensemble.experts() as u32,
            horizon: horizon as usize,
        }
    }

    /// Plays one episode and returns its context: an expert is drawn and acts for all of it.
    pub fn play(&self, episode: &mut Episode, rng: &mut impl Rng) -> usize {
        let context = rng.random_range(0..self.experts) as usize;
        let mut state = self.starts.start(rng);
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

/// For each (context, state), the draw of its action.
pub fn action_draws(ensemble: &Ensemble) -> Vec<Draw<ACTIONS>> {
    ensemble.policies().iter().flat_map(|policy| policy.rows().iter().map(|row| Draw::new(row))).collect()
}

/// The draw of a context at a state.
pub type ContextDraw = Draw<{ Config::MAX_EXPERTS as usize }>;
