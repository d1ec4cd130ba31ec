//! What the benchmarks do, by name: `core` measures the time of it, `counts` the instructions.
//!
//! Every configuration is the library's default with one thing changed. Only what users of the library can call is
//! used, so that the inside may be rewritten and still be compared with what it was.

// Each benchmark takes its own part of this.
#![allow(dead_code)]

use std::cell::Cell;

use ape_lab::ape::observer::ObserverChoice;
use ape_lab::ape::{AlgorithmKind, BaselineKind, Config, Ensemble, GradientKind, Trainer};
use ape_lab::attack::{AttackerChoice, Target};
use ape_lab::experiment::{PRESETS, Setup};
use ape_lab::lab::{Command, Event, RunState, Session, encode};
use ape_lab::mdp::{Grid, GridSpec};

/// A training run, the default one but for one thing.
pub struct Training {
    pub name: &'static str,
    change: fn(&mut Setup),
}

/// Every kind of training run that is measured; the default first.
pub const TRAININGS: [Training; 10] = [
    Training { name: "default", change: |_| {} },
    Training { name: "joint", change: |setup| setup.config.baseline = BaselineKind::Joint },
    Training { name: "replay", change: |setup| setup.config.observer = ObserverChoice::PAPER },
    Training { name: "occupancy", change: |setup| setup.config.observer = ObserverChoice::OCCUPANCY },
    Training { name: "mixture", change: |setup| setup.config.gradient = GradientKind::Mixture },
    Training { name: "experts-8", change: |setup| setup.config.experts = Config::MAX_EXPERTS },
    Training {
        name: "adversary-reward",
        change: |setup| {
            let preset = PRESETS.iter().find(|preset| preset.name == "lure").expect("it is in the table");
            setup.config.adversary_reward = (preset.setup)().config.adversary_reward;
        },
    },
    Training { name: "slip", change: |setup| setup.grid.slip = 0.1 },
    Training { name: "history", change: |setup| setup.config.observer = "history".parse().expect("it is a model") },
    Training { name: "exact", change: |setup| setup.config.algorithm = AlgorithmKind::Exact },
];

impl Training {
    pub fn named(name: &str) -> &'static Training {
        TRAININGS.iter().find(|training| training.name == name).expect("asked for by a name in the table")
    }

    pub fn setup(&self) -> Setup {
        let mut setup = Setup::default();
        (self.change)(&mut setup);
        setup
    }
}

pub fn trainer(setup: &Setup) -> Trainer {
    Trainer::new(grid(&setup.grid), setup.config.clone()).expect("the configuration is good")
}

pub fn grid(spec: &GridSpec) -> Grid {
    Grid::new(spec.clone()).expect("the grid is good")
}

/// The paper's grid with another side.
pub fn square(side: u32) -> GridSpec {
    GridSpec { rows: side, cols: side, ..GridSpec::default() }
}

/// That of the paper's grid.
pub fn side() -> u32 {
    GridSpec::default().rows
}

/// Environment steps of a whole run: τ₁ and τ₂ of every update. Batches end with a whole episode, so that about one step in
/// a hundred more is played than is counted here.
pub fn steps(config: &Config) -> u64 {
    u64::from(config.updates()) * steps_of_update(config)
}

pub fn steps_of_update(config: &Config) -> u64 {
    2 * u64::from(config.batch_steps)
}

/// Trains a run from start to end.
pub fn run(setup: &Setup) -> u64 {
    let mut trainer = trainer(setup);
    trainer.finish(&mut |_| true);
    trainer.digest().0
}

/// Experts that have learned for a while: neither uniform nor settled.
pub fn experts(setup: &Setup) -> Ensemble {
    const UPDATES: u32 = 64;
    let mut trainer = trainer(setup);
    while trainer.updates() < UPDATES {
        trainer.update();
    }
    trainer.ensemble()
}

/// What `attacker` makes of the default run's experts: its clone's return within T.
pub fn clone(setup: &Setup, ensemble: &Ensemble, attacker: AttackerChoice) -> f64 {
    let grid = grid(&setup.grid);
    let Config { horizon, seed, .. } = setup.config;
    let target = Target { grid: &grid, ensemble, horizon, seed };
    attacker.clone_of(&target, &mut |_| true).expect("it was not told to stop").returns.horizon_return
}

/// A finished run on the page, with the two clones that the page shows at first.
pub struct Desk {
    session: Session,
    now: Cell<f64>,
}

impl Desk {
    pub fn new(setup: Setup) -> Desk {
        let mut session = Session::new();
        session.handle(Command::Load { setup: Box::new(setup), play: true });
        let mut desk = Desk { session, now: Cell::new(0.0) };
        while desk.next().is_none_or(|(state, _)| state != RunState::Finished) {}
        // What the curve has to say has been said.
        desk.snapshot();
        desk
    }

    /// Makes a snapshot and returns its bytes.
    pub fn snapshot(&mut self) -> Vec<u8> {
        self.session.handle(Command::Show(vec![AttackerChoice::OCCUPANCY]));
        self.next().expect("something has changed").1
    }

    /// Works until it rests or has something to show.
    fn next(&mut self) -> Option<(RunState, Vec<u8>)> {
        /// What this clock's every look adds to it, in milliseconds: long enough for a snapshot to be due.
        const TICK: f64 = 5.0;
        let clock = || {
            self.now.set(self.now.get() + TICK);
            self.now.get()
        };
        for _ in 0..100 {
            self.session.advance(&clock);
            let events = self.session.events();
            let snapshot = events.iter().find_map(|event| match event {
                Event::Snapshot(snapshot) => Some((snapshot.number, snapshot.state, encode(event))),
                _ => None,
            });
            if let Some((number, state, bytes)) = snapshot {
                self.session.handle(Command::Seen(number));
                return Some((state, bytes));
            }
        }
        None
    }
}
