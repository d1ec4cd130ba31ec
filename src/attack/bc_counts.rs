//! `bc_counts(N)`: behaviour cloning in closed form. The policy of greatest likelihood is the share of each
//! action among the pairs seen at a cell; where nothing was seen it is uniform.

use super::demonstrations::{counts, pairs};
use super::{Attacker, Cloned};
use crate::ape::Parameter;
use crate::mdp::{ACTIONS, Policy};

pub const ATTACKER: Attacker = Attacker {
    name: "bc_counts",
    title: "behaviour cloning in closed form",
    summary: "π(a|s) = share of a among the pairs seen at s; uniform where none was. What bc converges to.",
    parameter: Some(PAIRS),
    usual: &[1_000_000],
    is_quick: false,
    remembers: false,
    clone: |target, wanted, _| {
        let counts = counts(target.grid.cells(), &pairs(target, wanted));
        Some(Cloned::stationary(target, frequencies(&counts), None, Some(wanted)))
    },
};

/// State–action pairs, 10⁶ in the paper.
pub const PAIRS: Parameter =
    Parameter { meaning: "state–action pairs", default: 1_000_000, low: 1, high: 10_000_000 };

/// The policy of greatest likelihood.
fn frequencies(counts: &[[u32; ACTIONS]]) -> Policy {
    let row = |counts: &[u32; ACTIONS]| {
        let sum: u32 = counts.iter().sum();
        if sum == 0 { [1.0 / ACTIONS as f64; ACTIONS] } else { counts.map(|count| f64::from(count) / f64::from(sum)) }
    };
    Policy::from_rows(counts.iter().map(row).collect())
}
