//! The transition model of a gridworld, in the form of Gymnasium's toy-text environments: what other people's planners
//! and learners read.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::{ACTIONS, Action, Grid};

/// A way a step can go: its probability, the next state, the reward, and whether the episode ends there.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Transition(pub f64, pub usize, pub f64, pub bool);

/// P(s'|s, a) with rewards, the fields named as in Gymnasium's `FrozenLake-v1` (`env.unwrapped.P`, `nS`, `nA`).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TransitionModel {
    /// [`TransitionModel::FORMAT`].
    pub format: String,
    /// S, number of cells; state s is `row * cols + col`.
    #[serde(rename = "nS")]
    pub states: usize,
    #[serde(rename = "nA")]
    pub action_count: usize,
    /// Names of the actions, in order.
    pub actions: Vec<String>,
    /// Rows and columns.
    pub shape: [usize; 2],
    pub goal: usize,
    /// States that are walls: absorbing, and no other state leads there.
    pub walls: Vec<usize>,
    /// For every state and action the ways it can go: next states differ, probabilities sum to 1. The goal and walls
    /// lead to themselves at no cost.
    #[serde(rename = "P")]
    pub transitions: BTreeMap<usize, BTreeMap<usize, Vec<Transition>>>,
    /// Probability of each state as an episode's first, `[S]`.
    pub initial_state_distrib: Vec<f64>,
}

impl TransitionModel {
    pub const FORMAT: &'static str = "gymnasium-toy-text";
}

/// The model of a grid: reward −1 a step, terminated at the goal; no limit on the steps of an episode.
pub fn transition_model(grid: &Grid) -> TransitionModel {
    let absorbing = |state: usize| grid.is_wall(state) || state == grid.goal();
    let step = |state: usize, action: Action| {
        if absorbing(state) {
            return vec![Transition(1.0, state, 0.0, true)];
        }
        let next = grid.next(state);
        // Of the actions that a slip may execute, how many lead to each state.
        let mut slips = BTreeMap::<usize, f64>::new();
        next.iter().for_each(|&next| *slips.entry(next as usize).or_default() += 1.0);
        let meant = next[action as usize] as usize;
        let chance = |next: usize, slips: f64| {
            let slipped = grid.slip() * slips / ACTIONS as f64;
            if next == meant { 1.0 - grid.slip() + slipped } else { slipped }
        };
        let ways =
            slips.into_iter().map(|(next, slips)| Transition(chance(next, slips), next, -1.0, next == grid.goal()));
        ways.filter(|way| way.0 > 0.0).collect()
    };
    let of_state = |state: usize| Action::ALL.map(|action| (action as usize, step(state, action))).into();
    let mut initial_state_distrib = vec![0.0; grid.cells()];
    for &start in grid.starts() {
        initial_state_distrib[start as usize] = 1.0 / grid.starts().len() as f64;
    }
    TransitionModel {
        format: TransitionModel::FORMAT.to_owned(),
        states: grid.cells(),
        action_count: ACTIONS,
        actions: Action::ALL.map(|action| action.name().to_owned()).into(),
        shape: [grid.rows(), grid.cols()],
        goal: grid.goal(),
        walls: (0..grid.cells()).filter(|&state| grid.is_wall(state)).collect(),
        transitions: (0..grid.cells()).map(|state| (state, of_state(state))).collect(),
        initial_state_distrib,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::{GridSpec, HORIZON, Solver, optimal_policy};

    fn grid(slip: f64) -> Grid {
        let walls = vec![(1, 1), (1, 2), (1, 3), (2, 3), (3, 3), (5, 0), (5, 1)];
        Grid::new(GridSpec { rows: 7, cols: 5, goal: (2, 2), walls, slip }).unwrap()
    }

    #[test]
    fn rows_are_distributions_over_different_states_that_can_be_reached() {
        for slip in [0.0, 0.2, 0.9] {
            let grid = grid(slip);
            let model = transition_model(&grid);
            for (&state, ways) in
                model.transitions.iter().flat_map(|(s, actions)| actions.values().map(move |w| (s, w)))
            {
                let sum: f64 = ways.iter().map(|way| way.0).sum();
                assert!((sum - 1.0).abs() < 1e-15 && ways.iter().all(|way| way.0 > 0.0), "{state} {ways:?}");
                assert!(ways.windows(2).all(|pair| pair[0].1 < pair[1].1), "{state} {ways:?}");
                let is_absorbing = state == model.goal || model.walls.contains(&state);
                for &Transition(_, next, reward, terminated) in ways {
                    assert_eq!(
                        (reward, terminated),
                        if is_absorbing { (0.0, true) } else { (-1.0, next == model.goal) }
                    );
                    assert_eq!(is_absorbing, next == state && terminated);
                    assert!(is_absorbing || !model.walls.contains(&next));
                }
            }
            assert_eq!((model.transitions.len(), model.states, model.shape, model.walls.len()), (35, 35, [7, 5], 7));
            assert!((model.initial_state_distrib.iter().sum::<f64>() - 1.0).abs() < 1e-12);
            assert_eq!(model.initial_state_distrib.iter().filter(|p| **p > 0.0).count(), 27);
        }
        // Left of (0, 0) is the border, and so is above it.
        assert_eq!(
            transition_model(&grid(0.5)).transitions[&0][&2],
            [Transition(0.8, 0, -1.0, false), Transition(0.1, 1, -1.0, false), Transition(0.1, 5, -1.0, false)]
        );
    }

    /// A planner that knows only the model finds our optimal policy's hitting times, which come from elsewhere.
    #[test]
    fn value_iteration_on_it_finds_the_optimal_hitting_times() {
        for slip in [0.0, 0.2, 0.6] {
            let grid = grid(slip);
            let text = serde_json::to_string(&transition_model(&grid)).unwrap();
            let model: TransitionModel = serde_json::from_str(&text).unwrap();
            let mut values = vec![0.0; model.states];
            for _ in 0..3000 {
                let backup = |ways: &Vec<Transition>| -> f64 {
                    ways.iter().map(|way| way.0 * (way.2 + if way.3 { 0.0 } else { values[way.1] })).sum()
                };
                let best = |actions: &BTreeMap<usize, Vec<Transition>>| {
                    actions.values().map(backup).fold(f64::NEG_INFINITY, f64::max)
                };
                values = model.transitions.values().map(best).collect();
            }
            let steps = Solver::new(&grid).evaluate(&optimal_policy(&grid), HORIZON).hitting_time;
            for (state, (value, steps)) in values.iter().zip(&steps).enumerate() {
                assert!((value + steps).abs() < 1e-6 * steps.max(1.0), "{state} {slip}: {value} {steps}");
            }
        }
    }
}
