//! State–action pairs, as an observer collects them: from whole ensemble episodes, without their contexts.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::Target;
use crate::ape::{Demonstrator, Episode};
use crate::mdp::ACTIONS;

/// `pairs` state–action pairs, each as `s · 5 + a`, in the order in which they were seen; the last episode is
/// left out from where there are enough.
pub fn pairs(target: &Target, pairs: u32) -> Vec<u16> {
    let demonstrator = Demonstrator::new(target.grid, target.ensemble, target.horizon);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(u64::from(target.seed));
    let entries = (target.grid.cells() * ACTIONS) as u32;
    let mut episode = Episode::default();
    let mut seen = Vec::with_capacity(pairs as usize);
    while seen.len() < pairs as usize {
        demonstrator.play(&mut episode, &mut rng);
        // Without the context: at most 1,024 cells of 5 actions, which 16 bits hold.
        let missing = pairs as usize - seen.len();
        seen.extend(episode.entries.iter().take(missing).map(|entry| (entry % entries) as u16));
    }
    seen
}

/// How often each pair is among them, `[S][5]`.
pub fn counts(cells: usize, pairs: &[u16]) -> Vec<[u32; ACTIONS]> {
    let mut counts = vec![[0; ACTIONS]; cells];
    for &pair in pairs {
        counts.as_flattened_mut()[usize::from(pair)] += 1;
    }
    counts
}
