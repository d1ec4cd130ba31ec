//! `bc(N)`: behaviour cloning as in the paper's appendix: N state–action pairs (10⁶), a table of logits, Adam
//! with step size 0.01 on the cross-entropy, 100 epochs.
//!
//! The paper does not say the size of a minibatch. One step per epoch cannot do: 100 steps of 0.01 move a logit
//! by at most 1. Here an epoch has [`MINIBATCHES`] of them, 3,907 pairs each of a million, shuffled anew every time.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::bc_counts::PAIRS;
use super::demonstrations::{counts, pairs};
use super::{Attacker, Cloned, Progress, Target};
use crate::ape::{Adam, softmax};
use crate::mdp::ACTIONS;

pub const ATTACKER: Attacker = Attacker {
    name: "bc",
    title: "behaviour cloning, as the paper's",
    summary: "A table of logits, trained on the cross-entropy of N pairs: Adam 0.01, 100 epochs of shuffled minibatches.",
    parameter: Some(PAIRS),
    usual: &[1_000_000],
    is_quick: false,
    remembers: false,
    clone,
};

/// Minibatches in an epoch.
const MINIBATCHES: usize = 256;
const EPOCHS: u32 = 100;
const LEARNING_RATE: f64 = 0.01;

fn clone(target: &Target, wanted: u32, progress: &mut Progress) -> Option<Cloned> {
    let mut data = pairs(target, wanted);
    let logits = fit(&mut data, target.grid.cells(), MINIBATCHES, target.seed, progress)?;
    let policy = softmax(&logits, target.grid.cells()).policies()[0].clone();
    Some(Cloned::stationary(target, policy, None, Some(wanted)))
}

/// Logits `[S][5]` trained on `data`, which gets shuffled.
fn fit(data: &mut [u16], cells: usize, minibatches: usize, seed: u32, progress: &mut Progress) -> Option<Vec<f64>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(!u64::from(seed));
    let mut logits = vec![0.0; cells * ACTIONS];
    let mut gradient = logits.clone();
    let mut adam = Adam::new(logits.len());
    let minibatch = data.len().div_ceil(minibatches);
    for epoch in 0..EPOCHS {
        for i in (1..data.len()).rev() {
            data.swap(i, rng.random_range(0..=i as u32) as usize);
        }
        for batch in data.chunks(minibatch) {
            let counts = counts(cells, batch);
            let ensemble = softmax(&logits, cells);
            // ∇ of the mean log-likelihood: (count of a − count · π(a)) / size.
            for (state, (gradient, counts)) in gradient.as_chunks_mut().0.iter_mut().zip(&counts).enumerate() {
                let pi = ensemble.policies()[0].row(state);
                let all = f64::from(counts.iter().sum::<u32>());
                *gradient = std::array::from_fn::<f64, ACTIONS, _>(|a| {
                    (f64::from(counts[a]) - all * pi[a]) / batch.len() as f64
                });
            }
            adam.ascend(&mut logits, &gradient, LEARNING_RATE);
        }
        if !progress(f64::from(epoch + 1) / f64::from(EPOCHS)) {
            return None;
        }
    }
    Some(logits)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A cell where one action is always taken. In 100 steps of the full batch its probability comes to
    /// e / (e + 4/e) ≈ 0.65 at most; in minibatches it comes to where it belongs.
    #[test]
    fn the_full_batch_cannot_converge() {
        let learned = |minibatches: usize| {
            let mut data = vec![3; 5000];
            let logits = fit(&mut data, 1, minibatches, 1, &mut |_| true).unwrap();
            softmax(&logits, 1).policies()[0].row(0)[3]
        };
        assert!((0.5..0.66).contains(&learned(1)), "{}", learned(1));
        assert!(learned(MINIBATCHES) > 0.999, "{}", learned(MINIBATCHES));
    }
}
