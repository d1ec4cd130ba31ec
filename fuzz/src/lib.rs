//! What strangers may hand to ape-lab, and what the page and the command then do with it.
//!
//! A [`Target`] takes any bytes. It must not panic, take long or show what is no number; what it reads it goes on to use:
//! the page opens it, trains a little, draws and exports. Each makes its own seeds, so that no corpus is kept in the
//! repository. `page` holds a page without a window, `seeds` what the fuzzer begins with.

mod page;
mod seeds;

use std::cell::Cell;
use std::time::Duration;

use ape_lab::ape::{EnsembleFile, Figures};
use ape_lab::attack::AttackerChoice;
use ape_lab::experiment::{Outcome, Setup, Shard, Task, address, merge_shards};
use ape_lab::lab::{Command, Event, Pace, Session, TaskEvent, decode, encode};

use page::{Visit, assert_numbers, check_events, shrink};

/// One kind of input.
pub struct Target {
    name: &'static str,
    read: fn(&[u8]),
    seeds: fn() -> Vec<Vec<u8>>,
}

/// What follows `#` in the page's address.
pub static ADDRESS: Target = Target { name: "address", read: read_address, seeds: seeds::addresses };
/// An ensemble file, dropped on the page or named on the command line; a configuration file.
pub static ENSEMBLE: Target = Target { name: "ensemble", read: read_ensemble, seeds: seeds::ensembles };
/// A shard of a sweep, as `ape merge` reads it.
pub static SHARD: Target = Target { name: "shard", read: read_shard, seeds: seeds::shards };
/// What the page keeps in the browser's storage, with the address that asks for it.
pub static STORED: Target = Target { name: "stored", read: read_stored, seeds: seeds::stored };
/// What a page says to a session.
pub static COMMANDS: Target = Target { name: "commands", read: read_commands, seeds: seeds::commands };
/// What a session says to a page.
pub static EVENTS: Target = Target { name: "events", read: read_events, seeds: seeds::events };
/// What a page asks of the workers beside the session, and what they answer.
pub static TASKS: Target = Target { name: "tasks", read: read_tasks, seeds: seeds::tasks };

impl Target {
    pub fn run(&self, data: &[u8]) {
        (self.read)(data);
    }

    /// Puts the seeds where the fuzzer looks for them, and beside them a dictionary of words that inputs are made of.
    pub fn write_seeds(&self) {
        let corpus = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus");
        let folder = corpus.join(self.name);
        std::fs::create_dir_all(&folder).expect("the corpus can be written");
        for (index, seed) in (self.seeds)().iter().enumerate() {
            std::fs::write(folder.join(format!("seed{index:02}")), seed).expect("the corpus can be written");
        }
        std::fs::write(corpus.join("words.dict"), seeds::dictionary()).expect("the corpus can be written");
    }
}

/// Messages of two bytes' length each, then their bytes.
fn messages(mut data: &[u8]) -> Vec<&[u8]> {
    let mut messages = Vec::new();
    while let [low, high, rest @ ..] = data {
        let (message, rest) = rest.split_at(rest.len().min(usize::from(u16::from_le_bytes([*low, *high]))));
        messages.push(message);
        data = rest;
    }
    messages
}

/// Whether a page shall open what the core refuses: seldom, as that is soon known and slow.
fn is_worth_a_page(data: &[u8]) -> bool {
    data.iter().fold(0u8, |sum, byte| sum.wrapping_mul(31).wrapping_add(*byte)).is_multiple_of(16)
}

fn read_address(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let mut is_good = is_worth_a_page(data);
    if let Ok(mut pairs) = address::decode(&text)
        && let Ok(setup) = address::read(&mut pairs)
    {
        is_good = true;
        let again = address::encode(&address::write(&setup));
        let mut pairs = address::decode(&again).expect("what was written can be read");
        assert_eq!(address::read(&mut pairs).as_ref(), Ok(&setup), "{again}");
    }
    if is_good {
        Visit { fragment: text.into_owned(), ..Visit::default() }.play();
    }
}

fn read_ensemble(data: &[u8]) {
    let text = String::from_utf8_lossy(data).into_owned();
    // The command reads configurations from the same kind of file.
    if let Ok(setup) = Setup::parse(&text) {
        setup.check().map_or_else(|error| assert!(!error.to_string().is_empty()), |()| ());
    }
    let file = EnsembleFile::parse(&text);
    let mut is_good = is_worth_a_page(data);
    if let Ok((grid, ensemble)) = file.clone().and_then(EnsembleFile::check) {
        is_good = true;
        let file = file.expect("it was checked");
        let again = EnsembleFile::new(&grid, &ensemble, file.config.clone());
        let json = serde_json::to_string(&again).expect("a file is plain data");
        assert_eq!(EnsembleFile::parse(&json).as_ref(), Ok(&again));
        let figures = serde_json::to_string(&Figures::of(&grid, &ensemble, 50)).expect("figures are plain data");
        assert!(!figures.contains("null"), "{figures}");
        for attacker in ["uniform", "occupancy", "filtered", "history_k(1)", "history"] {
            let attacker = attacker.parse().expect("it is in the table");
            run(Task::Attack { ensemble: Box::new(again.clone()), attacker, horizon: 50, seed: 1 });
        }
    }
    if is_good {
        Visit { file: Some(text), ..Visit::default() }.play();
    }
}

fn read_shard(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    let Ok(shard) = Shard::parse(&text) else { return };
    let again = shard.text().expect("a shard is plain data");
    assert_eq!(Shard::parse(&again).as_ref(), Ok(&shard));
    assert!(shard.missing().len() <= shard.size());
    let mut resumed = Shard::new(shard.sweep().clone(), shard.which()).expect("its plan was checked");
    resumed.resume(shard.clone()).expect("it is the same shard");
    if let Ok(sweep) = merge_shards(vec![("one.json".to_owned(), shard)]) {
        assert_numbers(&sweep.csv());
    }
}

/// Preferences, a kept file and an address, with zeros between.
fn read_stored(data: &[u8]) {
    let text = String::from_utf8_lossy(data).into_owned();
    let mut parts = text.split('\0');
    let mut next = || parts.next().unwrap_or_default().to_owned();
    let kept = vec![("preferences", next()), ("ensemble", next()), ("visited", "yes".to_owned())];
    Visit { kept, fragment: next(), ..Visit::default() }.play();
}

fn read_commands(data: &[u8]) {
    let (mut session, mut grid) = (Session::new(), None);
    let now = Cell::new(0.0);
    let clock = || {
        now.set(now.get() + 4.0);
        now.get()
    };
    for message in messages(data).into_iter().take(24) {
        let Ok(command) = decode::<Command>(message) else { continue };
        assert_eq!(decode::<Command>(&encode(&command)).map(|again| encode(&again)), Ok(encode(&command)));
        session.handle(shrink(command));
        for _ in 0..2 {
            if let Pace::After(ms) = session.advance(&clock) {
                assert!(Duration::try_from_secs_f64(ms / 1000.0).is_ok(), "{ms}");
            }
            let events = session.events();
            check_events(&mut grid, &events);
            for event in &events {
                assert_eq!(decode(&encode(event)).as_ref(), Ok(event));
                if let Event::Snapshot(snapshot) = event {
                    session.handle(Command::Seen(snapshot.number));
                }
            }
        }
    }
}

fn read_events(data: &[u8]) {
    let events: Vec<_> = messages(data).into_iter().take(24).map(decode).collect();
    if events.iter().any(Result::is_ok) || is_worth_a_page(data) {
        Visit { events, ..Visit::default() }.play();
    }
}

/// Runs a task for a while; what comes of it must be what a page takes.
fn run(task: Task) {
    let mut calls = 0;
    let mut progress = |done: f64| {
        assert!((0.0..=1.0 + 1e-9).contains(&done), "{done}");
        calls += 1;
        calls < 50
    };
    if let Ok(Some(outcome)) = task.run(&|| 0.0, &mut progress) {
        assert_eq!(outcome.check(&task), Ok(()));
        assert_eq!(decode::<Outcome>(&encode(&outcome)), Ok(outcome));
    }
}

fn read_tasks(data: &[u8]) {
    let messages = messages(data);
    let [task, news @ ..] = &messages[..] else { return };
    let Ok(task) = decode::<Task>(task) else { return };
    let outcomes = news.iter().take(8).filter_map(|message| match decode(message) {
        Ok(TaskEvent::Done(outcome, _)) => Some(outcome),
        _ => None,
    });
    outcomes.for_each(|outcome| assert!(outcome.check(&task) != Err(String::new())));
    if let Some(task) = small(task) {
        run(task);
    }
}

/// A task with so little to do that a fuzzer gets on.
fn small(mut task: Task) -> Option<Task> {
    const MOST: u32 = 200;
    let quick = |attacker: AttackerChoice| attacker.with_parameter(attacker.parameter().min(MOST));
    let is_quick = |attacker: &AttackerChoice| attacker.model().name != "gru";
    match &mut task {
        Task::Attack { attacker, horizon, .. } => {
            // One that is too long is to be refused.
            *horizon = if *horizon <= 10_000 { (*horizon).min(MOST) } else { *horizon };
            *attacker = quick(*attacker);
            is_quick(attacker).then_some(task)
        }
        Task::Table1 { setup, attackers } => {
            page::shrink_setup(setup);
            attackers.retain(is_quick);
            attackers.iter_mut().for_each(|attacker| *attacker = quick(*attacker));
            Some(task)
        }
        Task::Sweep { setup } => {
            page::shrink_setup(setup);
            Some(task)
        }
        Task::Race(race) => {
            race.horizon = if race.horizon <= 10_000 { race.horizon.min(MOST) } else { race.horizon };
            race.episodes = if race.episodes <= 100_000 { race.episodes.min(20) } else { race.episodes };
            race.cloner = quick(race.cloner);
            is_quick(&race.cloner).then_some(task)
        }
    }
}
