//! When an episode from one cell arrives: the exact distribution of the hitting time, step by step.

use super::chain::{Chain, Field};
use super::{Grid, Policy};

/// P(τ = t) for t = 0, 1, 2, … of one stationary policy from one cell; slip and walls included, no noise. It never
/// ends: take as many steps as are wanted.
pub struct Arrivals {
    chain: Chain,
    goal: usize,
    /// Probability of being at each cell before the step to come.
    now: Field,
    next: Field,
    is_under_way: bool,
}

impl Arrivals {
    pub fn new(grid: &Grid, policy: &Policy, start: usize) -> Arrivals {
        let chain = Chain::new(grid, policy);
        let mut now = chain.field();
        now.cells_mut()[start] = 1.0;
        Arrivals { goal: grid.goal(), next: chain.field(), now, chain, is_under_way: false }
    }
}

impl Iterator for Arrivals {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        if std::mem::replace(&mut self.is_under_way, true) {
            self.chain.forward(&self.now, &mut self.next);
            std::mem::swap(&mut self.now, &mut self.next);
        }
        Some(std::mem::take(&mut self.now.cells_mut()[self.goal]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::{GridSpec, Solver};
    use rand::{RngExt, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// A corridor of four cells with the goal at its left end, walked to the left with probability p and stood
    /// still in otherwise: from three cells away τ is negative binomial.
    #[test]
    fn a_corridor_by_hand() {
        let walls = (0..4).map(|col| (1, col)).collect();
        let grid = Grid::new(GridSpec { rows: 2, cols: 4, goal: (0, 0), walls, slip: 0.0 }).unwrap();
        let p = 0.75;
        let policy = Policy::from_rows(vec![[0.0, 0.0, p, 0.0, 1.0 - p]; 8]);
        let exact: Vec<f64> = Arrivals::new(&grid, &policy, 3).take(7).collect();
        let q: f64 = 1.0 - p;
        let by_hand = [0.0, 0.0, 0.0, 1.0, 3.0 * q, 6.0 * q * q, 10.0 * q * q * q].map(|paths| paths * p * p * p);
        exact.iter().zip(by_hand).for_each(|(exact, by_hand)| assert!((exact - by_hand).abs() < 1e-15));
    }

    /// A slip of one half: a policy that walks left goes there 6 times in 10, moves right once in 10.
    #[test]
    fn slip_is_included() {
        let walls = (0..3).map(|col| (1, col)).collect();
        let grid = Grid::new(GridSpec { rows: 2, cols: 3, goal: (0, 0), walls, slip: 0.5 }).unwrap();
        let left = Policy::from_rows(vec![[0.0, 0.0, 1.0, 0.0, 0.0]; 6]);
        let exact: Vec<f64> = Arrivals::new(&grid, &left, 1).take(4).collect();
        let by_hand = [0.0, 0.6, 0.3 * 0.6, 0.3 * 0.3 * 0.6 + 0.1 * 0.6 * 0.6];
        exact.iter().zip(by_hand).for_each(|(exact, by_hand)| assert!((exact - by_hand).abs() < 1e-15));
    }

    /// Over all starts: the return within T and the success that the solver finds backwards.
    #[test]
    fn it_agrees_with_the_returns_within_t() {
        let walls = vec![(1, 1), (1, 2), (3, 3)];
        let grid = Grid::new(GridSpec { rows: 5, cols: 4, goal: (0, 2), walls, slip: 0.15 }).unwrap();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let row = |_| {
            let weights: [f64; 5] = std::array::from_fn(|_| rng.random::<f64>());
            weights.map(|w| w / weights.iter().sum::<f64>())
        };
        let policy = Policy::from_rows((0..grid.cells()).map(row).collect());
        for horizon in [0, 1, 40] {
            let (mut steps, mut arrived) = (0.0, 0.0);
            for &start in grid.starts() {
                let exact: Vec<f64> = Arrivals::new(&grid, &policy, start as usize).take(horizon + 1).collect();
                let sum: f64 = exact.iter().sum();
                arrived += sum;
                steps += exact.iter().enumerate().map(|(t, p)| t as f64 * p).sum::<f64>();
                steps += horizon as f64 * (1.0 - sum);
            }
            let returns = Solver::new(&grid).evaluate(&policy, horizon as u32).returns;
            assert!((returns.horizon_return + steps / grid.free_cells() as f64).abs() < 1e-12);
            assert!((returns.success - arrived / grid.starts().len() as f64).abs() < 1e-12);
        }
    }
}
