//! Digests of all parameters after 50 updates: the same natively, under node and in a browser.
//!
//! They change only when training itself changes, which has to be said where it happens.

use ape_lab::ape::{BaselineKind, Config, GradientKind, ReturnToGo, Trainer};
use ape_lab::mdp::{Grid, GridSpec};

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
    for (name, grid, config, expected) in [
        ("blind", GridSpec::default(), blind, 0xd7a37a4b3f88e32e),
        ("paper", GridSpec::default(), paper, 0x0790de7bb31be379),
        ("other", slippery, other, 0x9a22f2c61dfd3395),
    ] {
        let mut trainer = Trainer::new(Grid::new(grid).unwrap(), config).unwrap();
        for _ in 0..50 {
            trainer.update();
        }
        let digest: u64 = trainer.digest();
        assert_eq!(digest, expected, "{name}: {digest:#018x}");
    }
}
