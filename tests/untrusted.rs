#![cfg(not(target_arch = "wasm32"))]
//! What strangers may hand in, and what fuzzing or looking for limits has found: each is refused with a sentence, none hangs
//! a worker or brings a page down. docs/TESTING.md has the limits.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use ape_lab::ape::{Config, EnsembleFile, GradientKind, Trainer};
use ape_lab::attack::AttackerChoice;
use ape_lab::experiment::{Course, Outcome, Preset, Race, Setup, Shard, Task};
use ape_lab::lab::{Command, Event, Hand, Pool, Session, Snapshot, Started, TaskEvent, decode, encode};
use ape_lab::mdp::{Grid, GridSpec, KnownReturns};

fn small() -> Setup {
    let grid = GridSpec { rows: 2, cols: 3, ..GridSpec::default() };
    let config = Config { batch_steps: 20, total_steps: 200, horizon: 9, ..Config::default() };
    Setup { grid, config, ..Setup::default() }
}

fn trap() -> Setup {
    (Preset::find("trap").unwrap().setup)()
}

fn load(setup: Setup) -> Command {
    Command::Load { setup: Box::new(setup), play: false }
}

/// What a session says to a command.
fn said(session: &mut Session, command: Command) -> Vec<Event> {
    session.handle(command);
    session.advance(&|| 1e6);
    session.events()
}

fn refused(session: &mut Session, command: Command) -> String {
    match &said(session, command)[..] {
        [Event::Refused(sentence), ..] => sentence.clone(),
        other => panic!("{other:?}"),
    }
}

fn started_and_shown(setup: Setup) -> (Started, Snapshot) {
    match &said(&mut Session::new(), load(setup))[..] {
        [Event::Started(started), Event::Snapshot(snapshot)] => ((**started).clone(), (**snapshot).clone()),
        other => panic!("{other:?}"),
    }
}

/// A thread that waits for a session's next turn panicked for a time that is no time.
#[test]
fn a_speed_is_a_number_of_updates() {
    let mut session = Session::new();
    for speed in [f32::NAN, f32::INFINITY, 0.0, -1.0, 1e-30, 1e30] {
        let sentence = refused(&mut session, Command::Speed(Some(speed)));
        assert!(sentence.ends_with("must be from 0.01 to 1000000 updates a second."), "{sentence}");
    }
    assert!(said(&mut session, Command::Speed(Some(0.01))).is_empty());
}

/// Each of them is evaluated for every snapshot.
#[test]
fn clones_to_show_are_few_and_quick() {
    let mut session = Session::new();
    let many: Vec<AttackerChoice> = (1..=17).map(|kept| format!("replay({kept})").parse().unwrap()).collect();
    assert_eq!(refused(&mut session, Command::Show(many)), "17 clones: must be at most 16.");
    let large = Setup {
        grid: GridSpec { rows: 32, cols: 32, ..GridSpec::default() },
        config: Config { horizon: 10_000, batch_steps: 1, ..Config::default() },
        ..Setup::default()
    };
    let [one, three]: [AttackerChoice; 2] = ["history_k(1)", "history_k(3)"].map(|name| name.parse().unwrap());
    assert!(three.is_quick(100, 100) && three.is_quick(1024, 100) && one.is_quick(1024, 3000));
    // A minute of work.
    assert!(!three.is_quick(1024, 10_000));
    said(&mut session, Command::Show(vec![three]));
    let events = said(&mut session, load(large));
    let shown = events.iter().find_map(|event| match event {
        Event::Snapshot(snapshot) => Some(snapshot.clones.len()),
        _ => None,
    });
    assert_eq!(shown, Some(1));
}

/// The configuration that came with a given ensemble was not looked at: four billion steps for every figure.
#[test]
fn a_given_ensemble_comes_with_a_good_configuration() {
    let config = Config { horizon: u32::MAX, ..Config::default() };
    let sentence = refused(&mut Session::new(), load(Setup { config, ..trap() }));
    assert_eq!(sentence, "horizon 4294967295: must be a whole number from 1 to 10000");
    // The page asks the setup for the grid.
    let grid = GridSpec { cols: 0, ..GridSpec::default() };
    let sentence = refused(&mut Session::new(), load(Setup { grid, ..trap() }));
    assert_eq!(sentence, "grid: must be that of the ensemble which is given");
    // An observer that has to learn first is not made while everybody waits.
    let config = Config { observer: "gru(32)".parse().unwrap(), ..Config::default() };
    let (_, snapshot) = started_and_shown(Setup { config, ..trap() });
    assert_eq!(snapshot.clones, []);
}

#[test]
fn no_update_takes_for_ever() {
    let gru = |units: u32, horizon: u32, batch_steps: u32| Config {
        observer: format!("gru({units})").parse().unwrap(),
        horizon,
        batch_steps,
        ..Config::default()
    };
    for config in [gru(4, 100, 4096), gru(32, 200, 12_500), gru(1, 888, 55_555)] {
        assert_eq!(config.check(), Ok(()));
    }
    // 25, 86 and 6 seconds of work.
    for config in [gru(32, 100, 1_000_000), gru(32, 10_000, 4096), gru(1, 6400, 4096)] {
        let sentence = config.check().unwrap_err().to_string();
        let expected =
            "must be one with (units + 8) · horizon of at most 8000 and (units + 8) · batch_steps of at most 500000";
        assert!(sentence.ends_with(expected), "{sentence}");
    }
    let config = Config { batch_steps: 1, total_steps: 1_000_000_000, ..Config::default() };
    let sentence = config.check().unwrap_err().to_string();
    assert_eq!(sentence, "total_steps 1000000000: must be at most 10000000 times batch_steps, which is 1");
    assert_eq!(Config { total_steps: 1_000_000_000, ..Config::default() }.check(), Ok(()));
    assert!(Config { total_steps: 1_000_000_001, ..Config::default() }.check().is_err());
}

/// For every turn all of the configuration was checked: thousands of turns beside a thousand rewards took seconds.
#[test]
fn many_turns_of_a_long_configuration_are_checked_at_once() {
    let reward = vec!["0,1=1"; 1029].join(" ");
    let config = Config { adversary_reward: Some(reward.parse().unwrap()), ..small().config };
    let turns = |beta: f64| (0..10_000).map(|update| (update, beta)).collect();
    let setup = |beta: f64| Setup {
        course: Course { turns: turns(beta), updates: Some(10_000) },
        config: config.clone(),
        ..small()
    };
    // A minute before.
    (0..20).for_each(|_| assert_eq!(setup(0.5).check(), Ok(())));
    assert_eq!(setup(2.5).check().unwrap_err().to_string(), "config: beta 2.5: must be a number from 0 to 2");
}

#[test]
fn a_course_has_no_more_turns_than_a_hand_can_make() {
    let course = |turns: u32| Setup {
        course: Course { turns: (0..turns).map(|update| (update, 0.5)).collect(), updates: Some(20_000) },
        ..small()
    };
    assert_eq!(course(10_000).check(), Ok(()));
    assert!(course(10_001).check().unwrap_err().to_string().starts_with("course: expected at most 10000 turns"));
}

/// Every update was a point of the curve where the configuration is of a single one: the page kept and drew ten million, and
/// took a worker for broken that sent more than ten thousand at once.
#[test]
fn a_long_run_leaves_a_curve_of_usual_length() {
    let grid = GridSpec { rows: 2, cols: 2, ..GridSpec::default() };
    let config = Config { experts: 1, batch_steps: 1, total_steps: 1, horizon: 1, ..Config::default() };
    for updates in [50, 1200, 30_001] {
        let course = Course { turns: Vec::new(), updates: Some(updates) };
        let setup = Setup { grid: grid.clone(), config: config.clone(), course, ensemble: None };
        let mut session = Session::new();
        session.handle(Command::Load { setup: Box::new(setup), play: true });
        let mut points = Vec::new();
        let mut now = 0.0;
        while points.last() != Some(&updates) {
            now += 100.0;
            session.advance(&|| now);
            for event in session.events() {
                if let Event::Snapshot(snapshot) = event {
                    session.handle(Command::Seen(snapshot.number));
                    points.extend(snapshot.curve.iter().map(|point| point.update));
                }
            }
        }
        assert!((50..=1300).contains(&points.len()), "{updates}: {}", points.len());
        assert!(points.is_sorted_by(|a, b| a < b) && points[0] == 0);
    }
}

/// Serde takes the entries of an array for the fields of an object, and what is checked by its name was not: a horizon of four
/// billion steps was evaluated.
#[test]
fn a_file_is_an_object() {
    let rows = "[0,0,1,0,0],[0,0,1,0,0],[1,0,0,0,0],[1,0,0,0,0]";
    let grid = r#"{"rows":2,"cols":2,"goal":[0,0]}"#;
    let array = format!(r#"["ape-ensemble",1,{grid},[[{rows}]],{{"horizon":4294967295}}]"#);
    assert!(EnsembleFile::parse(&array).unwrap_err().to_string().contains("no object of fields"));
    let object = format!(
        r#"{{"format":"ape-ensemble","version":1,"grid":{grid},"experts":[[{rows}]],"config":{{"horizon":4294967295}}}}"#
    );
    let file = EnsembleFile::parse(&object).unwrap();
    assert!(file.config.is_none() && file.left_out.unwrap().contains("horizon 4294967295: must be"));
}

/// Without an end to its episodes, an attack of no steps collected pairs for ever.
#[test]
fn tasks_are_checked_before_they_are_done() {
    let ensemble = Box::new(trap().ensemble.unwrap());
    for horizon in [0, 10_001, u32::MAX] {
        for attacker in ["bc_counts(5)", "occupancy", "gru(4)"] {
            let attacker = attacker.parse().unwrap();
            let task = Task::Attack { ensemble: ensemble.clone(), attacker, horizon, seed: 1 };
            let sentence = task.run(&|| 0.0, &mut |_| true).unwrap_err();
            assert_eq!(sentence, format!("horizon {horizon}: must be a whole number from 1 to 10000"));
        }
    }
    let attackers = vec![AttackerChoice::UNIFORM; 101];
    let task = Task::Table1 { setup: Box::new(small()), attackers };
    assert_eq!(task.run(&|| 0.0, &mut |_| true).unwrap_err(), "101 attackers: must be at most 100");
}

/// What is wrong is quoted, but not at any length.
#[test]
fn sentences_are_short() {
    let long = "x".repeat(1_000_000);
    let texts = [
        format!(r#"{{"format":"{long}","version":1,"grid":{{"rows":2,"cols":2,"goal":[0,0]}},"experts":[]}}"#),
        format!(r#"{{"format":"ape-ensemble","version":1,"grid":{{"{long}":2}},"experts":[]}}"#),
    ];
    for text in texts {
        let error = EnsembleFile::parse(&text).and_then(EnsembleFile::check).unwrap_err();
        assert!(error.to_string().len() < 600, "{} letters", error.to_string().len());
        assert!(Shard::parse(&text).unwrap_err().to_string().len() < 600);
    }
    assert!(Setup::parse(&format!(r#"{{"{long}":1}}"#)).unwrap_err().to_string().len() < 600);
    assert!(long.parse::<AttackerChoice>().unwrap_err().to_string().len() < 600);
}

#[test]
fn messages_are_of_a_known_length() {
    let bytes = encode(&Command::Play);
    assert_eq!(decode(&bytes), Ok(Command::Play));
    let longer = [&bytes[..], &[0]].concat();
    assert_eq!(decode::<Command>(&longer), Err("A message could not be read (1 bytes are left over).".to_owned()));
    let sentence = decode::<Command>(&vec![0; 16_000_001]).unwrap_err();
    assert_eq!(sentence, "A message could not be read (16000001 bytes: expected at most 16000000).");
    // A length that promises more than there is takes no memory.
    let show = encode(&Command::Show(Vec::new()));
    assert!(decode::<Command>(&[&show[..1], &[0xff, 0xff, 0xff, 0xff, 0x0f]].concat()).is_err());
}

/// A page draws by cell and by expert: figures of another grid brought it down.
#[test]
fn snapshots_fit_their_grid_and_are_made_of_numbers() {
    let (started, snapshot) = started_and_shown(small());
    let grid = started.check().unwrap();
    assert_eq!(snapshot.check(&grid), Ok(()));
    let wrong = |change: &dyn Fn(&mut Snapshot), expected: &str| {
        let mut snapshot = snapshot.clone();
        change(&mut snapshot);
        let sentence = snapshot.check(&grid).unwrap_err();
        assert!(sentence.contains(expected), "{sentence}: {expected}");
    };
    wrong(&|snapshot| snapshot.experts.clear(), "0 experts: expected 1 to 8");
    wrong(&|snapshot| _ = snapshot.experts[0].policy.pop(), "5 rows of a policy: expected 6");
    wrong(&|snapshot| snapshot.experts[0].policy[3][2] = f32::NAN, "a probability of NaN: expected a number");
    wrong(&|snapshot| _ = snapshot.experts[1].hitting_time.pop(), "5 hitting times: expected 6");
    wrong(&|snapshot| snapshot.experts[1].hitting_time[1] = f32::INFINITY, "a hitting time of inf");
    wrong(&|snapshot| snapshot.clones[0].contexts.push(0.5), "13 probabilities of contexts: expected 12");
    wrong(&|snapshot| snapshot.clones[0].view.returns.capped_return = Some(f64::NAN), "capped_return NaN: expected");
    wrong(&|snapshot| snapshot.ensemble.success = f64::NEG_INFINITY, "success -inf: expected a number from 0 to 1");
    wrong(&|snapshot| snapshot.beta = 3.0, "β 3: expected a number from 0 to 2");
    wrong(&|snapshot| snapshot.course.turns = vec![(1, 0.5); 10_001], "10001 turns of β");
    wrong(&|snapshot| snapshot.curve[0].clone.horizon_return = f64::NAN, "horizon_return NaN: expected");
    wrong(&|snapshot| snapshot.curve = vec![snapshot.curve[0]; 10_001], "10001 points of the curve");
    let mut other = started.clone();
    other.optimal.policy.pop();
    assert!(other.check().is_err());
    let other = Started { setup: Setup { grid: GridSpec { rows: 0, ..GridSpec::default() }, ..small() }, ..started };
    assert!(other.check().is_err());
}

/// Says what it is told to.
struct Liar(Rc<RefCell<VecDeque<TaskEvent>>>);

impl Hand for Liar {
    fn begin(&mut self, _task: &Task) {}

    fn receive(&mut self) -> Option<Result<TaskEvent, String>> {
        self.0.borrow_mut().pop_front().map(Ok)
    }

    fn stop(&mut self) {}
}

#[test]
fn outcomes_are_those_of_their_tasks() {
    let mut trainer = Trainer::new(Grid::new(small().grid).unwrap(), small().config).unwrap();
    trainer.update();
    let ensemble = EnsembleFile::new(trainer.grid(), &trainer.ensemble(), None);
    let attack =
        Task::Attack { ensemble: Box::new(ensemble.clone()), attacker: AttackerChoice::UNIFORM, horizon: 9, seed: 1 };
    let cloner = AttackerChoice::OCCUPANCY;
    let race = Race { ensemble, cloner, expert: None, start: (1, 1), horizon: 9, episodes: 4, seed: 1, luck: 1 };
    let race = Task::Race(Box::new(race));
    let done = |task: &Task| task.run(&|| 0.0, &mut |_| true).unwrap().unwrap();
    let (attacked, raced) = (done(&attack), done(&race));
    assert_eq!((attacked.check(&attack), raced.check(&race)), (Ok(()), Ok(())));
    assert!(attacked.check(&race).is_err() && raced.check(&attack).is_err());
    let mut lost = raced.clone();
    if let Outcome::Race(raced) = &mut lost {
        raced.runs[1].path[0] = 6;
    }
    assert_eq!(lost.check(&race).unwrap_err(), "cell 6 of a path: expected one below 6");
    let says = Rc::new(RefCell::new(VecDeque::new()));
    let ears = says.clone();
    let mut pool = Pool::new(1, move || Box::new(Liar(ears.clone())));
    let mut answer = |event: TaskEvent| {
        let id = pool.begin(race.clone());
        says.borrow_mut().push_back(event);
        let news = pool.receive();
        pool.cancel([id]);
        assert_eq!(news[0].0, id);
        news[0].1.clone()
    };
    assert_eq!(answer(TaskEvent::Progress(f32::NAN)), TaskEvent::Progress(0.0));
    let good = TaskEvent::Done(Box::new(raced.clone()), 1.0);
    assert_eq!(answer(good.clone()), good);
    assert!(matches!(answer(TaskEvent::Done(Box::new(lost), 1.0)), TaskEvent::Failed(_)));
    assert!(matches!(answer(TaskEvent::Done(Box::new(attacked), 1.0)), TaskEvent::Failed(_)));
    assert!(matches!(answer(TaskEvent::Done(Box::new(raced), f64::NAN)), TaskEvent::Failed(_)));
}

/// What a file or message says of a world, a policy or its figures is what there can be.
#[test]
fn what_cannot_be_is_not_taken() {
    for slip in [-0.5, 1.0, f64::NAN] {
        assert!(Grid::new(GridSpec { slip, ..GridSpec::default() }).is_err(), "{slip}");
    }
    let spec = GridSpec { rows: 2, cols: 2, goal: (0, 0), walls: vec![(1, 1)], slip: 0.0 };
    let file = |rows: [[f64; 5]; 4], experts: usize| EnsembleFile {
        grid: spec.clone(),
        experts: vec![rows.to_vec(); experts],
        ..trap().ensemble.unwrap()
    };
    let [up, left] = [[1.0, 0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0]];
    // Of the wall nothing counts, and it is as any other afterwards.
    let good = file([up, left, up, [9.0, -1.0, 0.0, 0.0, 0.0]], 8);
    let (_, ensemble) = good.check().unwrap();
    assert_eq!(ensemble.policies()[0].row(3), &[0.2; 5]);
    for rows in [[up, left.map(|p| p / 2.0), up, up], [up, [0.0; 5], up, up]] {
        assert!(file(rows, 2).check().is_err());
    }
    assert!(file([up, left, up, up], 9).check().is_err());
    let returns = KnownReturns {
        capped_return: None,
        uncapped_return: None,
        horizon_return: -5.0,
        success: 0.5,
        horizon_error: 0.1,
        success_error: 0.1,
    };
    assert!(returns.check(100).is_ok());
    for wrong in [
        KnownReturns { horizon_return: 1.0, ..returns },
        KnownReturns { horizon_return: -100.1, ..returns },
        KnownReturns { horizon_error: 101.0, ..returns },
        KnownReturns { success_error: 3.1, ..returns },
        KnownReturns { uncapped_return: Some(1e300), ..returns },
        KnownReturns { success: 1.1, ..returns },
        KnownReturns { horizon_error: -1.0, ..returns },
    ] {
        assert!(wrong.check(100).is_err(), "{wrong:?}");
    }
}

/// A mixture's gradient has no formula for a clone that remembers; and after its end a run's bonus on entropy stays as it is.
#[test]
fn a_configuration_holds_also_past_its_end() {
    let mixture = |observer: &str| Config {
        observer: observer.parse().unwrap(),
        gradient: GradientKind::Mixture,
        ..Config::default()
    };
    assert!(mixture("history").check().is_err() && mixture("replay(60)").check().is_ok());
    let config = Config::default();
    assert!((config.entropy_weight(10 * config.updates()) - config.entropy_end).abs() < 1e-12);
}
