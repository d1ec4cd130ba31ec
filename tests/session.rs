#![cfg(not(target_arch = "wasm32"))]
//! The session as a page meets it: commands in, events out, at a pace. Time is a number that the test sets.

use std::cell::Cell;
use std::rc::Rc;

use ape_lab::ape::{Config, Digest, EnsembleFile, Trainer};
use ape_lab::attack::AttackerChoice;
use ape_lab::experiment::{Course, Preset, Race, Setup, Sweep, Task};
use ape_lab::lab::{
    Command, Event, Exported, Hand, Link, PROTOCOL, Pace, Pool, RunState, Session, Snapshot, Started, TaskEvent,
    ThreadLink, decode, encode, thread_pool,
};
use ape_lab::mdp::{Grid, GridSpec};

/// A session with a clock that goes on by a step at every look at it.
struct Desk {
    session: Session,
    now: Cell<f64>,
    tick: f64,
    snapshots: Vec<Snapshot>,
    started: Vec<Started>,
    refused: Vec<String>,
    exported: Vec<Exported>,
    /// How far a run that is made again was said to be.
    remade: Vec<u32>,
    /// Whether snapshots are answered.
    is_drawing: bool,
}

impl Desk {
    fn new() -> Desk {
        Desk {
            session: Session::new(),
            now: Cell::new(0.0),
            tick: 0.5,
            snapshots: Vec::new(),
            started: Vec::new(),
            refused: Vec::new(),
            exported: Vec::new(),
            remade: Vec::new(),
            is_drawing: true,
        }
    }

    fn send(&mut self, command: Command) {
        // Through bytes, as in the browser.
        let command: Command = decode(&encode(&command)).unwrap();
        self.session.handle(command);
        self.hear();
    }

    fn hear(&mut self) {
        for event in self.session.events() {
            match decode(&encode(&event)).unwrap() {
                Event::Ready { .. } => unreachable!("drivers say so, not sessions"),
                Event::Started(started) => self.started.push(*started),
                Event::Refused(sentence) => self.refused.push(sentence),
                Event::Remade(updates) => self.remade.push(updates),
                Event::Exported(exported) => self.exported.push(*exported),
                Event::Snapshot(snapshot) => {
                    if self.is_drawing {
                        self.session.handle(Command::Seen(snapshot.number));
                    }
                    self.snapshots.push(*snapshot);
                }
            }
        }
    }

    fn advance(&mut self) -> Pace {
        let pace = self.session.advance(&|| {
            self.now.set(self.now.get() + self.tick);
            self.now.get()
        });
        self.hear();
        pace
    }

    /// Lets the session work as a driver does, until it waits for a command or `milliseconds` have gone by.
    fn run(&mut self, milliseconds: f64) {
        let end = self.now.get() + milliseconds;
        while self.now.get() < end {
            match self.advance() {
                Pace::Now => {}
                Pace::After(wait) => self.now.set(self.now.get() + wait),
                Pace::Idle => return,
            }
        }
    }

    fn load(&mut self, config: Config, play: bool) {
        self.send(Command::Load { setup: Box::new(Setup { config, ..Setup::default() }), play });
    }

    fn last(&self) -> &Snapshot {
        self.snapshots.last().expect("there has been a snapshot")
    }
}

/// 20 updates of 100 steps.
fn short() -> Config {
    Config { batch_steps: 100, total_steps: 2000, ..Config::default() }
}

fn digest_after(config: Config, updates: u32) -> Option<Digest> {
    let mut trainer = Trainer::new(Grid::new(GridSpec::default()).unwrap(), config).unwrap();
    (0..updates).for_each(|_| trainer.update());
    Some(trainer.digest())
}

#[test]
fn a_run_plays_to_its_end_and_shows_what_the_trainer_makes() {
    let mut desk = Desk::new();
    desk.load(short(), true);
    desk.run(1e6);
    let last = desk.last();
    assert_eq!((last.state, last.update, last.last_update), (RunState::Finished, 20, 20));
    assert_eq!(last.digest, digest_after(short(), 20));
    assert!(last.training_ms > 0.0);
    assert_eq!((last.experts.len(), last.clones[0].cloner), (2, AttackerChoice::UNIFORM));
    let curve: Vec<u32> = desk.snapshots.iter().flat_map(|s| s.curve.iter().map(|point| point.update)).collect();
    assert_eq!(curve, (0..=20).collect::<Vec<_>>());
    assert_eq!(desk.started.len(), 1);
    assert!((desk.started[0].optimal.returns.capped_return.unwrap() + 9.0).abs() < 1e-6);
}

#[test]
fn play_pause_step_and_reset() {
    let mut desk = Desk::new();
    desk.load(short(), false);
    desk.run(1e3);
    assert_eq!((desk.last().state, desk.last().update), (RunState::Paused, 0));
    for update in 1..=3 {
        desk.send(Command::Step);
        desk.run(1e3);
        assert_eq!((desk.last().state, desk.last().update), (RunState::Paused, update));
    }
    assert_eq!(desk.last().digest, digest_after(short(), 3));
    desk.send(Command::Play);
    desk.advance();
    desk.send(Command::Pause);
    desk.run(1e3);
    let paused_at = desk.last().update;
    assert_eq!(desk.last().state, RunState::Paused);
    desk.run(1e3);
    assert_eq!(desk.last().update, paused_at);
    desk.load(short(), false);
    desk.run(1e3);
    assert_eq!(
        (desk.last().state, desk.last().update, desk.last().digest),
        (RunState::Paused, 0, digest_after(short(), 0))
    );
    // Played to the end, it plays on for as long again.
    for end in [20, 40] {
        desk.send(Command::Play);
        desk.run(1e6);
        assert_eq!((desk.last().state, desk.last().update), (RunState::Finished, end));
    }
}

#[test]
fn speed_is_kept() {
    let mut desk = Desk::new();
    desk.load(Config { total_steps: 100_000, ..short() }, false);
    desk.send(Command::Speed(Some(50.0)));
    desk.run(1e3);
    desk.tick = 0.01;
    desk.send(Command::Play);
    desk.run(2000.0);
    assert!((95..=115).contains(&desk.last().update), "{}", desk.last().update);
    desk.send(Command::Speed(None));
    desk.run(1000.0);
    assert_eq!(desk.last().state, RunState::Finished);
    desk.load(Config { total_steps: 100_000, ..short() }, true);
    desk.send(Command::Speed(Some(1.0)));
    desk.run(10_500.0);
    assert!((9..=11).contains(&desk.last().update), "{}", desk.last().update);
}

/// Retraining is as fast as it goes; what follows keeps the speed that was set, from its first moment on.
#[test]
fn retraining_takes_nothing_from_the_speed() {
    let mut desk = Desk::new();
    desk.tick = 0.01;
    desk.load(short(), true);
    desk.send(Command::Speed(Some(100.0)));
    for beta in [0.1, 0.2, 0.3] {
        desk.send(Command::Retrain { beta });
        desk.run(500.0);
        assert_eq!((desk.last().beta, desk.last().state), (beta, RunState::Finished));
    }
    desk.load(Config { total_steps: 100_000, ..short() }, true);
    desk.run(1000.0);
    assert!((90..=130).contains(&desk.last().update), "{}", desk.last().update);
}

/// A β that waits for its run is the one that counts, whatever comes next; and it is trained once.
#[test]
fn a_waiting_beta_is_not_lost_and_not_left_over() {
    for command in [Command::Step, Command::Pause, Command::Play] {
        let mut desk = Desk::new();
        desk.load(short(), false);
        desk.send(Command::Retrain { beta: 0.2 });
        desk.send(Command::Retrain { beta: 0.4 });
        desk.send(command.clone());
        desk.run(1e6);
        assert_eq!(desk.last().beta, 0.4, "{command:?}");
        desk.send(Command::Retrain { beta: 0.7 });
        desk.run(1e6);
        assert_eq!((desk.last().beta, desk.last().state), (0.7, RunState::Finished), "{command:?}");
    }
}

#[test]
fn snapshots_come_sixty_a_second_and_never_more_than_two_unanswered() {
    let mut desk = Desk::new();
    desk.tick = 0.05;
    desk.load(Config { total_steps: 10_000_000, ..short() }, true);
    desk.run(500.0);
    let rate = f64::from(desk.snapshots.len() as u32) / 0.5;
    assert!((20.0..=62.0).contains(&rate), "{rate}");
    // The page stops drawing: two snapshots are on their way, then training waits too.
    desk.is_drawing = false;
    let before = desk.snapshots.len();
    desk.run(2000.0);
    assert_eq!(desk.snapshots.len(), before + 2);
    let waiting = desk.advance();
    assert_eq!(waiting, Pace::Idle);
    // It draws again: training goes on.
    desk.is_drawing = true;
    let update = desk.last().update;
    desk.send(Command::Seen(desk.last().number));
    desk.run(100.0);
    assert!(desk.last().update > update);
}

#[test]
fn a_changed_beta_goes_on_or_trains_anew() {
    let mut desk = Desk::new();
    desk.load(short(), true);
    desk.run(1e6);
    desk.send(Command::Continue { beta: 0.1 });
    desk.run(1e6);
    assert_eq!((desk.last().update, desk.last().beta, desk.started.len()), (40, 0.1, 1));
    // Retraining shows nothing before its end, and only the newest of many β is trained.
    let before = desk.snapshots.len();
    for beta in [0.2, 0.3, 0.4] {
        desk.send(Command::Retrain { beta });
    }
    desk.run(1e6);
    let after = &desk.snapshots[before..];
    let shown: Vec<_> = after.iter().map(|s| (s.beta, s.update, s.state)).collect();
    assert_eq!(shown, [(0.2, 20, RunState::Finished), (0.4, 20, RunState::Finished)]);
    assert_eq!(desk.last().digest, digest_after(Config { beta: 0.4, ..short() }, 20));
    // The whole curve comes with it.
    assert_eq!(desk.last().curve.len(), 21);
}

/// At the moment of a turn β is the one that the next update takes, whether a run has played to it or is looked back at.
#[test]
fn a_turn_holds_from_its_moment_on() {
    let mut desk = Desk::new();
    let course = Course { turns: vec![(0, 0.3), (2, 0.9)], updates: None };
    let setup = Setup { config: short(), course, ..Setup::default() };
    desk.send(Command::Load { setup: Box::new(setup), play: false });
    let mut betas = Vec::new();
    for _ in 0..3 {
        desk.run(1e3);
        betas.push((desk.last().update, desk.last().beta));
        desk.send(Command::Step);
    }
    desk.run(1e3);
    assert_eq!(betas, [(0, 0.3), (1, 0.3), (2, 0.9)]);
    desk.send(Command::Seek { run: desk.last().run, update: 2 });
    desk.run(1e3);
    assert_eq!((desk.last().update, desk.last().beta), (2, 0.9));
}

#[test]
fn what_cannot_be_done_is_refused_and_changes_nothing() {
    let mut desk = Desk::new();
    for command in [Command::Play, Command::Step, Command::Pause, Command::Retrain { beta: 0.5 }] {
        desk.send(command);
    }
    assert_eq!(desk.refused, vec!["Nothing has been loaded yet."; 4]);
    desk.load(short(), true);
    desk.run(1e6);
    let good = desk.last().clone();
    desk.load(Config { beta: 7.0, ..short() }, true);
    desk.send(Command::Continue { beta: f64::NAN });
    desk.send(Command::Retrain { beta: -1.0 });
    let grid = GridSpec { walls: vec![(0, 0)], ..GridSpec::default() };
    desk.send(Command::Load { setup: Box::new(Setup { grid, ..Setup::default() }), play: true });
    desk.run(1e6);
    let refused: Vec<&str> = desk.refused[4..].iter().map(String::as_str).collect();
    assert_eq!(
        refused,
        [
            "beta 7: must be a number from 0 to 2",
            "beta NaN: must be a number from 0 to 2",
            "beta -1: must be a number from 0 to 2",
            "goal (row 0, column 0) is a wall"
        ]
    );
    assert_eq!((desk.last().run, desk.last().digest), (good.run, good.digest));
    assert!(decode::<Command>(&[250, 1, 2]).unwrap_err().contains("could not be read"));
}

#[test]
fn a_given_ensemble_is_shown_and_not_trained() {
    let mut desk = Desk::new();
    desk.send(Command::Show(AttackerChoice::usual()));
    desk.send(Command::Load { setup: Box::new((Preset::find("trap").unwrap().setup)()), play: true });
    desk.run(1e3);
    assert_eq!(desk.last().state, RunState::Given);
    let names: Vec<String> = desk.last().clones.iter().map(|clone| clone.cloner.to_string()).collect();
    // All but those that take long.
    assert_eq!(names, ["occupancy", "uniform", "replay(60)", "filtered", "history_k(1)", "history_k(2)", "history"]);
    assert!((desk.last().clones[0].view.returns.capped_return.unwrap() + 90.45).abs() < 0.005);
    desk.send(Command::Play);
    assert_eq!(desk.refused, ["This ensemble was given: there is nothing to train."]);
}

/// The replay observer of a finished ensemble watches fresh demonstrations: close to `occupancy`.
#[test]
fn clones_that_are_asked_for_are_evaluated() {
    let mut desk = Desk::new();
    desk.load(Config { total_steps: 400_000, ..Config::default() }, true);
    desk.run(1e6);
    assert_eq!(desk.last().clones.len(), 1);
    desk.send(Command::Show(vec![AttackerChoice::OCCUPANCY, "replay".parse().unwrap()]));
    desk.run(1e3);
    let returns: Vec<f64> = desk.last().clones.iter().map(|clone| clone.view.returns.horizon_return).collect();
    assert_eq!(returns.len(), 3);
    assert!((returns[1] - returns[2]).abs() < 3.0, "{returns:?}");
}

/// The ensemble in full precision, with what made it; also while training goes on, without disturbing it.
#[test]
fn the_ensemble_can_be_exported() {
    let mut desk = Desk::new();
    desk.send(Command::Export);
    assert_eq!(desk.refused, ["Nothing has been loaded yet."]);
    desk.load(short(), true);
    desk.send(Command::Step);
    desk.send(Command::Export);
    let exported = desk.exported.pop().unwrap();
    assert_eq!((exported.run, exported.update, exported.file.config.clone()), (1, 1, Some(short())));
    let mut trainer = Trainer::new(Grid::new(GridSpec::default()).unwrap(), short()).unwrap();
    trainer.update();
    assert_eq!(exported.file.check().unwrap().1, trainer.ensemble());
}

/// Counts what it is given to begin, and does none of it.
struct Counts(Rc<Cell<u32>>);

impl Hand for Counts {
    fn begin(&mut self, _task: &Task) {
        self.0.set(self.0.get() + 1);
    }

    fn receive(&mut self) -> Option<Result<TaskEvent, String>> {
        None
    }

    fn stop(&mut self) {}
}

/// Of what is cancelled together no hand begins with the next.
#[test]
fn what_is_cancelled_is_not_begun() {
    let begun = Rc::new(Cell::new(0));
    let counted = begun.clone();
    let mut pool = Pool::new(2, move || Box::new(Counts(counted.clone())));
    let setup = Box::new(Setup { config: short(), ..Setup::default() });
    let ids: Vec<u32> = (0..10).map(|_| pool.begin(Task::Sweep { setup: setup.clone() })).collect();
    assert_eq!(begun.get(), 2);
    pool.cancel(ids[..9].iter().copied());
    assert_eq!(begun.get(), 3);
}

/// A pool does every task once, whatever its size, and nothing of what is cancelled.
#[test]
fn a_pool_does_every_task_once() {
    let setup = Setup { config: short(), ..Setup::default() };
    let tasks: Vec<Task> =
        Sweep::setups(&setup, &[0.0, 0.5], 3).into_iter().map(|setup| Task::Sweep { setup: Box::new(setup) }).collect();
    let mut pool = thread_pool(|| ());
    let ids: Vec<u32> = tasks.iter().map(|task| pool.begin(task.clone())).collect();
    pool.cancel([ids[2]]);
    let mut outcomes = Vec::new();
    while outcomes.len() < 5 {
        for (id, event) in pool.receive() {
            match event {
                TaskEvent::Done(outcome, _) => outcomes.push((id, *outcome)),
                TaskEvent::Failed(sentence) => panic!("{sentence}"),
                _ => {}
            }
        }
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    outcomes.sort_by_key(|(id, _)| *id);
    let expected = ids.iter().zip(&tasks).filter(|(id, _)| **id != ids[2]);
    let expected: Vec<_> =
        expected.map(|(id, task)| (*id, task.run(&|| 0.0, &mut |_| true).unwrap().unwrap())).collect();
    assert_eq!(outcomes, expected);
    assert!(pool.receive().is_empty());
}

/// What is said of how far a task is grows from 0 to 1, whatever the task.
#[test]
fn progress_grows_from_nothing_to_all() {
    let setup = Box::new(Setup { config: short(), ..Setup::default() });
    let grid = Grid::new(setup.grid.clone()).unwrap();
    let ensemble = Trainer::new(grid.clone(), short()).unwrap().ensemble();
    let file = EnsembleFile::new(&grid, &ensemble, None);
    let attack = |attacker: &str| Task::Attack {
        ensemble: Box::new(file.clone()),
        attacker: attacker.parse().unwrap(),
        horizon: 100,
        seed: 1,
    };
    let race = |cloner: &str| {
        let cloner = cloner.parse().unwrap();
        let (expert, start) = (None, (5, 5));
        Task::Race(Box::new(Race {
            ensemble: file.clone(),
            cloner,
            expert,
            start,
            horizon: 100,
            episodes: 300,
            seed: 1,
            luck: 2,
        }))
    };
    let attackers = vec![AttackerChoice::UNIFORM, "bc(200)".parse().unwrap()];
    let mut tasks = vec![Task::Table1 { setup: setup.clone(), attackers }, Task::Sweep { setup }];
    tasks.extend(["bc(2000)", "gru(1)", "history_k(2)", "filtered"].map(attack));
    tasks.extend(["occupancy", "history"].map(race));
    for task in tasks {
        let mut heard = Vec::new();
        let outcome = task.run(&|| 0.0, &mut |share| {
            heard.push(share);
            true
        });
        assert!(outcome.unwrap().is_some());
        let grows = heard.is_sorted() && heard.iter().all(|share| (0.0..=1.0).contains(share));
        // What is done at once need not say anything.
        let is_short = matches!(&task, Task::Attack { attacker, .. } if attacker.model().name == "filtered");
        assert!(grows && heard.is_empty() == is_short, "{task:?}: {heard:?}");
    }
}

/// The thread behind the native window: ready, a whole run, and a new thread when asked for.
#[test]
fn a_thread_runs_a_session() {
    let mut link = ThreadLink::new(|| ());
    let wait = |link: &mut ThreadLink| loop {
        match link.receive() {
            Some(event) => return event.unwrap(),
            None => std::thread::sleep(std::time::Duration::from_millis(1)),
        }
    };
    for _ in 0..2 {
        assert_eq!(wait(&mut link), Event::Ready { protocol: PROTOCOL });
        link.send(&Command::Load { setup: Box::new(Setup { config: short(), ..Setup::default() }), play: true });
        let last = loop {
            if let Event::Snapshot(snapshot) = wait(&mut link) {
                link.send(&Command::Seen(snapshot.number));
                if snapshot.state == RunState::Finished {
                    break snapshot;
                }
            }
        };
        assert_eq!(last.digest, digest_after(short(), 20));
        link.restart();
    }
}

/// Any update can be gone back to, and what is played from there is what was played before.
#[test]
fn every_update_can_be_sought() {
    let mut desk = Desk::new();
    desk.load(short(), true);
    desk.run(1e6);
    let (run, end) = (desk.last().run, desk.last().digest);
    for update in [7, 0, 19, 20, 1] {
        // Of two that are sought at once the last counts.
        desk.send(Command::Seek { run, update: 3 });
        desk.send(Command::Seek { run, update });
        desk.run(1e6);
        let last = desk.last();
        assert_eq!((last.update, last.recorded, last.digest), (update, 20, digest_after(short(), update)));
        assert_eq!(last.state, if update == 20 { RunState::Finished } else { RunState::Paused });
    }
    let points: usize = desk.snapshots.iter().map(|snapshot| snapshot.curve.len()).sum();
    desk.send(Command::Play);
    desk.run(1e6);
    assert_eq!((desk.last().update, desk.last().digest, desk.last().run), (20, end, run));
    // Nothing of it is new to the curve.
    assert_eq!(desk.snapshots.iter().map(|snapshot| snapshot.curve.len()).sum::<usize>(), points);
    // Of another run nothing is shown.
    desk.send(Command::Seek { run: run + 1, update: 2 });
    desk.run(1e6);
    assert_eq!(desk.last().update, 20);
    // A run that plays stops there.
    desk.send(Command::Speed(Some(100.0)));
    desk.load(short(), true);
    desk.run(100.0);
    let run = desk.started.last().unwrap().run;
    assert!((desk.last().run, desk.last().state) == (run, RunState::Playing) && desk.last().update > 2);
    desk.send(Command::Seek { run, update: 2 });
    desk.run(1e6);
    assert_eq!((desk.last().run, desk.last().update, desk.last().state), (run, 2, RunState::Paused));
    // One of which nothing is shown before its end has no past to look at.
    desk.send(Command::Retrain { beta: 0.5 });
    desk.advance();
    let run = desk.started.last().unwrap().run;
    desk.send(Command::Seek { run, update: 1 });
    desk.run(1e6);
    assert_eq!((desk.last().run, desk.last().update, desk.last().state), (run, 20, RunState::Finished));
}

/// Another β from a moment that lies back is another run with the same past; what is written of its course makes it again.
/// Where updates take long a moment is made again bit by bit, and the newest wish counts.
#[test]
fn a_long_way_back_does_not_hold_the_session() {
    let mut desk = Desk::new();
    desk.load(short(), true);
    desk.run(10_000.0);
    let run = desk.last().run;
    // A look at the clock takes longer than a stretch of work, so each turn makes one update.
    desk.tick = 1000.0;
    let taken = desk.snapshots.len();
    desk.send(Command::Seek { run, update: 7 });
    assert_eq!([desk.advance(), desk.advance()], [Pace::Now; 2]);
    desk.send(Command::Seek { run, update: 5 });
    let turns = (1..20).find(|_| desk.advance() != Pace::Now || desk.snapshots.len() > taken).unwrap();
    assert_eq!((turns, desk.last().update), (5, 5));
    assert_eq!(desk.last().digest, digest_after(short(), 5));
    // What needs the moment waits for it, and so does what comes after; the session goes on hearing.
    desk.send(Command::Seek { run, update: 6 });
    desk.send(Command::Export);
    let later = [Command::Seek { run, update: 3 }, Command::Seek { run, update: 7 }, Command::Step, Command::Pause];
    later.into_iter().for_each(|command| desk.send(command));
    assert_eq!((desk.advance(), desk.exported.len(), desk.last().update), (Pace::Now, 0, 5));
    desk.run(100_000.0);
    assert_eq!((desk.exported.len(), desk.exported[0].update), (1, 6));
    assert_eq!((desk.last().update, desk.last().digest), (8, digest_after(short(), 8)));
    assert!(desk.snapshots.iter().all(|snapshot| snapshot.update != 3));
    // A new run waits for nothing that the old one was to do, but for its ensemble.
    desk.send(Command::Seek { run, update: 6 });
    desk.send(Command::Play);
    desk.load(short(), false);
    desk.run(100_000.0);
    assert_eq!((desk.last().run, desk.last().update, desk.last().state), (run + 1, 0, RunState::Paused));
    assert_eq!(desk.refused, [""; 0]);
}

#[test]
fn a_branch_goes_on_from_the_past_and_can_be_made_again() {
    let mut desk = Desk::new();
    desk.load(short(), true);
    desk.run(1e6);
    let first = desk.last().run;
    desk.send(Command::Seek { run: first, update: 12 });
    desk.run(1e6);
    desk.send(Command::Continue { beta: 0.1 });
    desk.run(1e6);
    let branch = desk.started.last().unwrap().clone();
    assert_eq!(branch.branch_of, Some((first, 12)));
    let last = desk.last().clone();
    assert_eq!((last.run, last.update, last.beta), (branch.run, 22, 0.1));
    assert_eq!(last.course.turns, [(12, 0.1)]);
    assert_eq!(last.course.updates, Some(22));
    // By hand.
    let mut trainer = Trainer::new(Grid::new(GridSpec::default()).unwrap(), short()).unwrap();
    (0..12).for_each(|_| trainer.update());
    trainer.set_beta(0.1).unwrap();
    (12..22).for_each(|_| trainer.update());
    assert_eq!(last.digest, Some(trainer.digest()));
    // From what is written.
    let setup = Setup { config: short(), course: last.course.clone(), ..Setup::default() };
    let mut again = Desk::new();
    again.send(Command::Load { setup: Box::new(setup), play: true });
    again.run(1e6);
    assert_eq!((again.last().digest, again.last().update, again.last().beta), (last.digest, 22, 0.1));
    assert_eq!(again.last().course, last.course);
    // Its past is that of the first run, its future its own.
    desk.send(Command::Seek { run: last.run, update: 11 });
    desk.run(1e6);
    assert_eq!((desk.last().digest, desk.last().beta), (digest_after(short(), 11), 0.6));
    // At the end it is no branch to go on.
    desk.send(Command::Seek { run: last.run, update: 22 });
    desk.send(Command::Continue { beta: 0.3 });
    desk.run(1e6);
    assert_eq!((desk.last().run, desk.last().update), (last.run, 42));
    assert_eq!(desk.last().course.turns, [(12, 0.1), (22, 0.3)]);
}

/// A run whose session has died stands there again as it was seen, whatever had been done with it: moment, number, state and
/// what comes after; nothing is told twice.
#[test]
fn a_run_is_resumed_where_it_was_seen() {
    let mut desk = Desk::new();
    desk.load(short(), true);
    desk.run(1e6);
    let first = desk.last().run;
    let mut states = Vec::new();
    // At the end; looking back; on a branch under way and at its end; a step beyond it.
    states.push(desk.last().clone());
    desk.send(Command::Seek { run: first, update: 12 });
    desk.run(1e6);
    states.push(desk.last().clone());
    desk.is_drawing = false;
    desk.send(Command::Continue { beta: 0.1 });
    while desk.last().update < 14 {
        desk.advance();
        let seen = desk.last().number;
        desk.send(Command::Seen(seen));
    }
    states.push(desk.last().clone());
    desk.is_drawing = true;
    let seen = desk.last().number;
    desk.send(Command::Seen(seen));
    desk.run(1e6);
    let end = desk.last().clone();
    states.push(end.clone());
    desk.send(Command::Step);
    desk.run(1e6);
    states.push(desk.last().clone());
    assert_eq!(desk.last().course.updates, Some(23));
    for seen in states {
        let setup = Setup { config: short(), course: seen.course.clone(), ..Setup::default() };
        let mut again = Desk::new();
        let (run, recorded, update) = (seen.run, seen.recorded, seen.update);
        let is_playing = seen.state == RunState::Playing;
        again.send(Command::Resume { run, setup: Box::new(setup), recorded, update, is_playing });
        // What is pressed meanwhile is done afterwards.
        again.send(Command::Export);
        while again.snapshots.is_empty() {
            again.advance();
        }
        let now = again.snapshots[0].clone();
        assert_eq!((now.run, now.state, now.update, now.recorded), (run, seen.state, update, recorded));
        assert_eq!((now.digest, now.beta, now.last_update), (seen.digest, seen.beta, seen.last_update));
        assert_eq!((&now.course, now.experts), (&seen.course, seen.experts));
        assert_eq!((now.curve.len(), again.started.len(), again.refused.len()), (0, 0, 0));
        assert_eq!((again.exported[0].run, again.exported[0].update), (run, update));
        again.run(1e6);
        if is_playing {
            assert_eq!((again.last().update, again.last().digest), (end.update, end.digest));
            assert!(again.snapshots.iter().flat_map(|snapshot| &snapshot.curve).all(|point| point.update > recorded));
        } else {
            assert_eq!(again.last().number, 1);
        }
    }
}

/// A run that is being made again gives way to a new β at once, unless somebody waits for it.
#[test]
fn a_new_beta_need_not_wait_for_a_run_that_is_made_again() {
    let resume = || Command::Resume {
        run: 4,
        setup: Box::new(Setup { config: short(), ..Setup::default() }),
        recorded: short().updates(),
        update: 3,
        is_playing: false,
    };
    let mut desk = Desk::new();
    desk.send(resume());
    desk.advance();
    desk.send(Command::Retrain { beta: 7.0 });
    assert_eq!((desk.refused.len(), desk.started.len()), (1, 0));
    desk.send(Command::Seek { run: 4, update: 1 });
    desk.send(Command::Pause);
    desk.send(Command::Play);
    desk.send(Command::Retrain { beta: 0.3 });
    assert_eq!((desk.started.len(), desk.started[0].run, desk.started[0].setup.config.beta), (1, 5, 0.3));
    desk.run(1e6);
    assert!(desk.snapshots.iter().all(|snapshot| (snapshot.run, snapshot.beta) == (5, 0.3)));
    assert_eq!(desk.last().update, short().updates());

    let setup = Box::new(Setup { config: Config { beta: 0.3, ..short() }, ..Setup::default() });
    for command in [Command::Retrain { beta: 0.3 }, Command::Load { setup, play: true }] {
        let mut desk = Desk::new();
        desk.send(resume());
        desk.send(Command::Export);
        desk.send(command);
        assert_eq!((desk.exported.len(), desk.started.len()), (0, 0));
        desk.run(1e6);
        assert_eq!((desk.exported[0].run, desk.exported[0].update), (4, 3));
        assert_eq!((desk.started[0].run, desk.last().run, desk.last().update), (5, 5, short().updates()));
    }
}

/// A run that is made again also goes back to where it was a few milliseconds at a time.
#[test]
fn a_run_that_is_made_again_works_in_short_turns() {
    let config = Config { total_steps: 10_000 * 4096, ..Config::default() };
    let setup = Box::new(Setup { config, ..Setup::default() });
    let mut desk = Desk::new();
    desk.send(Command::Resume { run: 1, setup, recorded: 40, update: 39, is_playing: false });
    // Of an update as slow as this a turn does no more than one or two.
    desk.tick = 5.0;
    let mut turns = 0;
    while desk.snapshots.is_empty() {
        let begin = desk.now.get();
        desk.advance();
        let looks = (desk.now.get() - begin) / desk.tick;
        assert!(looks < 8.0, "{looks} looks at the clock in a turn");
        turns += 1;
    }
    assert_eq!((desk.last().update, desk.last().recorded), (39, 40));
    // Forty updates, and seven of them again.
    assert!(turns >= 40 + 7 / 2, "{turns}");
    // It is told how far it is, four times a second of those that this took.
    let told = desk.remade.len() as f64;
    assert!(desk.remade.is_sorted() && desk.remade[0] >= 2 && desk.remade.iter().all(|&update| update <= 40));
    assert!((2.0..=desk.now.get() / 250.0 + 1.0).contains(&told), "{:?}", desk.remade);
}

/// Whoever sends commands without end while a moment is searched for is told so.
#[test]
fn commands_that_wait_are_not_without_number() {
    let setup = Box::new(Setup { config: short(), ..Setup::default() });
    let mut desk = Desk::new();
    desk.send(Command::Resume { run: 1, setup, recorded: short().updates(), update: 3, is_playing: false });
    (0..1000).for_each(|_| desk.send(Command::Step));
    assert_eq!(desk.refused.len(), 0);
    desk.send(Command::Step);
    assert_eq!(desk.refused, ["1000 commands wait already."]);
}

#[test]
fn a_course_that_is_none_is_refused() {
    for course in [
        Course { turns: vec![(3, 0.1), (3, 0.2)], updates: None },
        Course { turns: vec![(3, 7.0)], updates: None },
        Course { turns: vec![], updates: Some(0) },
    ] {
        let mut desk = Desk::new();
        desk.send(Command::Load { setup: Box::new(Setup { course, ..Setup::default() }), play: true });
        assert_eq!((desk.refused.len(), desk.started.len()), (1, 0));
    }
}
