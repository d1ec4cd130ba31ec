//! `filtered`: an attacker who drops the demonstrations that T cut off, then clones the rest, infinitely many.
//!
//! Of expert c's demonstrations that arrive, the expected number of times that a is taken at s is
//! Σ_t P(s_t = s) π_c(a|s) P(arrives in the T − t − 1 steps after it): where it is forwards, times what comes
//! of it backwards. Exact.

use super::{Attacker, Cloned, Progress, Target};
use crate::ape::Contexts;
use crate::mdp::{ACTIONS, Policy};

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
    let horizon = target.horizon as usize;
    let slip = grid.slip();
    // Pairs of arriving demonstrations by expert, `[n][S][5]`.
    let mut pairs = vec![[0.0; ACTIONS]; n * cells];
    let mut arrives = vec![0.0; horizon * cells];
    for (policy, pairs) in target.ensemble.policies().iter().zip(pairs.chunks_mut(cells)) {
        let executed: Vec<_> = grid.starts().iter().map(|&s| grid.executed(policy.row(s as usize))).collect();
        // P(arrives within k steps), `[T][S]`, k = 0…T − 1.
        arrives.fill(0.0);
        arrives[grid.goal()] = 1.0;
        for k in 1..horizon {
            let (before, after) = arrives.split_at_mut(k * cells);
            let before = &before[(k - 1) * cells..];
            after[grid.goal()] = 1.0;
            for (&state, executed) in grid.starts().iter().zip(&executed) {
                let to = grid.next(state as usize);
                after[state as usize] = (0..ACTIONS).map(|a| executed[a] * before[to[a] as usize]).sum();
            }
        }
        let mut now = vec![0.0; cells];
        for &state in grid.starts() {
            now[state as usize] = 1.0 / grid.starts().len() as f64;
        }
        let mut next = now.clone();
        for t in 0..horizon {
            let arrives = &arrives[(horizon - 1 - t) * cells..][..cells];
            next.fill(0.0);
            for (&state, executed) in grid.starts().iter().zip(&executed) {
                let state = state as usize;
                let after = grid.next(state).map(|to| arrives[to as usize]);
                let slipped = after.iter().sum::<f64>() / ACTIONS as f64;
                for a in 0..ACTIONS {
                    let arrives = (1.0 - slip) * after[a] + slip * slipped;
                    pairs[state][a] += now[state] * policy.row(state)[a] * arrives;
                    next[grid.next(state)[a] as usize] += now[state] * executed[a];
                }
            }
            next[grid.goal()] = 0.0;
            std::mem::swap(&mut now, &mut next);
        }
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
