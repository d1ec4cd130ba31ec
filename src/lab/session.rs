//! The state machine behind the page: it trains, and tells what there is to see.
//!
//! It is driven from outside: [`Session::handle`] takes a command, [`Session::advance`] works for a few
//! milliseconds and says when to call it again, [`Session::events`] hands out what is to be sent.

use std::ops::RangeInclusive;

use super::recording::{Recording, Search, advance, turn};
use super::{CloneView, Command, Event, Exported, PolicyView, RunState, Snapshot, Started};
use crate::ape::{Config, Digest, Ensemble, EnsembleFile, Moment, Trainer};
use crate::attack::{AttackerChoice, Cloned, FEW_TRIALS, Target, own_clone};
use crate::experiment::{Course, CurvePoint, Setup};
use crate::mdp::{Grid, Policy, Returns, Solver, optimal_policy};

/// Longest stretch of work between two looks at the inbox, in milliseconds.
const STRETCH: f64 = 8.0;
/// Least time between two snapshots, in milliseconds: 60 a second.
const FRAME: f64 = 1000.0 / 60.0;
/// Snapshots that may be on their way to the page.
pub const IN_FLIGHT: u32 = 2;
/// How long the page may owe an answer before training waits for it, in milliseconds.
const PATIENCE: f64 = 250.0;
/// Points that a run of the usual length leaves on the curve, and about the most that a longer one leaves.
const CURVE_POINTS: u32 = 60;
const MOST_CURVE_POINTS: u32 = 1200;

/// Clones that may be shown besides that of the run's own observer.
const MOST_SHOWN: usize = 16;
/// Commands that may wait for a moment that is searched for: far more than a visitor gives.
const MOST_WAITING: usize = 1000;
/// Updates per second that can be asked for.
const SPEEDS: RangeInclusive<f32> = 0.01..=1e6;

/// When a driver should call [`Session::advance`] again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Pace {
    /// As soon as it has looked for commands.
    Now,
    /// In so many milliseconds, or when a command comes.
    After(f64),
    /// When a command comes.
    Idle,
}

/// What is being shown: a training run or a given ensemble.
enum Subject {
    Training(Box<Trainer>),
    Given { grid: Grid, ensemble: Ensemble },
}

impl Subject {
    fn grid(&self) -> &Grid {
        match self {
            Subject::Training(trainer) => trainer.grid(),
            Subject::Given { grid, .. } => grid,
        }
    }
}

struct Run {
    setup: Setup,
    subject: Subject,
    is_playing: bool,
    /// Nothing is shown before the end.
    is_silent: bool,
    last_update: u32,
    optimal: PolicyView,
    /// All of its past; nothing for a given ensemble.
    recording: Option<Recording>,
    training_ms: f64,
    curve: Vec<CurvePoint>,
}

/// A training session.
#[derive(Default)]
pub struct Session {
    run: Option<Run>,
    runs: u32,
    speed: Option<f32>,
    show: Vec<AttackerChoice>,
    /// A β to retrain with when the retraining under way has ended.
    next_beta: Option<f64>,
    /// An update of the run to go to.
    seek: Option<u32>,
    /// The way there.
    search: Option<Search>,
    /// A run that is being made again.
    resuming: Option<Resuming>,
    /// What is to be done with it once it is there, or with the moment that is searched for.
    waiting: Vec<Command>,
    outbox: Vec<Event>,
    /// Something has changed since the last snapshot.
    is_changed: bool,
    snapshots: u32,
    /// Number and time of the snapshots that the page has not drawn yet.
    in_flight: Vec<(u32, f64)>,
    /// When the next snapshot may be made.
    next_snapshot: f64,
    /// When updates were last counted against the speed.
    paced: f64,
    /// Updates that the speed allows by now.
    allowance: f64,
}

/// A run that is being made again: where it was.
struct Resuming {
    update: u32,
    is_playing: bool,
    /// Whether all that had been made is there again.
    is_complete: bool,
    /// When it is told next how far it is: not at all where it is there in a moment.
    next_news: Option<f64>,
}

impl Session {
    pub fn new() -> Session {
        Session::default()
    }

    /// What is to be sent, in order.
    pub fn events(&mut self) -> Vec<Event> {
        std::mem::take(&mut self.outbox)
    }

    /// Takes a command. What is not possible is refused with a sentence and changes nothing.
    pub fn handle(&mut self, command: Command) {
        let (is_resuming, is_first) = (self.resuming.is_some(), self.waiting.is_empty());
        let is_on_its_way = is_resuming || self.seek.is_some() || self.search.is_some();
        let waits = match command {
            Command::Resume { .. } | Command::Speed(_) | Command::Show(_) | Command::Seen(_) => false,
            // A new run takes the place of the old one, and of all that was to be done with it; but its ensemble is waited for.
            Command::Load { .. } | Command::Retrain { .. } => self.waiting.contains(&Command::Export),
            // These take another moment's place, or that of what goes on.
            Command::Seek { .. } | Command::Pause => is_resuming || !is_first,
            Command::Play | Command::Step | Command::Continue { .. } | Command::Export => is_on_its_way || !is_first,
        };
        if waits {
            // Of two moments one after the other only the last is wanted.
            if matches!((&command, self.waiting.last()), (Command::Seek { .. }, Some(Command::Seek { .. }))) {
                self.waiting.pop();
            }
            if self.waiting.len() >= MOST_WAITING {
                self.outbox.push(Event::Refused(format!("{MOST_WAITING} commands wait already.")));
                return;
            }
            return self.waiting.push(command);
        }
        if let Err(sentence) = self.carry_out(command) {
            self.outbox.push(Event::Refused(sentence));
        }
    }

    fn carry_out(&mut self, command: Command) -> Result<(), String> {
        match command {
            Command::Load { setup, play } => {
                self.begin(*setup, play, false)?;
            }
            Command::Resume { recorded, .. } if recorded > Config::MOST_UPDATES => {
                return Err(format!("{recorded} updates: must be at most {}.", Config::MOST_UPDATES));
            }
            Command::Resume { run, setup, recorded, update, is_playing } => {
                let mut resumed = Run::new(*setup, true, true)?;
                resumed.last_update = recorded;
                resumed.is_playing &= recorded > 0;
                self.put(resumed);
                self.runs = run;
                self.resuming = Some(Resuming { update, is_playing, is_complete: false, next_news: None });
            }
            Command::Retrain { beta } => {
                let is_resuming = self.resuming.is_some();
                let run = self.training()?;
                if run.is_silent && run.is_playing && !is_resuming {
                    self.next_beta = Some(beta);
                } else {
                    self.retrain(beta)?;
                }
            }
            Command::Continue { beta } => {
                self.begin_queued()?;
                self.continue_with(beta)?;
            }
            Command::Seek { run, update } => {
                let is_shown =
                    run == self.runs && self.run.as_ref().is_some_and(|run| !run.is_silent || !run.is_playing);
                if is_shown && matches!(self.run.as_ref().map(|run| &run.subject), Some(Subject::Training(_))) {
                    self.seek = Some(update);
                }
                return Ok(());
            }
            Command::Play => {
                self.begin_queued()?;
                self.unfinished()?.go_on();
            }
            Command::Pause => {
                self.begin_queued()?;
                let run = self.training()?;
                (run.is_playing, run.is_silent) = (false, false);
            }
            Command::Step => {
                self.begin_queued()?;
                let run = self.unfinished()?;
                (run.is_playing, run.is_silent) = (false, false);
                run.last_update = run.last_update.max(run.trainer().updates() + 1);
                run.set_course_updates();
                run.update(&|| 0.0);
            }
            Command::Speed(speed) => {
                if let Some(speed) = speed.filter(|speed| !SPEEDS.contains(speed)) {
                    let (least, most) = (SPEEDS.start(), SPEEDS.end());
                    return Err(format!("Speed {speed}: must be from {least} to {most} updates a second."));
                }
                self.speed = speed;
                self.allowance = 0.0;
                return Ok(());
            }
            Command::Show(cloners) if cloners.len() > MOST_SHOWN => {
                return Err(format!("{} clones: must be at most {MOST_SHOWN}.", cloners.len()));
            }
            Command::Show(cloners) => self.show = cloners,
            Command::Export => {
                let run = self.run.as_ref().ok_or(NOTHING)?;
                let exported = run.export(self.runs);
                self.outbox.push(Event::Exported(Box::new(exported)));
                return Ok(());
            }
            Command::Seen(number) => {
                self.in_flight.retain(|&(sent, _)| sent > number);
                return Ok(());
            }
        }
        self.is_changed = true;
        Ok(())
    }

    /// The run, where it is one that trains.
    fn training(&mut self) -> Result<&mut Run, String> {
        match &mut self.run {
            Some(run) if matches!(run.subject, Subject::Training(_)) => Ok(run),
            Some(_) => Err("This ensemble was given: there is nothing to train.".to_owned()),
            None => Err(NOTHING.to_owned()),
        }
    }

    /// The run, where it trains and may go on from where it is.
    fn unfinished(&mut self) -> Result<&mut Run, String> {
        let run = self.training()?;
        if run.trainer().updates() >= Config::MOST_UPDATES {
            return Err(format!("This run has made {} updates, which is as many as it can.", Config::MOST_UPDATES));
        }
        Ok(run)
    }

    /// Begins the run of a β that was asked for while another was being trained: the β on the page is the
    /// one that counts, whatever is done next.
    fn begin_queued(&mut self) -> Result<(), String> {
        self.next_beta.take().map_or(Ok(()), |beta| self.retrain(beta))
    }

    fn retrain(&mut self, beta: f64) -> Result<(), String> {
        let mut setup = self.training()?.setup.clone();
        setup.config.beta = beta;
        setup.course = Course::default();
        self.begin(setup, true, true)
    }

    /// Goes towards the update that was asked for, the last one, until time is over: whether it is there.
    fn approach(&mut self, is_over: &dyn Fn() -> bool) -> bool {
        let Some(run) = &mut self.run else { return true };
        if let (Some(update), Some(recording)) = (self.seek.take(), &run.recording) {
            self.search = Some(recording.search(update));
        }
        let Some(mut search) = self.search.take() else { return true };
        while !search.step(&run.setup.course) {
            if is_over() {
                self.search = Some(search);
                return false;
            }
        }
        run.subject = Subject::Training(Box::new(search.trainer));
        (run.is_playing, run.is_silent) = (false, false);
        self.is_changed = true;
        true
    }

    /// Goes on with another β: where there is a future already, on a branch beside it.
    fn continue_with(&mut self, beta: f64) -> Result<(), String> {
        let runs = self.runs;
        let run = self.unfinished()?;
        let update = run.trainer().updates();
        let is_settled = run.setup.course.is_settled(update);
        if run.trainer().config().beta == beta && is_settled {
            // What is to come has been, or comes as it would have.
            run.go_on();
            return Ok(());
        }
        if run.setup.course.turns.len() == Course::MOST_TURNS {
            return Err(format!(
                "β was moved {} times in this run, which is as often as it can be.",
                Course::MOST_TURNS
            ));
        }
        run.trainer_mut().set_beta(beta).map_err(|error| error.to_string())?;
        run.setup.course.turn(update, beta);
        let has_future = run.recording.as_ref().is_some_and(|recording| recording.end() > update);
        if has_future {
            if let Some(recording) = &mut run.recording {
                recording.cut(update);
            }
            // At least half of a run is still to come.
            let half = update.saturating_add(run.setup.config.updates() / 2);
            run.last_update = run.last_update.max(half).min(Config::MOST_UPDATES);
            run.set_course_updates();
            run.curve.clear();
            let (optimal, setup) = (run.optimal.clone(), run.setup.clone());
            self.runs = self.runs.wrapping_add(1);
            let branch_of = Some((runs, update));
            self.outbox.push(Event::Started(Box::new(Started { run: self.runs, setup, optimal, branch_of })));
        }
        self.training()?.go_on();
        Ok(())
    }

    /// Puts a new run in the place of the old one, if its setup is good.
    fn begin(&mut self, setup: Setup, is_playing: bool, is_silent: bool) -> Result<(), String> {
        let mut run = Run::new(setup, is_playing, is_silent)?;
        self.runs = self.runs.wrapping_add(1);
        let (setup, optimal) = (run.setup.clone(), run.optimal.clone());
        self.outbox.push(Event::Started(Box::new(Started { run: self.runs, setup, optimal, branch_of: None })));
        run.add_curve_point();
        self.put(run);
        Ok(())
    }

    fn put(&mut self, run: Run) {
        self.run = Some(run);
        (self.seek, self.search) = (None, None);
        (self.resuming, self.next_beta) = (None, None);
        self.waiting.clear();
        self.allowance = 0.0;
        self.is_changed = true;
    }

    /// Where a run that is made again has come as far as it was, it goes back to where it stood; then it is as it was.
    fn finish_resuming(&mut self) {
        let Some(run) = self.run.as_mut().filter(|run| !run.is_playing) else { return };
        let Some(resuming) = &mut self.resuming else { return };
        if !resuming.is_complete {
            resuming.is_complete = true;
            run.last_update = run.setup.updates();
            // The page has its curve.
            run.curve.clear();
            self.seek = Some(resuming.update);
            return;
        }
        run.is_playing = resuming.is_playing && run.recording.is_some();
        self.resuming = None;
        self.catch_up();
    }

    /// How far a run that is made again is, four times a second: it may take minutes.
    fn tell_remade(&mut self, now: f64) {
        let Some(run) = self.run.as_ref().filter(|run| run.is_playing) else { return };
        let Some(resuming) = &mut self.resuming else { return };
        if resuming.next_news.is_some_and(|then| now >= then) {
            self.outbox.push(Event::Remade(run.trainer().updates()));
        } else if resuming.next_news.is_some() {
            return;
        }
        resuming.next_news = Some(now + 250.0);
    }

    /// Does what had to wait, up to what has to wait again.
    fn catch_up(&mut self) {
        for command in std::mem::take(&mut self.waiting) {
            self.handle(command);
        }
    }

    /// Trains for a few milliseconds where there is something to train, and makes a snapshot where there is
    /// something new to see. `clock` counts milliseconds from any moment.
    pub fn advance(&mut self, clock: &dyn Fn() -> f64) -> Pace {
        let now = clock();
        if !self.approach(&|| clock() - now >= STRETCH) {
            return Pace::Now;
        }
        if self.resuming.is_none() && !self.waiting.is_empty() {
            self.catch_up();
        }
        let mut pace = self.train(now, clock);
        if self.seek.is_some() {
            pace = Pace::Now;
        }
        if self.resuming.is_some() {
            self.tell_remade(clock());
            self.finish_resuming();
            return Pace::Now;
        }
        if let Some(run) = &self.run {
            let has_ended = run.is_silent && !run.is_playing;
            if has_ended && self.next_beta.is_some() {
                // The newest β is wanted; what was trained is shown all the same, for the eye to follow, as long
                // as the page keeps up.
                if self.in_flight.len() < IN_FLIGHT as usize {
                    self.snapshot(clock);
                }
                if let Err(sentence) = self.begin_queued() {
                    self.outbox.push(Event::Refused(sentence));
                }
                return Pace::Now;
            }
        }
        let is_hidden = self.run.as_ref().is_none_or(|run| run.is_silent && run.is_playing);
        if self.is_changed && !is_hidden && self.in_flight.len() < IN_FLIGHT as usize {
            let now = clock();
            if now >= self.next_snapshot {
                self.snapshot(clock);
            } else if pace != Pace::Now {
                let wait = self.next_snapshot - now;
                pace = Pace::After(if let Pace::After(ms) = pace { ms.min(wait) } else { wait });
            }
        }
        pace
    }

    /// Makes the updates that are due, for at most [`STRETCH`].
    fn train(&mut self, now: f64, clock: &dyn Fn() -> f64) -> Pace {
        let since = now - std::mem::replace(&mut self.paced, now);
        let Some(run) = self.run.as_mut().filter(|run| run.is_playing) else { return Pace::Idle };
        let is_page_behind = self.in_flight.first().is_some_and(|(_, sent)| now - sent > PATIENCE);
        if is_page_behind && !run.is_silent {
            self.allowance = 0.0;
            return Pace::Idle;
        }
        let speed = self.speed.filter(|_| !run.is_silent).map(f64::from);
        if let Some(speed) = speed {
            // No more than a quarter of a second is made up for after a pause.
            self.allowance = (self.allowance + since.max(0.0) * speed / 1000.0).min((speed / 4.0).max(1.0));
        }
        while run.is_playing && clock() - now < STRETCH && (speed.is_none() || self.allowance >= 1.0) {
            if speed.is_some() {
                self.allowance -= 1.0;
            }
            run.update(clock);
            self.is_changed = true;
        }
        match speed {
            _ if !run.is_playing => Pace::Idle,
            Some(speed) if self.allowance < 1.0 => Pace::After((1.0 - self.allowance) * 1000.0 / speed),
            _ => Pace::Now,
        }
    }

    /// Evaluates everything the page shows and puts it in the outbox.
    fn snapshot(&mut self, clock: &dyn Fn() -> f64) {
        let Some(run) = &mut self.run else { return };
        let begin = clock();
        self.snapshots += 1;
        self.outbox.push(Event::Snapshot(Box::new(run.snapshot(self.snapshots, self.runs, &self.show))));
        self.is_changed = false;
        let end = clock();
        self.in_flight.push((self.snapshots, end));
        // At most half of the time goes into showing.
        self.next_snapshot = (begin + FRAME).max(end + (end - begin));
    }
}

const NOTHING: &str = "Nothing has been loaded yet.";

impl Run {
    /// The start of a run, if its setup is good.
    fn new(setup: Setup, is_playing: bool, is_silent: bool) -> Result<Run, String> {
        let mut subject = match setup.ensemble.clone().map(EnsembleFile::check) {
            Some(given) => {
                let (grid, ensemble) = given.map_err(|error| error.to_string())?;
                setup.config.check().map_err(|error| error.to_string())?;
                Subject::Given { grid, ensemble }
            }
            None => {
                let grid = Grid::new(setup.grid.clone()).map_err(|error| error.to_string())?;
                let trainer = Trainer::new(grid, setup.config.clone()).map_err(|error| error.to_string())?;
                Subject::Training(Box::new(trainer))
            }
        };
        setup.check().map_err(|error| error.to_string())?;
        if let Subject::Training(trainer) = &mut subject {
            turn(trainer, &setup.course);
        }
        let grid = subject.grid();
        let optimal = optimal_policy(grid);
        let value = Solver::new(grid).evaluate(&optimal, setup.config.horizon);
        let optimal = PolicyView::new(&optimal, &value.hitting_time, value.returns.into());
        let recording = match &subject {
            Subject::Training(trainer) => Some(Recording::new(trainer, Recording::BUDGET)),
            Subject::Given { .. } => None,
        };
        let is_training = recording.is_some();
        Ok(Run {
            last_update: if is_training { setup.updates() } else { 0 },
            recording,
            optimal,
            is_playing: is_playing && is_training,
            is_silent,
            setup,
            subject,
            training_ms: 0.0,
            curve: Vec::new(),
        })
    }

    fn trainer(&self) -> &Trainer {
        match &self.subject {
            Subject::Training(trainer) => trainer,
            Subject::Given { .. } => unreachable!("only runs that train are asked for their trainer"),
        }
    }

    fn trainer_mut(&mut self) -> &mut Trainer {
        match &mut self.subject {
            Subject::Training(trainer) => trainer,
            Subject::Given { .. } => unreachable!("only runs that train are asked for their trainer"),
        }
    }

    /// Plays; a run that had ended for as long again.
    fn go_on(&mut self) {
        if self.trainer().updates() >= self.last_update {
            let last = self.trainer().updates().saturating_add(self.setup.config.updates());
            self.last_update = last.min(Config::MOST_UPDATES);
        }
        self.set_course_updates();
        (self.is_playing, self.is_silent) = (true, false);
    }

    fn set_course_updates(&mut self) {
        self.setup.course.updates = Some(self.last_update).filter(|&last| last != self.setup.config.updates());
    }

    /// One update, and what follows it: the recording, the curve, the end of the run. Of updates that were made before only
    /// the last follows.
    fn update(&mut self, clock: &dyn Fn() -> f64) {
        let Subject::Training(trainer) = &mut self.subject else { return };
        let begin = clock();
        advance(trainer, &self.setup.course);
        self.training_ms += clock() - begin;
        let updates = trainer.updates();
        if updates >= self.last_update {
            self.is_playing = false;
        }
        match &mut self.recording {
            Some(recording) if recording.end() < updates => recording.keep(trainer),
            _ => return,
        }
        let usual = self.setup.config.updates().div_ceil(CURVE_POINTS);
        let every = usual.max(self.last_update.div_ceil(MOST_CURVE_POINTS));
        if updates.is_multiple_of(every) || updates == self.last_update {
            self.add_curve_point();
        }
    }

    fn ensemble(&self) -> Ensemble {
        match &self.subject {
            Subject::Training(trainer) => trainer.ensemble(),
            Subject::Given { ensemble, .. } => ensemble.clone(),
        }
    }

    /// The clone by the run's own observer.
    fn own_clone(&mut self, target: &Target) -> Option<Cloned> {
        let observer = self.setup.config.observer;
        match &mut self.subject {
            Subject::Training(trainer) => Some(own_clone(trainer, FEW_TRIALS)),
            Subject::Given { .. } => AttackerChoice::of(observer).clone_of(target, &mut |_| true),
        }
    }

    fn export(&self, run: u32) -> Exported {
        let (update, config, digest) = match &self.subject {
            Subject::Training(trainer) => (trainer.updates(), Some(self.setup.config.clone()), Some(trainer.digest())),
            Subject::Given { .. } => {
                (0, self.setup.ensemble.as_ref().and_then(|file| file.config.clone()), self.given_digest())
            }
        };
        let moment = match &self.subject {
            Subject::Training(_) => {
                let turns: Vec<_> = self.setup.course.turns.iter().copied().filter(|(at, _)| *at < update).collect();
                let is_end = turns.is_empty() && update == self.setup.config.updates();
                (!is_end).then_some(Moment { update, turns })
            }
            Subject::Given { .. } => self.setup.ensemble.as_ref().and_then(|file| file.moment.clone()),
        };
        let file = EnsembleFile::new(self.subject.grid(), &self.ensemble(), config);
        Exported { run, update, file: EnsembleFile { digest, moment, ..file } }
    }

    /// The digest that the file of a given ensemble has.
    fn given_digest(&self) -> Option<Digest> {
        self.setup.ensemble.as_ref().and_then(|file| file.digest)
    }

    fn add_curve_point(&mut self) {
        if let Subject::Training(trainer) = &mut self.subject {
            self.curve.push(CurvePoint::of(trainer));
        }
    }

    fn snapshot(&mut self, number: u32, run: u32, show: &[AttackerChoice]) -> Snapshot {
        let Config { observer, horizon, seed, .. } = self.setup.config;
        let ensemble = self.ensemble();
        let grid = self.subject.grid().clone();
        let target = Target { grid: &grid, ensemble: &ensemble, horizon, seed };
        let mut solver = Solver::new(&grid);
        let mut returns = Vec::new();
        let mut view = |policy: &Policy| {
            let value = solver.evaluate(policy, horizon);
            returns.push(value.returns);
            PolicyView::new(policy, &value.hitting_time, value.returns.into())
        };
        let experts = ensemble.policies().iter().map(&mut view).collect();
        let own = AttackerChoice::of(observer);
        let mut clones: Vec<CloneView> = Vec::new();
        for cloner in std::iter::once(own).chain(show.iter().copied()) {
            let is_at_hand = cloner == own && matches!(self.subject, Subject::Training(_));
            let is_wanted = is_at_hand || cloner.is_quick(grid.cells(), horizon);
            if clones.iter().any(|clone| clone.cloner == cloner) || !is_wanted {
                continue;
            }
            let cloned = if cloner == own { self.own_clone(&target) } else { cloner.clone_of(&target, &mut |_| true) };
            clones.extend(cloned.map(|cloned| CloneView::new(cloner, &cloned)));
        }
        let (update, beta, digest) = match &self.subject {
            Subject::Training(trainer) => (trainer.updates(), trainer.config().beta, Some(trainer.digest())),
            Subject::Given { .. } => (0, self.setup.config.beta, self.given_digest()),
        };
        let state = match &self.subject {
            Subject::Given { .. } => RunState::Given,
            _ if self.is_playing => RunState::Playing,
            _ if update >= self.last_update => RunState::Finished,
            _ => RunState::Paused,
        };
        Snapshot {
            number,
            run,
            state,
            update,
            last_update: self.last_update,
            recorded: self.recording.as_ref().map_or(0, Recording::end),
            course: self.setup.course.clone(),
            beta,
            digest,
            training_ms: self.training_ms,
            experts,
            ensemble: Returns::mean(&returns),
            clones,
            curve: std::mem::take(&mut self.curve),
        }
    }
}
