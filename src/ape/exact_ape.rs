//! Exact APE: the same objective as PG-APE, climbed by its exact gradient. Nothing is sampled.
//!
//! J(θ) = E_{τ ~ π_c}[r(τ)] − β E_{τ ~ π_o}[r(τ)]                                     (paper, Eq. 3)
//!
//! undiscounted, over T steps, from every start alike. The expected return of a policy over T steps is a sum
//! over paths that dynamic programming gives forwards (where it is at step t) and backwards (what is still to
//! come): their product is the derivative by each π(a|s). The clone mixes the experts by p(c|s), so that its
//! derivative flows to every expert; with `occupancy`, p(c|s) is itself made of the experts' visits, and that
//! part of the derivative is once more the return of a policy, for a reward of its own.

use std::sync::Arc;

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::algorithm::{Algorithm, Experts};
use super::observer::ObserverChoice;
use super::{Config, Contexts, Ensemble};
use crate::mdp::{ACTIONS, Chain, Grid, Policy, Prospect};

/// A training run by exact gradients.
pub struct ExactApe {
    experts: Experts,
    prospect: Prospect,
    /// r̃(s, a), `[S][5]`; −1 everywhere where the clone's reward is the experts'.
    clone_reward: Arc<[[f64; ACTIONS]]>,
}

impl ExactApe {
    /// Logits at the start lie within this of 0: all alike, the experts would have no reason to part.
    const SPREAD: f64 = 0.1;
    const PARTING_BETA: f64 = 0.6;
    /// Times the entropy bonus of the configuration: exact gradients have no noise of their own that explores.
    const EXPLORATION: f64 = 20.0;

    /// `config` must have been checked.
    pub fn new(grid: Grid, config: Config) -> ExactApe {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(u64::from(config.seed));
        let entries = config.experts as usize * grid.cells() * ACTIONS;
        let logits = (0..entries).map(|_| Self::SPREAD * (2.0 * rng.random::<f64>() - 1.0)).collect();
        let clone_reward = match &config.adversary_reward {
            Some(reward) => reward.table(&grid),
            None => vec![[-1.0; ACTIONS]; grid.cells()],
        };
        let clone_reward = clone_reward.into();
        ExactApe { prospect: Prospect::default(), clone_reward, experts: Experts::new(grid, config, logits) }
    }

    /// J of the experts as they are, its gradient by the logits `[n][S][5]`, the ensemble's part of J, and how
    /// often each cell is visited by each expert and by the clone: `[n + 1][S]`.
    pub fn gradient(&mut self) -> ExactGradient {
        self.gradient_of(&self.experts.ensemble())
    }

    /// The same, the experts being known.
    fn gradient_of(&mut self, ensemble: &Ensemble) -> ExactGradient {
        let task = (&*self.experts.grid, self.experts.config.horizon);
        let (n, cells) = (ensemble.experts(), self.experts.grid.cells());
        let beta = self.beta();
        let share = 1.0 / n as f64;
        let mut by_policy = vec![[0.0; ACTIONS]; n * cells];
        let mut visits = Vec::with_capacity((n + 1) * cells);
        let own_reward = vec![[-1.0; ACTIONS]; cells];
        let mut own = 0.0;
        for (policy, by_policy) in ensemble.policies().iter().zip(by_policy.chunks_mut(cells)) {
            own += share * differentiate(&mut self.prospect, task, policy, &own_reward, share, by_policy);
            visits.extend_from_slice(&self.prospect.visits);
        }
        let is_occupancy = self.experts.config.observer == ObserverChoice::OCCUPANCY;
        let contexts = if is_occupancy {
            Contexts::from_weights(cells, n, |state, c| visits[c * cells + state])
        } else {
            Contexts::equal(cells, n)
        };
        let clone = ensemble.cloned(&contexts);
        let mut by_clone = vec![[0.0; ACTIONS]; cells];
        let denied = differentiate(&mut self.prospect, task, &clone, &self.clone_reward, -beta, &mut by_clone);
        visits.extend_from_slice(&self.prospect.visits);
        for (pair, by_policy) in by_policy.iter_mut().enumerate() {
            let p = contexts.row(pair % cells)[pair / cells];
            for (sum, by_clone) in by_policy.iter_mut().zip(&by_clone[pair % cells]) {
                *sum += p * by_clone;
            }
        }
        if is_occupancy {
            // ∂J/∂d_c(s) = Σ_a ∂J/∂π_o(a|s) (π_c(a|s) − π_o(a|s)) / Σ_c d_c(s): what a visit is worth.
            for (c, policy) in ensemble.policies().iter().enumerate() {
                let worth = |state: usize| {
                    let all: f64 = (0..n).map(|c| visits[c * cells + state]).sum();
                    let change = |a: usize| by_clone[state][a] * (policy.row(state)[a] - clone.row(state)[a]);
                    if all > 0.0 { (0..ACTIONS).map(change).sum::<f64>() / all } else { 0.0 }
                };
                let worth: Vec<_> = (0..cells).map(|state| [worth(state); ACTIONS]).collect();
                differentiate(&mut self.prospect, task, policy, &worth, 1.0, &mut by_policy[c * cells..][..cells]);
            }
        }
        let mut logits = vec![0.0; self.experts.logits.len()];
        for (pair, logits) in logits.as_chunks_mut::<ACTIONS>().0.iter_mut().enumerate() {
            let pi = ensemble.policies()[pair / cells].row(pair % cells);
            let mean: f64 = pi.iter().zip(&by_policy[pair]).map(|(p, g)| p * g).sum();
            for b in 0..ACTIONS {
                logits[b] = pi[b] * (by_policy[pair][b] - mean);
            }
        }
        ExactGradient { objective: own - beta * denied, ensemble_return: own, logits, visits }
    }
}

/// J and its exact derivative.
pub struct ExactGradient {
    /// J, mean over the cells where episodes start.
    pub objective: f64,
    /// Its first term.
    pub ensemble_return: f64,
    /// ∂J/∂θ, `[n][S][5]`.
    pub logits: Vec<f64>,
    /// Expected visits by every expert, then by the clone, `[n + 1][S]`.
    visits: Vec<f64>,
}

impl Algorithm for ExactApe {
    fn experts(&self) -> &Experts {
        &self.experts
    }

    fn bytes(&self) -> usize {
        size_of::<ExactApe>() + self.experts.bytes()
    }

    fn boxed(&self) -> Box<dyn Algorithm> {
        let (experts, clone_reward) = (self.experts.clone(), self.clone_reward.clone());
        Box::new(ExactApe { prospect: Prospect::default(), experts, clone_reward })
    }

    fn experts_mut(&mut self) -> &mut Experts {
        &mut self.experts
    }

    fn contexts(&mut self) -> Contexts {
        self.experts.config.observer.contexts(
            &self.experts.grid,
            &self.experts.ensemble(),
            self.experts.config.horizon,
            0,
        )
    }

    /// β of the coming update. For a small β the experts that agree are a local optimum which gradients do not
    /// leave, while experts that were parted under a large β stay parted under a small one, at a better J. A
    /// very large one, from the start, makes an expert give up. So a run starts at `PARTING_BETA` and comes to
    /// its own β over its first half.
    fn beta(&self) -> f64 {
        let Config { beta, alpha, exact_updates, .. } = self.experts.config;
        if beta == 0.0 || alpha.is_some() {
            return beta;
        }
        let done = f64::from(self.experts.updates) / f64::from(exact_updates);
        beta + (Self::PARTING_BETA - beta) * (1.0 - 2.0 * done).max(0.0)
    }

    fn update(&mut self) -> f64 {
        let ensemble = self.experts.ensemble();
        let ExactGradient { logits, ensemble_return, visits, .. } = self.gradient_of(&ensemble);
        let (experts, clone) = visits.split_at(self.experts.config.experts as usize * self.experts.grid.cells());
        let (all, by_clone) = (experts.iter().sum::<f64>(), clone.iter().sum::<f64>());
        let n = f64::from(self.experts.config.experts);
        let visited =
            |context: usize, state: usize| experts[context * clone.len() + state] / all + clone[state] / by_clone / n;
        let weight = Self::EXPLORATION * self.experts.config.entropy_weight(self.experts.updates);
        self.experts.ascend(&ensemble, logits, weight, visited);
        ensemble_return
    }
}

/// Expected return of T steps of `policy` for a reward r(s, a), mean over starts; adds `scale` times its derivative by
/// π(a|s) to `by_policy`, `[S][5]`.
fn differentiate(
    prospect: &mut Prospect,
    task: (&Grid, u32),
    policy: &Policy,
    reward: &[[f64; ACTIONS]],
    scale: f64,
    by_policy: &mut [[f64; ACTIONS]],
) -> f64 {
    let (grid, horizon) = task;
    let mut immediate = vec![0.0; grid.cells()];
    for &state in grid.starts() {
        let state = state as usize;
        immediate[state] = policy.row(state).iter().zip(&reward[state]).map(|(p, reward)| p * reward).sum();
    }
    prospect.look(&Chain::new(grid, policy), horizon, &immediate, 0.0);
    let Prospect { visits, to_come, .. } = prospect;
    for &state in grid.starts() {
        let state = state as usize;
        for a in 0..ACTIONS {
            let worth = (1.0 - grid.slip()) * to_come[state][a] + visits[state] * reward[state][a];
            by_policy[state][a] += scale * worth;
        }
    }
    visits.iter().zip(&immediate).map(|(visits, immediate)| visits * immediate).sum()
}
