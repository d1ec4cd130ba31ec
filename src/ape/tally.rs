//! A batch of episodes as far as learning needs it: how often each action was taken, and what followed.

use std::hint::select_unpredictable;

use super::batch::{Batch, WALKERS};
use crate::mdp::ACTIONS;

/// What a step is worth.
#[derive(Clone, Copy)]
pub struct Rewards<'a> {
    pub discount: f64,
    /// By entry, `[S][n][5]`; −1 a step where there is none.
    pub by_entry: Option<&'a [f64]>,
    /// What the return after step t counts, `[T]`, where that is not 1.
    pub weights: Option<&'a [f64]>,
}

#[derive(Default)]
pub struct Tally {
    /// `[S][n][5]`: how often each action was taken, and the sum of the returns R(t) that followed.
    entries: Vec<[f64; 2]>,
    /// `[S][n]`: the same summed over actions.
    pub pairs: Vec<[f64; 2]>,
    pub episodes: f64,
    pub steps: f64,
}

impl Tally {
    /// `[S][n]`, the entries of each pair (state, context).
    pub fn by_pair(&self) -> &[[[f64; 2]; ACTIONS]] {
        self.entries.as_chunks().0
    }

    /// Counts a batch anew; there are so many entries.
    pub fn count(&mut self, entries: usize, batch: &Batch, Rewards { discount, by_entry, weights }: Rewards) {
        self.entries.clear();
        self.entries.resize(entries, [0.0; 2]);
        // A loop of its own for each case.
        match (by_entry, weights) {
            (None, None) => self.add(batch, discount, |_| -1.0, |_| 1.0),
            (None, Some(weights)) => self.add(batch, discount, |_| -1.0, |t| weights[t]),
            (Some(reward), None) => self.add(batch, discount, |entry| reward[entry], |_| 1.0),
            (Some(reward), Some(weights)) => self.add(batch, discount, |entry| reward[entry], |t| weights[t]),
        }
        self.episodes = f64::from(batch.episodes);
        self.steps = batch.steps() as f64;
        let sum = |actions: &[[f64; 2]; ACTIONS]| {
            actions.iter().fold([0.0; 2], |sum, entry| [sum[0] + entry[0], sum[1] + entry[1]])
        };
        self.pairs.clear();
        self.pairs.extend(self.entries.as_chunks().0.iter().map(sum));
    }

    #[inline(always)]
    fn add(&mut self, batch: &Batch, discount: f64, reward: impl Fn(usize) -> f64, weight: impl Fn(usize) -> f64) {
        // What follows each walker's step before this one: the return, and what it counts, nothing after an episode's end.
        let mut later = [(0.0, 0.0); WALKERS];
        let entries = &mut self.entries[..];
        batch.backwards(|walker, step| {
            let (to_go, factor) = later[walker];
            let to_go = reward(step.entry()) + factor * to_go;
            let [count, returns] = &mut entries[step.entry()];
            *count += 1.0;
            *returns += weight(step.time()) * to_go;
            // Without a branch, which would often be mistaken.
            let factor = select_unpredictable(step.time() == 0, 0, discount.to_bits());
            later[walker] = (to_go, f64::from_bits(factor));
        });
    }
}
