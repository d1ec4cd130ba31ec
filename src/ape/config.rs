//! Every knob of PG-APE, with the paper's value and unit.

use serde::{Deserialize, Serialize};

use super::fields::{ConfigError, FIELDS};
use super::observer::ObserverChoice;
use super::{AdversaryReward, reward};
use crate::mdp::Grid;

/// How J is climbed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AlgorithmKind {
    /// The paper's Algorithm 1: policy gradient from sampled episodes.
    PgApe,
    /// Exact gradients of J over T steps, nothing sampled. Ours.
    Exact,
}

/// How the clone's trajectories push the experts (paper, appendix "Estimating ∇ log π_o").
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GradientKind {
    /// ∇ log π_c(a|s) of the context that was drawn with the action. The paper's choice.
    SampledContext,
    /// ∇ log Σ_c p(c|s) π_c(a|s): every expert by its responsibility for the action.
    Mixture,
}

/// What the advantage is measured against.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BaselineKind {
    /// One table Ṽ_c(s), fitted to R on τ₁ and to −βR on τ₂ (the paper's loss for φ).
    Joint,
    /// A table for the experts and one for the clone: less variance.
    Separate,
}

/// The return that follows a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ReturnToGo {
    /// R(t) = Σ_{t' ≥ t} γ^{t' − t} r.
    FromStep,
    /// R(t) = Σ_{t' ≥ t} γ^{t'} r: the exact gradient of the discounted return (paper, section 2.2).
    FromStart,
}

/// The configuration of a training run. Fields left out of a file take the default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// n, number of experts, 1..=8 (paper: 2).
    pub experts: u32,
    /// β, weight of the clone's return in the objective, 0..=2 (paper: 0.6).
    pub beta: f64,
    /// How J is climbed (paper: `pg_ape`).
    pub algorithm: AlgorithmKind,
    /// Who the clone is thought to be: `p(c|s)` (paper: `replay(60)`).
    pub observer: ObserverChoice,
    /// Estimator of the clone's gradient (paper: `sampled_context`).
    pub gradient: GradientKind,
    /// Adam's step size, of policies and baselines alike (paper: 0.05).
    pub learning_rate: f64,
    /// Weight of the baseline's loss (paper: 0.5).
    pub value_weight: f64,
    /// What the advantage is measured against (paper: `joint`).
    pub baseline: BaselineKind,
    /// Weight of the entropy bonus at the first update, falling linearly (paper: 0.5).
    pub entropy_start: f64,
    /// Weight of the entropy bonus at the last update (paper: 0.005).
    pub entropy_end: f64,
    /// γ, 0..=1 (paper: 0.99).
    pub discount: f64,
    /// Whether discounting counts from the step or from the start of the episode (paper: both are written).
    pub return_to_go: ReturnToGo,
    /// T, longest episode in steps (paper: 100).
    pub horizon: u32,
    /// Whole episodes are played until at least this many steps, for τ₁ and again for τ₂ (paper: 4096).
    pub batch_steps: u32,
    /// Steps of τ₁ in a whole run; divided by `batch_steps` it gives the updates (paper: 3,000,000).
    pub total_steps: u32,
    /// Updates in a whole run of exact APE, which has no steps to count (paper: none).
    pub exact_updates: u32,
    /// r̃, what the clone is to be denied instead of the experts' reward (paper: none).
    #[serde(deserialize_with = "reward::or_none")]
    pub adversary_reward: Option<AdversaryReward>,
    /// α of Eq. 2, as a return within T: β then follows so that the ensemble's return stays at least this
    /// (paper: none).
    pub alpha: Option<f64>,
    /// Everything random comes from it.
    pub seed: u32,
}

impl Default for Config {
    fn default() -> Self {
        Config {
            experts: 2,
            beta: 0.6,
            algorithm: AlgorithmKind::PgApe,
            observer: ObserverChoice::UNIFORM,
            gradient: GradientKind::SampledContext,
            learning_rate: 0.05,
            value_weight: 0.5,
            baseline: BaselineKind::Separate,
            entropy_start: 0.5,
            entropy_end: 0.005,
            discount: 0.99,
            return_to_go: ReturnToGo::FromStep,
            horizon: 100,
            batch_steps: 4096,
            total_steps: 3_000_000,
            exact_updates: 1500,
            adversary_reward: None,
            alpha: None,
            seed: 1,
        }
    }
}

impl Config {
    /// Most experts an ensemble may have.
    pub const MAX_EXPERTS: u32 = 8;
    pub const MAX_BETA: f64 = 2.0;
    /// Longest T, in steps.
    pub const MAX_HORIZON: u32 = 10_000;
    /// Most updates of a run.
    pub const MOST_UPDATES: u32 = 10_000_000;

    /// The paper's literal configuration where it differs from our default (see docs/METHOD.md).
    pub fn paper() -> Config {
        Config { observer: ObserverChoice::PAPER, baseline: BaselineKind::Joint, ..Config::default() }
    }

    /// Number of updates of a whole run (paper: 732).
    pub fn updates(&self) -> u32 {
        match self.algorithm {
            AlgorithmKind::PgApe => (self.total_steps / self.batch_steps).max(1),
            AlgorithmKind::Exact => self.exact_updates,
        }
    }

    /// Weight of the entropy bonus after so many updates: linear from start to end, then as at the end.
    pub fn entropy_weight(&self, updates: u32) -> f64 {
        let last = (self.updates() - 1).max(1);
        self.entropy_start + (self.entropy_end - self.entropy_start) * f64::from(updates.min(last)) / f64::from(last)
    }

    /// Checks every range, and that the fields go together.
    pub fn check(&self) -> Result<(), ConfigError> {
        FIELDS.iter().try_for_each(|field| field.check(self))?;
        if self.updates() > Self::MOST_UPDATES {
            return Err(ConfigError {
                field: "total_steps",
                value: self.total_steps.to_string(),
                expected: format!("at most {} times batch_steps, which is {}", Self::MOST_UPDATES, self.batch_steps),
            });
        }
        // The dense layer behind the units takes about as long as eight of them.
        const GRU_DENSE: u64 = 8;
        const MOST_GRU_HORIZON: u64 = 8_000;
        const MOST_GRU_BATCH: u64 = 500_000;
        let observer = |expected: &str| {
            Err(ConfigError { field: "observer", value: self.observer.to_string(), expected: expected.to_owned() })
        };
        let has_formula = [ObserverChoice::UNIFORM, ObserverChoice::OCCUPANCY].contains(&self.observer);
        if self.algorithm == AlgorithmKind::Exact && !has_formula {
            return observer("uniform or occupancy with the algorithm exact, which needs a formula for p(c|s)");
        }
        if self.adversary_reward.is_some() && self.observer.model().name == "gru" {
            return observer("one whose clone is exact with an adversary_reward, of which the clone's share is told");
        }
        if self.observer.model().name == "gru" {
            // What it learns in an update, and what it is tried in, is not to take longer than a second or two.
            let units = u64::from(self.observer.parameter()) + GRU_DENSE;
            if units * u64::from(self.horizon) > MOST_GRU_HORIZON
                || units * u64::from(self.batch_steps) > MOST_GRU_BATCH
            {
                return observer(&format!(
                    "one with (units + {GRU_DENSE}) · horizon of at most {MOST_GRU_HORIZON} and (units + {GRU_DENSE}) · batch_steps of at most {MOST_GRU_BATCH}"
                ));
            }
        }
        if self.gradient == GradientKind::Mixture && self.observer.model().remembers {
            return observer("one without a memory with the gradient mixture, which needs a p(c|s)");
        }
        Ok(())
    }

    /// Checks what depends on the grid.
    pub fn check_on(&self, grid: &Grid) -> Result<(), ConfigError> {
        match self.adversary_reward.as_ref().and_then(|reward| reward.idle(grid)) {
            None => Ok(()),
            Some((row, col)) => Err(ConfigError {
                field: "adversary_reward",
                value: format!("{row},{col}"),
                expected: format!(
                    "a cell of the grid of {} × {} cells where a step begins: no wall and not the goal",
                    grid.rows(),
                    grid.cols()
                ),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_runs_for_the_papers_732_updates() {
        assert_eq!(Config::default().updates(), 732);
        assert_eq!(Config::default().check(), Ok(()));
    }

    #[test]
    fn a_field_out_of_range_is_named_with_its_range() {
        let error = Config { beta: 3.0, ..Config::default() }.check().unwrap_err();
        assert_eq!(error.to_string(), "beta 3: must be a number from 0 to 2");
        let error = Config { experts: 9, ..Config::default() }.check().unwrap_err();
        assert_eq!(error.to_string(), "experts 9: must be a whole number from 1 to 8");
        assert!(Config { discount: f64::NAN, ..Config::default() }.check().is_err());
    }
}
