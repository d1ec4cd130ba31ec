//! The race: an expert, the clone and the optimal policy start from the same cell with the same luck.
//!
//! Luck is a stream of random numbers for each episode, three for each step: one for the action, whether it
//! slips, and where to. Every racer reads the same ones, so that two who would act alike do act alike, slip
//! included, and nobody's path depends on who else is racing.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

use crate::ape::observer::{Memory, Posterior};
use crate::ape::{Ensemble, EnsembleError, EnsembleFile};
use crate::attack::{AttackerChoice, Progress, Target};
use crate::mdp::{ACTIONS, ActionDraw, Arrivals, Cell, Draw, Grid, Policy, one_of, optimal_policy};

/// Who races; a racer's place in [`Raced::runs`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Racer {
    Expert,
    Clone,
    Optimal,
}

impl Racer {
    pub const ALL: [Racer; 3] = [Racer::Expert, Racer::Clone, Racer::Optimal];
}

/// A race, as it is asked for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Race {
    pub ensemble: EnsembleFile,
    /// Who clones.
    pub cloner: AttackerChoice,
    /// The expert that races; none: one drawn anew for each episode.
    pub expert: Option<u32>,
    /// Where all start, (row, column).
    pub start: Cell,
    /// T, longest episode in steps, 1..=10,000.
    pub horizon: u32,
    /// 1..=100,000.
    pub episodes: u32,
    /// Everything random about how the clone is made comes from it.
    pub seed: u32,
    /// Everything random on the way comes from it.
    pub luck: u32,
}

/// Why there is no race.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RaceError {
    #[error("{0}")]
    Ensemble(#[from] EnsembleError),
    #[error("expert {}: there are {experts}", u64::from(*.expert) + 1)]
    Expert { expert: u32, experts: usize },
    #[error("{0} cannot race: of the clones that remember their episode only history can")]
    Clone(AttackerChoice),
    #[error("start (row {}, column {}): must be a free cell of the grid other than the goal", .0.0, .0.1)]
    Start(Cell),
    #[error("{what} {value}: must be from 1 to {most}")]
    Number { what: &'static str, value: u32, most: u32 },
}

/// What has come of a race.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Raced {
    /// The expert that ran in the first episode.
    pub expert: u32,
    pub episodes: u32,
    /// In the order of [`Racer`].
    pub runs: [Run; 3],
}

/// What has come of one racer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// Cells of the first episode: the start and one for every step.
    pub path: Vec<u32>,
    /// Whether the first episode ends at the goal; otherwise T cut it off.
    pub has_arrived: bool,
    /// Episodes that took so many steps, `[T + 1]`; those that T cut off are not among them.
    pub arrivals: Vec<u32>,
    /// P(τ = t), exact, `[T + 1]`.
    pub exact: Vec<f64>,
}

/// Figures of many episodes from one cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Figures {
    /// Mean of min(τ, T), in steps.
    pub steps: f64,
    /// Share that is there by T.
    pub success: f64,
}

impl Figures {
    /// `share`: of each number of steps, `[T + 1]`.
    fn of(share: impl ExactSizeIterator<Item = f64>) -> Figures {
        let horizon = share.len() as f64 - 1.0;
        let (steps, success) = share
            .enumerate()
            .fold((0.0, 0.0), |(steps, success), (t, share)| (steps + t as f64 * share, success + share));
        Figures { steps: steps + horizon * (1.0 - success), success }
    }
}

impl Raced {
    pub fn run(&self, racer: Racer) -> &Run {
        &self.runs[racer as usize]
    }

    /// Of the episodes that were run.
    pub fn sample(&self, racer: Racer) -> Figures {
        let of = |&count: &u32| f64::from(count) / f64::from(self.episodes);
        Figures::of(self.run(racer).arrivals.iter().map(of))
    }

    /// Of infinitely many.
    pub fn exact(&self, racer: Racer) -> Figures {
        Figures::of(self.run(racer).exact.iter().copied())
    }
}

/// How a racer chooses.
enum Mind {
    /// By the cell alone.
    Policy(Vec<ActionDraw>),
    /// By the mixture of the experts that its memory of the episode says.
    Memory(Box<dyn Memory>),
}

impl Mind {
    fn of(policy: &Policy) -> Mind {
        Mind::Policy(policy.rows().iter().map(|row| ActionDraw::new(row)).collect())
    }
}

/// The random numbers of one episode; drawn when the first racer needs them.
struct Luck {
    rng: Xoshiro256PlusPlus,
    /// For the choice of the expert.
    expert: u32,
    /// For each step: the action, whether it slips, and where to.
    steps: Vec<[u32; 3]>,
}

impl Luck {
    fn new(seed: u32, episode: u32) -> Luck {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(u64::from(seed) << 32 | u64::from(episode));
        Luck { expert: rng.next_u32(), steps: Vec::new(), rng }
    }

    fn step(&mut self, t: usize) -> [u32; 3] {
        while self.steps.len() <= t {
            self.steps.push(std::array::from_fn(|_| self.rng.next_u32()));
        }
        self.steps[t]
    }
}

/// What all racers run on.
struct Track<'a> {
    grid: &'a Grid,
    ensemble: &'a Ensemble,
    start: usize,
    horizon: u32,
    slip: Draw<1>,
}

impl<'a> Track<'a> {
    fn new(grid: &'a Grid, ensemble: &'a Ensemble, start: usize, horizon: u32) -> Track<'a> {
        Track { grid, ensemble, start, horizon, slip: Draw::new(&[1.0 - grid.slip(), grid.slip()]) }
    }

    /// Runs one episode; calls `at` with every cell. Returns its steps where it arrives.
    fn run(&self, mind: &Mind, luck: &mut Luck, mut at: impl FnMut(usize)) -> Option<u32> {
        let mut memory = match mind {
            Mind::Policy(_) => Vec::new(),
            Mind::Memory(memory) => memory.start(),
        };
        let mut p = vec![0.0; self.ensemble.experts()];
        let mut state = self.start;
        at(state);
        for t in 0..self.horizon {
            let [action, slips, to] = luck.step(t as usize);
            let action = match mind {
                Mind::Policy(draws) => draws[state].outcome(action),
                Mind::Memory(mind) => {
                    mind.see(&mut memory, state, &mut p);
                    let mut row = [0.0; ACTIONS];
                    for (policy, p) in self.ensemble.policies().iter().zip(&p) {
                        row.iter_mut().zip(policy.row(state)).for_each(|(row, pi)| *row += p * pi);
                    }
                    let action = ActionDraw::new(&row).outcome(action);
                    mind.act(&mut memory, state, action);
                    action
                }
            };
            let has_slipped = self.slip.outcome(slips) == 1;
            let executed = if has_slipped { one_of(ACTIONS, to) } else { action };
            state = self.grid.next(state)[executed] as usize;
            at(state);
            if state == self.grid.goal() {
                return Some(t + 1);
            }
        }
        None
    }

    /// P(τ = t), the mean over equally likely policies, `[T + 1]`; nothing when told to stop.
    fn exact(&self, policies: &[&Policy], progress: &mut Progress) -> Option<Vec<f64>> {
        const LOOK: usize = 64;
        let (n, all) = (policies.len() as f64, self.horizon as usize + 1);
        let mut mean = vec![0.0; all];
        for (done, policy) in policies.iter().enumerate() {
            for (t, (mean, p)) in mean.iter_mut().zip(Arrivals::new(self.grid, policy, self.start)).enumerate() {
                if t.is_multiple_of(LOOK) && !progress((done as f64 + t as f64 / all as f64) / n) {
                    return None;
                }
                *mean += p / n;
            }
        }
        Some(mean)
    }
}

impl Race {
    /// Most steps of an episode, and most episodes.
    pub const MOST_STEPS: u32 = 10_000;
    pub const MOST_EPISODES: u32 = 100_000;

    /// Whether this clone can race: it has one policy, or its memory is exact Bayes.
    pub fn knows(cloner: AttackerChoice) -> bool {
        !cloner.model().remembers || cloner.model().name == "history"
    }

    /// Runs it. Nothing when told to stop.
    pub fn run(&self, progress: &mut Progress) -> Result<Option<Raced>, RaceError> {
        let (grid, ensemble) = self.check()?;
        let target = Target { grid: &grid, ensemble: &ensemble, horizon: self.horizon, seed: self.seed };
        let start = self.start.0 as usize * grid.cols() + self.start.1 as usize;
        Ok(self.run_on(&target, &Track::new(&grid, &ensemble, start, self.horizon), progress))
    }

    fn check(&self) -> Result<(Grid, Ensemble), RaceError> {
        let number = |what, value, most| match (1..=most).contains(&value) {
            true => Ok(()),
            false => Err(RaceError::Number { what, value, most }),
        };
        number("horizon", self.horizon, Self::MOST_STEPS)?;
        number("episodes", self.episodes, Self::MOST_EPISODES)?;
        if !Race::knows(self.cloner) {
            return Err(RaceError::Clone(self.cloner));
        }
        let (grid, ensemble) = self.ensemble.clone().check()?;
        let experts = ensemble.experts();
        if let Some(expert) = self.expert.filter(|&expert| expert as usize >= experts) {
            return Err(RaceError::Expert { expert, experts });
        }
        if !grid.starts().iter().any(|&s| grid.cell(s as usize) == self.start) {
            return Err(RaceError::Start(self.start));
        }
        Ok((grid, ensemble))
    }

    fn run_on(&self, target: &Target, track: &Track, progress: &mut Progress) -> Option<Raced> {
        /// Parts of the work: making the clone, the exact distributions of each racer; the rest is episodes.
        const CLONE: f64 = 0.4;
        const EXACT: f64 = 0.15;
        let experts: Vec<&Policy> = target.ensemble.policies().iter().collect();
        let optimal = optimal_policy(target.grid);
        let cloned = match self.cloner.model().remembers {
            true => None,
            false => Some(self.cloner.clone_of(target, &mut |done| progress(CLONE * done))?.policy),
        };
        let racing = self.expert.map_or(&experts[..], |expert| &experts[expert as usize..][..1]);
        // The episodes of a clone with exact memory have the ensemble's law.
        let cloned_law = cloned.as_ref().map_or(experts.clone(), |policy| vec![policy]);
        let mut raced = Raced { expert: 0, episodes: self.episodes, runs: Default::default() };
        for (index, policies) in [racing, &cloned_law, &[&optimal]].into_iter().enumerate() {
            let mut part = |done| progress(CLONE + EXACT * (index as f64 + done));
            raced.runs[index].exact = track.exact(policies, &mut part)?;
            raced.runs[index].arrivals = vec![0; self.horizon as usize + 1];
        }
        let minds: Vec<Mind> = experts.iter().map(|policy| Mind::of(policy)).collect();
        let clone = match &cloned {
            Some(policy) => Mind::of(policy),
            None => Mind::Memory(Box::new(Posterior::new(target.ensemble))),
        };
        let optimal = Mind::of(&optimal);
        for episode in 0..self.episodes {
            let done = f64::from(episode) / f64::from(self.episodes);
            if episode.is_multiple_of(16) && !progress(CLONE + 3.0 * EXACT + (1.0 - CLONE - 3.0 * EXACT) * done) {
                return None;
            }
            let mut luck = Luck::new(self.luck, episode);
            let drawn = one_of(experts.len(), luck.expert);
            let expert = self.expert.map_or(drawn, |expert| expert as usize);
            if episode == 0 {
                raced.expert = expert as u32;
            }
            for (mind, run) in [&minds[expert], &clone, &optimal].into_iter().zip(&mut raced.runs) {
                let steps = track.run(mind, &mut luck, |state| {
                    if episode == 0 {
                        run.path.push(state as u32);
                    }
                });
                run.has_arrived |= episode == 0 && steps.is_some();
                if let Some(steps) = steps {
                    run.arrivals[steps as usize] += 1;
                }
            }
        }
        Some(raced)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Preset;
    use crate::mdp::{GridSpec, Solver};
    use rand::RngExt;

    fn grid(slip: f64) -> Grid {
        let walls = vec![(1, 1), (1, 2), (3, 3), (4, 1)];
        Grid::new(GridSpec { rows: 6, cols: 5, goal: (0, 0), walls, slip }).unwrap()
    }

    /// Policies that go to the goal more or less.
    fn ensemble(grid: &Grid, experts: usize, seed: u64) -> Ensemble {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut row = |_: usize| {
            let weights = [2.0, 0.7, 2.0, 0.7, 0.3].map(|weight| weight * rng.random::<f64>());
            weights.map(|w| w / weights.iter().sum::<f64>())
        };
        let mut policy = || Policy::from_rows((0..grid.cells()).map(&mut row).collect());
        Ensemble::new((0..experts).map(|_| policy()).collect())
    }

    fn race(grid: &Grid, ensemble: &Ensemble) -> Race {
        Race {
            ensemble: EnsembleFile::new(grid, ensemble, None),
            cloner: AttackerChoice::UNIFORM,
            expert: None,
            start: (5, 4),
            horizon: 60,
            episodes: 1,
            seed: 0,
            luck: 7,
        }
    }

    fn run(race: &Race) -> Raced {
        race.run(&mut |_| true).unwrap().unwrap()
    }

    /// Pearson's χ² of a histogram, with its degrees of freedom; numbers of steps are taken together until ten
    /// episodes are expected.
    fn chi_square(raced: &Raced, racer: Racer) -> (f64, f64) {
        let Run { arrivals, exact, .. } = raced.run(racer);
        let n = f64::from(raced.episodes);
        let lost = (n - arrivals.iter().map(|&count| f64::from(count)).sum::<f64>(), 1.0 - exact.iter().sum::<f64>());
        let bins = arrivals.iter().map(|&count| f64::from(count)).zip(exact.iter().copied()).chain([lost]);
        let (mut sum, mut groups, mut seen, mut expected) = (0.0, 0.0, 0.0, 0.0);
        for (count, p) in bins {
            seen += count;
            expected += n * p;
            if expected >= 10.0 {
                sum += (seen - expected) * (seen - expected) / expected;
                groups += 1.0;
                (seen, expected) = (0.0, 0.0);
            }
        }
        // What is left over is expected less than ten times.
        assert!(seen < 40.0, "{seen} episodes where {expected} were expected");
        (sum, groups - 1.0)
    }

    /// The histogram of 20,000 episodes is that of the exact distribution: χ² no more than five standard deviations
    /// above its mean. With and without slip, of a clone with a memory and of one without.
    #[test]
    fn episodes_have_the_exact_distribution() {
        for (slip, expert) in [(0.0, None), (0.2, None), (0.2, Some(1))] {
            let grid = grid(slip);
            let ensemble = ensemble(&grid, 3, 1);
            for cloner in ["uniform", "history"] {
                let cloner = cloner.parse().unwrap();
                let raced = run(&Race { expert, cloner, episodes: 20_000, ..race(&grid, &ensemble) });
                for racer in Racer::ALL {
                    let (sum, freedom) = chi_square(&raced, racer);
                    let bound = freedom + 5.0 * (2.0 * freedom).sqrt() + 1e-6;
                    assert!(sum <= bound, "{racer:?}, {cloner}, slip {slip}: {sum} of {freedom}");
                    let (sample, exact) = (raced.sample(racer), raced.exact(racer));
                    // Standard errors: of steps at most T/2 / √n.
                    assert!((sample.steps - exact.steps).abs() < 4.0 * 30.0 / 20_000f64.sqrt());
                    assert!((sample.success - exact.success).abs() < 4.0 * 0.5 / 20_000f64.sqrt());
                }
            }
        }
    }

    /// What is exact here is what the solver says of the same policies, and of a clone with a memory what the
    /// ensemble does.
    #[test]
    fn exact_figures_are_those_of_the_returns() {
        let grid = grid(0.1);
        let ensemble = ensemble(&grid, 2, 2);
        let mut solver = Solver::new(&grid);
        let mut steps = [0.0; 3];
        for &start in grid.starts() {
            let start = grid.cell(start as usize);
            let raced = run(&Race { start, ..race(&grid, &ensemble) });
            Racer::ALL.iter().for_each(|&racer| steps[racer as usize] -= raced.exact(racer).steps);
            let raced = run(&Race { start, cloner: "history".parse().unwrap(), ..race(&grid, &ensemble) });
            assert_eq!(raced.run(Racer::Clone).exact, raced.run(Racer::Expert).exact);
        }
        let law = ensemble.law(&mut solver, 60).returns.horizon_return;
        let equal = crate::ape::Contexts::equal(grid.cells(), 2);
        let mut returns = |policy| solver.evaluate(&policy, 60).returns.horizon_return;
        let expected = [law, returns(ensemble.cloned(&equal)), returns(optimal_policy(&grid))];
        for (steps, expected) in steps.iter().zip(expected) {
            assert!((steps / grid.free_cells() as f64 - expected).abs() < 1e-10);
        }
    }

    /// Equal policies take equal paths, slip included: the clone of a single expert is that expert.
    #[test]
    fn who_acts_alike_goes_the_same_way() {
        for slip in [0.0, 0.3] {
            let grid = grid(slip);
            let alone = ensemble(&grid, 1, 3);
            for cloner in ["uniform", "history"] {
                for luck in 0..20 {
                    let raced = run(&Race { luck, cloner: cloner.parse().unwrap(), ..race(&grid, &alone) });
                    assert_eq!(raced.run(Racer::Clone).path, raced.run(Racer::Expert).path);
                }
            }
        }
    }

    /// Nobody's path depends on who else races, and the first of many episodes is the one that is run alone.
    #[test]
    fn paths_are_ones_own() {
        let grid = grid(0.2);
        let ensemble = ensemble(&grid, 3, 4);
        let race = race(&grid, &ensemble);
        for luck in 0..20 {
            let one = run(&Race { luck, expert: Some(0), ..race.clone() });
            let other = run(&Race { luck, expert: Some(2), episodes: 50, ..race.clone() });
            assert_eq!(one.run(Racer::Clone).path, other.run(Racer::Clone).path);
            assert_eq!(one.run(Racer::Optimal).path, other.run(Racer::Optimal).path);
            let third = run(&Race { luck, expert: Some(0), cloner: "history".parse().unwrap(), ..race.clone() });
            assert_eq!(one.run(Racer::Expert), third.run(Racer::Expert));
            let drawn = run(&Race { luck, ..race.clone() });
            let same = run(&Race { luck, expert: Some(drawn.expert), ..race.clone() });
            assert_eq!(drawn.run(Racer::Expert).path, same.run(Racer::Expert).path);
        }
    }

    /// The trap's experts are deterministic and walk from (9, 9) straight to (0, 0) in 18 steps, as the best do.
    #[test]
    fn the_trap_by_hand() {
        let trap = (Preset::find("trap").unwrap().setup)().ensemble.unwrap();
        let cloner = AttackerChoice::OCCUPANCY;
        let race = Race {
            ensemble: trap,
            cloner,
            expert: Some(1),
            start: (9, 9),
            horizon: 100,
            episodes: 10,
            seed: 0,
            luck: 0,
        };
        let raced = run(&race);
        for racer in [Racer::Expert, Racer::Optimal] {
            let Run { path, has_arrived, arrivals, exact } = raced.run(racer);
            assert_eq!((path.len(), path[0], path[18], *has_arrived), (19, 99, 0, true));
            assert_eq!((arrivals[18], arrivals.len(), exact.len()), (10, 101, 101));
            assert!((exact[18] - 1.0).abs() < 1e-12);
            assert_eq!(raced.sample(racer), Figures { steps: 18.0, success: 1.0 });
        }
        // At X = (0, 1) both stay for ever.
        let raced = run(&Race { start: (0, 1), ..race });
        let lost = raced.run(Racer::Expert);
        assert_eq!((lost.path.len(), lost.has_arrived), (101, false));
        assert_eq!(raced.exact(Racer::Expert), Figures { steps: 100.0, success: 0.0 });
    }

    #[test]
    fn what_cannot_race_is_refused_with_a_sentence() {
        let grid = grid(0.0);
        let race = race(&grid, &ensemble(&grid, 2, 5));
        let refused = |race: Race| race.run(&mut |_| true).unwrap_err().to_string();
        let gru = "gru(4)".parse().unwrap();
        assert!(refused(Race { cloner: gru, ..race.clone() }).starts_with("gru(4) cannot race: of the clones"));
        assert_eq!(refused(Race { expert: Some(2), ..race.clone() }), "expert 3: there are 2");
        for start in [(0, 0), (1, 1), (6, 0), (0, 5), (u32::MAX, u32::MAX)] {
            assert!(refused(Race { start, ..race.clone() }).starts_with("start (row "));
        }
        assert_eq!(refused(Race { horizon: 10_001, ..race.clone() }), "horizon 10001: must be from 1 to 10000");
        assert_eq!(refused(Race { episodes: 0, ..race.clone() }), "episodes 0: must be from 1 to 100000");
        let calls = std::cell::Cell::new(0);
        let told_to_stop = race.run(&mut |_| {
            calls.set(calls.get() + 1);
            calls.get() < 5
        });
        assert_eq!((told_to_stop, calls.get()), (Ok(None), 5));
        let bytes = crate::lab::encode(&race);
        assert_eq!(crate::lab::decode::<Race>(&bytes), Ok(race));
    }
}
