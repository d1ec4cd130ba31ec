//! `history_k(k)`: cloning with the last k cells besides the one it is in, from infinitely many demonstrations.
//!
//! A window is the cell it is in and up to k cells before; at the start of an episode there are fewer. The
//! experts are Markov, so a window of expert c comes up as often as its first cell is visited in time, times
//! the probabilities of the moves after it; p(c|window) is the share. The clone is Markov on windows, of which
//! there are at most cells · 5ᵏ, so its T steps are dynamic programming: exact.

use std::collections::BTreeMap;

use super::{Attacker, Cloned, Progress, Target};
use crate::ape::{Contexts, Parameter};
use crate::mdp::{ACTIONS, KnownReturns, occupancy};

pub const ATTACKER: Attacker = Attacker {
    name: "history_k",
    title: "remembers a few cells",
    summary: "Clones what is done after the last k cells and in the present one, from infinitely many demonstrations. \
              Exact within T; drawn as at the start of an episode.",
    parameter: Some(Parameter { meaning: "cells remembered", default: 1, low: 1, high: 3 }),
    usual: &[1, 2],
    is_quick: true,
    remembers: true,
    clone,
};

/// Whether the dynamic programming over all windows takes less than half a second or so.
pub fn is_quick(k: u32, cells: usize, horizon: u32) -> bool {
    const MOST: u64 = 20_000_000;
    cells as u64 * (ACTIONS as u64).pow(k) * u64::from(horizon) <= MOST
}

/// A window while the clone's moves are worked out.
struct Window {
    /// Its cells, the present one last.
    cells: Vec<u32>,
    /// Weight of every expert, `[n]`.
    weights: Vec<f64>,
    /// Where it goes: probability and number of the window, none at the goal.
    moves: Vec<(f64, Option<usize>)>,
}

fn clone(target: &Target, k: u32, progress: &mut Progress) -> Option<Cloned> {
    let (grid, policies, k) = (target.grid, target.ensemble.policies(), k as usize);
    let n = policies.len();
    // P_c(s → s') and how often a window of full length begins at s.
    let executed: Vec<Vec<[f64; ACTIONS]>> =
        policies.iter().map(|policy| policy.rows().iter().map(|row| grid.executed(row)).collect()).collect();
    let moves_to = |c: usize, from: u32, to: u32| -> f64 {
        let next = grid.next(from as usize);
        (0..ACTIONS).filter(|&a| next[a] == to).map(|a| executed[c][from as usize][a]).sum()
    };
    let begins: Vec<Vec<f64>> =
        policies.iter().map(|policy| occupancy(grid, policy, target.horizon.saturating_sub(k as u32)).visits).collect();
    let start = 1.0 / grid.starts().len() as f64;
    let weights = |cells: &[u32]| -> Vec<f64> {
        let weight = |c: usize| {
            let begins = if cells.len() <= k { start } else { begins[c][cells[0] as usize] };
            begins * cells.windows(2).map(|pair| moves_to(c, pair[0], pair[1])).product::<f64>()
        };
        (0..n).map(weight).collect()
    };
    let mut windows: Vec<Window> = Vec::new();
    let mut number: BTreeMap<Vec<u32>, usize> = BTreeMap::new();
    let mut window_of = |cells: Vec<u32>, windows: &mut Vec<Window>| {
        *number.entry(cells).or_insert_with_key(|cells| {
            windows.push(Window { weights: weights(cells), cells: cells.clone(), moves: Vec::new() });
            windows.len() - 1
        })
    };
    for &state in grid.starts() {
        window_of(vec![state], &mut windows);
    }
    let mut at = 0;
    while at < windows.len() {
        let Window { cells, weights, .. } = &windows[at];
        let state = *cells.last().expect("a window has a cell") as usize;
        let row = acts(target, weights, state);
        let tail = cells[cells.len().saturating_sub(k)..].to_vec();
        let mut moves = Vec::with_capacity(ACTIONS);
        for (p, &to) in grid.executed(&row).into_iter().zip(grid.next(state)) {
            if p == 0.0 {
                continue;
            }
            let next = (to as usize != grid.goal()).then(|| {
                let mut cells = tail.clone();
                cells.push(to);
                window_of(cells, &mut windows)
            });
            moves.push((p, next));
        }
        windows[at].moves = moves;
        at += 1;
    }
    // P(still under way after so many steps), from every window.
    let mut under_way = vec![1.0; windows.len()];
    let mut next = under_way.clone();
    let starts = grid.starts().len();
    let mut steps = vec![0.0; starts];
    for step in 0..target.horizon {
        if step.is_multiple_of(16) && !progress(f64::from(step) / f64::from(target.horizon)) {
            return None;
        }
        for (steps, under_way) in steps.iter_mut().zip(&under_way) {
            *steps += under_way;
        }
        for (next, window) in next.iter_mut().zip(&windows) {
            *next = window.moves.iter().map(|&(p, to)| to.map_or(0.0, |to| p * under_way[to])).sum();
        }
        std::mem::swap(&mut under_way, &mut next);
    }
    let contexts = Contexts::equal(grid.cells(), n);
    let mut by_cell = vec![0.0; grid.cells()];
    for (&state, steps) in grid.starts().iter().zip(&steps) {
        by_cell[state as usize] = *steps;
    }
    Some(Cloned {
        policy: target.ensemble.cloned(&contexts),
        contexts: Some(contexts),
        steps: by_cell,
        returns: KnownReturns {
            capped_return: None,
            uncapped_return: None,
            horizon_return: -steps.iter().sum::<f64>() / grid.free_cells() as f64,
            success: 1.0 - under_way[..starts].iter().sum::<f64>() / starts as f64,
            horizon_error: 0.0,
            success_error: 0.0,
        },
        pairs: None,
    })
}

/// The clone's row after a window of these weights, `[5]`.
fn acts(target: &Target, weights: &[f64], state: usize) -> [f64; ACTIONS] {
    let sum: f64 = weights.iter().sum();
    let mut row = [0.0; ACTIONS];
    for (policy, weight) in target.ensemble.policies().iter().zip(weights) {
        let p = if sum > 0.0 { weight / sum } else { 1.0 / weights.len() as f64 };
        for (row, pi) in row.iter_mut().zip(policy.row(state)) {
            *row += p * pi;
        }
    }
    row
}
