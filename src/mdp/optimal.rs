//! The policy that reaches the goal soonest.

use super::{ACTIONS, Grid, HORIZON, Policy, Solver};

/// How close two actions must be, relative to the hitting time, to count as equally good: above the noise of
/// 1e−9 that hitting times carry, far below any real difference.
const TIE: f64 = 1e-7;

/// The policy of least hitting time, by policy iteration from the shortest paths; equally good actions
/// share their probability.
pub fn optimal_policy(grid: &Grid) -> Policy {
    let mut solver = Solver::new(grid);
    let distance: Vec<f64> = grid.distances().into_iter().map(f64::from).collect();
    let mut policy = greedy(grid, &distance);
    let mut cost = solver.evaluate(&policy, HORIZON).hitting_time;
    loop {
        policy = greedy(grid, &cost);
        let better = solver.evaluate(&policy, HORIZON).hitting_time;
        // The sum falls with every real improvement, so this ends.
        if better.iter().sum::<f64>() >= cost.iter().sum::<f64>() * (1.0 - TIE) {
            return policy;
        }
        cost = better;
    }
}

/// The policy that acts best one step ahead of `cost`.
fn greedy(grid: &Grid, cost: &[f64]) -> Policy {
    let row = |state: usize| {
        if grid.is_wall(state) || state == grid.goal() {
            return [1.0 / ACTIONS as f64; ACTIONS];
        }
        let ahead = grid.next(state).map(|next| cost[next as usize]);
        let best = ahead.into_iter().fold(f64::INFINITY, f64::min);
        let is_best = ahead.map(|cost| cost <= best + TIE * best.max(1.0));
        let share = 1.0 / is_best.iter().filter(|&&best| best).count() as f64;
        is_best.map(|best| if best { share } else { 0.0 })
    };
    Policy::from_rows((0..grid.cells()).map(row).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::GridSpec;

    #[test]
    fn the_paper_grid_returns_minus_nine() {
        let grid = Grid::new(GridSpec::default()).unwrap();
        let policy = optimal_policy(&grid);
        let value = Solver::new(&grid).evaluate(&policy, HORIZON);
        assert!((value.returns.capped_return + 9.0).abs() < 1e-6, "{:?}", value.returns);
        assert_eq!(value.returns.horizon_return, -9.0);
        assert_eq!(value.returns.success, 1.0);
        assert_eq!(policy.row(11), &[0.5, 0.0, 0.5, 0.0, 0.0]);
    }

    /// No single change of one action helps: Bellman's condition, where slip makes it matter.
    #[test]
    fn nothing_beats_it_one_step_ahead() {
        for slip in [0.0, 0.2, 0.9] {
            let walls = vec![(1, 1), (1, 2), (1, 3), (2, 3), (3, 3), (5, 0), (5, 1)];
            let grid = Grid::new(GridSpec { rows: 7, cols: 5, goal: (2, 2), walls, slip }).unwrap();
            let h = Solver::new(&grid).evaluate(&optimal_policy(&grid), HORIZON).hitting_time;
            for &state in grid.starts() {
                let next = grid.next(state as usize);
                let mean = next.iter().map(|&n| h[n as usize]).sum::<f64>() / 5.0;
                let best = next.iter().map(|&n| h[n as usize]).fold(f64::INFINITY, f64::min);
                let bellman = 1.0 + (1.0 - slip) * best + slip * mean;
                assert!((h[state as usize] - bellman).abs() < 1e-5 * bellman, "{state} {slip}");
            }
        }
    }
}
