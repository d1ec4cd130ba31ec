//! The page's end of a session, whatever drives the other.

use super::{Command, Event};

/// A session somewhere else: in a Web Worker or a thread.
pub trait Link {
    /// Sends a command. Nothing is heard before [`Event::Ready`] came.
    fn send(&mut self, command: &Command);

    /// The next event that has arrived; an error when the session has died or never came to life, with a
    /// sentence that says so. After an error only [`Link::restart`] helps.
    fn receive(&mut self) -> Option<Result<Event, String>>;

    /// Gives up the old session and starts a new one, which will say that it is ready.
    fn restart(&mut self);
}
