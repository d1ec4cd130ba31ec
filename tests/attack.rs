#![cfg(not(target_arch = "wasm32"))]
//! The cloners: against each other, against what must hold of them, and against counting by hand.

use std::sync::LazyLock;

use ape_lab::ape::observer::Posterior;
use ape_lab::ape::{Config, Ensemble, Trainer};
use ape_lab::attack::{AttackerChoice, Cloned, TRIALS, Target, own_clone, simulate};
use ape_lab::experiment::{Preset, ensemble_returns};
use ape_lab::mdp::{ACTIONS, Grid, GridSpec, KnownReturns, Policy, Starts, occupancy};
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const T: u32 = 100;

/// The ensemble of a preset after its whole run.
fn trained(preset: &str) -> Ensemble {
    let config = (Preset::find(preset).unwrap().setup)().config;
    let updates = config.updates();
    let mut trainer = Trainer::new(Grid::new(GridSpec::default()).unwrap(), config).unwrap();
    (0..updates).for_each(|_| trainer.update());
    trainer.ensemble()
}

static GRID: LazyLock<Grid> = LazyLock::new(|| Grid::new(GridSpec::default()).unwrap());
static BLIND: LazyLock<Ensemble> = LazyLock::new(|| trained("blind"));
static PAPER: LazyLock<Ensemble> = LazyLock::new(|| trained("paper"));

fn attack(name: &str, grid: &Grid, ensemble: &Ensemble, horizon: u32) -> Cloned {
    let choice: AttackerChoice = name.parse().unwrap();
    choice.clone_of(&Target { grid, ensemble, horizon, seed: 3 }, &mut |_| true).unwrap()
}

fn random_ensemble(grid: &Grid, experts: usize, seed: u64) -> Ensemble {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut row = || {
        let weights: [f64; ACTIONS] = std::array::from_fn(|_| libm::pow(rng.random::<f64>(), 4.0));
        weights.map(|w| w / weights.iter().sum::<f64>())
    };
    Ensemble::new((0..experts).map(|_| Policy::from_rows((0..grid.cells()).map(|_| row()).collect())).collect())
}

/// Share of visits to each cell by the ensemble, `[S]`.
fn visit_shares(grid: &Grid, ensemble: &Ensemble) -> Vec<f64> {
    let visits: Vec<Vec<f64>> = ensemble.policies().iter().map(|policy| occupancy(grid, policy, T).visits).collect();
    let all: f64 = visits.iter().flatten().sum();
    (0..grid.cells()).map(|s| visits.iter().map(|visits| visits[s]).sum::<f64>() / all).collect()
}

/// Mean distance of two policies in total variation, over the cells by their share of visits.
fn distance(a: &Policy, b: &Policy, shares: &[f64]) -> f64 {
    let at = |s: usize| a.row(s).iter().zip(b.row(s)).map(|(a, b)| (a - b).abs()).sum::<f64>() / 2.0;
    shares.iter().enumerate().map(|(s, share)| share * at(s)).sum()
}

/// Counted frequencies come as close to `occupancy` as sampling lets them, ten times the data √10 times as close.
#[test]
fn more_data_brings_bc_counts_to_occupancy() {
    let shares = visit_shares(&GRID, &BLIND);
    let limit = attack("occupancy", &GRID, &BLIND, T).policy;
    for pairs in [1e4, 1e5, 1e6] {
        let counted = attack(&format!("bc_counts({pairs})"), &GRID, &BLIND, T).policy;
        // Mean absolute error of a frequency p over n draws is √(2 p (1 − p) / π n). Steps of one episode are not
        // quite independent, hence the factor of two.
        let error = |s: usize| -> f64 {
            let n = pairs * shares[s];
            limit.row(s).iter().map(|p| (2.0 * p * (1.0 - p) / (std::f64::consts::PI * n)).sqrt()).sum::<f64>() / 2.0
        };
        let expected: f64 = GRID.starts().iter().map(|&s| shares[s as usize] * error(s as usize)).sum();
        let found = distance(&counted, &limit, &shares);
        assert!((0.5 * expected..2.0 * expected).contains(&found), "{pairs}: {found} {expected}");
    }
}

/// What the paper trains is what its data say: the closed form, at every cell that was seen.
#[test]
fn bc_agrees_with_its_closed_form() {
    for (ensemble, pairs) in [(&*BLIND, 1_000_000), (&*PAPER, 1_000_000), (&*BLIND, 10_000)] {
        let trained = attack(&format!("bc({pairs})"), &GRID, ensemble, T);
        let counted = attack(&format!("bc_counts({pairs})"), &GRID, ensemble, T);
        let shares = visit_shares(&GRID, ensemble);
        let found = distance(&trained.policy, &counted.policy, &shares);
        assert!(found < 0.03, "{found}");
        if pairs == 1_000_000 {
            let worst = GRID.starts().iter().map(|&s| {
                let s = s as usize;
                trained.policy.row(s).iter().zip(counted.policy.row(s)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
            });
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < 0.08, "{worst}");
        }
    }
}

/// The identity: no demonstration is cut off, so behaviour cloning is as good as the ensemble, but for noise.
#[test]
fn behaviour_cloning_is_as_good_as_the_ensemble() {
    for ensemble in [&*BLIND, &*PAPER] {
        let own = ensemble_returns(&GRID, ensemble, T);
        for cloner in ["bc(1000000)", "bc_counts(1000000)", "occupancy", "filtered"] {
            let clone = attack(cloner, &GRID, ensemble, T).returns;
            let gap = own.capped_return - clone.capped_return.unwrap();
            assert!(gap.abs() < 0.2, "{cloner}: {gap}");
        }
    }
}

/// `history` has the ensemble's law: played, it returns what the ensemble does, within the interval.
#[test]
fn exact_bayes_has_the_ensembles_law() {
    let slippery =
        Grid::new(GridSpec { rows: 6, cols: 5, goal: (2, 2), walls: vec![(1, 1), (3, 3)], slip: 0.2 }).unwrap();
    let random = random_ensemble(&slippery, 3, 5);
    for (grid, ensemble) in [(&*GRID, &*BLIND), (&slippery, &random)] {
        let target = Target { grid, ensemble, horizon: T, seed: 11 };
        let (_, played) = simulate(&target, &Posterior::new(ensemble), TRIALS, &mut |_| true).unwrap();
        let own = ensemble_returns(grid, ensemble, T);
        // Twice the 95 % interval is nearly four standard errors.
        let off = (played.horizon_return - own.horizon_return).abs();
        assert!(played.horizon_error > 0.0 && off < 2.0 * played.horizon_error, "{played:?} {own:?}");
        assert!((played.success - own.success).abs() <= 2.0 * played.success_error.max(1e-3));
        let exact = attack("history", grid, ensemble, T).returns;
        assert!((exact.horizon_return - own.horizon_return).abs() < 1e-9);
    }
}

/// On a grid small enough to count every window step by step, `history_k(1)` is what counting says.
#[test]
fn a_window_of_one_cell_is_counted_right() {
    let spec = GridSpec { rows: 3, cols: 2, goal: (0, 0), walls: vec![(2, 1)], slip: 0.15 };
    let grid = Grid::new(spec).unwrap();
    let (cells, horizon) = (grid.cells(), 7);
    let ensemble = random_ensemble(&grid, 2, 9);
    let executed = |c: usize, s: usize| grid.executed(ensemble.policies()[c].row(s));
    let p0 = 1.0 / grid.starts().len() as f64;
    // Expected times that expert c is at s having come from r, before step T; and that it starts at s.
    let mut weight = vec![vec![vec![0.0; cells]; cells]; 2];
    for (c, weight) in weight.iter_mut().enumerate() {
        let mut now = vec![0.0; cells];
        grid.starts().iter().for_each(|&s| now[s as usize] = p0);
        for _ in 1..horizon {
            let mut next = vec![0.0; cells];
            for &r in grid.starts() {
                let r = r as usize;
                for (p, &s) in executed(c, r).iter().zip(grid.next(r)) {
                    if s as usize != grid.goal() {
                        weight[r][s as usize] += now[r] * p;
                        next[s as usize] += now[r] * p;
                    }
                }
            }
            now = next;
        }
    }
    let row = |weights: [f64; 2], s: usize| -> [f64; ACTIONS] {
        let sum: f64 = weights.iter().sum();
        let p = if sum > 0.0 { weights.map(|w| w / sum) } else { [0.5; 2] };
        grid.executed(&std::array::from_fn(|a| (0..2).map(|c| p[c] * ensemble.policies()[c].row(s)[a]).sum()))
    };
    // The clone's own T steps: where it is and where it was.
    let mut steps = 0.0;
    let mut arrived = 0.0;
    let mut now = vec![vec![0.0; cells]; cells];
    for t in 0..horizon {
        let mut next = vec![vec![0.0; cells]; cells];
        let mut go = |p: f64, row: [f64; ACTIONS], s: usize| {
            steps += p;
            for (q, &to) in row.iter().zip(grid.next(s)) {
                if to as usize == grid.goal() { arrived += p * q } else { next[s][to as usize] += p * q }
            }
        };
        if t == 0 {
            grid.starts().iter().for_each(|&s| go(p0, row([1.0, 1.0], s as usize), s as usize));
        } else {
            for (r, row_of) in now.iter().enumerate() {
                for (s, &p) in row_of.iter().enumerate() {
                    if p > 0.0 {
                        go(p, row([weight[0][r][s], weight[1][r][s]], s), s);
                    }
                }
            }
        }
        now = next;
    }
    let clone = attack("history_k(1)", &grid, &ensemble, horizon as u32).returns;
    let scale = grid.starts().len() as f64 / grid.free_cells() as f64;
    assert!((clone.horizon_return + steps * scale).abs() < 1e-12, "{clone:?} {steps}");
    assert!((clone.success - arrived).abs() < 1e-12);
}

/// `filtered` against playing: a million steps, and what is cut off by a short T thrown away.
#[test]
fn dropping_failures_is_counted_right() {
    let grid = Grid::new(GridSpec { rows: 4, cols: 3, goal: (1, 1), walls: vec![(2, 1)], slip: 0.1 }).unwrap();
    let (ensemble, horizon) = (random_ensemble(&grid, 2, 4), 6);
    let exact = attack("filtered", &grid, &ensemble, horizon);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let starts = Starts::new(&grid);
    let mut counts = vec![[0.0; ACTIONS]; grid.cells()];
    let mut dropped = 0;
    for episode in 0..400_000 {
        let policy = &ensemble.policies()[episode % 2];
        let mut state = starts.start(rng.next_u32());
        let mut taken = Vec::new();
        while state != grid.goal() && taken.len() < horizon as usize {
            let mut x = rng.random::<f64>();
            let action = policy.row(state).iter().position(|p| {
                x -= p;
                x < 0.0
            });
            let action = action.unwrap_or(ACTIONS - 1);
            taken.push((state, action));
            state = starts.step(state, action, &mut rng);
        }
        if state == grid.goal() {
            taken.into_iter().for_each(|(s, a)| counts[s][a] += 1.0);
        } else {
            dropped += 1;
        }
    }
    assert!((50_000..350_000).contains(&dropped), "{dropped}");
    for &s in grid.starts() {
        let s = s as usize;
        let n: f64 = counts[s].iter().sum();
        for (p, count) in exact.policy.row(s).iter().zip(&counts[s]) {
            let found = count / n;
            assert!((p - found).abs() < 5.0 * (p.max(1e-4) / n).sqrt() + 1e-4, "{s}: {p} {found}");
        }
    }
}

/// The learned observer gets nearly all of the gap back that the blind clone leaves.
#[test]
fn the_gru_gets_the_gap_back() {
    let own = ensemble_returns(&GRID, &BLIND, T).horizon_return;
    let blind = attack("uniform", &GRID, &BLIND, T).returns.horizon_return;
    for units in [1, 4] {
        let learned = attack(&format!("gru({units})"), &GRID, &BLIND, T).returns;
        let share = (learned.horizon_return - blind) / (own - blind);
        assert!((0.97..1.03).contains(&share) && learned.success > 0.98, "{units}: {share}");
    }
}

/// One expert, or experts that are all alike: every cloner ends as good as they are.
#[test]
fn experts_that_agree_are_cloned() {
    let one = Ensemble::new(vec![BLIND.policies()[0].clone()]);
    let alike = Ensemble::new(vec![BLIND.policies()[1].clone(); 3]);
    for ensemble in [&one, &alike] {
        let own = ensemble_returns(&GRID, ensemble, T).horizon_return;
        for cloner in AttackerChoice::usual() {
            let clone = attack(&cloner.to_string(), &GRID, ensemble, T).returns;
            assert!((clone.horizon_return - own).abs() < 0.3, "{cloner}: {clone:?} {own}");
        }
    }
}

/// A seed gives the same clone again, another seed another one; and every attack can be stopped.
#[test]
fn attacks_repeat_and_stop() {
    let grid = Grid::new(GridSpec { rows: 4, cols: 4, ..GridSpec::default() }).unwrap();
    let config = Config { experts: 2, ..Config::default() };
    let mut trainer = Trainer::new(grid.clone(), config).unwrap();
    (0..20).for_each(|_| trainer.update());
    let ensemble = trainer.ensemble();
    let on = |cloner: AttackerChoice, seed| {
        cloner.clone_of(&Target { grid: &grid, ensemble: &ensemble, horizon: T, seed }, &mut |_| true).unwrap()
    };
    for cloner in ["replay(5)", "bc(500)", "bc_counts(500)", "gru(2)"] {
        let cloner: AttackerChoice = cloner.parse().unwrap();
        assert!(on(cloner, 1) == on(cloner, 1) && on(cloner, 1) != on(cloner, 2), "{cloner}");
    }
    for cloner in ["bc", "gru"] {
        let cloner: AttackerChoice = cloner.parse().unwrap();
        let target = Target { grid: &grid, ensemble: &ensemble, horizon: T, seed: 1 };
        assert!(cloner.clone_of(&target, &mut |_| false).is_none());
    }
}

/// The clone by a run's own observer is made of what that one has watched, and evaluated within the run's T.
#[test]
fn a_runs_own_clone_is_of_its_own_observer() {
    for observer in ["uniform", "replay(3)"] {
        let observer = observer.parse().unwrap();
        let config = Config { observer, horizon: 15, total_steps: 9000, ..Config::default() };
        let mut trainer = Trainer::new(GRID.clone(), config).unwrap();
        (0..2).for_each(|_| trainer.update());
        let own = own_clone(&mut trainer, 10);
        let (ensemble, contexts) = (trainer.ensemble(), trainer.contexts());
        let target = Target { grid: &GRID, ensemble: &ensemble, horizon: 15, seed: 1 };
        assert!(own == Cloned::mixture(&target, contexts), "{observer}");
    }
}

/// The interval of what was played: a proportion's for success, the rule of three where all arrive, and there is one
/// however few episodes are played.
#[test]
fn the_interval_of_success_is_that_of_a_proportion() {
    // Episodes begin in one cell only, so that all of them count for one proportion.
    let spec = GridSpec { rows: 2, cols: 2, goal: (0, 0), walls: vec![(0, 1), (1, 1)], slip: 0.0 };
    let grid = Grid::new(spec).unwrap();
    let ensemble = random_ensemble(&grid, 2, 8);
    let play = |horizon: u32, trials: usize| {
        let target = Target { grid: &grid, ensemble: &ensemble, horizon, seed: 4 };
        simulate(&target, &Posterior::new(&ensemble), trials, &mut |_| true).unwrap().1
    };
    let KnownReturns { success: p, success_error, .. } = play(1, 1000);
    assert!(p > 0.02 && p < 0.98, "{p}");
    assert!((success_error - 1.96 * (p * (1.0 - p) / 999.0).sqrt()).abs() < 1e-12, "{p} {success_error}");
    let all = play(10_000, 1000);
    assert_eq!((all.success, all.success_error), (1.0, 3.0 / 1000.0));
    let few = play(5, 1);
    assert!(few.horizon_error.is_finite() && few.success_error.is_finite(), "{few:?}");
    // Told to stop, it has no figures.
    let target = Target { grid: &grid, ensemble: &ensemble, horizon: 5, seed: 4 };
    let mut calls = 0;
    let mut once = |_: f64| {
        calls += 1;
        calls < 3
    };
    assert!(simulate(&target, &Posterior::new(&ensemble), 1000, &mut once).is_none());
}

/// What learns says of how many pairs it was made; a cell that was seen once is cloned as it was seen.
#[test]
fn pairs_are_counted() {
    let pairs = |name: &str| attack(name, &GRID, &BLIND, T).pairs;
    assert_eq!([pairs("bc(100)"), pairs("bc_counts(1)"), pairs("occupancy")], [Some(100), Some(1), None]);
    let small = Grid::new(GridSpec { rows: 3, cols: 3, ..GridSpec::default() }).unwrap();
    assert!(attack("gru(1)", &small, &random_ensemble(&small, 2, 1), 10).pairs > Some(1000));
    let once = attack("bc_counts(1)", &GRID, &BLIND, T).policy;
    let seen = once.rows().iter().filter(|row| row.contains(&1.0)).count();
    let unseen = once.rows().iter().filter(|row| **row == [0.2; ACTIONS]).count();
    assert_eq!((seen, unseen), (1, 99));
}

/// What a clone with a memory is drawn and run with.
#[test]
fn clones_that_remember_say_so_and_take_their_time() {
    let of = |name: &str| name.parse::<AttackerChoice>().unwrap();
    for name in ["history_k(1)", "history", "gru(4)"] {
        assert!(of(name).model().remembers, "{name}");
    }
    assert!(of("history_k(3)").is_quick(100, 100) && !of("history_k(3)").is_quick(1024, 10_000));
    assert!(of("history_k(1)").is_quick(1024, 1000) && !of("history_k(3)").is_quick(400, 1000));
    let steps = attack("history", &GRID, &BLIND, T).steps;
    let mean = GRID.starts().iter().map(|&start| steps[start as usize].min(100.0)).sum::<f64>() / 100.0;
    let own = ensemble_returns(&GRID, &BLIND, T).capped_return;
    assert!((mean + own).abs() < 1e-6, "{mean} {own}");
    // Its capped return is that of its own hitting times, which are means over experts, some of them lost.
    let lost = Policy::from_rows(vec![[1.0 / ACTIONS as f64; ACTIONS]; GRID.cells()]);
    let ensemble = Ensemble::new(vec![BLIND.policies()[0].clone(), lost]);
    let lost = attack("history", &GRID, &ensemble, T);
    let mean = GRID.starts().iter().map(|&start| lost.steps[start as usize].min(100.0)).sum::<f64>() / 100.0;
    assert!((mean + lost.returns.capped_return.unwrap()).abs() < 1e-6, "{mean} {:?}", lost.returns);
}

/// Where every episode arrives nothing is dropped: `filtered` is `occupancy`, in p(c|s) too.
#[test]
fn without_failures_filtered_is_occupancy() {
    let [filtered, occupancy] = ["filtered", "occupancy"].map(|name| attack(name, &GRID, &BLIND, 2000));
    let [filtered, occupancy] = [filtered, occupancy].map(|clone| clone.contexts.unwrap());
    for &start in GRID.starts() {
        let rows = filtered.row(start as usize).iter().zip(occupancy.row(start as usize));
        rows.for_each(|(a, b)| assert!((a - b).abs() < 1e-9, "{start}: {a} {b}"));
    }
}
