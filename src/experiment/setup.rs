//! What a run starts from: a grid and a configuration.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::ape::{Config, ConfigError, EnsembleError, EnsembleFile, Field, json};
use crate::mdp::{Grid, GridError, GridSpec, HORIZON};

/// What changed on the way of a run: together with grid and configuration it gives the same run again.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Course {
    /// (u, β): from the moment after u updates on, β is this. Ascending in u.
    pub turns: Vec<(u32, f64)>,
    /// Updates in all, where they are not as many as the configuration says.
    pub updates: Option<u32>,
}

impl Course {
    /// Most turns of a run: nobody moves a slider as often.
    pub const MOST_TURNS: usize = 10_000;

    /// Whether β is not turned any more after `update` updates.
    pub fn is_settled(&self, update: u32) -> bool {
        self.turns.last().is_none_or(|(last, _)| *last <= update)
    }

    /// From the moment after `update` updates on β is `beta`; what was to come later is forgotten.
    pub fn turn(&mut self, update: u32, beta: f64) {
        self.turns.retain(|(earlier, _)| *earlier < update);
        self.turns.push((update, beta));
    }

    /// Checks it, of a run of so many updates: turns in order and before the end. β itself is checked with its field.
    pub fn check(&self, updates: u32) -> Result<(), SetupError> {
        let is_ascending = self.turns.is_sorted_by(|(a, _), (b, _)| a < b);
        let is_within = self.turns.last().is_none_or(|(last, _)| *last < updates);
        let is_short = self.turns.len() <= Course::MOST_TURNS;
        let is_run = self.updates.is_none_or(|updates| (1..=Config::MOST_UPDATES).contains(&updates));
        if is_short && is_ascending && is_within && is_run { Ok(()) } else { Err(SetupError::Course) }
    }

    /// β where it changes after so many updates.
    pub fn turn_at(&self, update: u32) -> Option<f64> {
        self.turns.iter().find(|(at, _)| *at == update).map(|(_, beta)| *beta)
    }
}

/// A grid, a configuration, and an ensemble where one is given instead of trained.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    pub grid: GridSpec,
    pub config: Config,
    pub course: Course,
    /// An ensemble to look at; nothing is trained then.
    pub ensemble: Option<EnsembleFile>,
}

/// Why a setup is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    #[error("not a configuration: {0}")]
    Json(String),
    #[error("grid: {0}")]
    Grid(#[from] GridError),
    #[error(
        "course: expected at most {} turns of β in the order of their updates and before the last, and 1 to {} updates in all",
        Course::MOST_TURNS,
        Config::MOST_UPDATES
    )]
    Course,
    #[error("grid: must be that of the ensemble which is given")]
    TwoGrids,
    #[error("ensemble: {0}")]
    Ensemble(#[from] EnsembleError),
    #[error("config: {0}")]
    Config(#[from] ConfigError),
}

impl Setup {
    /// Updates of the whole run.
    pub fn updates(&self) -> u32 {
        self.course.updates.unwrap_or(self.config.updates())
    }

    /// Checks everything.
    pub fn check(&self) -> Result<(), SetupError> {
        let grid = match &self.ensemble {
            Some(given) if given.grid != self.grid => return Err(SetupError::TwoGrids),
            Some(given) => given.clone().check()?.0,
            None => Grid::new(self.grid.clone())?,
        };
        self.config.check()?;
        self.config.check_on(&grid)?;
        self.check_course()
    }

    /// Checks what is to change on the way.
    fn check_course(&self) -> Result<(), SetupError> {
        self.course.check(self.updates())?;
        // Of β alone: all else has been checked, and there may be thousands of them.
        let field = Field::named("beta");
        self.course.turns.iter().try_for_each(|&(_, beta)| Ok(field.check(&Config { beta, ..Config::default() })?))
    }

    /// β at the end of the run.
    pub fn last_beta(&self) -> f64 {
        self.course.turns.last().map_or(self.config.beta, |(_, beta)| *beta)
    }

    /// Whether the paper's figures are of this grid, number of experts, horizon and reward.
    pub fn is_papers(&self) -> bool {
        let Config { experts, horizon, ref adversary_reward, .. } = self.config;
        (&self.grid, experts, horizon) == (&GridSpec::default(), 2, HORIZON) && adversary_reward.is_none()
    }

    /// Whether the paper's Table 1 is of the same, and of this β.
    pub fn is_papers_table(&self) -> bool {
        self.is_papers() && self.config.beta == Config::paper().beta
    }

    /// Reads a configuration file: the fields of [`Config`], alone or as `config`, with a `grid` where it is not the
    /// paper's. An ensemble file does too: its `grid` and `config` are taken.
    pub fn parse(text: &str) -> Result<Setup, SetupError> {
        let wrong = |sentence: &str| Err(SetupError::Json(sentence.to_owned()));
        let Value::Object(mut fields) = json::parse(text).map_err(SetupError::Json)? else {
            return wrong("expected an object of fields, as {\"beta\": 0.3, \"seed\": 2}");
        };
        let grid = fields.remove("grid").map_or(Ok(GridSpec::default()), |grid| json::read("grid", grid));
        let grid: GridSpec = grid.map_err(SetupError::Json)?;
        let config = fields.remove("config");
        let config = if let Some(format) = fields.get("format") {
            let version = fields.get("version").cloned().unwrap_or_default();
            EnsembleFile::check_format(format.as_str().unwrap_or_default(), version)?;
            // It need not say how it was made.
            config
                .filter(|config| !config.is_null())
                .map_or(Ok(Config::default()), |config| json::read("config", config))
        } else if let Some(config) = config {
            match fields.keys().next() {
                Some(other) => {
                    return wrong(&format!(
                        "unknown field `{}` beside config, expected grid alone",
                        json::quoted(other)
                    ));
                }
                None => json::read("config", config),
            }
        } else {
            json::read("", Value::Object(fields))
        };
        let config: Config = config.map_err(SetupError::Json)?;
        config.check()?;
        config.check_on(&Grid::new(grid.clone())?)?;
        Ok(Setup { grid, config, ..Setup::default() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_alone_or_an_ensemble_file_will_do() {
        let setup = Setup::parse(r#"{"beta": 0.25, "observer": "replay(7)"}"#).unwrap();
        assert_eq!((setup.config.beta, setup.config.observer.to_string().as_str()), (0.25, "replay(7)"));
        let file = r#"{"format": "ape-ensemble", "version": 1, "experts": [], "config": {"seed": 5},
            "grid": {"rows": 3, "cols": 4, "goal": [1, 1], "walls": [[0, 0]], "slip": 0.1}}"#;
        let setup = Setup::parse(file).unwrap();
        assert_eq!((setup.grid.cols, setup.config.seed), (4, 5));
        for config in [r#","config": null"#, ""] {
            let file = format!(r#"{{"format": "ape-ensemble", "version": 1, "experts": []{config}}}"#);
            assert_eq!(Setup::parse(&file).unwrap(), Setup::default());
        }
    }

    #[test]
    fn what_is_wrong_is_said() {
        let sentence = |text| Setup::parse(text).unwrap_err().to_string();
        assert_eq!(sentence(r#"{"beta": 5}"#), "config: beta 5: must be a number from 0 to 2");
        assert!(sentence(r#"{"betta": 0.5}"#).contains("unknown field `betta`"));
        assert!(sentence(r#"{"observer": "me"}"#).contains("must be one of uniform"));
        assert!(sentence(r#"{"grid": {"rows": 1, "cols": 4, "goal": [0, 0]}}"#).contains("1 × 4"));
        assert_eq!(
            sentence(r#"{"grid": {"rows": 3, "cols": 4, "goal": [0]}}"#),
            "not a configuration: grid.goal: invalid length 1, expected a tuple of size 2"
        );
        assert!(sentence(r#"{"beta": "x"}"#).contains("beta: invalid type: string"));
        assert!(sentence(r#"{"beta": 0.1, "beta": 0.2}"#).contains("\"beta\" stands there twice at line 1 column 20"));
        assert!(sentence(r#"{"adversary_reward": "20,20=1"}"#).contains("adversary_reward 20,20: must be a cell"));
        // What is in no field of ours was meant to be in one.
        assert!(sentence(r#"{"config": {"seed": 2}, "beta": 1}"#).contains("unknown field `beta` beside config"));
        assert!(sentence(r#"{"format": "ape-sweep-shard", "version": 1}"#).contains("must be \"ape-ensemble\""));
        assert!(sentence(r#"{"format": "ape-ensemble", "version": 9}"#).contains("version 9"));
        assert!(sentence("[]").contains("expected an object"));
        assert!(sentence("{").contains("EOF"));
    }
}
