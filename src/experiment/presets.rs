//! The presets: a name, a sentence, and what to start from. A preset is one line in [`PRESETS`].

use super::Setup;
use crate::ape::observer::ObserverChoice;
use crate::ape::{AlgorithmKind, Config, Ensemble, EnsembleFile};
use crate::mdp::{Action, Grid, GridSpec, Policy};

/// A named starting point.
pub struct Preset {
    /// As on the command line.
    pub name: &'static str,
    pub title: &'static str,
    pub summary: &'static str,
    pub setup: fn() -> Setup,
}

/// Every preset; the first is where the page opens.
pub static PRESETS: [Preset; 7] = [
    Preset {
        name: "blind",
        title: "Blind clone",
        summary: "Two experts against a clone that weighs them equally at every cell. It gets lost.",
        setup: Setup::default,
    },
    Preset {
        name: "paper",
        title: "Paper, literally",
        summary: "The paper's appendix word for word: replay(60) and one joint baseline. The clone ends as good as the ensemble.",
        setup: || Setup { config: Config::paper(), ..Setup::default() },
    },
    Preset {
        name: "exact",
        title: "Exact gradients",
        summary: "The same objective climbed by its exact gradient, nothing sampled: a better ensemble and a clone as lost.",
        setup: || Setup { config: Config { algorithm: AlgorithmKind::Exact, ..Config::default() }, ..Setup::default() },
    },
    Preset {
        name: "price",
        title: "At a given price",
        summary: "The paper's Eq. 2: the worst clone that 14 steps an episode can buy. β follows by dual ascent.",
        setup: || {
            let config = Config { algorithm: AlgorithmKind::Exact, alpha: Some(-14.0), ..Config::default() };
            Setup { config, ..Setup::default() }
        },
    },
    Preset {
        name: "lure",
        title: "Another reward",
        summary: "The semantics of reward: useless is not slow here but caught. The experts lure their clone into a corner.",
        setup: || {
            let adversary_reward = "0,9=-1".parse().ok();
            let config = Config { algorithm: AlgorithmKind::Exact, beta: 1.0, adversary_reward, ..Config::default() };
            Setup { config, ..Setup::default() }
        },
    },
    Preset {
        name: "no-protection",
        title: "No protection",
        summary: "β = 0: the experts care only about the goal, and their clone is as good as they are.",
        setup: || Setup { config: Config { beta: 0.0, ..Config::default() }, ..Setup::default() },
    },
    Preset {
        name: "trap",
        title: "Trap",
        summary: "Two experts drawn by hand, nothing trained: cut at 100 steps a cell their honest clone looks ruined, \
                  yet it reaches the goal almost as often as they do.",
        setup: trap,
    },
];

impl Preset {
    pub fn find(name: &str) -> Option<&'static Preset> {
        PRESETS.iter().find(|preset| preset.name == name)
    }
}

/// Both experts stay for ever at X = (0, 1), next to the goal, and enter it through (1, 0). The second walks
/// from (1, 1) into X, where it hardly ever is; the clone does the same once in a hundred visits, and is lost.
fn trap() -> Setup {
    let grid = Grid::new(GridSpec::default()).expect("the paper's grid is valid");
    let expert = |other: fn(u32, u32) -> Action| {
        let row = |state: usize| {
            let action = match grid.cell(state) {
                (0, 1) => Action::Stay,
                (_, 0) => Action::Up,
                (0, _) => Action::Down,
                (row, col) => other(row, col),
            };
            Action::ALL.map(|a| if a == action { 1.0 } else { 0.0 })
        };
        Policy::from_rows((0..grid.cells()).map(row).collect())
    };
    let first = expert(|row, _| if row == 1 { Action::Left } else { Action::Up });
    let second = expert(|row, col| match (row, col) {
        (1, 1) => Action::Up,
        (1, _) => Action::Down,
        _ => Action::Left,
    });
    let ensemble = EnsembleFile::new(&grid, &Ensemble::new(vec![first, second]), None);
    let config = Config { observer: ObserverChoice::OCCUPANCY, ..Config::default() };
    Setup { ensemble: Some(ensemble), config, ..Setup::default() }
}
