//! The Markov decision process of the paper: a gridworld, stationary policies, and what they return.
//!
//! Everything here is exact or a single draw; nothing learns and nothing knows of ensembles.

mod arrival;
mod chain;
mod grid;
mod model;
mod optimal;
mod policy;
mod returns;
mod rollout;

pub use arrival::Arrivals;
pub use chain::{Chain, Field, Occupancy, Prospect, occupancy};
pub use grid::{Action, Cell, Grid, GridError, GridSpec};
pub use model::{Transition, TransitionModel, transition_model};
pub use optimal::optimal_policy;
pub use policy::{Policy, PolicyError};
pub use returns::{CAP, HORIZON, KnownReturns, RETURN_KINDS, ReturnKind, Returns, Solver, Value};
pub use rollout::{ActionDraw, Draw, Starts, one_of};

/// Number of actions.
pub const ACTIONS: usize = 5;
