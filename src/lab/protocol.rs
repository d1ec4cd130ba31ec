//! What page and session say to each other: one enum each way, as compact bytes (postcard).
//!
//! No `usize` here: its size differs between the two ends' possible machines.

use serde::{Deserialize, Serialize};

use crate::ape::{Digest, EnsembleFile};
use crate::attack::{AttackerChoice, Cloned};
use crate::experiment::{Course, CurvePoint, Outcome, Setup};
use crate::mdp::{KnownReturns, Policy, Returns};

/// Version of the messages: an old cached worker must not be taken for a new one. [`Event::Ready`] stays the
/// first variant, so that every version can read every other's.
pub const PROTOCOL: u32 = 10;

/// What is said of a worker with another [`PROTOCOL`].
pub const OTHER_VERSION: &str = "The worker is of another version than the page: reload the page.";

/// Longest message, in bytes: the largest ensemble there can be, with its clones and its curve, takes a tenth of it.
pub const LONGEST: usize = 16_000_000;

/// From the page to the session.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Command {
    /// Begin a new run, or the same one again; a setup that is no good is refused and the old run stays.
    Load {
        setup: Box<Setup>,
        play: bool,
    },
    /// Make a run again that a session which has died was at, up to where the page has seen it: it is shown there, at
    /// `update` of the `recorded` ones, with the number it had, and goes on.
    Resume {
        run: u32,
        setup: Box<Setup>,
        recorded: u32,
        update: u32,
        is_playing: bool,
    },
    /// Begin the same run again, with this β, and show nothing before it has ended. While one is under way
    /// only the last β asked for is kept.
    Retrain {
        beta: f64,
    },
    /// β for the updates to come; a run that had ended goes on. From a moment that lies back, a branch begins: a new
    /// run with the same past.
    Continue {
        beta: f64,
    },
    /// Show the run of this number after so many updates, paused. While one is sought only the last is.
    Seek {
        run: u32,
        update: u32,
    },
    Play,
    Pause,
    /// One update, then pause.
    Step,
    /// Updates per second, from 0.01 to 1,000,000; `None` is as fast as it goes.
    Speed(Option<f32>),
    /// Clones to evaluate besides that of the run's own observer, sixteen at most; those that are not quick are left out.
    Show(Vec<AttackerChoice>),
    /// Send the ensemble as it is, in full precision.
    Export,
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
    /// What [`Command::Export`] asked for.
    Exported(Box<Exported>),
    /// A command was not carried out; the sentence says why.
    Refused(String),
    /// So many updates have been made again of a run that [`Command::Resume`] names.
    Remade(u32),
}

/// An ensemble, and which moment of which run it is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Exported {
    pub run: u32,
    pub update: u32,
    pub file: EnsembleFile,
}

/// From a worker that does a [`crate::experiment::Task`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum TaskEvent {
    /// The worker listens; not about a task. The version of its messages is as in [`Event::Ready`].
    Ready { protocol: u32 },
    /// How much of it is done, 0..=1.
    Progress(f32),
    /// And how many milliseconds of work it was.
    Done(Box<Outcome>, f64),
    /// It could not be done; the sentence says why.
    Failed(String),
}

/// What stays the same during a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Started {
    pub run: u32,
    pub setup: Setup,
    pub optimal: PolicyView,
    /// Where it is a branch: the run and update it goes on from.
    pub branch_of: Option<(u32, u32)>,
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
    /// Updates made at the moment shown, when the run ends, and how many were made in all so far.
    pub update: u32,
    pub last_update: u32,
    pub recorded: u32,
    /// What changed on the way.
    pub course: Course,
    /// β of the updates to come.
    pub beta: f64,
    /// Of a given ensemble what its file says.
    pub digest: Option<Digest>,
    /// Time spent on updates while playing this run, in milliseconds.
    pub training_ms: f64,
    pub experts: Vec<PolicyView>,
    /// Mean of the experts' returns.
    pub ensemble: Returns,
    /// First that of the run's own observer, then those asked for.
    pub clones: Vec<CloneView>,
    /// Points of the curve since the last snapshot of this run.
    pub curve: Vec<CurvePoint>,
}

/// A policy as the page draws it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PolicyView {
    /// π(a|s), `[S][5]`.
    pub policy: Vec<[f32; 5]>,
    /// h(s) in steps, uncapped, `[S]`; what is longer than `f32::MAX` is that.
    pub hitting_time: Vec<f32>,
    pub returns: KnownReturns,
}

/// A clone, and what it takes p(c|s) to be. One with a memory is as at the start of an episode, its
/// `hitting_time` the expected steps of an episode from there.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CloneView {
    pub cloner: AttackerChoice,
    /// p(c|s), `[S][n]`; empty where the clone is no mixture.
    pub contexts: Vec<f32>,
    pub view: PolicyView,
}

impl PolicyView {
    /// `steps`: expected steps to the goal, `[S]`.
    pub fn new(policy: &Policy, steps: &[f64], returns: KnownReturns) -> PolicyView {
        PolicyView {
            policy: policy.rows().iter().map(|row| row.map(|p| p as f32)).collect(),
            hitting_time: steps.iter().map(|&h| (h as f32).min(f32::MAX)).collect(),
            returns,
        }
    }
}

impl CloneView {
    pub fn new(cloner: AttackerChoice, cloned: &Cloned) -> CloneView {
        let contexts = cloned.contexts.as_ref().map_or(&[][..], |contexts| contexts.as_slice());
        CloneView {
            cloner,
            contexts: contexts.iter().map(|&p| p as f32).collect(),
            view: PolicyView::new(&cloned.policy, &cloned.steps, cloned.returns),
        }
    }
}

/// A sentence about a fault in a length that can be shown, whoever has said it.
pub fn shortened(mut sentence: String) -> String {
    const MOST: usize = 600;
    if let Some((end, _)) = sentence.char_indices().nth(MOST) {
        sentence.truncate(end);
        sentence.push('…');
    }
    sentence
}

/// A message as bytes.
pub fn encode(message: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(message).expect("messages are plain data of known length")
}

/// A message from bytes; a sentence when they are none.
pub fn decode<'a, T: Deserialize<'a>>(bytes: &'a [u8]) -> Result<T, String> {
    check_length(bytes.len())?;
    match postcard::take_from_bytes(bytes) {
        Ok((message, [])) => Ok(message),
        Ok((_, rest)) => Err(unreadable(&format!("{} bytes are left over", rest.len()))),
        Err(error) => Err(unreadable(&error.to_string())),
    }
}

/// Whether a message of so many bytes may be taken in at all: to be asked before it is copied.
pub fn check_length(bytes: usize) -> Result<(), String> {
    if bytes <= LONGEST { Ok(()) } else { Err(unreadable(&format!("{bytes} bytes: expected at most {LONGEST}"))) }
}

/// What is said of a message that is none.
pub fn unreadable(why: &str) -> String {
    format!("A message could not be read ({why}).")
}
