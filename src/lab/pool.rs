//! Workers for long experiments: tasks wait in a queue, a hand for each core takes them.

use std::collections::{BTreeSet, VecDeque};

use super::{TaskEvent, shortened};
use crate::experiment::Task;

/// A worker that does one task at a time: a Web Worker or a thread.
pub trait Hand {
    /// Begins a task; the last one has ended or was stopped.
    fn begin(&mut self, task: &Task);

    /// What it has to say of its task, in order; an error when it has died.
    fn receive(&mut self) -> Option<Result<TaskEvent, String>>;

    /// Gives up the task at hand.
    fn stop(&mut self);

    /// Whether its program is on its way: it has been started and has not answered yet.
    fn is_starting(&self) -> bool {
        false
    }
}

/// The number of a task, by which its news are told apart.
pub type TaskId = u32;

type Numbered = (TaskId, Task);

/// Tasks, and the hands that do them. Hands are hired when there is work for them.
pub struct Pool {
    hire: Box<dyn Fn() -> Box<dyn Hand>>,
    most: usize,
    /// Each with the task at hand.
    hands: Vec<(Box<dyn Hand>, Option<Numbered>)>,
    queue: VecDeque<Numbered>,
    begun: TaskId,
}

impl Pool {
    /// Most hands there may be, whatever the machine has.
    pub const MOST: usize = 8;

    /// A pool of at most `cores` hands.
    pub fn new(cores: usize, hire: impl Fn() -> Box<dyn Hand> + 'static) -> Pool {
        Pool {
            hire: Box::new(hire),
            most: cores.clamp(1, Self::MOST),
            hands: Vec::new(),
            queue: VecDeque::new(),
            begun: 0,
        }
    }

    /// Number of hands that work at once.
    pub fn size(&self) -> usize {
        self.most
    }

    /// Whether a hand is on its way.
    pub fn is_starting(&self) -> bool {
        self.hands.iter().any(|(hand, _)| hand.is_starting())
    }

    /// Puts a task at the end of the queue.
    pub fn begin(&mut self, task: Task) -> TaskId {
        self.begun += 1;
        self.queue.push_back((self.begun, task));
        self.hand_out();
        self.begun
    }

    /// Forgets tasks, done or not: all at once, so that no hand begins with one of them in between.
    pub fn cancel(&mut self, ids: impl IntoIterator<Item = TaskId>) {
        let ids: BTreeSet<TaskId> = ids.into_iter().collect();
        self.queue.retain(|(queued, _)| !ids.contains(queued));
        for (hand, busy) in &mut self.hands {
            if busy.as_ref().is_some_and(|(at_hand, _)| ids.contains(at_hand)) {
                hand.stop();
                *busy = None;
            }
        }
        self.hand_out();
    }

    /// What has been heard, each with its task.
    pub fn receive(&mut self) -> Vec<(TaskId, TaskEvent)> {
        let mut news = Vec::new();
        for (hand, busy) in &mut self.hands {
            while let Some(event) = hand.receive() {
                let event = event.unwrap_or_else(|sentence| {
                    hand.stop();
                    TaskEvent::Failed(sentence)
                });
                // What comes from a task that was cancelled is of no interest.
                let Some((id, task)) = busy.take() else { continue };
                let event = match event {
                    TaskEvent::Done(outcome, ms) => match outcome.check(&task) {
                        Ok(()) if ms.is_finite() => TaskEvent::Done(outcome, ms),
                        Ok(()) => TaskEvent::Failed(format!("{ms} milliseconds of work: expected a number")),
                        Err(sentence) => TaskEvent::Failed(sentence),
                    },
                    TaskEvent::Progress(part) => {
                        *busy = Some((id, task));
                        TaskEvent::Progress(if part.is_finite() { part.clamp(0.0, 1.0) } else { 0.0 })
                    }
                    TaskEvent::Failed(sentence) => TaskEvent::Failed(shortened(sentence)),
                    event => event,
                };
                news.push((id, event));
            }
        }
        self.hand_out();
        news
    }

    fn hand_out(&mut self) {
        while !self.queue.is_empty() {
            let free = self.hands.iter().position(|(_, busy)| busy.is_none());
            let free = match free {
                Some(free) => free,
                None if self.hands.len() < self.most => {
                    self.hands.push(((self.hire)(), None));
                    self.hands.len() - 1
                }
                None => return,
            };
            if let Some((id, task)) = self.queue.pop_front() {
                let (hand, busy) = &mut self.hands[free];
                hand.begin(&task);
                *busy = Some((id, task));
            }
        }
    }
}
