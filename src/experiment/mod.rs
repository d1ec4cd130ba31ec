//! Named experiments: what a run starts from, and the presets.

mod presets;
mod setup;

pub use presets::{PRESETS, Preset};
pub use setup::{Setup, SetupError};
