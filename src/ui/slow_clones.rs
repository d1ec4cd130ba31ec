//! Clones in the panels that take too long for a frame: made by the pool once training rests, and kept for that moment.

use super::app::{App, Wanted};
use crate::ape::{Config, EnsembleFile};
use crate::attack::AttackerChoice;
use crate::experiment::{Outcome, Task};
use crate::lab::{CloneView, Exported, Pool, RunState, TaskEvent, TaskId};
use crate::mdp::GridSpec;

/// A run and one of its updates.
type Moment = (u32, u32);

/// Clones being made that are not quick, and those that were.
#[derive(Default)]
pub struct SlowClones {
    making: Vec<(TaskId, Moment, AttackerChoice)>,
    made: Vec<(Moment, CloneView)>,
    /// When those that are missing are to be made, on the page's clock: once a moment has stood for a while. Who drags the
    /// timeline would have a worker begin for each.
    due: Option<f64>,
}

/// How long a moment stands before its slow clones are made, in seconds.
const PAUSE: f64 = 0.3;

impl SlowClones {
    /// Forgets them all, done or not.
    pub fn clear(&mut self, pool: &mut Pool) {
        self.made.clear();
        pool.cancel(self.making.drain(..).map(|(id, ..)| id));
    }
}

impl App {
    /// Begins to make the clones on the page that are not quick, where they are not there for this moment.
    pub(super) fn make_clones(&mut self, exported: &Exported) {
        let moment = (exported.run, exported.update);
        for attacker in self.wanted_slow_clones() {
            let is_made = self.slow_clones.made.iter().any(|(of, clone)| *of == moment && clone.cloner == attacker);
            let is_being_made =
                self.slow_clones.making.iter().any(|(_, of, cloner)| *of == moment && *cloner == attacker);
            if is_made || is_being_made {
                continue;
            }
            let Config { horizon, seed, .. } = self.setup.config;
            let ensemble = Box::new(EnsembleFile { config: None, ..exported.file.clone() });
            let id = self.pool.begin(Task::Attack { ensemble, attacker, horizon, seed });
            self.slow_clones.making.push((id, moment, attacker));
        }
    }

    fn wanted_slow_clones(&self) -> Vec<AttackerChoice> {
        let own = AttackerChoice::of(self.setup.config.observer);
        let GridSpec { rows, cols, .. } = self.setup.grid;
        let (cells, horizon) = ((rows * cols) as usize, self.setup.config.horizon);
        // Only a run that trains has its own at hand.
        let is_at_hand = |cloner: &AttackerChoice| *cloner == own && self.setup.ensemble.is_none();
        let is_slow = |cloner: &AttackerChoice| !is_at_hand(cloner) && !cloner.is_quick(cells, horizon);
        self.view.clones.iter().copied().filter(is_slow).collect()
    }

    /// A clone that is not quick has been made, or not.
    pub(super) fn take_clone(&mut self, id: TaskId, event: TaskEvent) {
        let Some(index) = self.slow_clones.making.iter().position(|(task, ..)| *task == id) else { return };
        match event {
            TaskEvent::Ready { .. } | TaskEvent::Progress(_) => {}
            TaskEvent::Failed(sentence) => {
                let (_, moment, cloner) = self.slow_clones.making.remove(index);
                let (Some((_, snapshot)), clones) = (self.shown(), &self.view.clones) else { return };
                if moment == (snapshot.run, snapshot.update) {
                    // It would stand there as being made for ever; whoever chooses it again has it tried again.
                    let left: Vec<AttackerChoice> = clones.iter().copied().filter(|other| *other != cloner).collect();
                    let left = if left.is_empty() { App::usual_clones(self.setup.config.observer) } else { left };
                    self.show_clones(left);
                    self.notice = Some(format!("{cloner} could not be made: {sentence}"));
                }
            }
            TaskEvent::Done(outcome, _) => {
                let (_, moment, cloner) = self.slow_clones.making.remove(index);
                if let Outcome::Attack(_, cloned) = *outcome {
                    self.slow_clones.made.push((moment, CloneView::new(cloner, &cloned)));
                }
                self.add_made_clones();
            }
        }
    }

    /// Adds the clones that are not quick to the snapshot on the page; where it rests, those that are missing are
    /// asked for.
    pub(super) fn add_made_clones(&mut self) {
        let Some(shown) = &mut self.shown else { return };
        let moment = (shown.snapshot.run, shown.snapshot.update);
        // Of moments gone by nothing is kept.
        self.slow_clones.made.retain(|(of, _)| *of == moment);
        self.slow_clones.making.retain(|(id, of, _)| {
            if *of != moment {
                self.pool.cancel([*id]);
            }
            *of == moment
        });
        for (_, clone) in &self.slow_clones.made {
            if !shown.snapshot.clones.iter().any(|other| other.cloner == clone.cloner) {
                shown.snapshot.clones.push(clone.clone());
                self.taken += 1;
                shown.version = self.taken;
            }
        }
        self.slow_clones.due = Some(self.now + PAUSE).filter(|_| self.misses_slow_clones());
    }

    /// Whether the page rests at a moment for which a clone is neither there nor being made.
    fn misses_slow_clones(&self) -> bool {
        let Some(shown) = &self.shown else { return false };
        let is_resting = shown.snapshot.state != RunState::Playing && self.begun.is_none();
        let is_missing = |cloner: &AttackerChoice| {
            !shown.snapshot.clones.iter().any(|clone| clone.cloner == *cloner)
                && !self.slow_clones.making.iter().any(|(_, _, making)| making == cloner)
        };
        is_resting && self.wanted_slow_clones().iter().any(is_missing)
    }

    /// Asks for the ensemble of a moment that has stood for a while, where clones are to be made of it.
    pub(super) fn look_after_slow_clones(&mut self, ctx: &egui::Context) {
        let Some(due) = self.slow_clones.due else { return };
        if self.now < due {
            return ctx.request_repaint_after_secs((due - self.now) as f32);
        }
        self.slow_clones.due = None;
        if self.misses_slow_clones() {
            self.want(Wanted::Clones);
        }
    }
}
