//! PG-APE: the paper's Algorithm 1, top to bottom.
//!
//! One update plays a batch of episodes with the ensemble (τ₁) and a batch with its clone (τ₂), and climbs
//!
//! J(θ) = E_{τ ~ π_c}[r(τ)] − β E_{τ ~ π_o}[r(τ)]                                   (paper, Eq. 3)
//!
//! once with Adam. Experts are tables of logits, `θ[c][s][a]`. As they are tables, the gradient needs nothing
//! of a batch but how often each (context, state, action) was taken and the sum of the returns that followed: a
//! [`Tally`].

use std::sync::Arc;

use rand_xoshiro::Xoshiro256PlusPlus;

use super::adam::Adam;
use super::algorithm::{Algorithm, Experts};
use super::batch::{Batch, ClonePlayer, Course, EnsemblePlayer, Luck, RememberingPlayer};
use super::observer::{Memory, Observer};
use super::tally::{Rewards, Tally};
use super::{AdversaryReward, BaselineKind, Config, Contexts, Ensemble, GradientKind, ReturnToGo};
use crate::mdp::{ACTIONS, Draw, Grid};

/// What one update plays. The next begins anew, so that a copy of it is empty.
#[derive(Default)]
struct Played {
    /// Made when first needed.
    course: Option<Course>,
    batch: Batch,
    ensemble_tally: Tally,
    clone_tally: Tally,
}

impl Clone for Played {
    fn clone(&self) -> Self {
        Played::default()
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
    luck: Luck<Xoshiro256PlusPlus>,
    observer: Box<dyn Observer>,
    /// φ. `joint`: Ṽ_c, `[n][S]`. `separate`: V_c, `[n][S]`, then V_o, `[S]`.
    values: Vec<f64>,
    values_adam: Adam,
    /// What the return after step t counts for `from_start`, γᵗ: `[T]`. For `from_step` all count the same.
    weights: Option<Arc<[f64]>>,
    /// r̃ by entry, `[S][n][5]`, where the clone's reward is not the experts'.
    adversary_reward: Option<Arc<[f64]>>,
    played: Played,
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
        let weight = |step| libm::pow(config.discount, step as f64);
        let weights = (config.return_to_go == ReturnToGo::FromStart).then(|| (0..horizon).map(weight).collect());
        let by_entry =
            |reward: &AdversaryReward| reward.table(&grid).iter().flat_map(|rewards| rewards.repeat(experts)).collect();
        PgApe {
            luck: Luck::new(config.seed),
            observer: config.observer.build(&grid, experts),
            values: vec![0.0; values],
            values_adam: Adam::new(values),
            weights,
            adversary_reward: config.adversary_reward.as_ref().map(by_entry),
            played: Played::default(),
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
        let Config { batch_steps, discount, observer, horizon, .. } = self.experts.config;
        let Experts { grid, .. } = &self.experts;
        let course = self.played.course.get_or_insert_with(|| Course::new(grid, ensemble.experts(), horizon));
        course.set(ensemble);
        self.played.batch.play(course, &EnsemblePlayer, batch_steps, &mut self.luck);
        let rewards = Rewards { discount, by_entry: None, weights: self.weights.as_deref() };
        self.played.ensemble_tally.count(self.experts.logits.len(), &self.played.batch, rewards);
        if observer.model().learns {
            self.show();
        }
    }

    /// Shows the observer the episodes of the batch.
    fn show(&mut self) {
        let experts = self.experts.config.experts as usize;
        let (mut context, mut states) = (0, Vec::new());
        for walk in self.played.batch.walks() {
            for step in walk {
                if step.time() == 0 && !states.is_empty() {
                    self.observer.saw(context, &states);
                    states.clear();
                }
                let pair = step.entry() / ACTIONS;
                context = pair % experts;
                states.push((pair / experts) as u32);
            }
            if !states.is_empty() {
                self.observer.saw(context, &states);
                states.clear();
            }
        }
    }

    /// Plays τ₂: the context is drawn anew at each state, then the action from that expert. The ensemble has played
    /// before.
    fn play_clone(&mut self, ensemble: &Ensemble, contexts: &Contexts) {
        let Config { batch_steps, discount, .. } = self.experts.config;
        let Played { course: Some(course), batch, clone_tally, .. } = &mut self.played else { return };
        match (self.observer.memory(ensemble), ensemble.experts()) {
            (Some(memory), n) => {
                let mut player = Remembering { memory: &*memory, remembered: Vec::new(), p: vec![0.0; n] };
                batch.play_remembering(course, &mut player, batch_steps, &mut self.luck);
            }
            (None, ..=2) => batch.play(course, &blind::<1>(contexts), batch_steps, &mut self.luck),
            (None, ..=4) => batch.play(course, &blind::<3>(contexts), batch_steps, &mut self.luck),
            (None, _) => batch.play(course, &blind::<MOST_ENDS>(contexts), batch_steps, &mut self.luck),
        }
        let rewards =
            Rewards { discount, by_entry: self.adversary_reward.as_deref(), weights: self.weights.as_deref() };
        clone_tally.count(self.experts.logits.len(), batch, rewards);
    }

    /// G₁ + G₂ (paper, Eqs. 5–7).
    fn policy_gradient(&self, ensemble: &Ensemble, contexts: &Contexts) -> Vec<f64> {
        let (beta, cells) = (self.experts.config.beta, self.experts.grid.cells());
        let experts = self.experts.config.experts as usize;
        let pairs = experts * cells;
        // ∂J/∂log π_c(a|s), `[n][S][5]`: Σ over a tally's entries of one (context, state), the returns, times `scale`,
        // less a baseline.
        let mut scores = vec![[0.0; ACTIONS]; pairs];
        let add = |score: &mut [f64; ACTIONS], tally: &[[f64; 2]; ACTIONS], scale: f64, baseline: f64| {
            for (score, [count, returns]) in score.iter_mut().zip(tally) {
                *score += scale * returns - baseline * count;
            }
        };
        // G₁ = 1/N₁ Σ ∇ log π_c(a|s) Ã(t), Ã(t) = R(t) − Ṽ_c(s).
        let scale = 1.0 / self.played.ensemble_tally.episodes;
        let tallies = self.played.ensemble_tally.by_pair();
        for (context, scores) in scores.chunks_mut(cells).enumerate() {
            let values = &self.values[context * cells..];
            for ((score, tallies), value) in scores.iter_mut().zip(tallies.chunks(experts)).zip(values) {
                add(score, &tallies[context], scale, scale * value);
            }
        }
        // G₂ = 1/N₂ Σ ∇ log π_o(a|s) Ã(t), Ã(t) = −βR(t) − Ṽ_o(s).
        let tallies = self.played.clone_tally.by_pair();
        let scale = 1.0 / self.played.clone_tally.episodes;
        let kind = self.experts.config.baseline;
        match self.experts.config.gradient {
            GradientKind::SampledContext => {
                for (context, scores) in scores.chunks_mut(cells).enumerate() {
                    let (values, factor) = match kind {
                        BaselineKind::Joint => (&self.values[context * cells..], 1.0),
                        BaselineKind::Separate => (&self.values[pairs..], -beta),
                    };
                    for ((score, tallies), value) in scores.iter_mut().zip(tallies.chunks(experts)).zip(values) {
                        add(score, &tallies[context], -beta * scale, scale * (factor * value));
                    }
                }
            }
            GradientKind::Mixture => {
                for state in 0..cells {
                    let p = contexts.row(state);
                    // The score does not depend on the context drawn, so neither may the baseline.
                    let baseline = match kind {
                        BaselineKind::Joint => {
                            p.iter().enumerate().map(|(c, p)| p * self.values[c * cells + state]).sum()
                        }
                        BaselineKind::Separate => -beta * self.values[pairs + state],
                    };
                    let mut advantage = [0.0; ACTIONS];
                    let mut mixed = [0.0; ACTIONS];
                    for (c, p) in p.iter().enumerate() {
                        add(&mut advantage, &tallies[state * experts + c], -beta * scale, scale * baseline);
                        mixed.iter_mut().zip(ensemble.policies()[c].row(state)).for_each(|(sum, pi)| *sum += p * pi);
                    }
                    for (c, p) in p.iter().enumerate() {
                        let pi = ensemble.policies()[c].row(state);
                        for (action, score) in scores[c * cells + state].iter_mut().enumerate() {
                            // Responsibility of expert c for the action: p(c|s) π_c(a|s) / π_o(a|s).
                            let share = if mixed[action] > 0.0 { p * pi[action] / mixed[action] } else { 0.0 };
                            *score += share * advantage[action];
                        }
                    }
                }
            }
        }
        // Σ_a score(a) ∇ log π_c(a|s), for a softmax: score(b) − π(b) Σ_a score(a).
        for (policy, scores) in ensemble.policies().iter().zip(scores.chunks_mut(cells)) {
            for (pi, score) in policy.rows().iter().zip(scores) {
                let sum: f64 = score.iter().sum();
                score.iter_mut().zip(pi).for_each(|(score, pi)| *score -= pi * sum);
            }
        }
        scores.into_flattened()
    }

    /// −∇J(φ) (paper, Eq. 4): the way down the squared error of the baselines, per episode.
    fn value_gradient(&self) -> Vec<f64> {
        let Config { beta, value_weight, baseline, .. } = self.experts.config;
        let (experts, cells) = (self.experts.config.experts as usize, self.experts.grid.cells());
        let pairs = experts * cells;
        let [by_ensemble, by_clone] = [&self.played.ensemble_tally, &self.played.clone_tally]
            .map(|tally| (&tally.pairs[..], value_weight / tally.episodes));
        let fit = |(tally, weight): (&[[f64; 2]], f64), pair: usize, scale: f64, value: f64| {
            let [count, returns] = tally[pair];
            weight * (scale * returns - count * value)
        };
        let mut gradient = vec![0.0; self.values.len()];
        for context in 0..experts {
            for state in 0..cells {
                let (pair, index) = (state * experts + context, context * cells + state);
                gradient[index] += fit(by_ensemble, pair, 1.0, self.values[index]);
                // A baseline of its own is fitted to R itself, so that β can change while it trains.
                let (index, scale) = match baseline {
                    BaselineKind::Joint => (index, -beta),
                    BaselineKind::Separate => (pairs + state, 1.0),
                };
                gradient[index] += fit(by_clone, pair, scale, self.values[index]);
            }
        }
        gradient
    }
}

const MOST_ENDS: usize = Config::MAX_EXPERTS as usize - 1;

/// The clone by p(c|s).
fn blind<const ENDS: usize>(contexts: &Contexts) -> ClonePlayer<ENDS> {
    let mut draws = vec![Draw::new(&[]); contexts.as_slice().len()];
    draws.iter_mut().step_by(contexts.row(0).len()).zip(contexts.rows()).for_each(|(draw, p)| *draw = Draw::new(p));
    ClonePlayer { contexts: draws }
}

/// The clone by p(c|τ).
struct Remembering<'a> {
    memory: &'a dyn Memory,
    remembered: Vec<f64>,
    /// `[n]`.
    p: Vec<f64>,
}

impl RememberingPlayer for Remembering<'_> {
    fn begin(&mut self) {
        self.remembered = self.memory.start();
    }

    fn context(&mut self, state: usize, bits: u32) -> usize {
        self.memory.see(&mut self.remembered, state, &mut self.p);
        Draw::<MOST_ENDS>::new(&self.p).outcome(bits)
    }

    fn acted(&mut self, state: usize, action: usize) {
        self.memory.act(&mut self.remembered, state, action);
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
        // What `joint` or `separate` has learned comes with two moments of Adam each.
        size_of::<PgApe>() + self.experts.bytes() + 3 * 8 * self.values.len() + self.observer.bytes()
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
        let experts = ensemble.experts();
        let [by_ensemble, by_clone] = [&self.played.ensemble_tally, &self.played.clone_tally];
        let visited = |context: usize, state: usize| {
            let share = |tally: &Tally| tally.pairs[state * experts + context][0] / tally.steps;
            share(by_ensemble) + share(by_clone)
        };
        self.experts.ascend(&ensemble, gradient, self.experts.config.entropy_weight(self.experts.updates), visited);
        // 5: update of the value function, φ ← φ − α_φ ∇J(φ).
        self.values_adam.ascend(&mut self.values, &value_gradient, self.experts.config.learning_rate);
        -self.played.ensemble_tally.steps / self.played.ensemble_tally.episodes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::GridSpec;

    /// A recording holds thousands of copies, and counts what each has for itself.
    #[test]
    fn copies_share_what_never_changes() {
        let config = Config {
            return_to_go: ReturnToGo::FromStart,
            horizon: 10_000,
            batch_steps: 1,
            adversary_reward: "9,9=-1 stay=0.5".parse().ok(),
            ..Config::default()
        };
        let run = PgApe::new(Grid::new(GridSpec::default()).unwrap(), config);
        let copy = run.clone();
        assert!(Arc::ptr_eq(&run.experts.grid, &copy.experts.grid));
        let are_shared = |of: fn(&PgApe) -> &Option<Arc<[f64]>>| {
            of(&run).as_ref().zip(of(&copy).as_ref()).is_some_and(|(a, b)| Arc::ptr_eq(a, b))
        };
        assert!(are_shared(|run| &run.weights) && are_shared(|run| &run.adversary_reward));
    }
}
