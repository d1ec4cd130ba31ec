//! Adversarial policy ensembles: what they are, who clones them, and the training of the paper.
//!
//! Knows grids and policies ([`crate::mdp`]), and nothing of sessions or pages.

mod adam;
mod algorithm;
mod batch;
mod choice;
mod config;
mod demonstrate;
mod digest;
mod ensemble;
mod exact_ape;
mod fields;
mod figures;
pub(crate) mod json;
pub mod observer;
mod pg_ape;
mod recurrent;
mod reward;
mod softmax;
mod tally;

pub use adam::Adam;
pub use algorithm::{Algorithm, Experts, Trainer};
pub use choice::{Choice, ChoiceError, Model, Parameter};
pub use config::{AlgorithmKind, BaselineKind, Config, GradientKind, ReturnToGo};
pub use demonstrate::{Demonstrator, Episode};
pub use digest::{Digest, DigestError};
pub use ensemble::{Contexts, Ensemble, EnsembleError, EnsembleFile, Moment};
pub use exact_ape::{ExactApe, ExactGradient};
pub use fields::{ConfigError, FIELDS, Field, Kind, written};
pub use figures::{Figures, Identity};
pub use pg_ape::{Gradient, PgApe};
pub use recurrent::{Labelled, Network};
pub use reward::AdversaryReward;
pub use softmax::softmax;
