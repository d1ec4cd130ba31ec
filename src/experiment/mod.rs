//! Experiments: what a run starts from, the presets, and the course of a run.

mod curve;
mod presets;
mod setup;

pub use curve::CurvePoint;
pub use presets::{PRESETS, Preset};
pub use setup::{Setup, SetupError};
