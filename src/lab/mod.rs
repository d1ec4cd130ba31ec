//! A training session that a page plays with: messages in, messages out.
//!
//! Long experiments are done beside it by the hands of a [`Pool`].
//!
//! [`Session`] is the state machine; it knows neither browsers nor threads and asks its driver for the time.
//! In the browser a Web Worker drives it (`src/bin/worker.rs`), in a window a thread ([`ThreadLink`]). The
//! page holds the other end as a [`Link`].

mod check;
mod link;
mod pool;
mod protocol;
mod recording;
mod session;
#[cfg(not(target_arch = "wasm32"))]
mod thread;

pub use link::Link;
pub use pool::{Hand, Pool, TaskId};
pub use protocol::{
    CloneView, Command, Event, Exported, OTHER_VERSION, PROTOCOL, PolicyView, RunState, Snapshot, Started, TaskEvent,
};
pub use protocol::{check_length, decode, encode, shortened, unreadable};
pub use session::{IN_FLIGHT, Pace, Session};
#[cfg(not(target_arch = "wasm32"))]
pub use thread::{ThreadLink, thread_pool};
