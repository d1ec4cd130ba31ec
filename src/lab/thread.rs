//! A session and the hands of a pool in threads, for the native window.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, TryRecvError, channel};
use std::time::{Duration, Instant};

use super::{Command, Event, Hand, Link, PROTOCOL, Pace, Pool, Session, TaskEvent};
use crate::experiment::Task;

/// The page's end of a thread that runs a session.
pub struct ThreadLink {
    wake: Arc<dyn Fn() + Send + Sync>,
    commands: Sender<Command>,
    events: Receiver<Event>,
    has_failed: bool,
}

impl ThreadLink {
    /// Starts the thread; `wake` is called when an event has arrived.
    pub fn new(wake: impl Fn() + Send + Sync + 'static) -> ThreadLink {
        let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
        let (commands, events) = start(wake.clone());
        ThreadLink { wake, commands, events, has_failed: false }
    }
}

impl Link for ThreadLink {
    fn send(&mut self, command: &Command) {
        // A thread that has gone is noticed when receiving.
        let _ = self.commands.send(command.clone());
    }

    fn receive(&mut self) -> Option<Result<Event, String>> {
        match self.events.try_recv() {
            Ok(event) => Some(Ok(event)),
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) if self.has_failed => None,
            Err(TryRecvError::Disconnected) => {
                self.has_failed = true;
                Some(Err("The training thread has stopped.".to_owned()))
            }
        }
    }

    fn restart(&mut self) {
        (self.commands, self.events) = start(self.wake.clone());
        self.has_failed = false;
    }
}

/// Wakes the page also when its thread ends, however that comes about.
struct WakeAtEnd(Arc<dyn Fn() + Send + Sync>);

impl Drop for WakeAtEnd {
    fn drop(&mut self) {
        (self.0)();
    }
}

fn start(wake: Arc<dyn Fn() + Send + Sync>) -> (Sender<Command>, Receiver<Event>) {
    let (commands, inbox) = channel();
    let (outbox, events) = channel();
    std::thread::spawn(move || {
        let at_end = WakeAtEnd(wake);
        // Moved in after `at_end`, so that the channel closes before the page is woken.
        let outbox = outbox;
        let begin = Instant::now();
        let clock = || begin.elapsed().as_secs_f64() * 1000.0;
        let mut session = Session::new();
        let mut events = vec![Event::Ready { protocol: PROTOCOL }];
        loop {
            if !events.is_empty() {
                for event in events.drain(..) {
                    if outbox.send(event).is_err() {
                        return;
                    }
                }
                (at_end.0)();
            }
            let pace = session.advance(&clock);
            events.extend(session.events());
            let command = match pace {
                _ if !events.is_empty() => inbox.try_recv().map_err(|error| error == TryRecvError::Disconnected),
                Pace::Now => inbox.try_recv().map_err(|error| error == TryRecvError::Disconnected),
                Pace::After(ms) => inbox
                    .recv_timeout(Duration::from_secs_f64(ms / 1000.0))
                    .map_err(|error| error == RecvTimeoutError::Disconnected),
                Pace::Idle => inbox.recv().map_err(|_| true),
            };
            match command {
                Ok(command) => {
                    session.handle(command);
                    inbox.try_iter().for_each(|command| session.handle(command));
                    events.extend(session.events());
                }
                Err(is_closed) if is_closed => return,
                Err(_) => {}
            }
        }
    });
    (commands, events)
}

/// A pool of threads, one for each core.
pub fn thread_pool(wake: impl Fn() + Send + Sync + 'static) -> Pool {
    let wake: Arc<dyn Fn() + Send + Sync> = Arc::new(wake);
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    Pool::new(cores, move || Box::new(ThreadHand { wake: wake.clone(), at_work: None }))
}

struct ThreadHand {
    wake: Arc<dyn Fn() + Send + Sync>,
    /// What the thread says, and whether it is to stop.
    at_work: Option<(Receiver<TaskEvent>, Arc<AtomicBool>)>,
}

impl Hand for ThreadHand {
    fn begin(&mut self, task: &Task) {
        let (sender, receiver) = channel();
        let is_stopped = Arc::new(AtomicBool::new(false));
        self.at_work = Some((receiver, is_stopped.clone()));
        let (task, at_end) = (task.clone(), WakeAtEnd(self.wake.clone()));
        std::thread::spawn(move || {
            let at_end = at_end;
            let sender = sender;
            let begin = Instant::now();
            let clock = || begin.elapsed().as_secs_f64() * 1000.0;
            let mut progress = |done: f64| {
                // Whoever does not listen any more has stopped it, too.
                let is_heard = sender.send(TaskEvent::Progress(done as f32)).is_ok();
                (at_end.0)();
                is_heard && !is_stopped.load(Ordering::Relaxed)
            };
            let _ = match task.run(&clock, &mut progress) {
                Ok(Some(outcome)) => sender.send(TaskEvent::Done(Box::new(outcome), clock())),
                Ok(None) => Ok(()),
                Err(sentence) => sender.send(TaskEvent::Failed(sentence)),
            };
        });
    }

    fn receive(&mut self) -> Option<Result<TaskEvent, String>> {
        let (receiver, _) = self.at_work.as_ref()?;
        match receiver.try_recv() {
            Ok(event) => {
                if !matches!(event, TaskEvent::Progress(_)) {
                    self.at_work = None;
                }
                Some(Ok(event))
            }
            Err(TryRecvError::Empty) => None,
            Err(TryRecvError::Disconnected) => {
                self.at_work = None;
                Some(Err("A thread has stopped.".to_owned()))
            }
        }
    }

    fn stop(&mut self) {
        if let Some((_, is_stopped)) = self.at_work.take() {
            is_stopped.store(true, Ordering::Relaxed);
        }
    }
}
