//! Digests of all parameters after 50 updates, and of learned clones: the same natively, under node and in a browser.
//!
//! They change only when training itself changes, which has to be said where it happens.

use std::hash::Hasher;

use ape_lab::ape::{AlgorithmKind, BaselineKind, Config, Digest, GradientKind, ReturnToGo, Trainer};
use ape_lab::attack::{AttackerChoice, Target};
use ape_lab::experiment::{PRESETS, Preset};
use ape_lab::mdp::{Grid, GridSpec};

/// Of every preset that trains, with some seeds, after a run of 40 updates: preset, seed, digest. `cargo xtask test release`
/// compares the optimised command line with it, too.
const PRESETS_AND_SEEDS: &str = include_str!("presets.csv");

/// Trains every preset with every seed of the table and compares.
pub fn check_presets() {
    let mut found = Vec::new();
    for line in PRESETS_AND_SEEDS.lines().skip(1) {
        let [name, seed, expected] = line.split(',').collect::<Vec<_>>()[..] else { panic!("{line}") };
        let setup = (Preset::find(name).unwrap().setup)();
        let config = Config { seed: seed.parse().unwrap(), total_steps: 40 * 4096, exact_updates: 40, ..setup.config };
        assert_eq!(config.updates(), 40);
        let mut trainer = Trainer::new(Grid::new(setup.grid).unwrap(), config).unwrap();
        (0..40).for_each(|_| trainer.update());
        found.push(format!("{name},{seed},{}", trainer.digest()));
        assert_eq!(found.last().unwrap(), &format!("{name},{seed},{expected}"));
    }
    let trains = |preset: &&Preset| (preset.setup)().ensemble.is_none();
    for preset in PRESETS.iter().filter(trains) {
        let seeds = found.iter().filter(|line| line.starts_with(&format!("{},", preset.name))).count();
        assert_eq!(seeds, 3, "{}", preset.name);
    }
}

/// Trains every configuration for 50 updates and compares.
pub fn check() {
    let slippery = GridSpec { rows: 7, cols: 9, goal: (3, 4), walls: vec![(2, 4), (3, 3)], slip: 0.1 };
    let blind = Config::default();
    let paper = Config::paper();
    let other = Config {
        experts: 5,
        beta: 0.9,
        observer: "occupancy".parse().unwrap(),
        gradient: GradientKind::Mixture,
        baseline: BaselineKind::Joint,
        return_to_go: ReturnToGo::FromStart,
        seed: 77,
        ..Config::default()
    };
    let exact = Config {
        experts: 3,
        algorithm: AlgorithmKind::Exact,
        observer: "occupancy".parse().unwrap(),
        alpha: Some(-20.0),
        exact_updates: 60,
        ..Config::default()
    };
    let memory = Config {
        observer: "history".parse().unwrap(),
        adversary_reward: Some("0,3=-1 stay=0.5".parse().unwrap()),
        ..Config::default()
    };
    for (name, grid, config, expected) in [
        ("blind", GridSpec::default(), blind, 0xf710efa24bbb0806),
        ("paper", GridSpec::default(), paper, 0x5f1d5281d7d8b841),
        ("other", slippery.clone(), other, 0x2d4ad861ed8f1efb),
        ("exact", slippery.clone(), exact, 0x99856c682fe9a038),
        ("memory", slippery.clone(), memory, 0xd3a0f85928ca4b9a),
    ] {
        let mut trainer = Trainer::new(Grid::new(grid).unwrap(), config).unwrap();
        for _ in 0..50 {
            trainer.update();
        }
        let Digest(digest) = trainer.digest();
        assert_eq!(digest, expected, "{name}: {digest:#018x}");
    }
}

/// Attacks a short run on a slippery grid with everything that learns, counts or plays, and compares.
pub fn check_clones() {
    let spec = GridSpec { rows: 5, cols: 4, goal: (1, 1), walls: vec![(2, 2)], slip: 0.1 };
    let grid = Grid::new(spec).unwrap();
    let mut trainer = Trainer::new(grid.clone(), Config { experts: 3, ..Config::default() }).unwrap();
    (0..60).for_each(|_| trainer.update());
    let ensemble = trainer.ensemble();
    for (name, expected) in [
        ("replay(9)", 0xc59c49899f7dcab4),
        ("bc(2000)", 0xae1db3ee8c914433),
        ("bc_counts(2000)", 0x6a87d34c6b707474),
        ("filtered", 0x4f3fcfcd69353a0c),
        ("history_k(2)", 0xaf122915b83035cd),
        ("gru(2)", 0xf511c170ecd4146c),
    ] {
        let choice: AttackerChoice = name.parse().unwrap();
        let target = Target { grid: &grid, ensemble: &ensemble, horizon: 30, seed: 5 };
        let clone = choice.clone_of(&target, &mut |_| true).unwrap();
        let returns = [clone.returns.horizon_return, clone.returns.success, clone.returns.horizon_error];
        let mut digest = fnv::FnvHasher::default();
        for number in clone.policy.rows().iter().flatten().chain(&clone.steps).chain(&returns) {
            digest.write(&number.to_bits().to_le_bytes());
        }
        let digest = digest.finish();
        assert_eq!(digest, expected, "{name}: {digest:#018x}");
    }
}
