//! The ensembles that Table 1 compares: adversarial ones, and plain ones that only look like them.
//!
//! An ensemble is one line in [`METHODS`]. The baselines take their measure from the PG-APE ensemble of the same
//! seed.

use crate::ape::observer::ObserverChoice;
use crate::ape::{AlgorithmKind, Config, ConfigError, Digest, Ensemble, Trainer};
use crate::attack::{Progress, TRIALS, own_clone};
use crate::mdp::{ACTIONS, Grid, Policy, Solver, optimal_policy};

/// What the baselines are measured by: capped returns of the PG-APE ensemble and of its clone.
#[derive(Clone, Copy)]
pub struct Measure {
    pub ensemble: f64,
    pub clone: f64,
}

/// Where and how a method trains.
pub struct Case<'a> {
    pub grid: &'a Grid,
    pub config: &'a Config,
    /// None while the PG-APE ensemble itself is made.
    pub measure: Option<Measure>,
}

/// A row of one of the paper's tables: mean and standard deviation of ensemble and clone.
pub struct PaperRow {
    pub ensemble: (f64, f64),
    pub clone: (f64, f64),
}

/// An ensemble as a method has made it.
pub struct Made {
    pub ensemble: Ensemble,
    /// Of the run that it was trained in, if it was.
    pub digest: Option<Digest>,
    /// Capped return of the clone by that run's own observer, at the run's end.
    pub clone: Option<f64>,
}

/// A way to come by an ensemble.
pub struct Method {
    /// As in files.
    pub name: &'static str,
    pub title: &'static str,
    pub summary: &'static str,
    pub paper: Option<PaperRow>,
    /// None when it was told to stop.
    pub make: fn(&Case, &mut Progress) -> Result<Option<Made>, ConfigError>,
}

/// Every method; PG-APE first, as the baselines are measured by it.
pub static METHODS: [Method; 6] = [
    Method {
        name: "pg_ape",
        title: "PG-APE",
        summary: "The paper's algorithm.",
        paper: Some(PaperRow { ensemble: (-16.24, 1.20), clone: (-44.27, 1.07) }),
        make: |case, progress| train(case, AlgorithmKind::PgApe, progress),
    },
    Method {
        name: "exact",
        title: "Exact APE (ours)",
        summary: "The same objective, climbed by its exact gradient.",
        paper: None,
        make: |case, progress| train(case, AlgorithmKind::Exact, progress),
    },
    Method {
        name: "near_optimal",
        title: "Near-optimal PE",
        summary: "Plain policy gradient (β = 0), stopped when the ensemble returns what the PG-APE ensemble returns.",
        paper: Some(PaperRow { ensemble: (-16.74, 1.32), clone: (-16.67, 1.31) }),
        make: |case, progress| stopped_early(case, |of, _| of, |measure| measure.ensemble, progress),
    },
    Method {
        name: "random",
        title: "Random policy",
        summary: "Plain policy gradient (β = 0), stopped when the clone returns what the clone of the PG-APE ensemble returns.",
        paper: Some(PaperRow { ensemble: (-44.59, 0.52), clone: (-44.52, 0.77) }),
        make: |case, progress| stopped_early(case, |_, clone| clone, |measure| measure.clone, progress),
    },
    Method {
        name: "optimal",
        title: "Optimal",
        summary: "Every expert the optimal policy.",
        paper: None,
        make: |case, _| Ok(Some(all_alike(case, optimal_policy(case.grid)))),
    },
    Method {
        name: "noisy",
        title: "Noisy",
        summary: "Every expert the optimal policy with each action replaced at random as often as costs its owner what PG-APE \
                  costs: the cheap alternative.",
        paper: None,
        make: |case, _| Ok(Some(all_alike(case, noisy(case)))),
    },
];

fn train(case: &Case, algorithm: AlgorithmKind, progress: &mut Progress) -> Result<Option<Made>, ConfigError> {
    // What exact APE has no formula for is trained against its limit of many demonstrations.
    let observer = match algorithm {
        AlgorithmKind::Exact if case.config.observer != ObserverChoice::UNIFORM => ObserverChoice::OCCUPANCY,
        _ => case.config.observer,
    };
    let config = Config { algorithm, observer, ..case.config.clone() };
    let mut trainer = Trainer::new(case.grid.clone(), config)?;
    Ok(trainer.finish(progress).then(|| Made {
        ensemble: trainer.ensemble(),
        digest: Some(trainer.digest()),
        clone: own_clone(&mut trainer, TRIALS).returns.capped_return,
    }))
}

/// A run with β = 0, stopped where `figure` of the ensemble's and the clone's capped returns comes closest to what
/// is wanted, at its first crossing.
fn stopped_early(
    case: &Case,
    figure: fn(f64, f64) -> f64,
    wanted: fn(&Measure) -> f64,
    progress: &mut Progress,
) -> Result<Option<Made>, ConfigError> {
    let wanted = wanted(&case.measure.expect("PG-APE comes first"));
    let config = Config {
        beta: 0.0,
        algorithm: AlgorithmKind::PgApe,
        adversary_reward: None,
        alpha: None,
        ..case.config.clone()
    };
    let (updates, horizon) = (config.updates(), config.horizon);
    let mut trainer = Trainer::new(case.grid.clone(), config)?;
    let mut solver = Solver::new(case.grid);
    let mut last: Option<(f64, Made)> = None;
    for update in 0..=updates {
        let ensemble = trainer.ensemble();
        let returns = ensemble.returns(&mut solver, horizon);
        let own = returns.iter().map(|returns| returns.capped_return).sum::<f64>() / returns.len() as f64;
        let clone = solver.evaluate(&ensemble.cloned(&trainer.contexts()), horizon).returns.capped_return;
        let found = figure(own, clone);
        let off = (found - wanted).abs();
        if found >= wanted || update == updates {
            let made = Made { ensemble, digest: Some(trainer.digest()), clone: None };
            let is_before_closer = last.as_ref().is_some_and(|(before, _)| *before < off);
            return Ok(Some(if is_before_closer { last.expect("just looked at").1 } else { made }));
        }
        last = Some((off, Made { ensemble, digest: Some(trainer.digest()), clone: None }));
        trainer.update();
        if !progress(f64::from(update) / f64::from(updates)) {
            return Ok(None);
        }
    }
    unreachable!("the last update returns")
}

fn all_alike(case: &Case, policy: Policy) -> Made {
    Made { ensemble: Ensemble::new(vec![policy; case.config.experts as usize]), digest: None, clone: None }
}

/// (1 − ε) optimal + ε uniform, with the ε that brings its capped return to the measure.
fn noisy(case: &Case) -> Policy {
    let wanted = case.measure.expect("PG-APE comes first").ensemble;
    let best = optimal_policy(case.grid);
    let with = |noise: f64| {
        let row = |row: &[f64; ACTIONS]| row.map(|p| (1.0 - noise) * p + noise / ACTIONS as f64);
        Policy::from_rows(best.rows().iter().map(row).collect())
    };
    let mut solver = Solver::new(case.grid);
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..40 {
        let middle = (low + high) / 2.0;
        let found = solver.evaluate(&with(middle), case.config.horizon).returns.capped_return;
        if found > wanted { low = middle } else { high = middle }
    }
    with(low)
}
