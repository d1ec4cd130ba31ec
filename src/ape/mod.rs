//! Adversarial policy ensembles: what they are, who clones them, and the training of the paper.
//!
//! Knows grids and policies ([`crate::mdp`]), and nothing of sessions or pages.

mod adam;
mod config;
mod demonstrate;
mod ensemble;
mod fields;
mod figures;
pub mod observer;
mod pg_ape;

pub use config::{BaselineKind, Config, GradientKind, ReturnToGo};
pub use ensemble::{Contexts, Ensemble, EnsembleError, EnsembleFile};
pub use fields::{ConfigError, FIELDS, Field, Kind};
pub use figures::{Figures, Identity};
pub use pg_ape::{Gradient, Trainer};
