//! `uniform`, `occupancy`, `replay(k)`: the clones of the observer models, as with infinitely many pairs.

use super::{Attacker, Cloned, Progress, Target};
use crate::ape::observer::{KEPT, ObserverChoice};

pub const UNIFORM: Attacker = Attacker {
    name: "uniform",
    title: "weighs the experts equally",
    summary: "π_o(a|s) = Σ_c π_c(a|s) / n: blind to where each expert goes, as with equally many labels from each. Exact.",
    parameter: None,
    usual: &[],
    is_quick: true,
    remembers: false,
    clone: |target, _, _| Some(mixture(target, ObserverChoice::UNIFORM)),
};

pub const OCCUPANCY: Attacker = Attacker {
    name: "occupancy",
    title: "clones the demonstrations",
    summary: "π_o(a|s) with p(c|s) by expected visits: what behaviour cloning ends in with infinitely many demonstrations. Exact.",
    parameter: None,
    usual: &[],
    is_quick: true,
    remembers: false,
    clone: |target, _, _| Some(mixture(target, ObserverChoice::OCCUPANCY)),
};

pub const REPLAY: Attacker = Attacker {
    name: "replay",
    title: "remembers recent demonstrations",
    summary: "π_o(a|s) with p(c|s) from the last contexts that ensemble episodes left at s (60 in the paper's appendix).",
    parameter: Some(KEPT),
    usual: &[60],
    is_quick: true,
    remembers: false,
    clone: replay,
};

fn mixture(target: &Target, observer: ObserverChoice) -> Cloned {
    Cloned::mixture(target, observer.contexts(target.grid, target.ensemble, target.horizon, target.seed))
}

fn replay(target: &Target, kept: u32, _: &mut Progress) -> Option<Cloned> {
    Some(mixture(target, ObserverChoice::PAPER.with_parameter(kept)))
}
