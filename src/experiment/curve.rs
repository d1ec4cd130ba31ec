//! The course of a run: exact returns of the ensemble and its clone at one update.

use serde::{Deserialize, Serialize};

use crate::ape::{Digest, Trainer};
use crate::attack::{FEW_TRIALS, own_clone};
use crate::mdp::{ACTIONS, Grid, KnownReturns, Policy, RETURN_KINDS, Returns, Solver, occupancy};

/// A run at one update.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    pub update: u32,
    /// Of the coming update.
    pub beta: f64,
    pub ensemble: Returns,
    /// Of the clone by the run's own observer.
    pub clone: KnownReturns,
    /// What is collected of r̃, where the clone is to be denied that.
    pub denied: Option<Denied>,
    pub digest: Digest,
}

/// E[Σ r̃] within T, undiscounted, mean over the cells where episodes start.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Denied {
    /// By the ensemble: mean of its experts.
    pub ensemble: f64,
    pub clone: f64,
}

impl CurvePoint {
    /// Evaluates a run as it stands.
    pub fn of(trainer: &mut Trainer) -> CurvePoint {
        let own = own_clone(trainer, FEW_TRIALS);
        let ensemble = trainer.ensemble();
        let (config, grid) = (trainer.config(), trainer.grid());
        let mut solver = Solver::new(grid);
        let remembers = config.observer.model().remembers;
        let denied = config.adversary_reward.as_ref().map(|reward| {
            let reward = reward.table(grid);
            let collected = |policy: &Policy| collected(grid, policy, config.horizon, &reward);
            let by_experts: f64 = ensemble.policies().iter().map(collected).sum();
            let by_experts = by_experts / ensemble.experts() as f64;
            // A clone that remembers its episode has the ensemble's law.
            Denied { ensemble: by_experts, clone: if remembers { by_experts } else { collected(&own.policy) } }
        });
        CurvePoint {
            update: trainer.updates(),
            beta: trainer.beta(),
            ensemble: Returns::mean(&ensemble.returns(&mut solver, config.horizon)),
            clone: own.returns,
            denied,
            digest: trainer.digest(),
        }
    }

    /// The head of a CSV table of points.
    pub fn csv_head() -> String {
        let columns = ["ensemble", "clone"].into_iter().flat_map(|of| RETURN_KINDS.iter().map(move |kind| (of, kind)));
        let columns: Vec<String> = columns.map(|(of, kind)| format!("{of}_{}", kind.name)).collect();
        let columns = columns.join(",");
        format!("update,beta,{columns},clone_horizon_error,clone_success_error,ensemble_denied,clone_denied,digest")
    }

    /// The point as a line of that table.
    pub fn csv_line(&self) -> String {
        let values = [self.ensemble.into(), self.clone];
        let values = values.iter().flat_map(|of: &KnownReturns| (0..RETURN_KINDS.len()).map(|kind| of.get(kind)));
        let values: Vec<String> = values.map(|value| value.map_or(String::new(), |v| v.to_string())).collect();
        let denied = self.denied.map_or(",".to_owned(), |denied| format!("{},{}", denied.ensemble, denied.clone));
        let KnownReturns { horizon_error, success_error, .. } = self.clone;
        let errors = format!("{horizon_error},{success_error}");
        format!("{},{},{},{errors},{denied},{}", self.update, self.beta, values.join(","), self.digest)
    }
}

/// E[Σ r(s, a)] of a policy within T.
fn collected(grid: &Grid, policy: &Policy, horizon: u32, reward: &[[f64; ACTIONS]]) -> f64 {
    let visits = occupancy(grid, policy, horizon).visits;
    let here = |state: usize| -> f64 { policy.row(state).iter().zip(&reward[state]).map(|(p, r)| p * r).sum() };
    grid.starts().iter().map(|&s| visits[s as usize] * here(s as usize)).sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ape::{AlgorithmKind, Config};
    use crate::mdp::GridSpec;

    /// Exact APE comes to its β over the first half of a run: a point tells the one that is climbed with.
    #[test]
    fn a_point_has_the_beta_of_the_coming_update() {
        let config = Config { algorithm: AlgorithmKind::Exact, exact_updates: 4, beta: 0.1, ..Config::default() };
        let mut trainer = Trainer::new(Grid::new(GridSpec::default()).unwrap(), config).unwrap();
        let mut betas = vec![CurvePoint::of(&mut trainer).beta];
        for _ in 0..3 {
            trainer.update();
            betas.push(CurvePoint::of(&mut trainer).beta);
        }
        assert!(
            betas.iter().zip([0.6, 0.35, 0.1, 0.1]).all(|(found, expected)| (found - expected).abs() < 1e-12),
            "{betas:?}"
        );
    }
}
