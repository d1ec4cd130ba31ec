//! Playing a clone that remembers its episode, and what it returns with its confidence interval.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::{Progress, Target};
use crate::ape::observer::Memory;
use crate::mdp::{ACTIONS, ActionDraw, KnownReturns, Starts};

/// Episodes that a clone is tried in as a rule.
pub const TRIALS: usize = 10_000;

/// Where figures are wanted again and again, as along a curve.
pub const FEW_TRIALS: usize = 1000;
/// Standard errors to each side of a 95 % confidence interval.
const NORMAL_95: f64 = 1.96;

/// Plays the same number of episodes from every start, at least `trials` and two from each. Returns the mean steps within T from each cell, `[S]`,
/// and the returns; nothing when told to stop.
pub fn simulate(
    target: &Target,
    memory: &dyn Memory,
    trials: usize,
    progress: &mut Progress,
) -> Option<(Vec<f64>, KnownReturns)> {
    let Target { grid, ensemble, horizon, seed } = *target;
    let each = trials.div_ceil(grid.starts().len()).max(2);
    let starts = Starts::new(grid);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(u64::from(seed) << 32 | 0x5eed);
    let mut p = vec![0.0; ensemble.experts()];
    let mut by_cell = vec![0.0; grid.cells()];
    // Sums over starts of the mean and of the variance of the mean: of steps, and of success.
    let (mut steps, mut success) = ([0.0; 2], [0.0; 2]);
    for (done, &start) in grid.starts().iter().enumerate() {
        let (mut sum, mut squares, mut arrived) = (0.0, 0.0, 0.0);
        for episode in 0..each {
            let part = (done as f64 + episode as f64 / each as f64) / grid.starts().len() as f64;
            if episode.is_multiple_of(64) && !progress(part) {
                return None;
            }
            let mut state = start as usize;
            let mut remembered = memory.start();
            let mut t = 0;
            while state != grid.goal() && t < horizon {
                memory.see(&mut remembered, state, &mut p);
                let mut row = [0.0; ACTIONS];
                for (policy, p) in ensemble.policies().iter().zip(&p) {
                    for (row, pi) in row.iter_mut().zip(policy.row(state)) {
                        *row += p * pi;
                    }
                }
                let action = ActionDraw::new(&row).outcome(rng.next_u32());
                memory.act(&mut remembered, state, action);
                state = starts.step(state, action, &mut rng);
                t += 1;
            }
            sum += f64::from(t);
            squares += f64::from(t) * f64::from(t);
            arrived += f64::from(u8::from(state == grid.goal()));
        }
        let n = each as f64;
        let (mean, share) = (sum / n, arrived / n);
        by_cell[start as usize] = mean;
        steps[0] += mean;
        steps[1] += (squares / n - mean * mean).max(0.0) / (n - 1.0);
        success[0] += share;
        success[1] += share * (1.0 - share) / (n - 1.0);
    }
    let (all, free) = (grid.starts().len() as f64, grid.free_cells() as f64);
    let returns = KnownReturns {
        capped_return: None,
        uncapped_return: None,
        horizon_return: -steps[0] / free,
        success: success[0] / all,
        horizon_error: NORMAL_95 * steps[1].sqrt() / free,
        // Where all arrived or none did, the rule of three.
        success_error: (NORMAL_95 * success[1].sqrt() / all).max(3.0 / (each as f64 * all)),
    };
    Some((by_cell, returns))
}
