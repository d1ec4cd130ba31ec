//! `filtered`: an attacker who drops the demonstrations that T cut off, then clones the rest, infinitely many.
//!
//! Of expert c's demonstrations that arrive, the expected number of times that a is taken at s is
//! Σ_t P(s_t = s) π_c(a|s) P(arrives in the T − t − 1 steps after it): where it is forwards, times what comes
//! of it backwards. Exact.

use super::{Attacker, Cloned, Progress, Target};
use crate::ape::Contexts;
use crate::mdp::{ACTIONS, Chain, Policy, Prospect};

pub const ATTACKER: Attacker = Attacker {
    name: "filtered",
    title: "drops failed demonstrations",
    summary: "Clones only the demonstrations that reach the goal within T, infinitely many of them. Exact.",
    parameter: None,
    usual: &[],
    is_quick: true,
    remembers: false,
    clone,
};

fn clone(target: &Target, _: u32, _: &mut Progress) -> Option<Cloned> {
    let (grid, cells, n) = (target.grid, target.grid.cells(), target.ensemble.experts());
    let slip = grid.slip();
    let nothing = vec![0.0; cells];
    let mut prospect = Prospect::default();
    // Pairs of arriving demonstrations by expert, `[n][S][5]`.
    let mut pairs = Vec::with_capacity(n * cells);
    for policy in target.ensemble.policies() {
        // Arrival is worth 1, so that what is to come is the probability to arrive.
        prospect.look(&Chain::new(grid, policy), target.horizon, &nothing, 1.0);
        pairs.extend(prospect.to_come.iter().zip(policy.rows()).map(|(to_come, row)| -> [f64; ACTIONS] {
            let slipped = to_come.iter().sum::<f64>() / ACTIONS as f64;
            std::array::from_fn(|a| row[a] * ((1.0 - slip) * to_come[a] + slip * slipped))
        }));
    }
    let row = |state: usize| {
        let taken: [f64; ACTIONS] = std::array::from_fn(|a| (0..n).map(|c| pairs[c * cells + state][a]).sum());
        let all: f64 = taken.iter().sum();
        if all > 0.0 { taken.map(|pairs| pairs / all) } else { [1.0 / ACTIONS as f64; ACTIONS] }
    };
    let policy = Policy::from_rows((0..cells).map(row).collect());
    let contexts = Contexts::from_weights(cells, n, |state, c| pairs[c * cells + state].iter().sum());
    Some(Cloned::stationary(target, policy, Some(contexts), None))
}
