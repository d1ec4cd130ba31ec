//! The figures of an ensemble: exact returns of the experts, the ensemble and its clones, and the identity.

use serde::{Deserialize, Serialize};

use super::observer::ObserverChoice;
use super::{Contexts, Ensemble};
use crate::mdp::{Grid, Returns, Solver, occupancy, optimal_policy};

/// What is reported of an ensemble; the keys are those of its JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Figures {
    /// T, in steps.
    pub horizon: u32,
    pub experts: Vec<Returns>,
    /// The mean of the experts'.
    pub ensemble: Returns,
    pub clone_uniform: Returns,
    pub clone_occupancy: Returns,
    pub optimal: Returns,
    pub identity: Identity,
}

/// The steps of the `occupancy` clone, counted and predicted: with D demonstrated steps and m(s) the mass of
/// episodes cut off by T at s, the clone takes D + Σ m(s) h_clone(s) steps. Means over starts.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Identity {
    /// D.
    pub demonstrated_steps: f64,
    /// Σ m(s).
    pub timed_out_mass: f64,
    /// D + Σ m(s) h_clone(s).
    pub predicted_clone_steps: f64,
    /// Mean h_clone over the cells where episodes start.
    pub clone_steps: f64,
}

impl Figures {
    /// All figures of an ensemble, exact; `horizon` is T.
    pub fn of(grid: &Grid, ensemble: &Ensemble, horizon: u32) -> Figures {
        let mut solver = Solver::new(grid);
        let experts = ensemble.returns(&mut solver, horizon);
        let uniform = ensemble.cloned(&Contexts::equal(grid.cells(), ensemble.experts()));
        let honest = ObserverChoice::OCCUPANCY.contexts(grid, ensemble, horizon, 0);
        let clone = solver.evaluate(&ensemble.cloned(&honest), horizon);
        let n = ensemble.experts() as f64;
        let played: Vec<_> = ensemble.policies().iter().map(|policy| occupancy(grid, policy, horizon)).collect();
        let demonstrated_steps = played.iter().flat_map(|o| &o.visits).sum::<f64>() / n;
        let after_cut: f64 =
            played.iter().flat_map(|o| o.cut_off.iter().zip(&clone.hitting_time)).map(|(m, h)| m * h).sum();
        Figures {
            horizon,
            ensemble: Returns::mean(&experts),
            experts,
            clone_uniform: solver.evaluate(&uniform, horizon).returns,
            clone_occupancy: clone.returns,
            optimal: solver.evaluate(&optimal_policy(grid), horizon).returns,
            identity: Identity {
                demonstrated_steps,
                timed_out_mass: played.iter().flat_map(|o| &o.cut_off).sum::<f64>() / n,
                predicted_clone_steps: demonstrated_steps + after_cut / n,
                clone_steps: clone.mean_steps(grid),
            },
        }
    }
}
