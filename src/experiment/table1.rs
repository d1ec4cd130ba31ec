//! Table 1: what adversarial ensembles and baselines return, and what every cloner makes of them, over seeds.

use serde::{Deserialize, Serialize};

use super::baselines::{Case, METHODS, Made, Measure};
use super::bench::ensemble_returns;
use super::{Setup, Summary};
use crate::ape::{Config, Digest};
use crate::attack::{AttackerChoice, Progress, Target};
use crate::mdp::{Grid, KnownReturns, RETURN_KINDS, Returns};

/// One seed of one method.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MethodRun {
    /// Its name in [`METHODS`].
    pub method: String,
    pub seed: u32,
    /// Of the run that the ensemble was trained in, for the methods that train.
    pub digest: Option<Digest>,
    pub ensemble: Returns,
    /// In the order of the attackers asked for.
    pub clones: Vec<KnownReturns>,
}

/// All methods with one seed, all attackers against each. Nothing when told to stop.
pub fn run_seed(
    setup: &Setup,
    attackers: &[AttackerChoice],
    progress: &mut Progress,
) -> Result<Option<Vec<MethodRun>>, String> {
    let grid = Grid::new(setup.grid.clone()).map_err(|error| error.to_string())?;
    let config = &setup.config;
    let mut runs: Vec<MethodRun> = Vec::new();
    let mut measure = None;
    // Training counts as one attack.
    let parts = (METHODS.len() * (attackers.len() + 1)) as f64;
    let mut done = 0.0;
    for (index, method) in METHODS.iter().enumerate() {
        let mut step = |part: f64| progress((done + part) / parts);
        let case = Case { grid: &grid, config, measure };
        let Some(Made { ensemble, digest, clone }) =
            (method.make)(&case, &mut step).map_err(|error| error.to_string())?
        else {
            return Ok(None);
        };
        done += 1.0;
        let returns = ensemble_returns(&grid, &ensemble, config.horizon);
        let target = Target { grid: &grid, ensemble: &ensemble, horizon: config.horizon, seed: config.seed };
        if index == 0 {
            measure = clone.map(|clone| Measure { ensemble: returns.capped_return, clone });
        }
        let mut clones = Vec::with_capacity(attackers.len());
        for attacker in attackers {
            let mut step = |part: f64| progress((done + part) / parts);
            let Some(clone) = attacker.clone_of(&target, &mut step) else { return Ok(None) };
            clones.push(clone.returns);
            done += 1.0;
        }
        runs.push(MethodRun { method: method.name.to_owned(), seed: config.seed, digest, ensemble: returns, clones });
    }
    Ok(Some(runs))
}

/// The table: every method over its seeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Table1 {
    pub attackers: Vec<AttackerChoice>,
    /// A run for each method and seed.
    pub runs: Vec<MethodRun>,
}

/// A method's row, for one kind of return.
pub struct Row {
    /// Place in [`METHODS`].
    pub method: usize,
    pub ensemble: Summary,
    /// A column for each attacker; none where the return is not known of a clone.
    pub clones: Vec<Option<Summary>>,
}

impl Table1 {
    /// A table of these cloners without a run yet.
    pub fn new(attackers: Vec<AttackerChoice>) -> Table1 {
        Table1 { attackers, runs: Vec::new() }
    }

    /// The setups of all seeds, from 1.
    pub fn setups(setup: &Setup, seeds: u32) -> Vec<Setup> {
        let config = |seed| Config { seed, ..setup.config.clone() };
        let with = |seed| Setup { config: config(seed), grid: setup.grid.clone(), ..Setup::default() };
        (1..=seeds).map(with).collect()
    }

    /// The rows for one kind of return (its place in [`RETURN_KINDS`]).
    pub fn rows(&self, kind: usize) -> Vec<Row> {
        let row = |method: usize| {
            let runs: Vec<&MethodRun> = self.runs.iter().filter(|run| run.method == METHODS[method].name).collect();
            let ensemble: Vec<f64> = runs.iter().map(|run| (RETURN_KINDS[kind].get)(&run.ensemble)).collect();
            let clones = (0..self.attackers.len()).map(|column| {
                let values: Option<Vec<f64>> = runs.iter().map(|run| run.clones[column].get(kind)).collect();
                values.and_then(|values| Summary::of(&values))
            });
            Some(Row { method, clones: clones.collect(), ensemble: Summary::of(&ensemble)? })
        };
        (0..METHODS.len()).filter_map(row).collect()
    }

    /// Every run and cloner as a line of CSV.
    pub fn csv(&self) -> String {
        let names: Vec<&str> = RETURN_KINDS.iter().map(|kind| kind.name).collect();
        let mut text = format!("method,seed,policy,{},horizon_error,success_error,digest\n", names.join(","));
        for run in &self.runs {
            let ensemble = KnownReturns::from(run.ensemble);
            let clones = self.attackers.iter().map(ToString::to_string).zip(&run.clones);
            for (policy, returns) in std::iter::once(("ensemble".to_owned(), &ensemble)).chain(clones) {
                let values =
                    (0..RETURN_KINDS.len()).map(|kind| returns.get(kind).map_or(String::new(), |v| v.to_string()));
                let values: Vec<String> = values.collect();
                text += &format!(
                    "{},{},{policy},{},{},{},{}\n",
                    run.method,
                    run.seed,
                    values.join(","),
                    returns.horizon_error,
                    returns.success_error,
                    run.digest.map_or(String::new(), |digest| digest.to_string())
                );
            }
        }
        text
    }
}

/// Whether a table can be made: the baselines must have a stationary clone to match, and methods of one β.
pub fn check(config: &Config) -> Result<(), String> {
    let observer = config.observer;
    if observer.model().remembers {
        return Err(format!(
            "observer {observer}: Table 1 needs one without a memory, whose clone the baselines can match"
        ));
    }
    super::sweep::check(config)
}
