//! The sweep over β: what ensemble and clone return for each β and seed; and the paper's table of β.

use serde::{Deserialize, Serialize};

use super::baselines::PaperRow;
use super::{Setup, Summary};
use crate::ape::{Config, Digest, Trainer};
use crate::attack::{AttackerChoice, Progress, TRIALS, Target, own_clone};
use crate::experiment::bench::ensemble_returns;
use crate::mdp::{Grid, KnownReturns, RETURN_KINDS, Returns};

/// A run of the sweep at its end.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SweepRun {
    pub beta: f64,
    pub seed: u32,
    pub ensemble: Returns,
    /// Of the clone by the run's own observer, which has watched the training.
    pub clone: KnownReturns,
    /// Of the clone that clones the demonstrations.
    pub occupancy: KnownReturns,
    pub digest: Digest,
}

impl SweepRun {
    /// Trains and evaluates; nothing when told to stop.
    pub fn run(setup: &Setup, progress: &mut Progress) -> Result<Option<SweepRun>, String> {
        let grid = Grid::new(setup.grid.clone()).map_err(|error| error.to_string())?;
        let config = setup.config.clone();
        let mut trainer = Trainer::new(grid.clone(), config.clone()).map_err(|error| error.to_string())?;
        if !trainer.finish(progress) {
            return Ok(None);
        }
        let ensemble = trainer.ensemble();
        let own = own_clone(&mut trainer, TRIALS).returns;
        let target = Target { grid: &grid, ensemble: &ensemble, horizon: config.horizon, seed: config.seed };
        let Some(occupancy) = AttackerChoice::OCCUPANCY.clone_of(&target, &mut |_| true) else { return Ok(None) };
        Ok(Some(SweepRun {
            beta: config.beta,
            seed: config.seed,
            ensemble: ensemble_returns(&grid, &ensemble, config.horizon),
            clone: own,
            occupancy: occupancy.returns,
            digest: trainer.digest(),
        }))
    }
}

/// Whether runs are told apart by β: with `alpha` it moves.
pub fn check(config: &Config) -> Result<(), String> {
    config.alpha.map_or(Ok(()), |alpha| {
        Err(format!("alpha {alpha}: must be none where runs are compared by their β, which it would move"))
    })
}

/// The runs of a sweep, in the order of its β, and of seeds for each.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Sweep {
    pub runs: Vec<SweepRun>,
}

/// All seeds of one β, for one kind of return.
pub struct SweepPoint {
    pub beta: f64,
    pub ensemble: Summary,
    /// None where the return is not known of the clone.
    pub clone: Option<Summary>,
    pub occupancy: Option<Summary>,
}

impl Sweep {
    /// The β of the paper's table (commented out in its source), with its ensemble and its clone, uncapped: mean and
    /// standard deviation over 3 seeds.
    pub const PAPER: [(f64, PaperRow); 4] = [
        (0.0, PaperRow { ensemble: (-9.0, 0.0), clone: (-9.0, 0.0) }),
        (0.1, PaperRow { ensemble: (-9.52, 0.22), clone: (-41.22, 20.41) }),
        (0.2, PaperRow { ensemble: (-10.06, 0.37), clone: (-144.76, 55.68) }),
        (0.3, PaperRow { ensemble: (-10.77, 0.68), clone: (-280.0, 106.62) }),
    ];

    /// β and seed of the run with this index, from 0; `seeds` is at least 1.
    pub fn place(betas: &[f64], seeds: u32, index: usize) -> (f64, u32) {
        let seeds = seeds as usize;
        (betas[index / seeds], (index % seeds) as u32 + 1)
    }

    /// What the run with this index starts from.
    pub fn setup(setup: &Setup, betas: &[f64], seeds: u32, index: usize) -> Setup {
        let (beta, seed) = Sweep::place(betas, seeds, index);
        let config = Config { beta, seed, ..setup.config.clone() };
        Setup { config, grid: setup.grid.clone(), ..Setup::default() }
    }

    /// The setups of all β and seeds.
    pub fn setups(setup: &Setup, betas: &[f64], seeds: u32) -> Vec<Setup> {
        (0..betas.len() * seeds as usize).map(|index| Sweep::setup(setup, betas, seeds, index)).collect()
    }

    /// β from `first` to `last` in steps of `step`, as `0:1:0.05`, or a list of them, as `0,0.1,0.6`.
    pub fn betas(text: &str) -> Result<Vec<f64>, String> {
        let wrong = || {
            format!(
                "betas {text}: must be FIRST:LAST:STEP or a list with commas, each from 0 to {}, at most 1000 of them",
                Config::MAX_BETA
            )
        };
        let number = |text: &str| text.trim().parse::<f64>().map_err(|_| wrong());
        let betas = match text.split(':').collect::<Vec<_>>()[..] {
            [first, last, step] => {
                let (first, last, step) = (number(first)?, number(last)?, number(step)?);
                let count = (last - first) / step;
                if !(step > 0.0 && (0.0..1000.0).contains(&count)) {
                    return Err(wrong());
                }
                // Rounded, so that 0.1 + 0.2 is 0.3.
                (0..=(count + 1e-9) as u32).map(|i| ((first + f64::from(i) * step) * 1e9).round() / 1e9).collect()
            }
            [_] => text.split(',').map(number).collect::<Result<Vec<f64>, String>>()?,
            _ => return Err(wrong()),
        };
        let is_good = |beta: &f64| (0.0..=Config::MAX_BETA).contains(beta);
        if !betas.iter().all(is_good) || betas.len() > 1000 {
            return Err(wrong());
        }
        Sweep::check_betas(&betas).map_err(|error| format!("betas {text}: {error}"))?;
        Ok(betas)
    }

    /// Each β once: a run made twice would count as another seed.
    pub fn check_betas(betas: &[f64]) -> Result<(), String> {
        let mut sorted = betas.to_vec();
        sorted.sort_by(f64::total_cmp);
        match sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(format!("β {} stands there twice, expected each once", pair[0])),
            None => Ok(()),
        }
    }

    /// One point for each β, for one kind of return (its place in [`RETURN_KINDS`]).
    pub fn points(&self, kind: usize) -> Vec<SweepPoint> {
        let point = |runs: &[SweepRun]| {
            let runs = || runs.iter();
            let own: Vec<f64> = runs().map(|run| (RETURN_KINDS[kind].get)(&run.ensemble)).collect();
            let clone: Option<Vec<f64>> = runs().map(|run| run.clone.get(kind)).collect();
            let occupancy: Option<Vec<f64>> = runs().map(|run| run.occupancy.get(kind)).collect();
            Some(SweepPoint {
                beta: runs().next()?.beta,
                ensemble: Summary::of(&own)?,
                clone: clone.and_then(|clone| Summary::of(&clone)),
                occupancy: occupancy.and_then(|occupancy| Summary::of(&occupancy)),
            })
        };
        // All seeds of a β stand together.
        let mut points: Vec<SweepPoint> = self.runs.chunk_by(|a, b| a.beta == b.beta).filter_map(point).collect();
        points.sort_by(|a, b| a.beta.total_cmp(&b.beta));
        points
    }

    /// A line for each run.
    pub fn csv(&self) -> String {
        let columns = ["ensemble", "clone", "occupancy"];
        let names = columns.iter().flat_map(|of| RETURN_KINDS.iter().map(move |kind| format!("{of}_{}", kind.name)));
        let names = names.collect::<Vec<_>>().join(",");
        let mut text = format!("beta,seed,{names},clone_horizon_error,clone_success_error,digest\n");
        for run in &self.runs {
            let values = [KnownReturns::from(run.ensemble), run.clone, run.occupancy];
            let values = values.iter().flat_map(|returns| {
                (0..RETURN_KINDS.len()).map(|kind| returns.get(kind).map_or(String::new(), |value| value.to_string()))
            });
            let values: Vec<String> = values.collect();
            let KnownReturns { horizon_error, success_error, .. } = run.clone;
            let values = values.join(",");
            text += &format!("{},{},{values},{horizon_error},{success_error},{}\n", run.beta, run.seed, run.digest);
        }
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn betas_are_a_range_or_a_list() {
        assert_eq!(Sweep::betas("0:1:0.25").unwrap(), [0.0, 0.25, 0.5, 0.75, 1.0]);
        assert_eq!(Sweep::betas("0:0.3:0.1").unwrap(), [0.0, 0.1, 0.2, 0.3]);
        assert_eq!(Sweep::betas("0.6, 0").unwrap(), [0.6, 0.0]);
        for twice in ["0.6,0,0.6", "0,-0", "0:5e-10:1e-12"] {
            assert!(Sweep::betas(twice).unwrap_err().contains("stands there twice"), "{twice}");
        }
        for bad in ["", "0:1", "0:1:0", "1:0:0.1", "0:3:1", "a", "0:1:-1", "NaN", "0:1:1e-9", "0:NaN:1"] {
            assert!(Sweep::betas(bad).unwrap_err().contains("FIRST:LAST:STEP"), "{bad}");
        }
    }
}
