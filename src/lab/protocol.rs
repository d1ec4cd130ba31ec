//! What page and session say to each other: one enum each way, as compact bytes (postcard).
//!
//! No `usize` here: its size differs between the two ends' possible machines.

use serde::{Deserialize, Serialize};

use crate::ape::observer::ObserverChoice;
use crate::experiment::{CurvePoint, Setup};
use crate::mdp::Returns;

/// Version of the messages: an old cached worker must not be taken for a new one. [`Event::Ready`] stays the
/// first variant, so that every version can read every other's.
pub const PROTOCOL: u32 = 1;

/// From the page to the session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Begin a new run; a setup that is no good is refused and the old run stays.
    Load {
        setup: Box<Setup>,
        play: bool,
    },
    /// Begin the same run again, with this β, and show nothing before it has ended. While one is under way
    /// only the last β asked for is kept.
    Retrain {
        beta: f64,
    },
    /// β for the updates to come; a run that had ended goes on for as long again.
    Continue {
        beta: f64,
    },
    Play,
    Pause,
    /// One update, then pause.
    Step,
    /// Back to the start of the run, paused.
    Reset,
    /// Updates per second; `None` is as fast as it goes.
    Speed(Option<f32>),
    /// Clones to evaluate besides that of the run's own observer.
    Show(Vec<ObserverChoice>),
    /// The snapshot of this number has been drawn.
    Seen(u32),
}

/// From the session to the page.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Event {
    /// The worker listens; nothing may be sent before.
    Ready {
        protocol: u32,
    },
    /// A run has begun; its snapshots follow.
    Started(Box<Started>),
    Snapshot(Box<Snapshot>),
    /// A command was not carried out; the sentence says why.
    Refused(String),
}

/// What stays the same during a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Started {
    pub run: u32,
    pub setup: Setup,
    pub optimal: PolicyView,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum RunState {
    Playing,
    Paused,
    /// All updates are made.
    Finished,
    /// The ensemble was given; there is nothing to train.
    Given,
}

/// A run at one moment.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snapshot {
    /// Counts up over the session's life.
    pub number: u32,
    pub run: u32,
    pub state: RunState,
    /// Updates made, and when the run ends.
    pub update: u32,
    pub last_update: u32,
    /// β of the updates to come.
    pub beta: f64,
    /// Hash of all parameters: equal runs share it, on every machine.
    pub digest: u64,
    /// Time spent on updates while playing this run, in milliseconds.
    pub training_ms: f64,
    pub experts: Vec<PolicyView>,
    /// First that of the run's own observer, then those asked for.
    pub clones: Vec<CloneView>,
    /// Points of the curve since the last snapshot of this run.
    pub curve: Vec<CurvePoint>,
}

impl Snapshot {
    /// Mean of the experts' returns.
    pub fn ensemble(&self) -> Returns {
        Returns::mean(&self.experts.iter().map(|expert| expert.returns).collect::<Vec<_>>())
    }
}

/// A policy as the page draws it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PolicyView {
    /// π(a|s), `[S][5]`.
    pub policy: Vec<[f32; 5]>,
    /// h(s) in steps, uncapped, `[S]`; what is longer than `f32::MAX` is that.
    pub hitting_time: Vec<f32>,
    pub returns: Returns,
}

/// A clone, and what its observer takes p(c|s) to be.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloneView {
    pub observer: ObserverChoice,
    /// p(c|s), `[S][n]`.
    pub contexts: Vec<f32>,
    pub view: PolicyView,
}

/// A message as bytes.
pub fn encode(message: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(message).expect("messages are plain data of known length")
}

/// A message from bytes; a sentence when they are none.
pub fn decode<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, String> {
    postcard::from_bytes(bytes).map_err(|error| format!("A message could not be read ({error})."))
}
