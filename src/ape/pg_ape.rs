//! PG-APE: the paper's Algorithm 1, top to bottom.
//!
//! One update plays a batch of episodes with the ensemble (τ₁) and a batch with its clone (τ₂), and climbs
//!
//! J(θ) = E_{τ ~ π_c}[r(τ)] − β E_{τ ~ π_o}[r(τ)]                                   (paper, Eq. 3)
//!
//! once with Adam. Experts are tables of logits, `θ[c][s][a]`. As they are tables, the gradient needs nothing
//! of a batch but how often each (context, state, action) was taken and the sum of the returns that followed:
//! [`Tally`] is all that playing writes.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::adam::Adam;
use super::algorithm::{Algorithm, Experts};
use super::demonstrate::{ContextDraw, Demonstrator, Episode, action_draws};
use super::observer::{Memory, Observer};
use super::{BaselineKind, Config, Contexts, Ensemble, GradientKind, ReturnToGo};
use crate::mdp::{ACTIONS, Grid, Starts};

/// A batch of episodes as far as learning needs it, per (context, state, action).
#[derive(Clone)]
struct Tally {
    /// `[n][S][5]`: how often the action was taken.
    count: Vec<u32>,
    /// `[n][S][5]`: sum of the returns R(t) that followed.
    returns: Vec<f64>,
    episodes: u32,
    steps: u32,
}

impl Tally {
    fn new(entries: usize) -> Tally {
        Tally { count: vec![0; entries], returns: vec![0.0; entries], episodes: 0, steps: 0 }
    }

    fn clear(&mut self) {
        self.count.fill(0);
        self.returns.fill(0.0);
        (self.episodes, self.steps) = (0, 0);
    }

    /// Adds an episode's steps with the returns that followed them: `to_go(t)`, times a weight.
    fn add_episode(&mut self, entries: &[u32], to_go: impl Fn(usize) -> f64, weights: &[f64]) {
        for (t, (&entry, weight)) in entries.iter().zip(weights).enumerate() {
            self.count[entry as usize] += 1;
            self.returns[entry as usize] += weight * to_go(t);
        }
        self.episodes += 1;
        self.steps += entries.len() as u32;
    }

    /// Visits and returns of the pair (context, state) with this number, over its actions.
    fn pair(&self, pair: usize) -> (f64, f64) {
        let actions = pair * ACTIONS..(pair + 1) * ACTIONS;
        let count: u32 = self.count[actions.clone()].iter().sum();
        (f64::from(count), self.returns[actions].iter().sum())
    }
}

/// A gradient estimate of J's two terms with entropy left out, for checks against exact derivatives.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient {
    /// `[n][S][5]`: G₁ + G₂ in the order of the logits.
    pub logits: Vec<f64>,
    /// p(c|s) while τ₂ was played.
    pub contexts: Contexts,
}

/// A training run: the experts, their baselines, and all that an update needs.
#[derive(Clone)]
pub struct PgApe {
    experts: Experts,
    rng: Xoshiro256PlusPlus,
    observer: Box<dyn Observer>,
    /// φ. `joint`: Ṽ_c, `[n][S]`. `separate`: V_c, `[n][S]`, then V_o, `[S]`.
    values: Vec<f64>,
    values_adam: Adam,
    /// Return that follows a step when k steps are left, counted from that step: `[T + 1]`.
    to_go: Vec<f64>,
    /// What the return after step t counts: γᵗ for `from_start`, 1 for `from_step`: `[T]`.
    weights: Vec<f64>,
    /// r̃(s, a), `[S][5]`, where the clone's reward is not the experts'.
    adversary_reward: Option<Vec<[f64; ACTIONS]>>,
    ensemble_tally: Tally,
    clone_tally: Tally,
    episode: Episode,
}

impl PgApe {
    /// A run at its start: all policies uniform, all baselines 0. `config` must have been checked.
    pub fn new(grid: Grid, config: Config) -> PgApe {
        let (experts, cells, horizon) = (config.experts as usize, grid.cells(), config.horizon as usize);
        let pairs = experts * cells;
        let values = match config.baseline {
            BaselineKind::Joint => pairs,
            BaselineKind::Separate => pairs + cells,
        };
        let (mut to_go, mut weights) = (vec![0.0], Vec::new());
        let mut weight = 1.0;
        for step in 0..horizon {
            // The reward is −1 a step, so that a return depends only on how many steps are left.
            to_go.push(-1.0 + config.discount * to_go[step]);
            weights.push(weight);
            if config.return_to_go == ReturnToGo::FromStart {
                weight *= config.discount;
            }
        }
        PgApe {
            rng: Xoshiro256PlusPlus::seed_from_u64(u64::from(config.seed)),
            observer: config.observer.build(&grid, experts),
            values: vec![0.0; values],
            values_adam: Adam::new(values),
            to_go,
            weights,
            ensemble_tally: Tally::new(pairs * ACTIONS),
            clone_tally: Tally::new(pairs * ACTIONS),
            episode: Episode::default(),
            adversary_reward: config.adversary_reward.as_ref().map(|reward| reward.table(&grid)),
            experts: Experts::new(grid, config, vec![0.0; pairs * ACTIONS]),
        }
    }

    /// The gradient that the next update would take, without entropy bonus and without taking it. Every
    /// call plays new episodes, so that calls give independent estimates.
    pub fn estimate_gradient(&mut self) -> Gradient {
        let ensemble = self.experts.ensemble();
        self.play_ensemble(&ensemble);
        let contexts = self.observer.contexts(&self.experts.grid, &ensemble, self.experts.config.horizon);
        self.play_clone(&ensemble, &contexts);
        Gradient { logits: self.policy_gradient(&ensemble, &contexts), contexts }
    }

    /// Plays τ₁: an expert is drawn for an episode and acts for all of it.
    fn play_ensemble(&mut self, ensemble: &Ensemble) {
        self.ensemble_tally.clear();
        let demonstrator = Demonstrator::new(&self.experts.grid, ensemble, self.experts.config.horizon);
        while self.ensemble_tally.steps < self.experts.config.batch_steps {
            let context = demonstrator.play(&mut self.episode, &mut self.rng);
            let steps = self.episode.entries.len();
            self.ensemble_tally.add_episode(&self.episode.entries, |t| self.to_go[steps - t], &self.weights);
            self.observer.saw(context, &self.episode.states);
        }
    }

    /// Plays τ₂: the context is drawn anew at each state, then the action from that expert.
    fn play_clone(&mut self, ensemble: &Ensemble, contexts: &Contexts) {
        let draws = action_draws(ensemble);
        let cells = self.experts.grid.cells();
        let context_draws: Vec<ContextDraw> = (0..cells).map(|state| ContextDraw::new(contexts.row(state))).collect();
        let memory = self.observer.memory(ensemble);
        let mut remembered = Vec::new();
        let mut p = vec![0.0; ensemble.experts()];
        self.clone_tally.clear();
        let starts = Starts::new(&self.experts.grid);
        while self.clone_tally.steps < self.experts.config.batch_steps {
            let mut state = starts.start(&mut self.rng);
            self.episode.entries.clear();
            if let Some(memory) = &memory {
                remembered = memory.start();
            }
            while state != self.experts.grid.goal() && self.episode.entries.len() < self.experts.config.horizon as usize
            {
                // One draw of 64 bits: half for the context, half for the action.
                let bits = self.rng.next_u64();
                let context = match &memory {
                    None => context_draws[state].outcome((bits >> 32) as u32),
                    Some(memory) => {
                        memory.see(&mut remembered, state, &mut p);
                        ContextDraw::new(&p).outcome((bits >> 32) as u32)
                    }
                };
                let pair = context * cells + state;
                let action = draws[pair].outcome(bits as u32);
                if let Some(memory) = &memory {
                    memory.act(&mut remembered, state, action);
                }
                self.episode.entries.push((pair * ACTIONS + action) as u32);
                state = starts.step(state, action, &mut self.rng);
            }
            let entries = &self.episode.entries;
            match &self.adversary_reward {
                None => self.clone_tally.add_episode(entries, |t| self.to_go[entries.len() - t], &self.weights),
                Some(reward) => {
                    let mut to_go = vec![0.0; entries.len() + 1];
                    for (t, &entry) in entries.iter().enumerate().rev() {
                        let (pair, action) = (entry as usize / ACTIONS, entry as usize % ACTIONS);
                        to_go[t] = reward[pair % cells][action] + self.experts.config.discount * to_go[t + 1];
                    }
                    self.clone_tally.add_episode(entries, |t| to_go[t], &self.weights);
                }
            }
        }
    }

    /// G₁ + G₂ (paper, Eqs. 5–7).
    fn policy_gradient(&self, ensemble: &Ensemble, contexts: &Contexts) -> Vec<f64> {
        let (beta, cells) = (self.experts.config.beta, self.experts.grid.cells());
        let pairs = self.experts.config.experts as usize * cells;
        let mut gradient = vec![0.0; pairs * ACTIONS];
        let mut add = |pair: usize, score: [f64; ACTIONS]| {
            // Σ_a score(a) ∇ log π_c(a|s), for a softmax: score(b) − π(b) Σ_a score(a).
            let pi = ensemble.policies()[pair / cells].row(pair % cells);
            let sum: f64 = score.iter().sum();
            for b in 0..ACTIONS {
                gradient[pair * ACTIONS + b] += score[b] - pi[b] * sum;
            }
        };
        // Σ over a tally's entries of one (context, state): the returns, times `scale`, less a baseline.
        let advantages = |tally: &Tally, pair: usize, scale: f64, baseline: f64| -> [f64; ACTIONS] {
            std::array::from_fn(|action| {
                let entry = pair * ACTIONS + action;
                scale * tally.returns[entry] - baseline * f64::from(tally.count[entry])
            })
        };
        // G₁ = 1/N₁ Σ ∇ log π_c(a|s) Ã(t), Ã(t) = R(t) − Ṽ_c(s).
        let per_episode = 1.0 / f64::from(self.ensemble_tally.episodes);
        for pair in 0..pairs {
            add(pair, advantages(&self.ensemble_tally, pair, 1.0, self.values[pair]).map(|a| a * per_episode));
        }
        // G₂ = 1/N₂ Σ ∇ log π_o(a|s) Ã(t), Ã(t) = −βR(t) − Ṽ_o(s).
        let per_episode = 1.0 / f64::from(self.clone_tally.episodes);
        match self.experts.config.gradient {
            GradientKind::SampledContext => {
                for pair in 0..pairs {
                    let baseline = match self.experts.config.baseline {
                        BaselineKind::Joint => self.values[pair],
                        BaselineKind::Separate => -beta * self.values[pairs + pair % cells],
                    };
                    add(pair, advantages(&self.clone_tally, pair, -beta, baseline).map(|a| a * per_episode));
                }
            }
            GradientKind::Mixture => {
                for state in 0..cells {
                    let p = contexts.row(state);
                    // The score does not depend on the context drawn, so neither may the baseline.
                    let baseline = match self.experts.config.baseline {
                        BaselineKind::Joint => {
                            p.iter().enumerate().map(|(c, p)| p * self.values[c * cells + state]).sum()
                        }
                        BaselineKind::Separate => -beta * self.values[pairs + state],
                    };
                    let mut advantage = [0.0; ACTIONS];
                    let mut mixed = [0.0; ACTIONS];
                    for (c, p) in p.iter().enumerate() {
                        let drawn = advantages(&self.clone_tally, c * cells + state, -beta, baseline);
                        let pi = ensemble.policies()[c].row(state);
                        for action in 0..ACTIONS {
                            advantage[action] += drawn[action];
                            mixed[action] += p * pi[action];
                        }
                    }
                    for (c, p) in p.iter().enumerate() {
                        let pi = ensemble.policies()[c].row(state);
                        // Responsibility of expert c for the action: p(c|s) π_c(a|s) / π_o(a|s).
                        add(
                            c * cells + state,
                            std::array::from_fn(|action| {
                                let share = if mixed[action] > 0.0 { p * pi[action] / mixed[action] } else { 0.0 };
                                share * advantage[action] * per_episode
                            }),
                        );
                    }
                }
            }
        }
        gradient
    }

    /// −∇J(φ) (paper, Eq. 4): the way down the squared error of the baselines, per episode.
    fn value_gradient(&self) -> Vec<f64> {
        let Config { beta, value_weight, baseline, .. } = self.experts.config;
        let pairs = self.experts.config.experts as usize * self.experts.grid.cells();
        let mut gradient = vec![0.0; self.values.len()];
        for pair in 0..pairs {
            let mut fit = |tally: &Tally, index: usize, scale: f64| {
                let (count, returns) = tally.pair(pair);
                let error = scale * returns - count * self.values[index];
                gradient[index] += value_weight * error / f64::from(tally.episodes);
            };
            fit(&self.ensemble_tally, pair, 1.0);
            match baseline {
                BaselineKind::Joint => fit(&self.clone_tally, pair, -beta),
                // Fitted to R itself, so that β can change while it trains.
                BaselineKind::Separate => fit(&self.clone_tally, pairs + pair % self.experts.grid.cells(), 1.0),
            }
        }
        gradient
    }
}

impl Algorithm for PgApe {
    fn experts(&self) -> &Experts {
        &self.experts
    }

    fn experts_mut(&mut self) -> &mut Experts {
        &mut self.experts
    }

    fn contexts(&mut self) -> Contexts {
        let ensemble = self.experts.ensemble();
        self.observer.contexts(&self.experts.grid, &ensemble, self.experts.config.horizon)
    }

    fn memory(&self) -> Option<Box<dyn Memory>> {
        self.observer.memory(&self.experts.ensemble())
    }

    fn values(&self) -> &[f64] {
        &self.values
    }

    fn bytes(&self) -> usize {
        // Numbers with two moments of Adam each, and two tallies.
        3 * 8 * (self.experts.logits.len() + self.values.len())
            + 2 * 12 * self.experts.logits.len()
            + self.observer.bytes()
    }

    fn boxed(&self) -> Box<dyn Algorithm> {
        Box::new(self.clone())
    }

    /// One iteration of Algorithm 1.
    fn update(&mut self) -> f64 {
        let ensemble = self.experts.ensemble();
        // 2: generate trajectories τ₁ with π_c.
        self.play_ensemble(&ensemble);
        // 3: generate trajectories τ₂ with π_o.
        let contexts = self.observer.contexts(&self.experts.grid, &ensemble, self.experts.config.horizon);
        self.play_clone(&ensemble, &contexts);
        // 4: gradient update on the experts, θ ← θ + α_θ ∇J(θ).
        let gradient = self.policy_gradient(&ensemble, &contexts);
        let value_gradient = self.value_gradient();
        let share = |tally: &Tally, pair| tally.pair(pair).0 / f64::from(tally.steps);
        let visited = |pair| share(&self.ensemble_tally, pair) + share(&self.clone_tally, pair);
        self.experts.ascend(gradient, self.experts.config.entropy_weight(self.experts.updates), visited);
        // 5: update of the value function, φ ← φ − α_φ ∇J(φ).
        self.values_adam.ascend(&mut self.values, &value_gradient, self.experts.config.learning_rate);
        -f64::from(self.ensemble_tally.steps) / f64::from(self.ensemble_tally.episodes)
    }
}
