//! The Markov chain that a stationary policy makes of a grid, step by step: where it is, and what is to come.
//!
//! A cell leads to its neighbours only. So a step of all cells at once is a sum of five products of whole rows, each
//! shifted by a fixed distance: no cell looks up where it leads, and a compiler takes several cells at a time. Around
//! the cells lies room for the shifts, always 0.

use super::{ACTIONS, Action, Grid, Policy};

/// A number for each cell, `[S]`, with room around for the largest shift.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    numbers: Vec<f64>,
    room: usize,
}

impl Field {
    fn zeros(cells: usize, room: usize) -> Field {
        Field { numbers: vec![0.0; cells + 2 * room], room }
    }

    /// The numbers, `[S]`.
    pub fn cells(&self) -> &[f64] {
        &self.numbers[self.room..self.numbers.len() - self.room]
    }

    pub fn cells_mut(&mut self) -> &mut [f64] {
        let end = self.numbers.len() - self.room;
        &mut self.numbers[self.room..end]
    }

    /// The number of the cell that lies at a distance from each, `[S]`.
    #[inline(always)]
    fn shifted(&self, distance: isize) -> &[f64] {
        let from = self.room.wrapping_add_signed(distance);
        &self.numbers[from..from + self.numbers.len() - 2 * self.room]
    }
}

/// A policy's chain until it arrives: the goal leads nowhere, and neither do walls.
pub struct Chain {
    /// For each action, the probability that it moves to its neighbour; what moves nowhere is with `Stay`.
    moves: [Field; ACTIONS],
    distances: [isize; ACTIONS],
    /// Whether an action moves, `[S][5]`.
    is_open: Vec<[bool; ACTIONS]>,
    starts: Vec<u32>,
    goal: usize,
}

impl Chain {
    /// What is less than this is taken to be 0: on the way to it numbers are denormal, and processors slow.
    const NOTHING: f64 = 1e-200;

    /// The chain of `policy`, slip included; no noise.
    pub fn new(grid: &Grid, policy: &Policy) -> Chain {
        let (cells, cols) = (grid.cells(), grid.cols());
        let distances = Action::ALL.map(|action| {
            let (down, right) = action.direction();
            down as isize * cols as isize + right as isize
        });
        let mut moves = [(); ACTIONS].map(|()| Field::zeros(cells, cols));
        let mut is_open = vec![[false; ACTIONS]; cells];
        for &state in grid.starts() {
            let state = state as usize;
            let executed = grid.executed(policy.row(state));
            for (action, (p, &to)) in executed.into_iter().zip(grid.next(state)).enumerate() {
                is_open[state][action] = to as usize != state;
                let action = if is_open[state][action] { action } else { Action::Stay as usize };
                moves[action].cells_mut()[state] += p;
            }
        }
        Chain { moves, distances, is_open, starts: grid.starts().to_vec(), goal: grid.goal() }
    }

    /// 0 at every cell.
    pub fn field(&self) -> Field {
        let Field { numbers, room } = &self.moves[0];
        Field::zeros(numbers.len() - 2 * room, *room)
    }

    /// Where an episode starts: each start alike.
    pub fn start(&self) -> Field {
        let mut field = self.field();
        for &state in &self.starts {
            field.cells_mut()[state as usize] = 1.0 / self.starts.len() as f64;
        }
        field
    }

    /// One step forwards: from the probability of being at each cell to that a step later. What arrives stands at the
    /// goal.
    pub fn forward(&self, now: &Field, next: &mut Field) {
        let next = next.cells_mut();
        let cells = next.len();
        // All of one length, that nothing has to be checked in the loop.
        let [p0, p1, p2, p3, p4] = [0, 1, 2, 3, 4].map(|a| &self.moves[a].shifted(-self.distances[a])[..cells]);
        let [x0, x1, x2, x3, x4] = self.distances.map(|distance| &now.shifted(-distance)[..cells]);
        for (i, next) in next.iter_mut().enumerate() {
            let sum = (p0[i] * x0[i] + p1[i] * x1[i]) + (p2[i] * x2[i] + p3[i] * x3[i]) + p4[i] * x4[i];
            *next = if sum < Self::NOTHING { 0.0 } else { sum };
        }
    }

    /// One step backwards: from what each cell is worth to what it is worth to be led on from each, plus
    /// `immediate`, `[S]`. The goal and walls keep theirs.
    pub fn backward(&self, ahead: &Field, immediate: &[f64], now: &mut Field) {
        let now = now.cells_mut();
        let cells = now.len();
        let [p0, p1, p2, p3, p4] = [0, 1, 2, 3, 4].map(|a| &self.moves[a].cells()[..cells]);
        let [x0, x1, x2, x3, x4] = self.distances.map(|distance| &ahead.shifted(distance)[..cells]);
        let immediate = &immediate[..cells];
        for i in 0..cells {
            let sum = (p0[i] * x0[i] + p1[i] * x1[i]) + (p2[i] * x2[i] + p3[i] * x3[i]) + p4[i] * x4[i] + immediate[i];
            now[i] = if sum.abs() < Self::NOTHING { 0.0 } else { sum };
        }
        now[self.goal] = ahead.cells()[self.goal];
    }
}

/// Where a policy spends its first T steps, from a uniformly drawn start.
#[derive(Clone, Debug, PartialEq)]
pub struct Occupancy {
    /// d(s), `[S]`: expected visits before step T; 0 at the goal and at walls.
    pub visits: Vec<f64>,
    /// m(s), `[S]`: probability that the episode is cut off by T at s.
    pub cut_off: Vec<f64>,
}

/// Exact occupancy of `policy` over `horizon` steps.
pub fn occupancy(grid: &Grid, policy: &Policy, horizon: u32) -> Occupancy {
    let chain = Chain::new(grid, policy);
    let mut visits = vec![0.0; grid.cells()];
    let (mut now, mut next) = (chain.start(), chain.field());
    for _ in 0..horizon {
        add(&mut visits, now.cells());
        chain.forward(&now, &mut next);
        next.cells_mut()[grid.goal()] = 0.0;
        std::mem::swap(&mut now, &mut next);
    }
    Occupancy { visits, cut_off: now.cells().to_vec() }
}

/// (horizon return, success) by T steps of dynamic programming: with f_t(s) = P(τ_s > t),
/// E[min(τ, T)] = Σ_{t<T} f_t and P(τ ≤ T) = 1 − f_T.
pub fn within_horizon(grid: &Grid, policy: &Policy, horizon: u32) -> (f64, f64) {
    let chain = Chain::new(grid, policy);
    let mut under_way = chain.field();
    for &state in grid.starts() {
        under_way.cells_mut()[state as usize] = 1.0;
    }
    let mut next = chain.field();
    let mut steps = vec![0.0; grid.cells()];
    let nothing = steps.clone();
    for _ in 0..horizon {
        add(&mut steps, under_way.cells());
        chain.backward(&under_way, &nothing, &mut next);
        std::mem::swap(&mut under_way, &mut next);
    }
    let lost: f64 = under_way.cells().iter().sum();
    // Sums of what leaves a cell may be larger than 1 by a last bit.
    let success = (1.0 - lost / grid.starts().len() as f64).max(0.0);
    (-steps.iter().sum::<f64>() / grid.free_cells() as f64, success)
}

fn add(sums: &mut [f64], more: &[f64]) {
    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum += more);
}

/// T steps of a policy, forwards times backwards; keeps its tables between calls, but for large ones.
#[derive(Clone, Default)]
pub struct Prospect {
    /// What is to come with k steps left, k = 0…T − 1.
    ahead: Vec<Field>,
    /// Expected visits within T steps, mean over starts, `[S]`.
    pub visits: Vec<f64>,
    /// For each action the executed a leads to, Σ_t P(s_t = s) · (what is to come T − t − 1 steps from where a leads),
    /// `[S][5]`.
    pub to_come: Vec<[f64; ACTIONS]>,
}

impl Prospect {
    /// Most numbers of a table that is kept: 8 MB.
    const MOST_KEPT: usize = 1_000_000;

    /// Looks `horizon` steps, 1 at least, ahead and back: each step from s brings `immediate[s]`, `[S]`, arrival `at_goal`.
    pub fn look(&mut self, chain: &Chain, horizon: u32, immediate: &[f64], at_goal: f64) {
        let horizon = horizon as usize;
        let cells = immediate.len();
        if self.ahead.len() != horizon || self.visits.len() != cells {
            self.ahead = vec![chain.field(); horizon];
        }
        // Backwards: what is to come. With no steps left, nothing is but what stands at the goal.
        self.ahead[0].cells_mut()[chain.goal] = at_goal;
        for k in 1..horizon {
            let (before, after) = self.ahead.split_at_mut(k);
            chain.backward(&before[k - 1], immediate, &mut after[0]);
        }
        // Forwards: where it is; times what is to come.
        self.visits = vec![0.0; cells];
        let mut sums = [(); ACTIONS].map(|()| vec![0.0; cells]);
        let (mut now, mut next) = (chain.start(), chain.field());
        for ahead in self.ahead.iter().rev() {
            let here = now.cells();
            add(&mut self.visits, here);
            for (sums, &distance) in sums.iter_mut().zip(&chain.distances) {
                for ((sum, here), ahead) in sums.iter_mut().zip(here).zip(ahead.shifted(distance)) {
                    *sum += here * ahead;
                }
            }
            chain.forward(&now, &mut next);
            next.cells_mut()[chain.goal] = 0.0;
            std::mem::swap(&mut now, &mut next);
        }
        // An action that does not move leads to where Stay does.
        let sum = |state: usize, action: usize| {
            sums[if chain.is_open[state][action] { action } else { Action::Stay as usize }][state]
        };
        self.to_come.clear();
        self.to_come.extend((0..cells).map(|state| std::array::from_fn(|action| sum(state, action))));
        if horizon * cells > Self::MOST_KEPT {
            self.ahead = Vec::new();
        }
    }
}
