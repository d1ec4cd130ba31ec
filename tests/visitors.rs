#![cfg(all(feature = "page", not(target_arch = "wasm32")))]
//! Visitors who do anything in any order, with a worker that is slow, silent or dies: whatever they did, once all is quiet the
//! page shows what its controls say, a fresh session comes to the same digest, and its address leads to the same page.
//!
//! proptest makes them up, always the same ones, and shrinks what fails. `VISITS=1000 SEED=7 cargo test --test visitors` tries
//! more of them, and others.

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, VecDeque};
use std::rc::Rc;

use ape_lab::ape::EnsembleFile;
use ape_lab::experiment::{Preset, Setup, Task, address};
use ape_lab::lab::{Command, Event, Hand, Link, PROTOCOL, Pace, Pool, RunState, Session, Snapshot, TaskEvent};
use ape_lab::ui::{App, Host};
use egui::accesskit::Role;
use egui::{Key, Modifiers, Vec2, pos2, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use proptest::prelude::{Just, Strategy, any};
use proptest::test_runner::{Config as Runs, RngSeed, TestRunner};

/// A worker beyond a wire on which everything takes some frames.
#[derive(Default)]
struct Worker {
    session: Session,
    frame: u32,
    latency: u32,
    is_silent: bool,
    /// Whether it would have gone on at once.
    is_busy: bool,
    now: f64,
    commands: VecDeque<(u32, Command)>,
    events: VecDeque<(u32, Result<Event, String>)>,
}

impl Worker {
    /// Works for a frame.
    fn work(&mut self) {
        self.frame += 1;
        self.now += 16.0;
        if self.is_silent {
            return;
        }
        while self.commands.front().is_some_and(|(due, _)| *due <= self.frame) {
            let (_, command) = self.commands.pop_front().unwrap();
            self.session.handle(command);
        }
        let now = Cell::new(self.now);
        let pace = self.session.advance(&|| {
            now.set(now.get() + 0.2);
            now.get()
        });
        self.is_busy = pace == Pace::Now;
        self.now = now.get();
        let due = self.frame + self.latency;
        self.events.extend(self.session.events().into_iter().map(|event| (due, Ok(event))));
    }

    fn die(&mut self) {
        (self.commands, self.events) = Default::default();
        self.events.push_back((self.frame, Err("The worker was ended.".to_owned())));
        self.session = Session::new();
    }
}

#[derive(Clone, Default)]
struct Wire(Rc<RefCell<Worker>>);

impl Link for Wire {
    fn send(&mut self, command: &Command) {
        let worker = &mut *self.0.borrow_mut();
        worker.commands.push_back((worker.frame + worker.latency, command.clone()));
    }

    fn receive(&mut self) -> Option<Result<Event, String>> {
        let worker = &mut *self.0.borrow_mut();
        let (due, _) = worker.events.front()?;
        if *due > worker.frame {
            return None;
        }
        worker.events.pop_front().map(|(_, event)| event)
    }

    fn restart(&mut self) {
        let worker = &mut *self.0.borrow_mut();
        worker.session = Session::new();
        worker.is_silent = false;
        worker.commands.clear();
        worker.events = VecDeque::from([(worker.frame + worker.latency, Ok(Event::Ready { protocol: PROTOCOL }))]);
    }
}

/// Does a task in the eighth look at it, unless that would take long.
#[derive(Default)]
struct Slow(Option<Task>, u32);

impl Hand for Slow {
    fn begin(&mut self, task: &Task) {
        *self = Slow(Some(task.clone()), 0);
    }

    fn receive(&mut self) -> Option<Result<TaskEvent, String>> {
        self.0.as_ref()?;
        self.1 += 1;
        if self.1 < 8 {
            return None;
        }
        let task = self.0.take()?;
        let is_long = match &task {
            Task::Attack { attacker, .. } => ["bc", "gru"].contains(&attacker.model().name),
            Task::Sweep { setup } | Task::Table1 { setup, .. } => work(setup) > 1e6,
            Task::Race(race) => race.episodes > 1000,
        };
        if is_long {
            return Some(Ok(TaskEvent::Failed("It takes too long.".to_owned())));
        }
        Some(Ok(match task.run(&|| 0.0, &mut |_| true) {
            Ok(outcome) => TaskEvent::Done(Box::new(outcome.expect("it was not told to stop")), 1.0),
            Err(sentence) => TaskEvent::Failed(sentence),
        }))
    }

    fn stop(&mut self) {
        self.0 = None;
    }
}

/// Steps that a run takes in all.
fn work(setup: &Setup) -> f64 {
    let is_learnt = setup.config.observer.to_string().starts_with("gru");
    f64::from(setup.config.total_steps) * f64::from(setup.config.experts) * if is_learnt { 100.0 } else { 1.0 }
}

type NamedText = (String, Result<String, String>);

#[derive(Clone, Default)]
struct Desktop {
    to_open: Rc<RefCell<Vec<NamedText>>>,
    visits: Rc<RefCell<Vec<String>>>,
    address: Rc<RefCell<String>>,
    kept: Rc<RefCell<HashMap<String, String>>>,
}

impl Host for Desktop {
    fn save(&mut self, name: &str, text: &str) -> Result<(), String> {
        assert_numbers(name, text);
        Ok(())
    }

    fn save_picture(&mut self, name: &str, svg: &str) -> Result<(), String> {
        self.save(name, svg)
    }

    fn ask_for_file(&mut self) -> Result<(), String> {
        Ok(())
    }

    fn read(&mut self, _file: egui::DroppedFileHandle) {}

    fn opened(&mut self) -> Option<NamedText> {
        self.to_open.borrow_mut().pop()
    }

    fn visited(&mut self) -> Option<String> {
        let visited = self.visits.borrow_mut().pop()?;
        *self.address.borrow_mut() = visited.clone();
        Some(visited)
    }

    fn set_address(&mut self, fragment: &str) {
        *self.address.borrow_mut() = fragment.to_owned();
    }

    fn keep(&mut self, name: &str, text: &str) -> Result<(), String> {
        self.kept.borrow_mut().insert(name.to_owned(), text.to_owned());
        Ok(())
    }

    fn kept(&self, name: &str) -> Option<String> {
        self.kept.borrow().get(name).cloned()
    }
}

/// No text says that something is no number.
fn assert_numbers(place: &str, text: &str) {
    let mut words = text.split(|c: char| !c.is_alphanumeric());
    assert!(!words.any(|word| ["NaN", "inf"].contains(&word)), "{place}: {text}");
}

/// Small worlds and short runs, so that many are seen; and the pages that a visitor may come from.
const ADDRESSES: [&str; 8] = [
    "v=1&size=4x5&goal=1,2&total_steps=9000&batch_steps=150&horizon=20&speed=max",
    "v=1&size=3x4&goal=0,3&walls=1:1&slip=0.2&total_steps=6000&batch_steps=300&horizon=12&observer=occupancy&tab=world",
    "v=1&size=4x4&total_steps=6000&batch_steps=100&horizon=20&turns=10:0.2;20:0.9&speed=60&at=15",
    "v=1&size=4x4&total_steps=5000&batch_steps=100&horizon=15&algorithm=exact&observer=uniform&experts=3",
    "v=1&ensemble=trap&observer=occupancy&tab=race",
    "v=1&size=4x4&total_steps=4000&batch_steps=100&horizon=20&observer=replay(3)&tab=sweep&clones=history;filtered",
    "v=1&size=4x4&total_steps=4000&batch_steps=100&horizon=20&alpha=-9&digest=0123456789abcdef",
    "v=1&size=99x1",
];

/// The last speed of the toolbar.
const FASTEST: usize = 8;

const TEXTS: [&str; 8] = ["3", "none", "-5", "x", "0,1=-1 stay=2", "0.35", "world", "clone"];

const KEYS: [(Modifiers, Key); 28] = {
    const fn plain(key: Key) -> (Modifiers, Key) {
        (Modifiers::NONE, key)
    }
    [
        plain(Key::Space),
        plain(Key::S),
        plain(Key::R),
        plain(Key::ArrowLeft),
        plain(Key::ArrowRight),
        plain(Key::ArrowUp),
        plain(Key::ArrowDown),
        (Modifiers::SHIFT, Key::ArrowLeft),
        (Modifiers::SHIFT, Key::ArrowRight),
        plain(Key::Home),
        plain(Key::End),
        plain(Key::Enter),
        plain(Key::Escape),
        plain(Key::Tab),
        (Modifiers::SHIFT, Key::Tab),
        plain(Key::Backspace),
        plain(Key::G),
        plain(Key::K),
        plain(Key::L),
        plain(Key::T),
        plain(Key::C),
        plain(Key::E),
        plain(Key::P),
        plain(Key::Num1),
        plain(Key::Num2),
        plain(Key::Num3),
        (Modifiers::COMMAND, Key::K),
        plain(Key::Questionmark),
    ]
};

const SIZES: [Vec2; 4] = [vec2(1280.0, 800.0), vec2(390.0, 844.0), vec2(320.0, 480.0), vec2(900.0, 600.0)];

/// What a visitor does, or what happens to them. Numbers count round among what there is.
#[derive(Clone, Copy, Debug)]
enum Act {
    Press(u16),
    /// Another value for a slider or number.
    Move(u16, i8),
    Key(usize),
    Write(usize),
    /// From one place to another, as parts of the page.
    Drag([f32; 4]),
    Scroll(f32),
    Visit(usize),
    /// Back to where the page was before the last visit.
    Back,
    Open(usize),
    Resize(usize),
    Latency(u32),
    Silence,
    Die,
    Wait,
}

fn acts() -> impl Strategy<Value = Vec<(Act, usize)>> {
    let part = || 0.0..1.0f32;
    let act = proptest::prop_oneof![
        14 => any::<u16>().prop_map(Act::Press),
        4 => (any::<u16>(), -4..5i8).prop_map(|(which, by)| Act::Move(which, by)),
        6 => (0..KEYS.len()).prop_map(Act::Key),
        2 => (0..TEXTS.len()).prop_map(Act::Write),
        2 => [part(), part(), part(), part()].prop_map(Act::Drag),
        1 => (-400.0..400.0f32).prop_map(Act::Scroll),
        1 => (0..ADDRESSES.len()).prop_map(Act::Visit),
        1 => Just(Act::Back),
        1 => (0..4usize).prop_map(Act::Open),
        1 => (0..SIZES.len()).prop_map(Act::Resize),
        1 => (0..12u32).prop_map(Act::Latency),
        1 => Just(Act::Silence),
        1 => Just(Act::Die),
        1 => Just(Act::Wait),
    ];
    proptest::collection::vec((act, 0..5usize), 1..40)
}

type Page<'a> = Harness<'a, Option<App>>;

struct Visitor<'a> {
    page: Page<'a>,
    wire: Wire,
    desktop: Desktop,
    /// Addresses that were left.
    past: Vec<String>,
    /// What was done, in words: printed when something is wrong.
    diary: Vec<String>,
}

impl Drop for Visitor<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            eprintln!("A visitor: {}.", self.diary.join("; "));
        }
    }
}

impl Visitor<'_> {
    fn new(address: &str, desktop: Desktop) -> Visitor<'static> {
        let wire = Wire::default();
        wire.clone().restart();
        desktop.kept.borrow_mut().insert("visited".to_owned(), "yes".to_owned());
        desktop.visits.borrow_mut().push(address.to_owned());
        let (link, host) = (wire.clone(), desktop.clone());
        let page = Harness::builder().with_size(SIZES[0]).build_ui_state(
            move |ui, app: &mut Option<App>| match app {
                Some(app) => {
                    link.0.borrow_mut().work();
                    app.hear();
                    app.show(ui);
                }
                None => {
                    let pool = Pool::new(2, || Box::new(Slow::default()));
                    *app = Some(App::new(ui.ctx(), Box::new(link.clone()), pool, Box::new(host.clone())));
                }
            },
            None,
        );
        Visitor { page, wire, desktop, past: Vec::new(), diary: vec![address.to_owned()] }
    }

    fn app(&self) -> &App {
        self.page.state().as_ref().expect("it is there from the first frame on")
    }

    fn app_mut(&mut self) -> &mut App {
        self.page.state_mut().as_mut().expect("it is there from the first frame on")
    }

    /// Those of these roles that are on the screen and enabled: their names and where they are.
    fn widgets(&self, roles: &[Role]) -> Vec<(String, egui::Rect)> {
        let screen = self.page.ctx.content_rect();
        let nodes = self.page.root().children_recursive();
        let is_there = |node: &egui_kittest::Node<'_>| {
            let of = node.accesskit_node();
            roles.contains(&of.role())
                && !of.is_disabled()
                && of.bounding_box().is_some()
                && screen.contains(node.rect().center())
        };
        let named = |node: egui_kittest::Node<'_>| {
            let of = node.accesskit_node();
            (of.label().or(of.value()).unwrap_or_default(), node.rect())
        };
        // What learns takes too long for a test of thousands of visits.
        let is_quick = |(name, _): &(String, egui::Rect)| !name.starts_with("gru");
        nodes.filter(is_there).map(named).filter(is_quick).collect()
    }

    fn act(&mut self, act: Act) {
        match act {
            Act::Press(which) => {
                let widgets = self.widgets(&[
                    Role::Button,
                    Role::RadioButton,
                    Role::CheckBox,
                    Role::ComboBox,
                    Role::SpinButton,
                    Role::TextInput,
                    Role::Image,
                    Role::Link,
                ]);
                if let Some((name, rect)) = widgets.get(usize::from(which) % widgets.len().max(1)) {
                    self.diary.push(format!("presses {name:?}"));
                    self.page.drag_at(rect.center());
                    self.page.drop_at(rect.center());
                }
            }
            Act::Move(which, by) => {
                let roles = [Role::Slider, Role::SpinButton];
                let widgets = self.widgets(&roles);
                if let Some((name, _)) = widgets.get(usize::from(which) % widgets.len().max(1)) {
                    let node = self.page.query_all_by(|node| roles.contains(&node.role())).find(|node| {
                        let of = node.accesskit_node();
                        of.label().or(of.value()).as_ref() == Some(name)
                    });
                    let Some(node) = node else { return };
                    let of = node.accesskit_node();
                    let step = of.numeric_value_step().unwrap_or(1.0);
                    let value = of.numeric_value().unwrap_or_default() + f64::from(by) * step;
                    self.diary.push(format!("sets {name:?} to {value}"));
                    node.set_value_accesskit(value);
                }
            }
            Act::Key(which) => {
                let (modifiers, key) = KEYS[which];
                self.diary.push(format!("presses {modifiers:?} {key:?}"));
                self.page.key_press_modifiers(modifiers, key);
            }
            Act::Write(which) => {
                self.diary.push(format!("writes {:?}", TEXTS[which]));
                self.page.event(egui::Event::Text(TEXTS[which].to_owned()));
            }
            Act::Drag([x0, y0, x1, y1]) => {
                let size = self.page.ctx.content_rect().size();
                self.diary.push(format!("drags from {x0}, {y0} to {x1}, {y1} of {size}"));
                self.page.drag_at(pos2(x0 * size.x, y0 * size.y));
                self.page.step();
                self.page.hover_at(pos2(x1 * size.x, y1 * size.y));
                self.page.step();
                self.page.drop_at(pos2(x1 * size.x, y1 * size.y));
            }
            Act::Scroll(by) => self.page.event(egui::Event::MouseWheel {
                unit: egui::MouseWheelUnit::Point,
                delta: vec2(0.0, by),
                phase: egui::TouchPhase::Move,
                source: egui::MouseWheelSource::Wheel,
                modifiers: Modifiers::NONE,
            }),
            Act::Visit(which) => self.visit(ADDRESSES[which].to_owned()),
            Act::Back => {
                if let Some(address) = self.past.pop() {
                    self.visit(address);
                    self.past.pop();
                }
            }
            Act::Open(which) => {
                self.diary.push(format!("opens file {which}"));
                let mut file = (Preset::find("trap").unwrap().setup)().ensemble.unwrap();
                match which {
                    0 => {}
                    1 => file.experts.truncate(1),
                    2 => file.digest = "0123456789abcdef".parse().ok(),
                    _ => file.experts[0][0][0] = 0.9,
                }
                let text = serde_json::to_string::<EnsembleFile>(&file).unwrap();
                self.desktop.to_open.borrow_mut().push((format!("file{which}.json"), Ok(text)));
            }
            Act::Resize(which) => {
                self.diary.push(format!("turns the page to {}", SIZES[which]));
                self.page.set_size(SIZES[which]);
            }
            Act::Latency(latency) => {
                self.diary.push(format!("has a latency of {latency} frames"));
                self.wire.0.borrow_mut().latency = latency;
            }
            Act::Silence => {
                self.diary.push("has a worker that hangs, or does so no more".to_owned());
                let worker = &mut *self.wire.0.borrow_mut();
                worker.is_silent = !worker.is_silent;
            }
            Act::Die => {
                self.diary.push("loses the worker".to_owned());
                self.wire.0.borrow_mut().die();
            }
            Act::Wait => {
                self.diary.push("waits".to_owned());
                self.page.run_steps(50);
            }
        }
    }

    fn visit(&mut self, address: String) {
        self.diary.push(format!("goes to {address}"));
        self.past.push(self.desktop.address.borrow().clone());
        self.desktop.visits.borrow_mut().push(address);
    }

    /// Everything comes to an end: the worker answers, and the run rests. Half a minute of the page's time for a short one.
    fn settle(&mut self) {
        self.diary.push("waits for the end".to_owned());
        {
            let worker = &mut *self.wire.0.borrow_mut();
            (worker.is_silent, worker.latency) = (false, 0);
        }
        // What is being dragged still moves.
        self.page.run_steps(4);
        self.app_mut().view.speed = FASTEST;
        self.app_mut().send(Command::Speed(None));
        for round in 0..1000 {
            self.page.run_steps(20);
            if !self.app().is_session_alive() {
                self.diary.push("restarts the worker".to_owned());
                self.page.key_press(Key::Escape);
                self.page.step();
                self.page.set_size(SIZES[0]);
                self.page.run_steps(2);
                self.page.get_by_label("Restart the worker").click_accesskit();
                continue;
            }
            if round == 20 {
                // A long run is stopped on its way; one that is made again after a loss comes to where it was first.
                self.app_mut().send(Command::Pause);
            }
            let worker = self.wire.0.borrow();
            let is_playing = self.app().shown().is_some_and(|(_, shown)| shown.state == RunState::Playing);
            if !is_playing && !worker.is_busy && worker.commands.is_empty() && worker.events.is_empty() {
                break;
            }
        }
        self.page.run_steps(20);
    }

    /// What holds whenever all is quiet.
    fn check(&self) {
        let app = self.app();
        let said: Vec<String> = self
            .page
            .root()
            .children_recursive()
            .flat_map(|node| [node.accesskit_node().label(), node.accesskit_node().value()])
            .flatten()
            .collect();
        said.iter().for_each(|text| assert_numbers("the page", text));
        let (started, snapshot) = app.shown().expect("a run has been shown");
        assert!(
            !app.is_retraining() && app.view.sought.is_none(),
            "retraining, or on the way to {:?}",
            app.view.sought
        );
        let words = |setup: &Setup| address::encode(&address::write(setup));
        let [shown, asked] = [&started.setup, app.setup()].map(words);
        assert!(app.shows_controls(), "{shown} and {:?} for {asked}", snapshot.course);
        assert_eq!(app.setup().check().map_err(|error| error.to_string()), Ok(()));
        let missing: Vec<&String> = said.iter().filter(|text| text.contains("being made")).collect();
        assert!(missing.is_empty(), "{missing:?}");
        for cloner in &app.view.clones {
            assert!(snapshot.clones.iter().any(|clone| clone.cloner == *cloner), "there is no {cloner}");
        }
        if work(app.setup()) < 1e7 {
            let again = again(Setup { course: snapshot.course.clone(), ..started.setup.clone() }, snapshot.update);
            assert_eq!(again.digest, snapshot.digest, "of update {}", snapshot.update);
            assert_eq!((again.ensemble, again.beta), (snapshot.ensemble, snapshot.beta));
            assert!(again.experts == snapshot.experts);
        }
    }
}

/// The same moment of the same run, by a session that has seen nothing else.
fn again(setup: Setup, update: u32) -> Snapshot {
    let mut session = Session::new();
    session.handle(Command::Speed(None));
    session.handle(Command::Load { setup: Box::new(setup), play: true });
    let (mut last, mut sought) = (None::<Snapshot>, false);
    for turn in 1..10_000 {
        session.advance(&|| 100.0 * f64::from(turn));
        for event in session.events() {
            if let Event::Snapshot(snapshot) = event {
                session.handle(Command::Seen(snapshot.number));
                last = Some(*snapshot);
            }
        }
        match &last {
            Some(snapshot) if snapshot.state != RunState::Playing && snapshot.update == update => break,
            Some(snapshot) if snapshot.state != RunState::Playing && !sought => {
                sought = true;
                session.handle(Command::Seek { run: snapshot.run, update });
            }
            _ => {}
        }
    }
    last.expect("a run shows something")
}

#[test]
fn whatever_a_visitor_does_the_page_stays_true() {
    let number = |name: &str, usual: u32| std::env::var(name).ok().and_then(|text| text.parse().ok()).unwrap_or(usual);
    let runs = Runs {
        cases: number("VISITS", 24),
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(u64::from(number("SEED", 1))),
        max_shrink_iters: 200,
        ..Runs::default()
    };
    let outcome = TestRunner::new(runs).run(&(0..ADDRESSES.len(), acts()), |(address, acts)| {
        let desktop = Desktop::default();
        let mut visitor = Visitor::new(ADDRESSES[address], desktop.clone());
        visitor.page.run_steps(2);
        for (act, frames) in acts {
            visitor.act(act);
            visitor.page.run_steps(frames);
        }
        visitor.settle();
        visitor.check();
        // Whoever opens its address sees the same.
        let address = desktop.address.borrow().clone();
        let mut other = Visitor::new(&address, desktop);
        other.settle();
        other.check();
        let seen = |visitor: &Visitor<'_>| {
            let (_, snapshot) = visitor.app().shown().unwrap();
            let view = visitor.app().view.clone();
            let setup = visitor.app().setup().clone();
            (
                address::encode(&address::write(&setup)),
                (snapshot.update, snapshot.digest),
                (view.tab, view.kind, view.clones, view.cell, view.step),
            )
        };
        assert_eq!(seen(&other), seen(&visitor), "{address}");
        Ok(())
    });
    outcome.unwrap_or_else(|failure| panic!("{failure}"));
}
