//! The course of a run: exact returns of the ensemble and its clone at one update.

use serde::{Deserialize, Serialize};

use crate::ape::Trainer;
use crate::mdp::{RETURN_KINDS, Returns, Solver};

/// A run at one update.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CurvePoint {
    pub update: u32,
    pub beta: f64,
    pub ensemble: Returns,
    /// Of the clone by the run's own observer.
    pub clone: Returns,
}

impl CurvePoint {
    /// Evaluates a run as it stands.
    pub fn of(trainer: &mut Trainer) -> CurvePoint {
        let contexts = trainer.contexts();
        let ensemble = trainer.ensemble();
        let horizon = trainer.config().horizon;
        let mut solver = Solver::new(trainer.grid());
        CurvePoint {
            update: trainer.updates(),
            beta: trainer.config().beta,
            ensemble: Returns::mean(&ensemble.returns(&mut solver, horizon)),
            clone: solver.evaluate(&ensemble.cloned(&contexts), horizon).returns,
        }
    }

    /// The head of a CSV table of points.
    pub fn csv_head() -> String {
        let columns = ["ensemble", "clone"].into_iter().flat_map(|of| RETURN_KINDS.iter().map(move |kind| (of, kind)));
        let columns: Vec<String> = columns.map(|(of, kind)| format!("{of}_{}", kind.name)).collect();
        format!("update,beta,{}", columns.join(","))
    }

    /// The point as a line of that table.
    pub fn csv_line(&self) -> String {
        let values =
            [self.ensemble, self.clone].into_iter().flat_map(|of| RETURN_KINDS.iter().map(move |kind| (kind.get)(&of)));
        let values: Vec<String> = values.map(|value| value.to_string()).collect();
        format!("{},{},{}", self.update, self.beta, values.join(","))
    }
}
