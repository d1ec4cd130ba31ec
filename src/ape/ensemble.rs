//! An ensemble of experts, its clone, and the file that holds it.

use serde::{Deserialize, Serialize};

use super::{Config, ConfigError, Digest, json};
use crate::mdp::{ACTIONS, Grid, GridError, GridSpec, Policy, PolicyError, Returns, Solver, Value};

/// n experts; one of them, drawn uniformly, acts for a whole episode.
#[derive(Clone, Debug, PartialEq)]
pub struct Ensemble {
    policies: Vec<Policy>,
}

impl Ensemble {
    /// `policies`: at least one, all for the same grid.
    pub fn new(policies: Vec<Policy>) -> Ensemble {
        Ensemble { policies }
    }

    pub fn policies(&self) -> &[Policy] {
        &self.policies
    }

    /// n.
    pub fn experts(&self) -> usize {
        self.policies.len()
    }

    /// Exact returns of every expert, `[n]`; the ensemble's are their mean.
    pub fn returns(&self, solver: &mut Solver, horizon: u32) -> Vec<Returns> {
        self.policies.iter().map(|policy| solver.evaluate(policy, horizon).returns).collect()
    }

    /// Hitting times and returns of whoever plays episodes with the ensemble's law: from each cell the mean of
    /// the experts' steps.
    pub fn law(&self, solver: &mut Solver, horizon: u32) -> Value {
        let values: Vec<Value> = self.policies.iter().map(|policy| solver.evaluate(policy, horizon)).collect();
        let n = values.len() as f64;
        let hitting_time: Vec<f64> = (0..self.policies[0].rows().len())
            .map(|state| values.iter().map(|value| value.hitting_time[state]).sum::<f64>() / n)
            .collect();
        let mean = Returns::mean(&values.iter().map(|value| value.returns).collect::<Vec<_>>());
        // Cut after the mean is taken, not before.
        let capped_return = solver.capped_return(&hitting_time);
        Value { hitting_time, returns: Returns { capped_return, ..mean } }
    }

    /// π_o(a|s) = Σ_c p(c|s) π_c(a|s) (paper, Eq. 1): what an observer ends up with.
    pub fn cloned(&self, contexts: &Contexts) -> Policy {
        let row = |state: usize| {
            let mut mixed = [0.0; ACTIONS];
            for (policy, &p) in self.policies.iter().zip(contexts.row(state)) {
                for (sum, action) in mixed.iter_mut().zip(policy.row(state)) {
                    *sum += p * action;
                }
            }
            mixed
        };
        Policy::from_rows((0..self.policies[0].rows().len()).map(row).collect())
    }
}

/// p(c|s): for every cell, the probability of each expert to have acted there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contexts {
    experts: usize,
    /// `[S][n]`.
    p: Vec<f64>,
}

impl Contexts {
    /// 1/n everywhere.
    pub fn equal(cells: usize, experts: usize) -> Contexts {
        Contexts { experts, p: vec![1.0 / experts as f64; cells * experts] }
    }

    /// Proportional to `weight(state, context)`; 1/n where all weights are 0.
    pub fn from_weights(cells: usize, experts: usize, weight: impl Fn(usize, usize) -> f64) -> Contexts {
        let mut p = Vec::with_capacity(cells * experts);
        for state in 0..cells {
            let sum: f64 = (0..experts).map(|context| weight(state, context)).sum();
            p.extend((0..experts).map(
                |context| {
                    if sum > 0.0 { weight(state, context) / sum } else { 1.0 / experts as f64 }
                },
            ));
        }
        Contexts { experts, p }
    }

    /// p(·|s), `[n]`.
    pub fn row(&self, state: usize) -> &[f64] {
        &self.p[state * self.experts..][..self.experts]
    }

    /// p(·|s) of every cell.
    pub fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.p.chunks(self.experts)
    }

    /// `[S][n]`, row by row.
    pub fn as_slice(&self) -> &[f64] {
        &self.p
    }
}

/// An ensemble as a file: `{"format":"ape-ensemble","version":1,"grid":…,"experts":[[[p;5];S];n]}`, with the
/// configuration that made it, and the digest of the run at that moment, where there are such. Other fields are ignored.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct EnsembleFile {
    pub format: String,
    pub version: u32,
    pub grid: GridSpec,
    /// `[n][S][5]`; rows of walls mean nothing.
    pub experts: Vec<Vec<[f64; ACTIONS]>>,
    // Written as null where there is none: messages (postcard) cannot leave a field out.
    #[serde(default)]
    pub config: Option<Config>,
    #[serde(default)]
    pub digest: Option<Digest>,
    /// Where it is not of the end of the run that `config` alone makes.
    #[serde(default)]
    pub moment: Option<Moment>,
    /// Why the `config` that the file has was left out.
    #[serde(skip)]
    pub left_out: Option<String>,
}

/// A moment of a run whose β was moved, or that is not over, or went on longer than its configuration says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Moment {
    /// Updates made.
    pub update: u32,
    /// (u, β): from the moment after u updates on, β was this.
    pub turns: Vec<(u32, f64)>,
}

impl Moment {
    /// Whether β was ever what it can be.
    fn is_possible(&self) -> bool {
        self.turns.iter().all(|(_, beta)| (0.0..=Config::MAX_BETA).contains(beta))
    }
}

/// Why a file holds no ensemble.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EnsembleError {
    #[error(
        "not an ensemble file: {0}; expected {{\"format\": \"ape-ensemble\", \"version\": 1, \"grid\": …, \"experts\": …}}"
    )]
    Json(String),
    #[error("not an ensemble file: longer than {} MB", EnsembleFile::LONGEST / 1_000_000)]
    Long,
    #[error("format {0:?}: must be \"ape-ensemble\"")]
    Format(String),
    #[error("version {0}: this program reads version 1")]
    Version(String),
    #[error("grid: {0}")]
    Grid(#[from] GridError),
    #[error("{0} experts: must be from 1 to {max}", max = Config::MAX_EXPERTS)]
    Experts(usize),
    #[error("config: {0}")]
    Config(#[from] ConfigError),
    #[error("moment: every β must be from 0 to {}", Config::MAX_BETA)]
    Moment,
    #[error("expert {expert}: {error}")]
    Policy { expert: usize, error: PolicyError },
}

impl EnsembleFile {
    const FORMAT: &str = "ape-ensemble";

    pub fn new(grid: &Grid, ensemble: &Ensemble, config: Option<Config>) -> EnsembleFile {
        EnsembleFile {
            format: Self::FORMAT.to_owned(),
            version: 1,
            grid: grid.spec().clone(),
            experts: ensemble.policies().iter().map(|policy| policy.rows().to_vec()).collect(),
            config,
            digest: None,
            moment: None,
            left_out: None,
        }
    }

    /// Longest text of a file, in bytes: the largest ensemble there can be takes a tenth of it.
    pub const LONGEST: usize = 10_000_000;

    /// Reads the JSON text of a file; [`EnsembleFile::check`] then says whether it makes sense. A `config` that
    /// is not ours, or not for this grid, is left out: it does not change what the ensemble is. So are a digest and a
    /// moment that are none, without a word.
    pub fn parse(text: &str) -> Result<EnsembleFile, EnsembleError> {
        if text.len() > Self::LONGEST {
            return Err(EnsembleError::Long);
        }
        let serde_json::Value::Object(mut fields) = json::parse(text).map_err(EnsembleError::Json)? else {
            return Err(EnsembleError::Json("no object of fields".to_owned()));
        };
        let (config, digest) = (fields.remove("config"), fields.remove("digest"));
        let digest = digest.and_then(|digest| json::read("digest", digest).ok());
        let moment =
            fields.remove("moment").and_then(|moment| json::read("moment", moment).ok()).filter(Moment::is_possible);
        let file: EnsembleFile = json::read("", serde_json::Value::Object(fields)).map_err(EnsembleError::Json)?;
        let file = EnsembleFile { digest, moment, ..file };
        let config: Result<Config, String> = match config {
            None | Some(serde_json::Value::Null) => return Ok(file),
            Some(config) => json::read("config", config),
        };
        let fits = |config: &Config| {
            config.check()?;
            // A grid that is none is said by `check`.
            Grid::new(file.grid.clone()).map_or(Ok(()), |grid| config.check_on(&grid))
        };
        let config = config.and_then(|config| fits(&config).map(|()| config).map_err(|error| error.to_string()));
        Ok(match config {
            Ok(config) => EnsembleFile { config: Some(config), ..file },
            Err(reason) => EnsembleFile { left_out: Some(reason), ..file },
        })
    }

    /// Whether a file calls itself one of these.
    pub fn check_format(format: &str, version: impl Into<serde_json::Value>) -> Result<(), EnsembleError> {
        let version = version.into();
        match (format == Self::FORMAT, version == 1) {
            (false, _) => Err(EnsembleError::Format(json::quoted(&format))),
            (_, false) => Err(EnsembleError::Version(json::quoted(&version))),
            _ => Ok(()),
        }
    }

    /// The grid and the ensemble, when everything about them is valid.
    pub fn check(self) -> Result<(Grid, Ensemble), EnsembleError> {
        Self::check_format(&self.format, self.version)?;
        let grid = Grid::new(self.grid)?;
        if self.experts.is_empty() || self.experts.len() > Config::MAX_EXPERTS as usize {
            return Err(EnsembleError::Experts(self.experts.len()));
        }
        self.config.as_ref().map_or(Ok(()), Config::check)?;
        if !self.moment.as_ref().is_none_or(Moment::is_possible) {
            return Err(EnsembleError::Moment);
        }
        let policy = |(index, rows)| {
            Policy::new(&grid, rows).map_err(|error| EnsembleError::Policy { expert: index + 1, error })
        };
        let policies: Vec<Policy> = self.experts.into_iter().enumerate().map(policy).collect::<Result<_, _>>()?;
        Ok((grid, Ensemble::new(policies)))
    }
}
