//! What a run starts from: a grid and a configuration.

use serde::{Deserialize, Serialize};

use crate::ape::{Config, ConfigError, EnsembleError, EnsembleFile, quoted};
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

    /// From the moment after `update` updates on β is `beta`; what was to come later is forgotten.
    pub fn turn(&mut self, update: u32, beta: f64) {
        self.turns.retain(|(earlier, _)| *earlier < update);
        self.turns.push((update, beta));
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
        let Course { turns, updates } = &self.course;
        let is_ascending = turns.is_sorted_by(|(a, _), (b, _)| a < b);
        let is_within = turns.last().is_none_or(|(last, _)| *last < self.updates());
        let is_short = turns.len() <= Course::MOST_TURNS;
        let is_run = updates.is_none_or(|updates| (1..=Config::MOST_UPDATES).contains(&updates));
        if !is_short || !is_ascending || !is_within || !is_run {
            return Err(SetupError::Course);
        }
        turns.iter().try_for_each(|&(_, beta)| Ok(Config { beta, ..self.config.clone() }.check()?))
    }

    /// β at the end of the run.
    pub fn last_beta(&self) -> f64 {
        self.course.turns.last().map_or(self.config.beta, |(_, beta)| *beta)
    }

    /// Whether the paper's figures are of this grid, number of experts and horizon.
    pub fn is_papers(&self) -> bool {
        let Config { experts, horizon, .. } = self.config;
        (&self.grid, experts, horizon) == (&GridSpec::default(), 2, HORIZON)
    }

    /// Reads a configuration file: the fields of [`Config`], with a `grid` where it is not the paper's. An
    /// ensemble file does too: its `grid` and `config` are taken.
    pub fn parse(text: &str) -> Result<Setup, SetupError> {
        let json = |error: serde_json::Error| SetupError::Json(quoted(&error));
        let value: serde_json::Value = serde_json::from_str(text).map_err(json)?;
        let serde_json::Value::Object(mut fields) = value else {
            return Err(SetupError::Json("expected an object of fields, as {\"beta\": 0.3, \"seed\": 2}".to_owned()));
        };
        let grid: GridSpec =
            fields.remove("grid").map_or(Ok(GridSpec::default()), serde_json::from_value).map_err(json)?;
        let config = match fields.remove("config") {
            // An ensemble file that does not say how it was made.
            None | Some(serde_json::Value::Null) if fields.contains_key("format") => Config::default(),
            Some(config) => serde_json::from_value(config).map_err(json)?,
            None => serde_json::from_value(serde_json::Value::Object(fields)).map_err(json)?,
        };
        Grid::new(grid.clone())?;
        config.check()?;
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
        assert!(sentence("[]").contains("expected an object"));
        assert!(sentence("{").contains("EOF"));
    }
}
