//! `gru(H)`: the paper's learned sequential observer. A recurrent network, trained on ensemble episodes labelled
//! with the expert that acted, guesses the expert of the clone's own episode; the clone acts by the mixture.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Attacker, Cloned, Progress, TRIALS, Target, simulate};
use crate::ape::observer::UNITS;
use crate::ape::{Demonstrator, Episode, Labelled, Network};

pub const ATTACKER: Attacker = Attacker {
    name: "gru",
    title: "learned memory, as the paper's",
    summary: "p(c|τ) by a GRU over its episode's cells, concatenated with the cell, a dense layer of 128 and a softmax; trained \
              on labelled demonstrations. Simulated, with a 95 % interval; drawn as at the start of an episode.",
    parameter: Some(UNITS),
    usual: &[4],
    is_quick: false,
    remembers: true,
    clone,
};

/// Labelled episodes to learn from.
const EPISODES: u32 = 5000;
/// They hold no more steps than this, where episodes are long.
const MOST_STEPS: u32 = 400_000;
const EPOCHS: u32 = 5;
/// Share of the work that is training.
const TRAINING: f64 = 0.8;

fn clone(target: &Target, units: u32, progress: &mut Progress) -> Option<Cloned> {
    let Target { grid, ensemble, horizon, seed } = *target;
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(u64::from(seed));
    let demonstrator = Demonstrator::new(grid, ensemble, horizon);
    let mut episode = Episode::default();
    let (mut episodes, mut pairs) = (Vec::new(), 0);
    while episodes.len() < EPISODES as usize && pairs < MOST_STEPS {
        let context = demonstrator.play(&mut episode, &mut rng) as u8;
        pairs += episode.states.len() as u32;
        episodes.push(Labelled { context, states: episode.states.clone() });
    }
    let mut network = Network::new(grid.cells(), ensemble.experts(), units as usize, &mut rng);
    if !network.train(&episodes, EPOCHS, &mut rng, &mut |done| progress(TRAINING * done)) {
        return None;
    }
    let (steps, returns) =
        simulate(target, &network, TRIALS, &mut |done| progress(TRAINING + (1.0 - TRAINING) * done))?;
    let contexts = network.at_start(grid.cells(), ensemble.experts());
    Some(Cloned { policy: ensemble.cloned(&contexts), contexts: Some(contexts), steps, returns, pairs: Some(pairs) })
}
