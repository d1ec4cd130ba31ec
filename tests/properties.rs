#![cfg(not(target_arch = "wasm32"))]
//! What must hold on every grid, for every ensemble and configuration: proptest makes them up, always the same ones, as
//! its generator has a fixed seed. What fails is shrunk and printed; nothing is kept in files.

use ape_lab::ape::observer::ObserverChoice;
use ape_lab::ape::{
    Algorithm, AlgorithmKind, Config, Contexts, Ensemble, EnsembleFile, ExactApe, FIELDS, Figures, Kind, Trainer,
};
use ape_lab::attack::{AttackerChoice, Cloned, Target};
use ape_lab::experiment::{Course, Outcome, Race, Setup, Task, address};
use ape_lab::lab::{Command, Event, Session, TaskEvent, decode, encode};
use ape_lab::mdp::{
    ACTIONS, Action, Grid, GridSpec, Policy, Returns, Solver, Transition, Value, occupancy, optimal_policy,
    transition_model,
};
use nalgebra::{DMatrix, DVector};
use proptest::prelude::{Strategy, any};
use proptest::test_runner::{Config as Runs, RngSeed, TestRunner};
use rand::{Rng, RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Where the paper cuts hitting times, in steps.
const CAP: f64 = 100.0;

/// Tries a property on so many values.
fn each<S: Strategy>(cases: u32, values: S, property: impl Fn(S::Value)) {
    let runs = Runs { cases, failure_persistence: None, rng_seed: RngSeed::Fixed(1), ..Runs::default() };
    let outcome = TestRunner::new(runs).run(&values, |value| {
        property(value);
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
}

/// A grid with an ensemble, and T.
#[derive(Clone, Debug)]
struct World {
    grid: Grid,
    ensemble: Ensemble,
    horizon: u32,
}

/// Grids of 2 × 2 to 7 × 7 cells with walls and slips, of up to four experts.
fn worlds() -> impl Strategy<Value = World> {
    let slip = proptest::prop_oneof![proptest::strategy::Just(0.0), 0.0..0.6f64];
    (2..8u32, 2..8u32, any::<u64>(), 0.0..0.4f64, slip, 1..5usize, 1..60u32).prop_map(
        |(rows, cols, seed, density, slip, experts, horizon)| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let grid = random_grid(rows, cols, density, slip, &mut rng);
            let policies = (0..experts).map(|_| random_policy(&grid, &mut rng)).collect();
            World { ensemble: Ensemble::new(policies), grid, horizon }
        },
    )
}

/// Walls at random; what they cut off is wall too.
fn random_grid(rows: u32, cols: u32, density: f64, slip: f64, rng: &mut Xoshiro256PlusPlus) -> Grid {
    let goal = (rng.random_range(0..rows), rng.random_range(0..cols));
    let mut spec = GridSpec { rows, cols, goal, walls: Vec::new(), slip };
    for cell in (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col))) {
        if cell != goal && rng.random_bool(density) {
            spec.walls.push(cell);
        }
    }
    let mut reached = vec![goal];
    let mut next = 0;
    while let Some(&(row, col)) = reached.get(next) {
        next += 1;
        for (down, right) in Action::ALL.map(Action::direction) {
            let cell = (row.wrapping_add_signed(down), col.wrapping_add_signed(right));
            if cell.0 < rows && cell.1 < cols && !spec.walls.contains(&cell) && !reached.contains(&cell) {
                reached.push(cell);
            }
        }
    }
    spec.walls = (0..rows).flat_map(|row| (0..cols).map(move |col| (row, col))).collect();
    spec.walls.retain(|cell| !reached.contains(cell));
    if reached.len() == 1 {
        spec.walls.clear();
    }
    Grid::new(spec).expect("every free cell is reached")
}

/// From nearly deterministic rows to nearly uniform ones; every action may happen.
fn random_policy(grid: &Grid, rng: &mut Xoshiro256PlusPlus) -> Policy {
    let sharpness: f64 = rng.random_range(0.0..3.0);
    let row = |_| {
        let weights: [f64; ACTIONS] = std::array::from_fn(|_| libm::exp(sharpness * rng.random_range(-1.0..1.0)));
        weights.map(|weight| weight / weights.iter().sum::<f64>())
    };
    let rows = (0..grid.cells()).map(row).collect();
    Policy::new(grid, rows).expect("rows sum to 1")
}

impl World {
    fn target(&self) -> Target<'_> {
        Target { grid: &self.grid, ensemble: &self.ensemble, horizon: self.horizon, seed: 7 }
    }

    fn clone_by(&self, attacker: &str) -> Cloned {
        let attacker: AttackerChoice = attacker.parse().unwrap();
        attacker.clone_of(&self.target(), &mut |_| true).unwrap()
    }

    fn values(&self) -> Vec<Value> {
        let mut solver = Solver::new(&self.grid);
        self.ensemble.policies().iter().map(|policy| solver.evaluate(policy, self.horizon)).collect()
    }
}

fn close(a: f64, b: f64, tolerance: f64) -> bool {
    (a - b).abs() <= tolerance * (1.0 + a.abs().max(b.abs()))
}

fn assert_same(a: &Returns, b: &Returns, tolerance: f64) {
    let pairs = [
        (a.capped_return, b.capped_return),
        (a.uncapped_return, b.uncapped_return),
        (a.horizon_return, b.horizon_return),
        (a.success, b.success),
    ];
    assert!(pairs.into_iter().all(|(a, b)| close(a, b, tolerance)), "{a:?} {b:?}");
}

/// The stationary clones.
const MIXTURES: [&str; 3] = ["uniform", "occupancy", "replay(20)"];

#[test]
fn rows_sum_to_one() {
    let is_row = |row: &[f64]| row.iter().all(|p| *p >= 0.0) && (row.iter().sum::<f64>() - 1.0).abs() < 1e-12;
    each(300, worlds(), |world| {
        assert!(optimal_policy(&world.grid).rows().iter().all(|row| is_row(row)));
        for attacker in MIXTURES.into_iter().chain(["filtered", "history", "history_k(1)", "bc_counts(500)"]) {
            let cloned = world.clone_by(attacker);
            assert!(cloned.policy.rows().iter().all(|row| is_row(row)), "{attacker}");
            assert!(cloned.contexts.iter().flat_map(Contexts::rows).all(is_row), "{attacker}");
        }
        let model = transition_model(&world.grid);
        assert!(is_row(&model.initial_state_distrib));
        for ways in model.transitions.values().flat_map(|actions| actions.values()) {
            assert!(is_row(&ways.iter().map(|way| way.0).collect::<Vec<_>>()));
        }
    });
    // And after training, however it is configured.
    each(40, (worlds(), configs()), |(world, config)| {
        let Ok(mut trainer) = Trainer::new(world.grid, config) else { return };
        (0..3).for_each(|_| trainer.update());
        assert!(trainer.ensemble().policies().iter().flat_map(Policy::rows).all(|row| is_row(row)));
        assert!(trainer.contexts().rows().all(is_row));
    });
}

/// (I − P)h = 1 of π̃ by a dense LU decomposition of another library, on P from the model for other people's planners.
#[test]
fn the_banded_solver_agrees_with_a_dense_one() {
    each(400, worlds(), |world| {
        let (grid, model) = (&world.grid, transition_model(&world.grid));
        let starts: Vec<usize> = grid.starts().iter().map(|&state| state as usize).collect();
        for (policy, value) in world.ensemble.policies().iter().zip(world.values()) {
            let mut matrix = DMatrix::<f64>::identity(starts.len(), starts.len());
            for (i, &state) in starts.iter().enumerate() {
                for (action, p) in policy.row(state).map(|p| (1.0 - 1e-9) * p + 1e-9 / 5.0).into_iter().enumerate() {
                    for &Transition(chance, next, _, is_over) in &model.transitions[&state][&action] {
                        if !is_over {
                            let j = starts.binary_search(&next).expect("steps lead to free cells");
                            matrix[(i, j)] -= p * chance;
                        }
                    }
                }
            }
            let dense = matrix.lu().solve(&DVector::from_element(starts.len(), 1.0)).expect("π̃ arrives");
            for (i, &state) in starts.iter().enumerate() {
                assert!(close(value.hitting_time[state], dense[i], 1e-7), "{} {}", value.hitting_time[state], dense[i]);
            }
            let mean = |of: &dyn Fn(f64) -> f64| -dense.iter().map(|&h| of(h)).sum::<f64>() / grid.free_cells() as f64;
            assert!(close(value.returns.uncapped_return, mean(&|h| h), 1e-7));
            assert!(close(value.returns.capped_return, mean(&|h| h.min(CAP)), 1e-7));
        }
    });
}

/// Exact returns within T against episodes that are played with the transition model alone: within five standard errors,
/// which of some hundred figures with fixed seeds none leaves by chance.
#[test]
fn exact_returns_are_those_of_episodes() {
    const EPISODES: u32 = 4000;
    each(100, worlds(), |world| {
        let model = transition_model(&world.grid);
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut draw = |shares: &[f64]| {
            let mut left = rng.random::<f64>();
            let taken = shares.iter().position(|share| {
                left -= share;
                left < 0.0
            });
            taken.unwrap_or(shares.len() - 1)
        };
        for (policy, value) in world.ensemble.policies().iter().zip(world.values()) {
            let (mut sum, mut squares, mut arrived) = (0.0, 0.0, 0.0);
            for _ in 0..EPISODES {
                let mut state = draw(&model.initial_state_distrib);
                let mut steps = 0;
                while steps < world.horizon && state != model.goal {
                    let ways = &model.transitions[&state][&draw(policy.row(state))];
                    state = ways[draw(&ways.iter().map(|way| way.0).collect::<Vec<_>>())].1;
                    steps += 1;
                }
                sum += f64::from(steps);
                squares += f64::from(steps) * f64::from(steps);
                arrived += f64::from(u8::from(state == model.goal));
            }
            let n = f64::from(EPISODES);
            let over_starts = world.grid.free_cells() as f64 / world.grid.starts().len() as f64;
            // A share of a few in thousands is as uncertain as one of three.
            let error = |mean: f64, variance: f64, least: f64| (mean, 5.0 * (variance.max(least) / n).sqrt());
            let (mean, share) = (sum / n, arrived / n);
            let (steps, steps_error) = error(mean, squares / n - mean * mean, 3.0 / n);
            let (success, success_error) = error(share, share * (1.0 - share), 3.0 / n);
            let found = -value.returns.horizon_return * over_starts;
            assert!((found - steps).abs() < steps_error, "{found} {steps} ± {steps_error}");
            assert!((value.returns.success - success).abs() < success_error, "{} {success}", value.returns.success);
        }
    });
}

/// min(·, T) is concave, so that E[min(τ, T)] ≤ min(E τ, T); who is not there by T has taken T steps; longer episodes cost
/// more and arrive more often.
#[test]
fn the_four_returns_go_together() {
    // The hitting times carry a noise of 1e−9.
    const NOISE: f64 = 1e-6;
    each(300, worlds(), |world| {
        let share = world.grid.starts().len() as f64 / world.grid.free_cells() as f64;
        let mut solver = Solver::new(&world.grid);
        let optimal = solver.evaluate(&optimal_policy(&world.grid), world.horizon).hitting_time;
        // Bellman: no other action is better, by the model for other people's planners.
        for (state, actions) in &transition_model(&world.grid).transitions {
            for ways in actions.values().filter(|_| world.grid.starts().contains(&(*state as u32))) {
                let ahead: f64 = ways.iter().map(|way| way.0 * optimal[way.1]).sum();
                assert!(1.0 + ahead >= optimal[*state] * (1.0 - NOISE), "{state}: {ahead} {optimal:?}");
            }
        }
        for policy in world.ensemble.policies() {
            let at = |solver: &mut Solver, horizon: u32| solver.evaluate(policy, horizon);
            let Value { hitting_time, returns } = at(&mut solver, world.horizon);
            let Returns { capped_return, uncapped_return, horizon_return, success } = returns;
            let slack = NOISE * (1.0 + uncapped_return.abs());
            assert!(uncapped_return <= capped_return && capped_return >= -CAP * share - slack);
            assert!(capped_return <= -share && horizon_return <= -share + slack && (0.0..=1.0).contains(&success));
            assert!(horizon_return >= uncapped_return - slack, "{returns:?}");
            let horizon = f64::from(world.horizon);
            assert!(-horizon_return / share <= horizon + slack);
            assert!(-horizon_return / share >= horizon * (1.0 - success) + success - slack, "{returns:?}");
            let at_cap = at(&mut solver, CAP as u32).returns;
            assert!(at_cap.horizon_return >= capped_return - slack, "{at_cap:?}");
            let longer = at(&mut solver, world.horizon + 1).returns;
            assert!(longer.horizon_return <= horizon_return && longer.success >= success - 1e-12);
            assert!(hitting_time.iter().zip(&optimal).all(|(h, best)| *h >= best - slack), "nobody is faster");
        }
    });
}

/// docs/METHOD.md: E[steps of the clone] = D + Σ m(s) h_clone(s), for whoever clones the demonstrations.
#[test]
fn the_identity_holds() {
    each(300, worlds(), |world| {
        let clone = world.clone_by("occupancy");
        let n = world.ensemble.experts() as f64;
        let (mut demonstrated, mut to_come) = (0.0, 0.0);
        for policy in world.ensemble.policies() {
            let of = occupancy(&world.grid, policy, world.horizon);
            demonstrated += of.visits.iter().sum::<f64>() / n;
            to_come += of.cut_off.iter().zip(&clone.steps).map(|(m, h)| m * h).sum::<f64>() / n;
        }
        let starts = world.grid.starts();
        let steps = starts.iter().map(|&s| clone.steps[s as usize]).sum::<f64>() / starts.len() as f64;
        assert!(close(steps, demonstrated + to_come, 1e-6), "{steps} {demonstrated} + {to_come}");
        // Nothing is cut off in so many steps: the clone is as good as the ensemble.
        let long = World { horizon: 10_000, ..world };
        let figures = Figures::of(&long.grid, &long.ensemble, long.horizon);
        let clone = long.clone_by("occupancy").returns;
        if figures.ensemble.success > 1.0 - 1e-9 {
            assert!(close(figures.ensemble.uncapped_return, clone.uncapped_return.unwrap(), 1e-4), "{figures:?}");
        }
    });
}

#[test]
fn the_clone_of_one_expert_is_the_expert() {
    each(300, worlds(), |world| {
        let expert = world.ensemble.policies()[0].clone();
        let world = World { ensemble: Ensemble::new(vec![expert.clone()]), ..world };
        let own = &world.values()[0];
        for attacker in MIXTURES {
            let cloned = world.clone_by(attacker);
            assert_eq!(cloned.policy, expert, "{attacker}");
            assert_eq!((cloned.steps, cloned.returns), (own.hitting_time.clone(), own.returns.into()), "{attacker}");
        }
        for attacker in ["history", "history_k(1)", "history_k(2)"] {
            let returns = world.clone_by(attacker).returns;
            assert!(close(returns.horizon_return, own.returns.horizon_return, 1e-9), "{attacker}");
            assert!(close(returns.success, own.returns.success, 1e-9), "{attacker}");
        }
    });
}

/// At β = 0 there is only the goal, and both algorithms find it; without much of a bonus on entropy, which keeps policies
/// from being sure where moves slip and little is lost by a wrong one.
#[test]
fn without_beta_the_ensemble_is_near_the_optimum() {
    let near = |world: &World, algorithm: AlgorithmKind| {
        let config = Config {
            beta: 0.0,
            algorithm,
            entropy_start: 0.02,
            entropy_end: 0.0,
            exact_updates: 600,
            ..Config::default()
        };
        let mut trainer = Trainer::new(world.grid.clone(), config).unwrap();
        assert!(trainer.finish(&mut |_| true));
        let mut solver = Solver::new(&world.grid);
        let optimal = solver.evaluate(&optimal_policy(&world.grid), 100).returns.horizon_return;
        for returns in trainer.ensemble().returns(&mut solver, 100) {
            assert!(returns.horizon_return > optimal - 0.2, "{algorithm:?}: {returns:?}, optimal {optimal}");
        }
    };
    each(10, worlds(), |world| near(&world, AlgorithmKind::Exact));
    // What is sampled finds its way in as many updates where nothing slips, as on the paper's grid.
    each(6, worlds(), |world| {
        let grid = Grid::new(GridSpec { slip: 0.0, ..world.grid.spec().clone() }).unwrap();
        near(&World { grid, ..world }, AlgorithmKind::PgApe);
    });
}

/// Where a cell and an action of one grid are in another that looks just like it.
struct Symmetry {
    grid: Grid,
    cell: Vec<usize>,
    action: [usize; ACTIONS],
}

impl Symmetry {
    /// Rows upside down, columns the other way round, or rows for columns.
    fn all(grid: &Grid) -> [Symmetry; 3] {
        let spec = grid.spec();
        let (rows, cols) = (spec.rows, spec.cols);
        let new = |move_to: &dyn Fn((u32, u32)) -> (u32, u32), (rows, cols), action| {
            let walls = spec.walls.iter().map(|&wall| move_to(wall)).collect();
            let spec = GridSpec { rows, cols, goal: move_to(spec.goal), walls, slip: spec.slip };
            let cell = |state| {
                let (row, col) = move_to(grid.cell(state));
                (row * cols + col) as usize
            };
            Symmetry { cell: (0..grid.cells()).map(cell).collect(), grid: Grid::new(spec).unwrap(), action }
        };
        // Actions are Up, Down, Left, Right, Stay.
        [
            new(&|(row, col)| (rows - 1 - row, col), (rows, cols), [1, 0, 2, 3, 4]),
            new(&|(row, col)| (row, cols - 1 - col), (rows, cols), [0, 1, 3, 2, 4]),
            new(&|(row, col)| (col, row), (cols, rows), [2, 3, 0, 1, 4]),
        ]
    }

    fn rows(&self, rows: &[[f64; ACTIONS]]) -> Vec<[f64; ACTIONS]> {
        let mut moved = vec![[0.0; ACTIONS]; rows.len()];
        for (state, row) in rows.iter().enumerate() {
            for (action, p) in row.iter().enumerate() {
                moved[self.cell[state]][self.action[action]] = *p;
            }
        }
        moved
    }

    fn world(&self, world: &World) -> World {
        let policies = world.ensemble.policies().iter();
        let policies = policies.map(|policy| Policy::from_rows(self.rows(policy.rows()))).collect();
        World { grid: self.grid.clone(), ensemble: Ensemble::new(policies), horizon: world.horizon }
    }
}

/// The gradient of exact APE at the logarithms of an ensemble's probabilities, `[n][S]`.
fn gradient(world: &World, observer: ObserverChoice) -> Vec<Vec<[f64; ACTIONS]>> {
    let experts = world.ensemble.experts();
    let algorithm = AlgorithmKind::Exact;
    let config = Config { algorithm, observer, experts: experts as u32, horizon: world.horizon, ..Config::default() };
    let mut ape = ExactApe::new(world.grid.clone(), config);
    let rows = world.ensemble.policies().iter().flat_map(|policy| policy.rows());
    ape.experts_mut().logits = rows.flat_map(|row| row.map(libm::log)).collect();
    let gradient = ape.gradient().logits;
    gradient.as_chunks::<ACTIONS>().0.chunks(world.grid.cells()).map(<[_]>::to_vec).collect()
}

fn assert_rows(a: &[[f64; ACTIONS]], b: &[[f64; ACTIONS]], tolerance: f64) {
    assert_eq!(a.len(), b.len());
    let mut pairs = a.as_flattened().iter().zip(b.as_flattened());
    assert!(pairs.all(|(a, b)| close(*a, *b, tolerance)), "{a:?}\n{b:?}");
}

#[test]
fn a_grid_looked_at_from_elsewhere_gives_the_same() {
    each(300, worlds(), |world| {
        for symmetry in Symmetry::all(&world.grid) {
            let other = symmetry.world(&world);
            for (here, there) in world.values().iter().zip(other.values()) {
                assert_same(&here.returns, &there.returns, 1e-9);
                let cells = symmetry.cell.iter().zip(&here.hitting_time);
                cells.for_each(|(&cell, h)| assert!(close(*h, there.hitting_time[cell], 1e-9)));
            }
            let free = |grid: &Grid, policy: Policy| {
                let rows = policy.rows().iter().enumerate();
                rows.map(|(state, row)| if grid.is_wall(state) { [0.0; ACTIONS] } else { *row }).collect::<Vec<_>>()
            };
            let best = symmetry.rows(&free(&world.grid, optimal_policy(&world.grid)));
            assert_rows(&best, &free(&other.grid, optimal_policy(&other.grid)), 1e-9);
            for attacker in ["uniform", "occupancy", "filtered", "history_k(1)"] {
                let (here, there) = (world.clone_by(attacker), other.clone_by(attacker));
                assert!(close(here.returns.horizon_return, there.returns.horizon_return, 1e-9), "{attacker}");
                assert!(close(here.returns.success, there.returns.success, 1e-9), "{attacker}");
            }
            for observer in [ObserverChoice::UNIFORM, ObserverChoice::OCCUPANCY] {
                for (here, there) in gradient(&world, observer).iter().zip(gradient(&other, observer)) {
                    assert_rows(&symmetry.rows(here), &there, 1e-8);
                }
            }
        }
    });
}

#[test]
fn experts_in_another_order_give_the_same() {
    each(200, worlds(), |world| {
        let mut turned = world.ensemble.policies().to_vec();
        turned.rotate_left(1);
        let other = World { ensemble: Ensemble::new(turned), ..world.clone() };
        let (mut here, there) = (world.values(), other.values());
        here.rotate_left(1);
        assert_eq!(here, there);
        for attacker in ["uniform", "occupancy", "filtered", "history", "history_k(1)"] {
            let (here, there) = (world.clone_by(attacker), other.clone_by(attacker));
            assert_rows(here.policy.rows(), there.policy.rows(), 1e-12);
            assert!(close(here.returns.horizon_return, there.returns.horizon_return, 1e-9), "{attacker}");
            for (here, there) in here.contexts.iter().zip(&there.contexts) {
                for (here, there) in here.rows().zip(there.rows()) {
                    let mut here = here.to_vec();
                    here.rotate_left(1);
                    assert!(here.iter().zip(there).all(|(here, there)| close(*here, *there, 1e-12)), "{attacker}");
                }
            }
        }
        for observer in [ObserverChoice::UNIFORM, ObserverChoice::OCCUPANCY] {
            let mut here = gradient(&world, observer);
            here.rotate_left(1);
            for (here, there) in here.iter().zip(gradient(&other, observer)) {
                assert_rows(here, &there, 1e-9);
            }
        }
    });
}

/// Configurations over the whole range of every field, but for the length of episodes and batches, which take time. What does
/// not go together is made to.
fn configs() -> impl Strategy<Value = Config> {
    any::<u64>().prop_map(|seed| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        loop {
            let mut config = Config::default();
            for field in &FIELDS {
                match &field.kind {
                    Kind::Real { low, high, set, .. } => set(&mut config, rng.random_range(*low..=*high)),
                    Kind::Whole { low, high, set, .. } => set(&mut config, rng.random_range(*low..=*high)),
                    Kind::Word { options, set, .. } => {
                        let options = options();
                        assert!(set(&mut config, &options[rng.random_range(0..options.len())]));
                    }
                    Kind::Text { .. } => {}
                }
            }
            config.horizon = 1 + config.horizon % 50;
            config.batch_steps = 1 + config.batch_steps % 300;
            config.total_steps %= 1_000_000;
            config.total_steps += 1;
            config.alpha = rng.random_bool(0.3).then(|| rng.random_range(-50.0..-0.1));
            if config.check().is_ok() {
                return config;
            }
        }
    })
}

fn setups() -> impl Strategy<Value = Setup> {
    (worlds(), configs(), any::<u64>()).prop_map(|(world, mut config, seed)| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let start = world.grid.cell(world.grid.starts()[rng.random_range(0..world.grid.starts().len())] as usize);
        if config.observer.model().name != "gru" && rng.random_bool(0.5) {
            let reward: f64 = rng.random_range(-1000.0..1000.0);
            config.adversary_reward =
                format!("{},{}={reward} stay={}", start.0, start.1, 0.5 - reward / 1e3).parse().ok();
        }
        let updates = rng.random_bool(0.5).then(|| rng.random_range(20..10_000_000));
        let last = updates.unwrap_or(config.updates());
        let mut turns: Vec<(u32, f64)> = (0..rng.random_range(0..5))
            .map(|_| (rng.random_range(0..last), rng.random_range(0.0..=Config::MAX_BETA)))
            .collect();
        turns.sort_by_key(|(update, _)| *update);
        turns.dedup_by_key(|(update, _)| *update);
        let setup =
            Setup { grid: world.grid.spec().clone(), config, course: Course { turns, updates }, ensemble: None };
        setup.check().unwrap();
        setup
    })
}

#[test]
fn what_is_written_reads_back() {
    each(600, setups(), |setup| {
        let text = address::encode(&address::write(&setup));
        let mut pairs = address::decode(&text).unwrap();
        assert_eq!(address::read(&mut pairs), Ok(setup.clone()), "{text}");
        assert_eq!(address::finish(&pairs), Ok(()));
        let json = serde_json::to_string(&setup.config).unwrap();
        assert_eq!(serde_json::from_str::<Config>(&json).unwrap(), setup.config);
        let load = Command::Load { setup: Box::new(setup.clone()), play: true };
        assert_eq!(decode(&encode(&load)), Ok(load));
        let sweep = Task::Sweep { setup: Box::new(setup) };
        assert_eq!(decode(&encode(&sweep)), Ok(sweep));
    });
    each(200, (worlds(), configs()), |(world, config)| {
        let file = EnsembleFile::new(&world.grid, &world.ensemble, Some(config));
        let json = serde_json::to_string(&file).unwrap();
        let parsed = EnsembleFile::parse(&json).unwrap();
        assert_eq!(parsed, file);
        assert_eq!(parsed.check(), Ok((world.grid.clone(), world.ensemble.clone())));
        let start = world.grid.cell(world.grid.starts()[0] as usize);
        let cloner = AttackerChoice::OCCUPANCY;
        let race =
            Race { ensemble: file, cloner, expert: None, start, horizon: world.horizon, episodes: 3, seed: 1, luck: 2 };
        let task = Task::Race(Box::new(race));
        assert_eq!(decode(&encode(&task)), Ok(task.clone()));
        let outcome: Outcome = task.run(&|| 0.0, &mut |_| true).unwrap().unwrap();
        assert_eq!(outcome.check(&task), Ok(()));
        let done = TaskEvent::Done(Box::new(outcome), 1.5);
        assert_eq!(decode(&encode(&done)), Ok(done));
    });
}

/// A session may be given any setup that is valid: all that it says reads back, and is what a page takes.
#[test]
fn what_a_session_says_can_be_shown() {
    each(100, setups(), |setup| {
        let mut session = Session::new();
        session.handle(Command::Show(vec![AttackerChoice::OCCUPANCY, "filtered".parse().unwrap()]));
        session.handle(Command::Load { setup: Box::new(setup), play: false });
        session.handle(Command::Export);
        let mut grid = None;
        for now in [0.0, 100.0, 200.0] {
            session.advance(&|| now);
            let events = session.events();
            assert!(!events.is_empty());
            for event in events {
                assert_eq!(decode(&encode(&event)), Ok(event.clone()));
                match event {
                    Event::Started(started) => grid = Some(started.check().unwrap()),
                    Event::Snapshot(snapshot) => {
                        assert_eq!(snapshot.check(grid.as_ref().unwrap()), Ok(()));
                        session.handle(Command::Seen(snapshot.number));
                    }
                    Event::Exported(exported) => assert_eq!(exported.check(), Ok(())),
                    other => panic!("{other:?}"),
                }
            }
            session.handle(Command::Step);
        }
    });
}

/// What is cut, or changed in one place, is read or refused; never more than that.
#[test]
fn damaged_messages_are_refused_or_read() {
    each(60, (setups(), any::<u64>()), |(setup, seed)| {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let bytes = encode(&Command::Load { setup: Box::new(setup), play: true });
        assert!((0..bytes.len()).all(|length| decode::<Command>(&bytes[..length]).is_err()));
        assert!(decode::<Command>(&[&bytes[..], &[0]].concat()).is_err());
        for _ in 0..50 {
            let mut bytes = bytes.clone();
            let at = rng.random_range(0..bytes.len());
            bytes[at] ^= 1 << (rng.next_u32() % 8);
            if let Ok(Command::Load { setup, .. }) = decode(&bytes) {
                let _ = setup.check();
            }
        }
    });
}
