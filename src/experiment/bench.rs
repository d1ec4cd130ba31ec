//! The attack bench: one cloner against one ensemble, and what comes of it as a line of a table.

use serde::{Deserialize, Serialize};

use super::Clock;
use crate::ape::{Digest, Ensemble};
use crate::attack::{AttackerChoice, Cloned, Progress, Target};
use crate::mdp::{Grid, KnownReturns, Returns, Solver};

/// A cloner against an ensemble.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Attack {
    pub attacker: AttackerChoice,
    pub returns: KnownReturns,
    /// Capped return of the ensemble less that of the clone, in steps: what the clone lost. Not known of a clone
    /// with a memory.
    pub drop: Option<f64>,
    /// The same of the returns within T: the imitation gap, in steps.
    pub imitation_gap: f64,
    /// State–action pairs that the clone was made of; none for the limit of infinitely many.
    pub pairs: Option<u32>,
    pub seconds: f64,
}

impl Attack {
    /// Makes the clone and compares it; nothing when told to stop.
    pub fn run(
        target: &Target,
        attacker: AttackerChoice,
        clock: Clock,
        progress: &mut Progress,
    ) -> Option<(Attack, Cloned)> {
        let begin = clock();
        let cloned = attacker.clone_of(target, progress)?;
        let seconds = (clock() - begin) / 1000.0;
        let ensemble = ensemble_returns(target.grid, target.ensemble, target.horizon);
        let returns = cloned.returns;
        let attack = Attack {
            attacker,
            drop: returns.capped_return.map(|clone| ensemble.capped_return - clone),
            imitation_gap: ensemble.horizon_return - returns.horizon_return,
            returns,
            pairs: cloned.pairs,
            seconds,
        };
        Some((attack, cloned))
    }
}

/// Exact returns of an ensemble.
pub fn ensemble_returns(grid: &Grid, ensemble: &Ensemble, horizon: u32) -> Returns {
    Returns::mean(&ensemble.returns(&mut Solver::new(grid), horizon))
}

/// Every attack on one ensemble: what `ape attack --json` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bench {
    /// T, in steps.
    pub horizon: u32,
    pub seed: u32,
    /// Of the run that the ensemble is from, where its file says so.
    pub digest: Option<Digest>,
    pub ensemble: Returns,
    pub attackers: Vec<Attack>,
}

impl Bench {
    /// The bench as CSV, a line for each attacker.
    pub fn csv(&self) -> String {
        let mut text = "attacker,capped_return,uncapped_return,horizon_return,horizon_error,success,success_error,drop,imitation_gap,pairs,seconds,digest\n".to_owned();
        let known = |value: Option<f64>| value.map_or(String::new(), |value| value.to_string());
        for attack in &self.attackers {
            let r = &attack.returns;
            let fields = [
                attack.attacker.to_string(),
                known(r.capped_return),
                known(r.uncapped_return),
                r.horizon_return.to_string(),
                r.horizon_error.to_string(),
                r.success.to_string(),
                r.success_error.to_string(),
                known(attack.drop),
                attack.imitation_gap.to_string(),
                attack.pairs.map_or(String::new(), |pairs| pairs.to_string()),
                format!("{:.3}", attack.seconds),
                self.digest.map_or(String::new(), |digest| digest.to_string()),
            ];
            text += &(fields.join(",") + "\n");
        }
        text
    }
}
