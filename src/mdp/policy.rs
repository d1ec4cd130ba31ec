//! A stationary policy: for every cell, the probability of each action.

use serde::{Deserialize, Serialize};

use super::{ACTIONS, Cell, Grid};

/// `π[s][a]`, one row for every cell of a grid. Rows of free cells sum to 1; rows of walls mean nothing.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Policy {
    rows: Vec<[f64; ACTIONS]>,
}

/// Why a table is not a policy.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PolicyError {
    #[error("the policy has {found} rows: expected {expected}, one for each cell")]
    Rows { found: usize, expected: usize },
    #[error("cell (row {}, column {}): probability {value:?} of action {action}: must be from 0 to 1", .cell.0, .cell.1)]
    Probability { cell: Cell, action: usize, value: f64 },
    #[error("cell (row {}, column {}): the probabilities sum to {sum:?}: must be 1 (to {})", .cell.0, .cell.1, Policy::TOLERANCE)]
    Sum { cell: Cell, sum: f64 },
}

impl Policy {
    /// How far a row's sum may be from 1; such a row is then divided by its sum.
    pub const TOLERANCE: f64 = 1e-5;

    /// Checks a table against a grid.
    pub fn new(grid: &Grid, mut rows: Vec<[f64; ACTIONS]>) -> Result<Policy, PolicyError> {
        if rows.len() != grid.cells() {
            return Err(PolicyError::Rows { found: rows.len(), expected: grid.cells() });
        }
        for (state, row) in rows.iter_mut().enumerate() {
            if grid.is_wall(state) {
                *row = [1.0 / ACTIONS as f64; ACTIONS];
                continue;
            }
            let cell = grid.cell(state);
            if let Some(action) = row.iter().position(|p| !(0.0..=1.0 + Self::TOLERANCE).contains(p)) {
                return Err(PolicyError::Probability { cell, action, value: row[action] });
            }
            let sum: f64 = row.iter().sum();
            if (sum - 1.0).abs() > Self::TOLERANCE {
                return Err(PolicyError::Sum { cell, sum });
            }
            // What is 1 but for the last bits stays as it is: a file reads back as it was written.
            if (sum - 1.0).abs() > 1e-12 {
                *row = row.map(|p| p / sum);
            }
        }
        Ok(Policy { rows })
    }

    /// A policy from rows that sum to 1 by construction, one for every cell of its grid.
    pub fn from_rows(rows: Vec<[f64; ACTIONS]>) -> Policy {
        Policy { rows }
    }

    pub fn rows(&self) -> &[[f64; ACTIONS]] {
        &self.rows
    }

    /// π(·|s).
    pub fn row(&self, state: usize) -> &[f64; ACTIONS] {
        &self.rows[state]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::GridSpec;

    #[test]
    fn a_bad_row_is_named_and_a_wall_row_is_ignored() {
        let grid = Grid::new(GridSpec { rows: 2, cols: 2, goal: (0, 0), walls: vec![(1, 1)], slip: 0.0 }).unwrap();
        let good = vec![[0.2; 5], [0.2; 5], [0.2; 5], [f64::NAN; 5]];
        assert!(Policy::new(&grid, good.clone()).is_ok());
        assert!(matches!(Policy::new(&grid, vec![[0.2; 5]; 3]), Err(PolicyError::Rows { found: 3, expected: 4 })));
        let with = |row| {
            let mut rows = good.clone();
            rows[1] = row;
            Policy::new(&grid, rows)
        };
        assert!(matches!(with([0.3; 5]), Err(PolicyError::Sum { cell: (0, 1), .. })));
        assert!(matches!(
            with([-0.2, 0.6, 0.2, 0.2, 0.2]),
            Err(PolicyError::Probability { cell: (0, 1), action: 0, .. })
        ));
        assert!(matches!(with([f64::NAN; 5]), Err(PolicyError::Probability { .. })));
        let rounded = with([0.333_333, 0.333_333, 0.333_333, 0.0, 0.0]).unwrap();
        assert!((rounded.row(1).iter().sum::<f64>() - 1.0).abs() < 1e-15);
    }
}
