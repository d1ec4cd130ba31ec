//! What a stationary policy returns: four figures, all exact, none sampled.
//!
//! Hitting times solve (I − P)h = 1 over the free cells that are not the goal. P couples a cell to its
//! neighbours only, so with cells numbered along the shorter side the matrix is banded, and elimination
//! costs cells × width². The elimination is that of Grassmann, Taksar and Heyman (1985): the diagonal is
//! formed as the sum of what leaves a cell, so that nothing is ever subtracted and every hitting time comes
//! out to nearly full relative precision, also where it is 10⁹ steps.

use serde::{Deserialize, Serialize};

use super::chain::within_horizon;
use super::{ACTIONS, Grid, Policy};

/// Where hitting times are cut for [`Returns::capped_return`], in steps (paper, appendix).
pub const CAP: f64 = 100.0;

/// The paper's longest episode T, in steps.
pub const HORIZON: u32 = 100;

/// The noise that gives every cell a hitting time (paper, appendix): π̃ = (1 − 1e−9)π + 1e−9·uniform.
const NOISE: f64 = 1e-9;

/// Hitting times are cut here, in steps: a policy that walks away from the goal on a large grid comes back
/// after 10⁹ steps to the power of its distance, which is more than any number.
const LONGEST: f64 = 1e300;

/// The four returns of a stationary policy, in steps (negative) and probability. Means run over all free
/// cells, the goal included, except for `success`, which runs over the cells where episodes start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Returns {
    /// −mean min(h(s), 100), h the hitting time of π̃: the paper's figure.
    pub capped_return: f64,
    /// −mean h(s).
    pub uncapped_return: f64,
    /// −mean E[min(τ_s, T)]: what T steps really cost. No noise.
    pub horizon_return: f64,
    /// Mean probability of reaching the goal within T steps. No noise.
    pub success: f64,
}

/// One of the four returns: what menus, tables and files call it.
pub struct ReturnKind {
    /// As in files.
    pub name: &'static str,
    /// As on the page, in a word or two.
    pub label: &'static str,
    pub help: &'static str,
    /// In steps, or a probability.
    pub is_steps: bool,
    pub get: fn(&Returns) -> f64,
}

/// The four returns; the paper's figure first.
pub static RETURN_KINDS: [ReturnKind; 4] = [
    ReturnKind {
        name: "capped_return",
        label: "capped",
        help: "−mean min(h(s), 100): hitting times cut at 100 steps a cell, the paper's figure. A clone that gets \
               lost once in a hundred runs has a huge mean hitting time, so this can look far worse than it is.",
        is_steps: true,
        get: |returns| returns.capped_return,
    },
    ReturnKind {
        name: "uncapped_return",
        label: "uncapped",
        help: "−mean h(s): hitting times as they are.",
        is_steps: true,
        get: |returns| returns.uncapped_return,
    },
    ReturnKind {
        name: "horizon_return",
        label: "within T",
        help: "−mean E[min(τ, T)]: what an episode of at most T steps really costs.",
        is_steps: true,
        get: |returns| returns.horizon_return,
    },
    ReturnKind {
        name: "success",
        label: "success",
        help: "Probability of reaching the goal within T steps, mean over starts.",
        is_steps: false,
        get: |returns| returns.success,
    },
];

impl Returns {
    /// The mean of several policies' returns, as for an ensemble.
    pub fn mean(of: &[Returns]) -> Returns {
        let mean = |figure: fn(&Returns) -> f64| of.iter().map(figure).sum::<f64>() / of.len() as f64;
        Returns {
            capped_return: mean(|r| r.capped_return),
            uncapped_return: mean(|r| r.uncapped_return),
            horizon_return: mean(|r| r.horizon_return),
            success: mean(|r| r.success),
        }
    }
}

/// Returns as far as they are known. A clone with a memory has no stationary policy, and so no hitting times to
/// cap; what it returns within T may be simulated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct KnownReturns {
    pub capped_return: Option<f64>,
    pub uncapped_return: Option<f64>,
    pub horizon_return: f64,
    pub success: f64,
    /// Half the width of the 95 % confidence interval of `horizon_return`; 0 where it is exact.
    pub horizon_error: f64,
    /// The same of `success`.
    pub success_error: f64,
}

impl From<Returns> for KnownReturns {
    fn from(returns: Returns) -> KnownReturns {
        KnownReturns {
            capped_return: Some(returns.capped_return),
            uncapped_return: Some(returns.uncapped_return),
            horizon_return: returns.horizon_return,
            success: returns.success,
            horizon_error: 0.0,
            success_error: 0.0,
        }
    }
}

impl KnownReturns {
    /// Whether these can be the returns of a policy, with a T of `horizon` steps; a sentence says which is not.
    pub fn check(&self, horizon: u32) -> Result<(), String> {
        // Means may be off by a last bit.
        const BIT: f64 = 1e-9;
        let steps = -LONGEST * (1.0 + BIT)..=BIT;
        let (most, within_t) = (f64::from(horizon), format!("-{horizon} to 0"));
        let within = -most * (1.0 + BIT)..=BIT;
        let figures = [
            ("capped_return", self.capped_return, -CAP - BIT..=BIT, "-100 to 0"),
            ("uncapped_return", self.uncapped_return, steps, "-1e300 to 0"),
            ("horizon_return", Some(self.horizon_return), within, &within_t),
            ("success", Some(self.success), -BIT..=1.0 + BIT, "0 to 1"),
            ("horizon_error", Some(self.horizon_error), 0.0..=most, &format!("0 to {horizon}")),
            // Of few trials none of which failed, 3 divided by their number.
            ("success_error", Some(self.success_error), 0.0..=3.0, "0 to 3"),
        ];
        for (name, value, range, expected) in figures {
            if let Some(value) = value.filter(|value| !range.contains(value)) {
                return Err(format!("{name} {value:?}: expected a number from {expected}"));
            }
        }
        Ok(())
    }

    /// The return of this place in [`RETURN_KINDS`], where it is known.
    pub fn get(&self, kind: usize) -> Option<f64> {
        [self.capped_return, self.uncapped_return, Some(self.horizon_return), Some(self.success)][kind]
    }
}

/// Hitting times and returns of one policy.
#[derive(Clone, Debug, PartialEq)]
pub struct Value {
    /// h(s) in steps, `[S]`, uncapped; 0 at the goal and at walls.
    pub hitting_time: Vec<f64>,
    pub returns: Returns,
}

impl Value {
    /// Mean hitting time over the cells where episodes start: the expected steps of an uncut episode.
    pub fn mean_steps(&self, grid: &Grid) -> f64 {
        let steps: f64 = grid.starts().iter().map(|&s| self.hitting_time[s as usize]).sum();
        steps / grid.starts().len() as f64
    }
}

/// Evaluates policies on one grid; keeps the band matrix between calls.
pub struct Solver<'g> {
    grid: &'g Grid,
    /// Cells along the shorter side: the matrix's half-bandwidth.
    width: usize,
    /// State of each position in elimination order.
    order: Vec<usize>,
    /// Position of each state.
    position: Vec<usize>,
    /// `[S][2 width + 1]`: probability of moving from position i to position i + j − width.
    band: Vec<f64>,
    /// `[S]`: probability of moving to the goal.
    to_goal: Vec<f64>,
}

impl<'g> Solver<'g> {
    pub fn new(grid: &'g Grid) -> Self {
        let (rows, cols) = (grid.rows(), grid.cols());
        let order: Vec<usize> = if cols <= rows {
            (0..rows * cols).collect()
        } else {
            (0..rows * cols).map(|i| (i % rows) * cols + i / rows).collect()
        };
        let mut position = vec![0; order.len()];
        for (i, &state) in order.iter().enumerate() {
            position[state] = i;
        }
        let width = rows.min(cols);
        let band = vec![0.0; order.len() * (2 * width + 1)];
        Solver { grid, width, to_goal: vec![0.0; order.len()], order, position, band }
    }

    /// Exact hitting times and returns of `policy`; `horizon` is T.
    pub fn evaluate(&mut self, policy: &Policy, horizon: u32) -> Value {
        let hitting_time = self.hitting_times(policy);
        let (horizon_return, success) = within_horizon(self.grid, policy, horizon);
        let returns = Returns {
            capped_return: self.capped_return(&hitting_time),
            uncapped_return: -self.mean(&hitting_time, |h| h),
            horizon_return,
            success,
        };
        Value { hitting_time, returns }
    }

    /// −mean min(h(s), 100) of hitting times `[S]`.
    pub fn capped_return(&self, hitting_time: &[f64]) -> f64 {
        -self.mean(hitting_time, |h| h.min(CAP))
    }

    /// Over the free cells, the goal included.
    fn mean(&self, hitting_time: &[f64], of: impl Fn(f64) -> f64) -> f64 {
        let sum: f64 = self.grid.starts().iter().map(|&s| of(hitting_time[s as usize])).sum();
        sum / self.grid.free_cells() as f64
    }

    /// h(s) of π̃, `[S]`.
    fn hitting_times(&mut self, policy: &Policy) -> Vec<f64> {
        let (width, stride) = (self.width, 2 * self.width + 1);
        self.band.fill(0.0);
        self.to_goal.fill(0.0);
        for &state in self.grid.starts() {
            let state = state as usize;
            let i = self.position[state];
            let noisy = policy.row(state).map(|p| (1.0 - NOISE) * p + NOISE / ACTIONS as f64);
            for (p, &next) in self.grid.executed(&noisy).iter().zip(self.grid.next(state)) {
                let next = next as usize;
                if next == self.grid.goal() {
                    self.to_goal[i] += p;
                } else {
                    // Staying (next = state) lands on the diagonal, which elimination does not read.
                    self.band[i * stride + self.position[next] + width - i] += p;
                }
            }
        }
        let cells = self.order.len();
        let mut steps = vec![1.0; cells];
        let mut leaves = vec![1.0; cells];
        for k in 0..cells {
            let (above, below) = self.band.split_at_mut((k + 1) * stride);
            let pivot = &above[k * stride + width + 1..];
            // What never leaves but by many noisy steps in a row may leave with a probability below any number.
            leaves[k] = (pivot.iter().sum::<f64>() + self.to_goal[k]).max(f64::MIN_POSITIVE);
            for i in k + 1..cells.min(k + width + 1) {
                let row = &mut below[(i - k - 1) * stride..(i - k) * stride];
                let from = k + width - i;
                if row[from] == 0.0 {
                    continue;
                }
                let factor = row[from] / leaves[k];
                for (entry, p) in row[from + 1..=from + width].iter_mut().zip(pivot) {
                    *entry += factor * p;
                }
                self.to_goal[i] += factor * self.to_goal[k];
                steps[i] = (steps[i] + factor * steps[k]).min(LONGEST);
            }
        }
        // The goal and walls are cut out: nothing leads to them in the band, and they take no steps.
        let mut solution = vec![0.0; cells + width];
        for k in (0..cells).rev() {
            let ahead = &self.band[k * stride + width + 1..(k + 1) * stride];
            let sum: f64 = ahead.iter().zip(&solution[k + 1..]).map(|(p, h)| p * h).sum();
            let state = self.order[k];
            let is_start = state != self.grid.goal() && !self.grid.is_wall(state);
            solution[k] = if is_start { ((steps[k] + sum) / leaves[k]).min(LONGEST) } else { 0.0 };
        }
        (0..cells).map(|state| solution[self.position[state]]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::{GridSpec, occupancy};
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    fn random_policy(grid: &Grid, rng: &mut Xoshiro256PlusPlus) -> Policy {
        let row = |rng: &mut Xoshiro256PlusPlus| {
            let weights: [f64; ACTIONS] = std::array::from_fn(|_| rng.random::<f64>());
            weights.map(|w| w / weights.iter().sum::<f64>())
        };
        Policy::from_rows((0..grid.cells()).map(|_| row(rng)).collect())
    }

    /// The band solver against (I − P)h = 1 itself, wide, tall, walled and slippery grids alike.
    #[test]
    fn hitting_times_satisfy_their_equation() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
        for (rows, cols, goal, walls, slip) in [
            (10, 10, (0, 0), vec![], 0.0),
            (3, 17, (2, 5), vec![(0, 3), (1, 3)], 0.1),
            (17, 3, (9, 1), vec![(0, 2)], 0.3),
            (2, 2, (1, 1), vec![(0, 0)], 0.0),
        ] {
            let grid = Grid::new(GridSpec { rows, cols, goal, walls, slip }).unwrap();
            let policy = random_policy(&grid, &mut rng);
            let h = Solver::new(&grid).evaluate(&policy, HORIZON).hitting_time;
            for &state in grid.starts() {
                let state = state as usize;
                let noisy = policy.row(state).map(|p| (1.0 - NOISE) * p + NOISE / 5.0);
                let ahead: f64 =
                    grid.executed(&noisy).iter().zip(grid.next(state)).map(|(p, &n)| p * h[n as usize]).sum();
                assert!((h[state] - 1.0 - ahead).abs() < 1e-9 * h[state], "{state}: {} {}", h[state], 1.0 + ahead);
            }
        }
    }

    /// A policy that never moves: only the noise brings it home, after about 5e9 steps a cell.
    #[test]
    fn a_policy_that_stays_has_a_finite_huge_hitting_time() {
        let grid = Grid::new(GridSpec { rows: 2, cols: 2, goal: (0, 0), walls: vec![(1, 1)], slip: 0.0 }).unwrap();
        let stay = Policy::from_rows(vec![[0.0, 0.0, 0.0, 0.0, 1.0]; 4]);
        let value = Solver::new(&grid).evaluate(&stay, HORIZON);
        assert!((value.hitting_time[1] * NOISE / 5.0 - 1.0).abs() < 1e-12);
        assert!((value.returns.capped_return + 200.0 / 3.0).abs() < 1e-12);
        assert_eq!((value.returns.horizon_return, value.returns.success), (-200.0 / 3.0, 0.0));
    }

    /// Walking away from the goal on the largest grid: hitting times beyond all numbers, and still figures.
    #[test]
    fn hitting_times_too_long_for_a_number_are_cut() {
        let grid = Grid::new(GridSpec { rows: 32, cols: 32, ..GridSpec::default() }).unwrap();
        let row =
            |state: usize| if grid.cell(state).0 < 31 { [0.0, 1.0, 0.0, 0.0, 0.0] } else { [0.0, 0.0, 0.0, 1.0, 0.0] };
        let away = Policy::from_rows((0..grid.cells()).map(row).collect());
        let value = Solver::new(&grid).evaluate(&away, HORIZON);
        assert!(value.hitting_time.iter().all(|h| h.is_finite()));
        assert!(value.returns.uncapped_return <= -1e290 && value.returns.uncapped_return.is_finite());
        assert_eq!(value.returns.capped_return, -100.0 * 1023.0 / 1024.0);
    }

    /// Occupancy and the horizon return count the same steps from two sides.
    #[test]
    fn visits_add_up_to_the_horizon_return() {
        let grid = Grid::new(GridSpec { walls: vec![(4, 4), (4, 5)], slip: 0.05, ..GridSpec::default() }).unwrap();
        let policy = random_policy(&grid, &mut Xoshiro256PlusPlus::seed_from_u64(2));
        let returns = Solver::new(&grid).evaluate(&policy, HORIZON).returns;
        let occupancy = occupancy(&grid, &policy, HORIZON);
        let steps = occupancy.visits.iter().sum::<f64>() * grid.starts().len() as f64 / grid.free_cells() as f64;
        assert!((steps + returns.horizon_return).abs() < 1e-10);
        assert!((occupancy.cut_off.iter().sum::<f64>() - (1.0 - returns.success)).abs() < 1e-12);
    }
}
