//! What training algorithms have in common, and [`Trainer`], a run by any of them.

use std::hash::Hasher;
use std::sync::Arc;

use super::adam::Adam;
use super::exact_ape::ExactApe;
use super::observer::Memory;
use super::pg_ape::PgApe;
use super::softmax::softmax;
use super::{AdversaryReward, AlgorithmKind, Config, ConfigError, Contexts, Digest, Ensemble};
use crate::mdp::{ACTIONS, Grid};

/// What every algorithm holds: the experts, where and how they train.
#[derive(Clone)]
pub struct Experts {
    /// What copies share: a recording holds thousands.
    pub grid: Arc<Grid>,
    pub config: Config,
    /// θ, `[n][S][5]`.
    pub logits: Vec<f64>,
    adam: Adam,
    /// Updates made so far.
    pub updates: u32,
}

impl Experts {
    /// `logits`: `[n][S][5]`.
    pub fn new(grid: Grid, config: Config, logits: Vec<f64>) -> Experts {
        Experts { adam: Adam::new(logits.len()), grid: Arc::new(grid), config, logits, updates: 0 }
    }

    /// About how many bytes a copy takes: r̃, and θ with two moments of Adam each.
    pub fn bytes(&self) -> usize {
        let reward = self.config.adversary_reward.as_ref().map_or(0, AdversaryReward::bytes);
        size_of::<Experts>() + reward + 3 * 8 * self.logits.len()
    }

    /// The experts as they are now.
    pub fn ensemble(&self) -> Ensemble {
        softmax(&self.logits, self.grid.cells())
    }

    /// θ ← θ + α_θ ∇J(θ), with the bonus on the entropy of the policies where they went: `visited` is the share of
    /// visits to a context and a state, `weight` that of the bonus. `ensemble`: the experts as they are now.
    pub fn ascend(
        &mut self,
        ensemble: &Ensemble,
        mut gradient: Vec<f64>,
        weight: f64,
        visited: impl Fn(usize, usize) -> f64,
    ) {
        if weight > 0.0 {
            add_entropy_bonus(&self.logits, ensemble, weight, visited, &mut gradient);
        }
        self.adam.ascend(&mut self.logits, &gradient, self.config.learning_rate);
        self.updates += 1;
    }
}

/// A training algorithm at work.
pub trait Algorithm: Send {
    fn experts(&self) -> &Experts;

    fn experts_mut(&mut self) -> &mut Experts;

    /// p(c|s) of the run's observer as it stands; of one with a memory, at the start of an episode.
    fn contexts(&mut self) -> Contexts;

    /// β of the coming update.
    fn beta(&self) -> f64 {
        self.experts().config.beta
    }

    /// What the run's observer makes of the clone's own episode, where it has a memory.
    fn memory(&self) -> Option<Box<dyn Memory>> {
        None
    }

    /// What is learned besides the logits.
    fn values(&self) -> &[f64] {
        &[]
    }

    /// About how many bytes a copy takes.
    fn bytes(&self) -> usize;

    /// A copy that goes on by itself.
    fn boxed(&self) -> Box<dyn Algorithm>;

    /// One update; returns the ensemble's return within T before it, mean over starts, as it was seen.
    fn update(&mut self) -> f64;
}

impl Clone for Box<dyn Algorithm> {
    fn clone(&self) -> Self {
        self.boxed()
    }
}

/// A training run. A copy of it goes on exactly as it would have.
#[derive(Clone)]
pub struct Trainer {
    algorithm: Box<dyn Algorithm>,
}

impl Trainer {
    /// A run at its start.
    pub fn new(grid: Grid, config: Config) -> Result<Trainer, ConfigError> {
        /// Least β at the start of a run under a constraint: experts that are never parted stay together.
        const PARTING_BETA: f64 = 0.6;
        config.check()?;
        config.check_on(&grid)?;
        let beta = if config.alpha.is_some() { config.beta.max(PARTING_BETA) } else { config.beta };
        let config = Config { beta, ..config };
        let algorithm: Box<dyn Algorithm> = match config.algorithm {
            AlgorithmKind::PgApe => Box::new(PgApe::new(grid, config)),
            AlgorithmKind::Exact => Box::new(ExactApe::new(grid, config)),
        };
        Ok(Trainer { algorithm })
    }

    pub fn grid(&self) -> &Grid {
        &self.algorithm.experts().grid
    }

    pub fn config(&self) -> &Config {
        &self.algorithm.experts().config
    }

    /// Updates made so far.
    pub fn updates(&self) -> u32 {
        self.algorithm.experts().updates
    }

    /// β for the updates to come.
    pub fn set_beta(&mut self, beta: f64) -> Result<(), ConfigError> {
        Config { beta, ..self.config().clone() }.check()?;
        self.algorithm.experts_mut().config.beta = beta;
        Ok(())
    }

    /// β of the coming update: where exact APE is still on its way to the one that is set, that of its place on the way.
    pub fn beta(&self) -> f64 {
        self.algorithm.beta()
    }

    /// The experts as they are now.
    pub fn ensemble(&self) -> Ensemble {
        self.algorithm.experts().ensemble()
    }

    /// p(c|s) of the run's observer as it stands; of one with a memory, at the start of an episode.
    pub fn contexts(&mut self) -> Contexts {
        self.algorithm.contexts()
    }

    /// What the run's observer makes of the clone's own episode, where it has a memory.
    pub fn memory(&self) -> Option<Box<dyn Memory>> {
        self.algorithm.memory()
    }

    /// About how many bytes a copy takes.
    pub fn bytes(&self) -> usize {
        self.algorithm.bytes()
    }

    pub fn digest(&self) -> Digest {
        let mut hash = fnv::FnvHasher::default();
        for parameter in self.algorithm.experts().logits.iter().chain(self.algorithm.values()) {
            hash.write(&parameter.to_bits().to_le_bytes());
        }
        Digest(hash.finish())
    }

    /// Makes the updates that are left of a run. `progress` hears what share is done and says whether to go on; the
    /// result is whether all were made.
    pub fn finish(&mut self, progress: &mut dyn FnMut(f64) -> bool) -> bool {
        let all = self.config().updates();
        while self.updates() < all {
            if self.updates().is_multiple_of(64) && !progress(f64::from(self.updates()) / f64::from(all)) {
                return false;
            }
            self.update();
        }
        true
    }

    /// One update of the experts; with `alpha`, one of β after it.
    pub fn update(&mut self) {
        /// Share of a run after which β begins to follow: the constraint means nothing to experts who are still
        /// learning to walk, and experts that were never parted by a large β do not part under a small one.
        const WARM_UP: f64 = 0.4;
        let ensemble_return = self.algorithm.update();
        let updates = f64::from(self.updates()) / f64::from(self.config().updates());
        if let Some(alpha) = self.config().alpha.filter(|_| updates > WARM_UP) {
            // Returns are told as means over all free cells, the goal included.
            let grid = self.grid();
            let found = ensemble_return * grid.starts().len() as f64 / grid.free_cells() as f64;
            let beta = dual_ascent(self.config().beta, found, alpha);
            self.algorithm.experts_mut().config.beta = beta;
        }
    }
}

/// Dual ascent for Eq. 2: the least return of the clone while that of the ensemble is at least α. With the multiplier 1/β on the constraint
/// the objective is Eq. 3 up to a factor; where the ensemble is better than it must be β may grow, where it is
/// worse β must shrink. The step is taken on log β, in units of |α|, so that β stays positive; a long one is cut, so
/// that the experts can follow.
fn dual_ascent(beta: f64, ensemble_return: f64, alpha: f64) -> f64 {
    const RATE: f64 = 0.5;
    const MOST: f64 = 0.05;
    const LEAST: f64 = 0.01;
    let step = (RATE * (ensemble_return - alpha) / alpha.abs()).clamp(-MOST, MOST);
    (beta * libm::exp(step)).clamp(LEAST, Config::MAX_BETA)
}

/// Adds `weight` times the gradient of the mean entropy of the policies where they went: `visited` is the share
/// of visits to a context and a state.
fn add_entropy_bonus(
    logits: &[f64],
    ensemble: &Ensemble,
    weight: f64,
    visited: impl Fn(usize, usize) -> f64,
    gradient: &mut [f64],
) {
    let experts = ensemble.policies().iter().enumerate();
    let places = experts.flat_map(|(context, policy)| policy.rows().iter().enumerate().map(move |row| (context, row)));
    let rows = logits.as_chunks::<ACTIONS>().0.iter().zip(gradient.as_chunks_mut::<ACTIONS>().0);
    for ((context, (state, pi)), (logits, gradient)) in places.zip(rows) {
        let weight = weight * visited(context, state);
        if weight == 0.0 {
            continue;
        }
        // −π(b) (log π(b) + H) with log π = θ − log Σ exp θ, where the last term drops out.
        let mean: f64 = pi.iter().zip(logits).map(|(p, logit)| p * logit).sum();
        for b in 0..ACTIONS {
            gradient[b] -= weight * pi[b] * (logits[b] - mean);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::GridSpec;

    /// Of both algorithms: shares that grow from 0 towards 1, and an end as soon as nobody wants more.
    #[test]
    fn progress_is_the_share_of_the_run_that_is_done() {
        for algorithm in [AlgorithmKind::PgApe, AlgorithmKind::Exact] {
            let config =
                Config { algorithm, batch_steps: 64, total_steps: 64 * 160, exact_updates: 160, ..Config::default() };
            let mut trainer = Trainer::new(Grid::new(GridSpec::default()).unwrap(), config).unwrap();
            let mut heard = Vec::new();
            assert!(!trainer.finish(&mut |done| {
                heard.push(done);
                heard.len() < 2
            }));
            assert_eq!((trainer.updates(), &heard), (64, &vec![0.0, 0.4]));
            assert!(trainer.finish(&mut |done| {
                heard.push(done);
                true
            }));
            assert_eq!((trainer.updates(), heard), (160, vec![0.0, 0.4, 0.4, 0.8]));
        }
    }

    /// A copy has at least its parameters and Adam's two moments of each.
    #[test]
    fn a_copy_takes_its_parameters_three_times() {
        for algorithm in [AlgorithmKind::PgApe, AlgorithmKind::Exact] {
            for experts in [2, 8] {
                let config = Config { algorithm, experts, ..Config::default() };
                let trainer = Trainer::new(Grid::new(GridSpec::default()).unwrap(), config).unwrap();
                let least = 3 * 8 * experts as usize * 100 * ACTIONS;
                assert!((least..least + 50_000).contains(&trainer.bytes()), "{algorithm:?}: {}", trainer.bytes());
            }
        }
    }
}
