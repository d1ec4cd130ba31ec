//! Experiments: what a run starts from, the presets, the course of a run; the attack bench, Table 1, the sweep
//! over β, whole or in shards, and the race, each a list of independent tasks.

pub mod address;
mod baselines;
mod bench;
mod curve;
mod presets;
mod race;
mod setup;
mod shard;
mod statistics;
mod sweep;
mod table1;
mod task;
mod worlds;

pub use baselines::{METHODS, Method, PaperRow};
pub use bench::{Attack, Bench, ensemble_returns};
pub use curve::{CurvePoint, Denied};
pub use presets::{PRESETS, Preset};
pub use race::{Figures, Race, RaceError, Raced, Racer, Run};
pub use setup::{Course, Setup, SetupError};
pub use shard::{Difference, RunPlace, Shard, ShardError, ShardNumber, SweepPlan, merge_shards};
pub use statistics::Summary;
pub use sweep::{Sweep, SweepPoint, SweepRun};
pub use table1::{MethodRun, Row, Table1};
pub use task::{Outcome, Task};
pub use worlds::{WORLDS, World};

/// Tells the time in milliseconds since any moment; browsers and programs have different clocks.
pub type Clock<'a> = &'a dyn Fn() -> f64;
