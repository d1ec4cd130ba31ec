#![cfg(all(feature = "page", not(target_arch = "wasm32")))]
//! The page as egui draws it, without a window: what it says, what its controls do, that nothing is cut off.

use std::cell::{Cell, RefCell};
use std::collections::{HashMap, VecDeque};
use std::rc::Rc;

use ape_lab::ape::{Config, EnsembleFile, Moment};
use ape_lab::attack::AttackerChoice;
use ape_lab::experiment::{Bench, Sweep, Task};
use ape_lab::lab::{Command, Event, Hand, Link, PROTOCOL, Pool, Session, TaskEvent};
use ape_lab::mdp::GridSpec;
use ape_lab::ui::{App, Host};
use egui::accesskit::Role;
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};

/// A session in the same thread, worked on whenever the page listens.
#[derive(Default)]
struct Desk {
    session: Session,
    now: f64,
    events: VecDeque<Result<Event, String>>,
    commands: Vec<Command>,
    starts: u32,
    hangs: bool,
}

#[derive(Clone, Default)]
struct Here(Rc<RefCell<Desk>>);

impl Here {
    fn new() -> Here {
        let mut here = Here::default();
        here.restart();
        here
    }
}

impl Link for Here {
    fn send(&mut self, command: &Command) {
        let mut desk = self.0.borrow_mut();
        desk.commands.push(command.clone());
        desk.session.handle(command.clone());
    }

    fn receive(&mut self) -> Option<Result<Event, String>> {
        let desk = &mut *self.0.borrow_mut();
        if desk.hangs {
            return None;
        }
        if desk.events.is_empty() {
            // A tenth of a second of the session's time goes by between two looks.
            desk.now += 100.0;
            let now = desk.now;
            desk.session.advance(&|| now);
            let events = desk.session.events();
            desk.events.extend(events.into_iter().map(Ok));
        }
        desk.events.pop_front()
    }

    fn restart(&mut self) {
        let desk = &mut *self.0.borrow_mut();
        desk.session = Session::new();
        desk.hangs = false;
        desk.starts += 1;
        desk.events = VecDeque::from([Ok(Event::Ready { protocol: PROTOCOL })]);
    }
}

/// Does a task while it is begun, and tells of it when asked; one that may not do it says so.
#[derive(Default)]
struct AtOnce(VecDeque<TaskEvent>, Rc<Cell<bool>>);

impl Hand for AtOnce {
    fn begin(&mut self, task: &Task) {
        self.0.push_back(TaskEvent::Progress(0.5));
        if self.1.get() {
            return self.0.push_back(TaskEvent::Failed("Out of memory.".to_owned()));
        }
        self.0.push_back(match task.run(&|| 0.0, &mut |_| true) {
            Ok(outcome) => TaskEvent::Done(Box::new(outcome.expect("it was not told to stop")), 1.0),
            Err(sentence) => TaskEvent::Failed(sentence),
        });
    }

    fn receive(&mut self) -> Option<Result<TaskEvent, String>> {
        self.0.pop_front().map(Ok)
    }

    fn stop(&mut self) {
        self.0.clear();
    }
}

/// A file: its name, and its text or why it could not be read.
type NamedText = (String, Result<String, String>);

/// Files that the page has saved, and files for it to open.
#[derive(Clone, Default)]
struct Desktop {
    saved: Rc<RefCell<Vec<(String, String)>>>,
    to_open: Rc<RefCell<Vec<NamedText>>>,
    failures: Rc<RefCell<Vec<String>>>,
    /// What the visitor puts behind `#`, and what the page has put there.
    visits: Rc<RefCell<Vec<String>>>,
    address: Rc<RefCell<String>>,
    kept: Rc<RefCell<HashMap<String, String>>>,
    kept_elsewhere: Rc<RefCell<HashMap<String, String>>>,
    tasks_fail: Rc<Cell<bool>>,
    has_no_clipboard: Rc<Cell<bool>>,
}

impl Host for Desktop {
    fn save(&mut self, name: &str, text: &str) -> Result<(), String> {
        self.saved.borrow_mut().push((name.to_owned(), text.to_owned()));
        Ok(())
    }

    fn save_picture(&mut self, name: &str, svg: &str) -> Result<(), String> {
        self.save(name, svg)
    }

    fn failure(&mut self) -> Option<String> {
        self.failures.borrow_mut().pop()
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

    fn can_copy(&self) -> bool {
        !self.has_no_clipboard.get()
    }

    fn keep(&mut self, name: &str, text: &str) -> Result<(), String> {
        self.kept.borrow_mut().insert(name.to_owned(), text.to_owned());
        Ok(())
    }

    fn kept(&self, name: &str) -> Option<String> {
        self.kept.borrow().get(name).cloned()
    }

    fn kept_elsewhere(&self, name: &str) -> Option<String> {
        self.kept_elsewhere.borrow().get(name).cloned()
    }
}

type Page<'a> = Harness<'a, Option<App>>;

fn open<'a>(width: f32, height: f32) -> (Page<'a>, Here) {
    open_with(width, height, Desktop::default())
}

fn open_with<'a>(width: f32, height: f32, desktop: Desktop) -> (Page<'a>, Here) {
    let here = Here::new();
    let link = here.clone();
    // Who has been here before is not told where to begin.
    desktop.kept.borrow_mut().insert("visited".to_owned(), "yes".to_owned());
    // What an address asks for may rest anywhere.
    let is_visit = !desktop.visits.borrow().is_empty();
    let mut page = Harness::builder().with_size(egui::vec2(width, height)).build_ui_state(
        move |ui, app: &mut Option<App>| {
            match app {
                Some(app) => {
                    app.hear();
                    app.show(ui);
                }
                // Fonts and styles hold from the next frame on.
                None => {
                    let fails = desktop.tasks_fail.clone();
                    let pool = Pool::new(2, move || Box::new(AtOnce(VecDeque::new(), fails.clone())));
                    *app = Some(App::new(ui.ctx(), Box::new(link.clone()), pool, Box::new(desktop.clone())));
                }
            }
        },
        None,
    );
    if !is_visit {
        settle(&mut page);
    }
    (page, here)
}

/// Draws until training has ended and everything is on the page.
fn settle(page: &mut Page) {
    for _ in 0..400 {
        page.step();
        if page
            .query_by(|node| says(node).is_some_and(|text| text.starts_with("trained") || text.starts_with("given")))
            .is_some()
        {
            page.run_steps(4);
            return;
        }
    }
    let said: Vec<String> =
        page.query_all_by(|node| node.role() == Role::Status).filter_map(|node| says(&node.accesskit_node())).collect();
    panic!("training did not end: {said:?}");
}

fn says(node: &egui_kittest::kittest::AccessKitNode<'_>) -> Option<String> {
    node.value().or_else(|| node.label())
}

/// The number in the figure whose spoken text starts so.
fn figure(page: &Page, start: &str) -> f64 {
    let node = page.get_by(|node| says(node).is_some_and(|text| text.starts_with(start)));
    let text = says(&node.accesskit_node()).unwrap();
    let number = text.split(": ").nth(1).unwrap().trim_end_matches(" steps").trim_end_matches('×').replace('−', "-");
    number.parse().unwrap_or_else(|_| panic!("{text}"))
}

#[test]
fn it_trains_by_itself_and_shows_the_effect() {
    let (page, _) = open(1280.0, 800.0);
    assert!(figure(&page, "Ensemble capped return") > -20.0);
    assert!(figure(&page, "Clone (uniform) capped return") < -90.0);
    assert_eq!(figure(&page, "Optimal capped return"), -9.0);
    for panel in ["Expert 1", "Expert 2", "Clone (uniform)", "Clone (occupancy)", "Optimal"] {
        page.get_by(|node| node.role() == Role::Image && says(node).is_some_and(|text| text.starts_with(panel)));
    }
    page.get_by(|node| says(node).is_some_and(|text| text.contains("gets lost")));
}

/// From a phone to a 4K screen every widget lies within the page's width, and on a phone a finger can press it.
#[test]
fn nothing_is_cut_off() {
    let sizes = [
        (320.0, 480.0),
        (390.0, 844.0),
        (730.0, 1000.0),
        (800.0, 500.0),
        (1000.0, 700.0),
        (1280.0, 800.0),
        (3840.0, 2160.0),
    ];
    let small = RefCell::new(std::collections::BTreeSet::new());
    for (width, height) in sizes {
        let (mut page, _) = open(width, height);
        let check = |page: &Page, place: &str| {
            for node in page.root().children_recursive() {
                let Some(bounds) = node.accesskit_node().bounding_box() else { continue };
                let name = says(&node.accesskit_node()).unwrap_or_default();
                if !name.is_empty() {
                    let is_inside = bounds.x0 >= -0.5 && bounds.x1 <= f64::from(width) + 0.5;
                    assert!(is_inside, "{width}, {place}: {name:?} {bounds:?}");
                }
                // A finger needs room.
                let role = node.accesskit_node().role();
                let is_pressed =
                    [Role::Button, Role::RadioButton, Role::ComboBox, Role::CheckBox, Role::Slider, Role::SpinButton];
                if width < 720.0 && is_pressed.contains(&role) && !name.starts_with("Sort by") {
                    let is_large = bounds.height() >= 39.5 && bounds.width() >= 39.5;
                    if !is_large {
                        small.borrow_mut().insert(format!(
                            "{place}: {role:?} {name:?} {:.0}x{:.0}",
                            bounds.width(),
                            bounds.height()
                        ));
                    }
                }
            }
        };
        for experts in ["2 experts", "8 experts"] {
            let node = page.get_by_role_and_label(Role::RadioButton, experts);
            node.click_accesskit();
            settle(&mut page);
            check(&page, experts);
        }
        page.get_by_label("2 experts").click_accesskit();
        settle(&mut page);
        page.state_mut().as_mut().unwrap().pin();
        for tab in ["Learn", "Train", "World", "Race", "β sweep", "Attack bench", "Table 1"] {
            go_to(&mut page, tab);
            page.run_steps(4);
            check(&page, tab);
        }
        // The lesson's longest steps, and looking back.
        go_to(&mut page, "Learn");
        for step in ["Step 3: β rises, and they part", "Step 7: It must be so"] {
            page.get_by_label(step).click_accesskit();
            settle(&mut page);
            check(&page, step);
        }
        page.state_mut().as_mut().unwrap().seek(100);
        page.run_steps(4);
        check(&page, "looking back");
    }
    assert!(small.borrow().is_empty(), "{:#?}", small.borrow());
}

#[test]
fn beta_moves_by_keyboard_and_everything_follows() {
    let (mut page, here) = open(1280.0, 800.0);
    let protected = figure(&page, "Clone ÷ ensemble capped");
    page.get_by_role_and_label(Role::Slider, "β").focus();
    page.step();
    for _ in 0..60 {
        page.key_press(egui::Key::ArrowLeft);
        page.step();
    }
    for _ in 0..60 {
        page.step();
    }
    settle(&mut page);
    assert!(matches!(here.0.borrow().commands.iter().rev().find(|c| matches!(c, Command::Retrain { .. })),
        Some(Command::Retrain { beta }) if *beta == 0.0));
    assert!(protected > 4.0 && figure(&page, "Clone ÷ ensemble capped") < 1.2);
}

/// Figures of another grid once brought the page down. A worker that sends them is replaced, and in the end given up.
#[test]
fn a_worker_that_makes_no_sense_is_replaced() {
    let (mut page, here) = open(1280.0, 800.0);
    let before = figure(&page, "Ensemble capped");
    let mut snapshot = page.state().as_ref().unwrap().shown().unwrap().1.clone();
    snapshot.experts[0].hitting_time.pop();
    let send = |page: &mut Page| {
        here.0.borrow_mut().events.push_back(Ok(Event::Snapshot(Box::new(snapshot.clone()))));
        page.run_steps(6);
        page.get_by(|node| says(node).is_some_and(|text| text.contains("99 hitting times: expected 100")));
        assert_eq!(figure(page, "Ensemble capped"), before);
        page.state().as_ref().unwrap().is_session_alive()
    };
    assert_eq!([(); 4].map(|()| send(&mut page)), [true, true, true, false]);
}

/// Between a move of β and the first word of its run the page shows another run: its digest does not go with this β.
#[test]
fn a_new_beta_has_no_digest_before_its_run() {
    let (mut page, here) = open(1280.0, 800.0);
    here.0.borrow_mut().hangs = true;
    for beta in [0.3, 0.2] {
        page.state_mut().as_mut().unwrap().set_beta(beta);
        page.run_steps(4);
        page.get_by(|node| node.role() == Role::Status && says(node).is_some_and(|text| text == "retraining …"));
        assert!(!page.state().as_ref().unwrap().can_export());
    }
    // That the run of the first β has begun, or an old picture comes, is not yet the run of the second.
    here.0.borrow_mut().hangs = false;
    settle(&mut page);
    let (started, _) = page.state().as_ref().unwrap().shown().unwrap();
    assert_eq!(started.setup.config.beta, 0.2);
    // A run that is refused is not waited for.
    here.0.borrow_mut().hangs = true;
    page.state_mut().as_mut().unwrap().set_beta(0.1);
    here.0.borrow_mut().events.push_back(Ok(Event::Refused("Not today.".to_owned())));
    here.0.borrow_mut().session = Session::new();
    here.0.borrow_mut().hangs = false;
    page.run_steps(4);
    assert!(!page.state().as_ref().unwrap().is_retraining());
}

/// Nothing that stands above the slider, and was drawn before it was moved, is of before: not for a single frame.
#[test]
fn a_digest_goes_in_the_frame_in_which_beta_moves() {
    let (mut page, here) = open(1280.0, 800.0);
    here.0.borrow_mut().hangs = true;
    page.get_by_role_and_label(Role::Slider, "β").focus();
    page.run_steps(4);
    text(&page, "trained");
    page.key_down(egui::Key::ArrowRight);
    page.step();
    assert_ne!(page.state().as_ref().unwrap().setup().last_beta(), 0.6);
    text(&page, "retraining …");
}

/// β is moved there and back while its first runs are still on their way: what they show is not the last word.
#[test]
fn a_beta_that_is_returned_to_waits_for_its_last_run() {
    let (mut page, here) = open(1280.0, 800.0);
    here.0.borrow_mut().hangs = true;
    let mut late = VecDeque::new();
    for beta in [0.3, 0.2] {
        page.state_mut().as_mut().unwrap().set_beta(beta);
        let desk = &mut *here.0.borrow_mut();
        desk.now += 100.0;
        let now = desk.now;
        desk.session.advance(&|| now);
        late.extend(desk.session.events().into_iter().map(Ok));
    }
    let snapshots = late.iter().filter(|event| matches!(event, Ok(Event::Snapshot(_)))).count();
    assert_eq!((late.len(), snapshots), (4, 2));
    page.state_mut().as_mut().unwrap().set_beta(0.3);
    // The session has nothing more to say yet.
    let mut session = std::mem::replace(&mut here.0.borrow_mut().session, Session::new());
    here.0.borrow_mut().events = late;
    here.0.borrow_mut().hangs = false;
    page.run_steps(4);
    let shown = |page: &Page| page.state().as_ref().unwrap().shown().unwrap().0.setup.config.beta;
    assert_eq!(shown(&page), 0.2);
    page.get_by(|node| node.role() == Role::Status && says(node).is_some_and(|text| text == "retraining …"));
    session.handle(Command::Seen(u32::MAX));
    here.0.borrow_mut().session = session;
    settle(&mut page);
    assert_eq!(shown(&page), 0.3);
    assert!(!page.state().as_ref().unwrap().is_retraining());
}

/// What cannot be trained changes nothing: neither the controls nor the run, and β can be moved afterwards.
#[test]
fn a_configuration_that_is_no_good_is_refused_before_it_is_set() {
    let (mut page, here) = open(1280.0, 800.0);
    page.state_mut().as_mut().unwrap().load_preset(4);
    settle(&mut page);
    page.get_by_label_contains("gru: learns").click_accesskit();
    page.run_steps(3);
    let app = page.state().as_ref().unwrap();
    assert_eq!((app.preset(), app.is_retraining()), (Some(4), false));
    page.get_by(|node| node.role() == Role::Alert && says(node).is_some_and(|text| text.contains("adversary_reward")));
    page.state_mut().as_mut().unwrap().set_beta(0.2);
    settle(&mut page);
    let desk = here.0.borrow();
    assert!(!desk.commands.iter().any(|c| matches!(c, Command::Load { setup, .. } if setup.check().is_err())));
}

/// Between a move of β at the end of a run and the first word of what follows, the digest on the page is of the run before.
#[test]
fn a_beta_continued_with_has_no_digest_before_the_run_has_heard_of_it() {
    let desktop = Desktop::default();
    let (mut page, here) = open_with(1280.0, 800.0, desktop.clone());
    here.0.borrow_mut().hangs = true;
    page.state_mut().as_mut().unwrap().continue_with(0.3);
    page.run_steps(60);
    let address = desktop.address.borrow().clone();
    assert!(address.contains("turns=732:0.3") && !address.contains("digest"), "{address}");
    assert!(!text(&page, "trained").contains("digest"));
    // The session is lost before it has heard of it; what the address and the controls say is trained by the next one.
    here.0.borrow_mut().events = VecDeque::from([Err("The worker has stopped.".to_owned())]);
    here.0.borrow_mut().hangs = false;
    page.run_steps(6);
    until(&mut page, "trained, update 1464 of 1464");
    let (_, snapshot) = page.state().as_ref().unwrap().shown().unwrap();
    assert_eq!((snapshot.beta, snapshot.course.turns.clone()), (0.3, vec![(732, 0.3)]));
    let digest = snapshot.digest;

    desktop.visits.borrow_mut().push(address);
    page.run_steps(3);
    until(&mut page, "trained, update 1464 of 1464");
    assert_eq!(page.state().as_ref().unwrap().shown().unwrap().1.digest, digest);
}

/// A branch of which the session has not heard yet is as long as the session makes it.
#[test]
fn a_branch_is_as_long_whether_or_not_its_worker_is_lost() {
    for is_lost in [false, true] {
        let (mut page, here) = open(1280.0, 800.0);
        page.state_mut().as_mut().unwrap().seek(700);
        until(&mut page, "paused at update 700 of 732");
        here.0.borrow_mut().hangs = is_lost;
        page.state_mut().as_mut().unwrap().continue_with(0.3);
        assert_eq!(page.state().as_ref().unwrap().setup().updates(), 700 + 366);
        if is_lost {
            page.run_steps(60);
            here.0.borrow_mut().events = VecDeque::from([Err("The worker has stopped.".to_owned())]);
            here.0.borrow_mut().hangs = false;
            page.run_steps(6);
        }
        until(&mut page, "trained, update 1066 of 1066");
        let (_, snapshot) = page.state().as_ref().unwrap().shown().unwrap();
        assert_eq!((snapshot.beta, snapshot.course.turns.clone()), (0.3, vec![(700, 0.3)]));
    }
}

/// Who continues with the β that is there makes no branch of it; digest and address stay what they were.
#[test]
fn a_run_continued_with_its_own_beta_is_the_same_run() {
    let desktop = Desktop::default();
    let (mut page, _here) = open_with(1280.0, 800.0, desktop.clone());
    let digest = page.state().as_ref().unwrap().shown().unwrap().1.digest;
    for update in [731, 300] {
        page.state_mut().as_mut().unwrap().seek(update);
        until(&mut page, &format!("paused at update {update} of 732"));
        page.state_mut().as_mut().unwrap().continue_with(0.6);
        until(&mut page, "trained, update 732 of 732");
        page.run_steps(60);
        let app = page.state().as_ref().unwrap();
        assert!(app.shows_controls() && app.setup().course == Default::default());
        assert_eq!(app.shown().unwrap().1.digest, digest);
        let address = desktop.address.borrow();
        assert!(!address.contains("turns") && !address.contains("updates") && address.contains("digest"), "{address}");
    }
}

/// Who continues with the β of a moment that lies before a turn leaves the turn out.
#[test]
fn a_run_continued_with_its_own_beta_turns_no_more() {
    let desktop = Desktop::default();
    desktop.visits.borrow_mut().push("v=1".to_owned());
    let (mut page, _here) = open_with(1280.0, 800.0, desktop.clone());
    settle(&mut page);
    let plain = page.state().as_ref().unwrap().shown().unwrap().1.digest;
    desktop.visits.borrow_mut().push("v=1&turns=300:0.2".to_owned());
    page.run_steps(3);
    settle(&mut page);
    page.state_mut().as_mut().unwrap().seek(100);
    until(&mut page, "paused at update 100 of 732");
    page.state_mut().as_mut().unwrap().continue_with(0.6);
    until(&mut page, "trained, update 732 of 732");
    page.run_steps(60);
    let app = page.state().as_ref().unwrap();
    let (_, snapshot) = app.shown().unwrap();
    assert!(app.shows_controls());
    assert_eq!((snapshot.beta, snapshot.course.turns.clone(), snapshot.digest), (0.6, vec![(100, 0.6)], plain));
}

/// The moment that is searched for comes before the β that it is continued with, in the address and with another worker, too.
#[test]
fn a_beta_continued_with_belongs_to_the_moment_that_is_sought() {
    let (mut page, here) = open(1280.0, 800.0);
    here.0.borrow_mut().hangs = true;
    page.state_mut().as_mut().unwrap().seek(300);
    page.state_mut().as_mut().unwrap().continue_with(0.3);
    let setup = page.state().as_ref().unwrap().setup().clone();
    assert_eq!((setup.course.turns.clone(), setup.updates()), (vec![(300, 0.3)], 732));
    here.0.borrow_mut().events = VecDeque::from([Err("The worker has stopped.".to_owned())]);
    here.0.borrow_mut().hangs = false;
    page.run_steps(6);
    until(&mut page, "trained, update 732 of 732");
    let app = page.state().as_ref().unwrap();
    assert!(app.shows_controls());
    assert_eq!(app.shown().unwrap().1.course.turns, [(300, 0.3)]);
}

/// A key that is held down asks a slow worker for no more than a few updates.
#[test]
fn updates_one_by_one_are_few_at_a_time() {
    let (mut page, here) = open(1280.0, 800.0);
    let steps = || here.0.borrow().commands.iter().filter(|command| **command == Command::Step).count();
    for expected in [4, 8] {
        here.0.borrow_mut().hangs = true;
        for _ in 0..20 {
            page.key_press(egui::Key::S);
            page.step();
        }
        assert_eq!(steps(), expected);
        here.0.borrow_mut().hangs = false;
        settle(&mut page);
    }
}

/// Pictures from before a move of β do not take it back.
#[test]
fn a_beta_on_its_way_is_not_taken_back() {
    let (mut page, here) = open(1280.0, 800.0);
    press(&mut page, "Back to the start");
    page.run_steps(3);
    press(&mut page, "One update");
    page.run_steps(3);
    // A snapshot that was made before the session heard of the move.
    here.0.borrow_mut().session.handle(Command::Step);
    page.state_mut().as_mut().unwrap().hear();
    page.state_mut().as_mut().unwrap().continue_with(0.3);
    let commands = here.0.borrow().commands.len();
    let (_, snapshot) = page.state().as_ref().unwrap().shown().unwrap();
    let mut late = snapshot.clone();
    late.number += 1;
    late.curve.clear();
    here.0.borrow_mut().events = VecDeque::from([Ok(Event::Snapshot(Box::new(late)))]);
    let session = std::mem::replace(&mut here.0.borrow_mut().session, Session::new());
    page.state_mut().as_mut().unwrap().hear();
    let app = page.state_mut().as_mut().unwrap();
    assert_eq!(app.setup().last_beta(), 0.3);
    app.set_beta(0.3);
    assert_eq!(here.0.borrow().commands.len(), commands);
    here.0.borrow_mut().session = session;
    settle(&mut page);
    assert_eq!(page.state().as_ref().unwrap().setup().last_beta(), 0.3);
    assert!(page.state().as_ref().unwrap().shows_controls());
}

/// Back at the start of a run that was continued with another β, its old pictures do not bring that back.
#[test]
fn a_course_that_was_left_is_not_taken_up_again() {
    let (mut page, here) = open(1280.0, 800.0);
    page.state_mut().as_mut().unwrap().continue_with(0.3);
    until(&mut page, "trained, update 1464 of 1464");
    let late = page.state().as_ref().unwrap().shown().unwrap().1.clone();
    page.state_mut().as_mut().unwrap().continue_with(0.6);
    until(&mut page, "trained, update 2196 of 2196");
    here.0.borrow_mut().hangs = true;
    page.state_mut().as_mut().unwrap().reset();
    here.0.borrow_mut().session = Session::new();
    here.0.borrow_mut().events = VecDeque::from([Ok(Event::Snapshot(Box::new(late)))]);
    here.0.borrow_mut().hangs = false;
    page.state_mut().as_mut().unwrap().hear();
    assert_eq!(page.state().as_ref().unwrap().setup().course, Default::default());
}

/// What a link promises is not made true by a picture of the run before.
#[test]
fn an_old_picture_does_not_keep_a_promise() {
    let desktop = Desktop::default();
    let (mut page, here) = open_with(1280.0, 800.0, desktop.clone());
    let late = page.state().as_ref().unwrap().shown().unwrap().1.clone();
    desktop.visits.borrow_mut().push("v=1&beta=0.3&digest=0123456789abcdef".to_owned());
    // It is read after the session has been heard; the picture comes next, and then the run.
    here.0.borrow_mut().hangs = true;
    page.state_mut().as_mut().unwrap().hear();
    here.0.borrow_mut().events = VecDeque::from([Ok(Event::Snapshot(Box::new(late)))]);
    here.0.borrow_mut().hangs = false;
    settle(&mut page);
    assert_eq!(page.state().as_ref().unwrap().setup().config.beta, 0.3);
    assert!(text(&page, "trained").ends_with("but the link was made with 0123456789abcdef"));
}

/// Pause counts although the worker that is told of it is not there yet.
#[test]
fn a_run_that_was_paused_while_its_worker_was_gone_stays_so() {
    let (mut page, here) = open(1280.0, 800.0);
    page.state_mut().as_mut().unwrap().send(Command::Play);
    page.step();
    until(&mut page, "training");
    for _ in 0..4 {
        here.0.borrow_mut().events.push_back(Err("The worker has stopped.".to_owned()));
        page.step();
    }
    page.state_mut().as_mut().unwrap().send(Command::Pause);
    page.get_by_role_and_label(Role::Button, "Restart the worker").click_accesskit();
    page.run_steps(3);
    until(&mut page, "paused");
}

/// The runs of another worker are counted from one again: one of the same number is not that of the link.
#[test]
fn a_link_says_nothing_of_the_runs_of_another_worker() {
    let desktop = Desktop::default();
    desktop.visits.borrow_mut().push("v=1&digest=0123456789abcdef".to_owned());
    let (mut page, here) = open_with(1280.0, 800.0, desktop);
    settle(&mut page);
    assert!(text(&page, "trained").ends_with("but the link was made with 0123456789abcdef"));
    let of_link = page.state().as_ref().unwrap().shown().unwrap().0.run;
    for _ in 0..4 {
        here.0.borrow_mut().events.push_back(Err("The worker has stopped.".to_owned()));
        page.run_steps(6);
    }
    page.state_mut().as_mut().unwrap().set_beta(0.2);
    page.get_by_role_and_label(Role::Button, "Restart the worker").click_accesskit();
    page.run_steps(3);
    settle(&mut page);
    page.state_mut().as_mut().unwrap().set_beta(0.3);
    settle(&mut page);
    let (started, _) = page.state().as_ref().unwrap().shown().unwrap();
    assert_eq!((started.run, started.setup.config.beta), (of_link, 0.3));
    assert!(!text(&page, "trained").contains("link"));
}

/// Whoever goes back to the start and plays is not taken for somebody who wants to pause what is not there yet.
#[test]
fn what_is_pressed_before_the_start_is_there_counts() {
    let (mut page, here) = open(1280.0, 800.0);
    let last =
        |here: &Here| here.0.borrow().commands.iter().rfind(|c| !matches!(c, Command::Seen(_))).cloned().unwrap();
    here.0.borrow_mut().hangs = true;
    for (key, command) in [(egui::Key::Space, Command::Play), (egui::Key::Space, Command::Pause)] {
        if command == Command::Play {
            page.key_press(egui::Key::R);
            page.step();
            assert!(matches!(last(&here), Command::Load { play: false, .. }));
        }
        page.key_press(key);
        page.step();
        assert_eq!(last(&here), command);
    }
    page.key_press(egui::Key::R);
    page.step();
    // It dies before it has gone back: another one stands at the start, too.
    here.0.borrow_mut().events = VecDeque::from([Err("The worker has stopped.".to_owned())]);
    here.0.borrow_mut().session = Session::new();
    here.0.borrow_mut().hangs = false;
    page.run_steps(6);
    until(&mut page, "paused at update 0 of 732");
}

/// Playing on from a moment that was looked for but never seen leaves nothing behind that is looked for.
#[test]
fn to_play_on_ends_the_search_for_a_moment() {
    let (mut page, here) = open(1280.0, 800.0);
    page.state_mut().as_mut().unwrap().view.speed = 0;
    here.0.borrow_mut().hangs = true;
    page.key_press(egui::Key::Home);
    page.step();
    assert_eq!(page.state().as_ref().unwrap().moment(), 0);
    page.key_press(egui::Key::S);
    page.step();
    here.0.borrow_mut().hangs = false;
    until(&mut page, "paused at update 1 of 732");
    assert_eq!(page.state().as_ref().unwrap().moment(), 1);
    page.key_press(egui::Key::Home);
    until(&mut page, "paused at update 0 of 732");
}

/// A link promises a moment; until it is there the visitor may look back at what there is.
#[test]
fn looking_back_while_a_link_is_made_true_is_left_alone() {
    let desktop = Desktop::default();
    desktop.visits.borrow_mut().push("v=1&speed=60&digest=0123456789abcdef".to_owned());
    let (mut page, _) = open_with(1280.0, 800.0, desktop);
    until(&mut page, "training, update 1");
    page.key_press(egui::Key::Space);
    until(&mut page, "paused");
    page.state_mut().as_mut().unwrap().seek(2);
    until(&mut page, "paused at update 2 of 732");
    page.run_steps(20);
    assert_eq!(page.state().as_ref().unwrap().moment(), 2);
    page.state_mut().as_mut().unwrap().send(Command::Speed(None));
    page.key_press(egui::Key::Space);
    until(&mut page, "trained");
    assert!(text(&page, "trained").ends_with("but the link was made with 0123456789abcdef"));
}

/// It has not said that it is gone, and may only be slow: it is the visitor who decides.
#[test]
fn a_worker_that_hangs_can_be_replaced() {
    let (mut page, here) = open(1280.0, 800.0);
    let is_offered = |page: &Page| {
        page.query_by(|node| says(node).is_some_and(|text| text.starts_with("The worker does not answer"))).is_some()
    };
    let pass = |page: &mut Page, seconds: u32| {
        for _ in 0..seconds {
            let now = page.ctx.input(|input| input.time);
            page.input_mut().time = Some(now + 1.0);
            page.step();
        }
    };
    // A page at rest expects nothing.
    here.0.borrow_mut().hangs = true;
    pass(&mut page, 60);
    assert!(!is_offered(&page));
    // One that has been started again before hangs when it is sent back to the start: another stands there, not at the end.
    here.0.borrow_mut().events = VecDeque::from([Err("The worker has stopped.".to_owned())]);
    here.0.borrow_mut().hangs = false;
    page.step();
    settle(&mut page);
    here.0.borrow_mut().hangs = true;
    press(&mut page, "Back to the start");
    pass(&mut page, 12);
    page.get_by_label("Restart the worker").click_accesskit();
    until(&mut page, "paused at update 0 of 732");
    here.0.borrow_mut().hangs = true;
    // That a run has begun is said at once.
    page.state_mut().as_mut().unwrap().load_preset(1);
    page.step();
    // A page that was hidden for an hour has waited for a second of it.
    let now = page.ctx.input(|input| input.time);
    page.input_mut().time = Some(now + 3600.0);
    page.step();
    assert!(!is_offered(&page));
    pass(&mut page, 8);
    assert!(!is_offered(&page));
    pass(&mut page, 4);
    assert!(is_offered(&page));
    page.get_by_label("Restart the worker").click_accesskit();
    settle(&mut page);
    assert!(!is_offered(&page));
    assert_eq!((here.0.borrow().starts, page.state().as_ref().unwrap().preset()), (4, Some(1)));
}

#[test]
fn an_honest_observer_undoes_the_protection() {
    let (mut page, _) = open(1280.0, 800.0);
    page.get_by_label_contains("occupancy: clones the demonstrations").click_accesskit();
    settle(&mut page);
    let (ensemble, clone) = (figure(&page, "Ensemble capped"), figure(&page, "Clone (occupancy) capped"));
    assert!((ensemble - clone).abs() < 0.5, "{ensemble} {clone}");
}

#[test]
fn the_replay_observer_takes_a_number() {
    let (mut page, here) = open(1280.0, 800.0);
    page.get_by_label_contains("replay: remembers recent demonstrations").click_accesskit();
    settle(&mut page);
    page.get_by_role_and_label(Role::SpinButton, "contexts kept at each cell").set_value_accesskit(7.0);
    settle(&mut page);
    let desk = here.0.borrow();
    let loaded = desk.commands.iter().rev().find_map(|command| match command {
        Command::Load { setup, .. } => Some(setup.config.observer.to_string()),
        _ => None,
    });
    assert_eq!(loaded.as_deref(), Some("replay(7)"));
    page.get_by(|node| {
        node.role() == Role::Image && says(node).is_some_and(|text| text.starts_with("Clone (replay(7))"))
    });
}

#[test]
fn every_return_can_be_chosen() {
    let (mut page, _) = open(1280.0, 800.0);
    for (label, figure_name) in [("uncapped", "uncapped"), ("within T", "within T"), ("capped", "capped")] {
        page.get_by_role_and_label(Role::RadioButton, &format!("Return: {label}")).click_accesskit();
        page.run_steps(3);
        assert!(figure(&page, &format!("Optimal {figure_name} return")) == -9.0);
    }
    page.get_by_role_and_label(Role::RadioButton, "Return: success").click_accesskit();
    page.run_steps(3);
    page.get_by_label("Optimal success return: 100 %");
}

#[test]
fn play_pause_step_and_reset_have_buttons() {
    let (mut page, here) = open(1280.0, 800.0);
    for (button, command) in [
        ("Back to the start", Command::Load { setup: Box::default(), play: false }),
        ("One update", Command::Step),
        ("Play", Command::Play),
        ("Pause", Command::Pause),
    ] {
        page.get_by_role_and_label(Role::Button, button).click_accesskit();
        page.run_steps(3);
        assert_eq!(here.0.borrow().commands.iter().rfind(|c| !matches!(c, Command::Seen(_))), Some(&command));
        if matches!(command, Command::Load { .. }) {
            // Uniform policies hardly arrive, and the page says so.
            page.get_by(|node| {
                says(node).is_some_and(|text| text.starts_with("The 2 experts arrive in 16 % of episodes"))
            });
        }
    }
}

/// A worker that dies leaves the page as it was, with a sentence and a button that brings a new one.
#[test]
fn a_dead_worker_is_replaced_and_the_run_goes_on() {
    let (mut page, here) = open(1280.0, 800.0);
    page.state_mut().as_mut().unwrap().seek(100);
    until(&mut page, "paused at update 100 of 732, digest");
    let before = (figure(&page, "Ensemble capped"), text(&page, "paused"));
    let die = |page: &mut Page| {
        here.0.borrow_mut().events.push_back(Err("The worker has stopped (out of memory).".to_owned()));
        page.run_steps(6);
    };
    die(&mut page);
    let sentence = "The worker has stopped (out of memory): it was started again and goes on from update 100.";
    page.get_by(|node| node.role() == Role::Alert && says(node).is_some_and(|text| text == sentence));
    until(&mut page, "paused at update 100 of 732, digest");
    assert_eq!((figure(&page, "Ensemble capped"), text(&page, "paused")), before);
    assert_eq!(here.0.borrow().starts, 2);
    let resumed = |desk: &Desk| desk.commands.iter().filter(|c| matches!(c, Command::Resume { .. })).count();
    assert_eq!(resumed(&here.0.borrow()), 1);

    // One that dies again and again is left dead, until somebody asks for another.
    (0..3).for_each(|_| die(&mut page));
    assert_eq!(here.0.borrow().starts, 4);
    page.get_by(|node| says(node).is_some_and(|text| text == "stopped at update 100 of 732"));
    assert_eq!(figure(&page, "Ensemble capped"), before.0);
    // There is nobody who could show another moment: the timeline stays where the picture is.
    page.state_mut().as_mut().unwrap().seek(300);
    page.run_steps(2);
    page.get_by(|node| says(node).is_some_and(|text| text == "100 of 732"));
    page.get_by_role_and_label(Role::Button, "Copy the report").click_accesskit();
    page.step();
    let copied = page.output().platform_output.commands.iter().any(|command| {
        matches!(command, egui::OutputCommand::CopyText(text) if text.starts_with("ape-lab ") && text.contains("out of memory"))
    });
    assert!(copied);
    page.get_by_role_and_label(Role::Button, "Restart the worker").click_accesskit();
    page.run_steps(3);
    until(&mut page, "paused at update 100 of 732, digest");
    assert_eq!((here.0.borrow().starts, resumed(&here.0.borrow())), (5, 4));
    assert!(page.query_by(|node| node.role() == Role::Alert).is_none());

    // What the controls have been set to since is trained.
    die(&mut page);
    page.state_mut().as_mut().unwrap().set_beta(0.0);
    page.get_by_role_and_label(Role::Button, "Restart the worker").click_accesskit();
    page.run_steps(3);
    settle(&mut page);
    assert!(figure(&page, "Clone ÷ ensemble capped") < 1.2);
}

/// A long run takes its time to be made again: the page says how far that is, and then what it said before.
#[test]
fn a_run_that_is_made_again_says_how_far_it_is() {
    let (mut page, here) = open(1280.0, 800.0);
    let before = text(&page, "trained, update 732 of 732");
    here.0.borrow_mut().hangs = true;
    here.0.borrow_mut().events.push_back(Err("The worker has stopped (out of memory).".to_owned()));
    here.0.borrow_mut().hangs = false;
    page.step();
    // What the new one says first; the rest of it is held back.
    here.0.borrow_mut().events.push_back(Ok(Event::Remade(300)));
    page.run_steps(1);
    here.0.borrow_mut().hangs = true;
    page.run_steps(2);
    page.get_by(|node| {
        node.role() == Role::Status && says(node).is_some_and(|text| text == "made again: 300 of 732 updates")
    });
    here.0.borrow_mut().hangs = false;
    settle(&mut page);
    let digest = |text: &str| text.rsplit(' ').next().unwrap().to_owned();
    assert_eq!(digest(&text(&page, "trained, update 732 of 732")), digest(&before));
}

/// A sentence that fills the page, as of a worker that has gone mad, is cut.
#[test]
fn a_sentence_is_no_longer_than_can_be_read() {
    let (mut page, here) = open(1280.0, 800.0);
    here.0.borrow_mut().events.push_back(Ok(Event::Refused("ä".repeat(1_000_000))));
    page.run_steps(3);
    assert_eq!(text(&page, "ää").chars().count(), 601);
}

/// What the session refuses is said on the page.
#[test]
fn a_refusal_is_shown_until_it_is_dismissed() {
    let (mut page, here) = open(1280.0, 800.0);
    here.0.borrow_mut().events.push_back(Ok(Event::Refused("beta 7: must be a number from 0 to 2".to_owned())));
    page.run_steps(3);
    let refusal = "must be a number from 0 to 2";
    page.get_by(|node| says(node).is_some_and(|text| text.contains(refusal)));
    page.get_by_role_and_label(Role::Button, "Dismiss").click_accesskit();
    page.run_steps(3);
    assert!(page.query_by(|node| says(node).is_some_and(|text| text.contains(refusal))).is_none());
}

/// Presses the button of this name, then draws a few times.
fn press(page: &mut Page, name: &str) {
    page.get_by_role_and_label(Role::Button, name).click_accesskit();
    page.run_steps(6);
}

fn go_to(page: &mut Page, tab: &str) {
    page.get_by_role_and_label(Role::RadioButton, &format!("Tab: {tab}")).click_accesskit();
    page.run_steps(3);
}

/// Leaves only the cloners of these names checked.
fn only(page: &mut Page, cloners: &[&str]) {
    for cloner in AttackerChoice::usual() {
        if !cloners.contains(&&*cloner.to_string()) {
            page.get_by_role_and_label(Role::CheckBox, &cloner.to_string()).click_accesskit();
            page.step();
        }
    }
}

#[test]
fn the_bench_attacks_what_is_shown_and_saves_it() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    go_to(&mut page, "Attack bench");
    only(&mut page, &["uniform", "occupancy", "bc_counts(1000000)", "history_k(1)"]);
    page.get_by_label_contains("learning curve").click_accesskit();
    page.step();
    press(&mut page, "Attack the ensemble shown");
    page.get_by(|node| says(node).is_some_and(|text| text.starts_with("The ensemble after update 732 returns −18.15")));
    press(&mut page, "CSV");
    press(&mut page, "JSON");
    press(&mut page, "Save the ensemble");
    page.run_steps(3);
    let saved = desktop.saved.borrow();
    let names: Vec<&str> = saved.iter().map(|(name, _)| &**name).collect();
    assert_eq!(names, ["ape-attack.csv", "ape-attack.json", "ape-ensemble.json"]);
    let bench: Bench = serde_json::from_str(&saved[1].1).unwrap();
    assert_eq!(saved[0].1.lines().count(), 1 + bench.attackers.len());
    let drops: Vec<Option<f64>> = bench.attackers.iter().map(|attack| attack.drop).collect();
    assert!(drops[0] > Some(75.0) && drops[1].unwrap().abs() < 0.01, "{drops:?}");
    assert!(drops[2].unwrap().abs() < 0.2 && drops[3].is_none(), "{drops:?}");
    // What was saved is the ensemble, in full.
    let (grid, ensemble) = EnsembleFile::parse(&saved[2].1).unwrap().check().unwrap();
    let returns = ape_lab::experiment::ensemble_returns(&grid, &ensemble, 100);
    assert_eq!(returns.capped_return, bench.ensemble.capped_return);
}

/// Picture, curve and model are those of the run on the page; a picture that fails later is told of.
#[test]
fn what_is_shown_can_be_taken_away() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    let take = |page: &mut Page| {
        let app = page.state_mut().as_mut().unwrap();
        app.export_picture();
        app.export_png();
        app.export_curve();
        app.export_model();
        std::mem::take(&mut *desktop.saved.borrow_mut())
    };
    let saved = take(&mut page);
    let names: Vec<&str> = saved.iter().map(|(name, _)| &**name).collect();
    assert_eq!(names, ["ape-panels.svg", "ape-panels.png", "ape-curve.csv", "ape-model.json"]);
    let svg = &saved[0].1;
    assert_eq!(&saved[1].1, svg);
    // What the caption says stands on one line or on two.
    let words = |svg: &str| -> String {
        let texts = svg.split("</text>").filter_map(|part| part.rsplit_once('>')).map(|(_, words)| words);
        texts.collect::<Vec<_>>().join(" ").replace('\u{a0}', " ")
    };
    for said in [
        "2 experts by PG-APE against the observer uniform (preset “Blind clone”): β = 0.6, seed 1, update 732 of 732.",
        "Grid of 10 × 10 cells, goal in row 0, column 0, no walls, slip 0. T = 100 steps.",
        "Return, capped, in steps: ensemble −18.15, clone (uniform) −99.",
        "optimal −9.00. (−mean min(h(s), 100):",
        "100 or more steps to the goal",
        concat!("ape-lab ", env!("CARGO_PKG_VERSION"), ", digest "),
    ] {
        assert!(words(svg).contains(said), "{said}: {}", words(svg));
    }
    for panel in ["Expert 1", "Expert 2", "Clone (uniform)", "Clone (occupancy)", "Optimal"] {
        assert!(svg.contains(&format!(">{panel}</text>")), "{panel}");
    }
    let curve: Vec<&str> = saved[2].1.lines().collect();
    let last: Vec<&str> = curve.last().unwrap().split(',').collect();
    assert!(curve[0].starts_with("update,beta,ensemble_capped_return") && curve[0].split(',').count() == last.len());
    assert_eq!((last[0], &last[2][..6]), ("732", "-18.14"));
    assert!(words(svg).contains(&format!(", digest {}.", last.last().unwrap())));
    let model: ape_lab::mdp::TransitionModel = serde_json::from_str(&saved[3].1).unwrap();
    assert_eq!((model.states, model.shape), (100, [10, 10]));

    // Other colours, and a clone with a memory.
    let app = page.state_mut().as_mut().unwrap();
    app.view.color_map = 2;
    page.run_steps(2);
    page.get_by_label_contains("history: ").click_accesskit();
    settle(&mut page);
    let svg = &take(&mut page)[0].1;
    assert!(!words(svg).contains("Of a clone that remembers"), "{}", words(svg));
    assert!(words(svg).contains("observer history: ") && words(svg).contains("clone (history) −"), "{}", words(svg));
    assert!(!words(svg).contains("preset") && svg.contains("stop-color=\"#ffffff\""));

    // Nothing was trained of the trap: no seed, no digest, no curve.
    page.state_mut().as_mut().unwrap().load_preset(6);
    settle(&mut page);
    page.run_steps(10);
    let saved = take(&mut page);
    assert_eq!(
        saved.iter().map(|(name, _)| &**name).collect::<Vec<_>>(),
        ["ape-panels.svg", "ape-panels.png", "ape-model.json"]
    );
    assert!(
        words(&saved[0].1).contains("A given ensemble of 2 experts (preset “Trap”). Grid"),
        "{}",
        words(&saved[0].1)
    );
    assert!(!words(&saved[0].1).contains("digest") && words(&saved[0].1).contains("clone (occupancy) −90.45"));

    desktop.failures.borrow_mut().push("ape-panels.png could not be drawn.".to_owned());
    page.run_steps(3);
    page.get_by(|node| says(node).is_some_and(|text| text == "ape-panels.png could not be drawn."));
}

/// A file that is no ensemble leaves everything as it is and says what is wrong; a good one is shown.
#[test]
fn files_are_opened_or_refused_with_a_sentence() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    let before = figure(&page, "Ensemble capped");
    for (text, expected) in [
        (Ok("{\"format\": \"ape-ense".to_owned()), "bad.json: not an ensemble file: EOF"),
        (Ok("{\"format\": \"ape-ensemble\", \"version\": 3, \"grid\": {\"rows\": 2, \"cols\": 2, \"goal\": [0, 0]}, \"experts\": []}".to_owned()), "reads version 1"),
        (Ok("x".repeat(EnsembleFile::LONGEST + 1)), "longer than 10 MB"),
        (Err("a file of 100 MB, expected at most 10 MB".to_owned()), "bad.json: a file of 100 MB"),
    ] {
        desktop.to_open.borrow_mut().push(("bad.json".to_owned(), text));
        page.run_steps(3);
        page.get_by(|node| node.role() == Role::Alert || says(node).is_some_and(|text| text.contains(expected)));
        page.get_by(|node| says(node).is_some_and(|text| text.contains(expected)));
        assert_eq!(figure(&page, "Ensemble capped"), before);
        press(&mut page, "Dismiss");
    }
    let trap = (ape_lab::experiment::Preset::find("trap").unwrap().setup)().ensemble.unwrap();
    desktop.to_open.borrow_mut().push(("trap.json".to_owned(), Ok(serde_json::to_string(&trap).unwrap())));
    settle(&mut page);
    page.run_steps(20);
    assert_eq!(figure(&page, "Ensemble capped"), -11.3);
    page.get_by(|node| says(node).is_some_and(|text| text == "given ensemble, nothing to train"));

    // A file that says which run it is from is shown, and saved, with that.
    let digest = "0123456789abcdef".parse().ok();
    let trap = serde_json::to_string(&EnsembleFile { digest, ..trap }).unwrap();
    desktop.to_open.borrow_mut().push(("known.json".to_owned(), Ok(trap.clone())));
    settle(&mut page);
    page.run_steps(20);
    page.get_by(|node| {
        says(node).is_some_and(|text| text == "given ensemble, nothing to train, digest by its file 0123456789abcdef")
    });
    go_to(&mut page, "Attack bench");
    press(&mut page, "Save the ensemble");
    page.run_steps(3);
    assert_eq!(desktop.saved.borrow().last().unwrap().1, trap);
}

#[test]
fn the_sweep_and_table_1_are_made_on_the_page() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    go_to(&mut page, "β sweep");
    press(&mut page, "Paper's table");
    page.run_steps(30);
    page.get_by(|node| says(node).is_some_and(|text| text == "−144.76 ± 55.68"));
    press(&mut page, "JSON");
    let sweep: Sweep = serde_json::from_str(&desktop.saved.borrow().last().unwrap().1).unwrap();
    assert_eq!((sweep.runs.len(), sweep.runs[0].beta, sweep.runs[11].beta), (12, 0.0, 0.3));
    assert!(sweep.csv().lines().nth(1).unwrap().ends_with(&format!(",{}", sweep.runs[0].digest)));
    go_to(&mut page, "Table 1");
    only(&mut page, &["uniform", "occupancy"]);
    page.get_by_role_and_label(Role::SpinButton, "Seeds").set_value_accesskit(2.0);
    page.run_steps(3);
    press(&mut page, "Make Table 1");
    page.run_steps(10);
    page.get_by(|node| says(node).is_some_and(|text| text == "−44.27 ± 1.07"));
    press(&mut page, "CSV");
    // Two seeds of six methods, each with the ensemble and two clones, and the head.
    assert_eq!(desktop.saved.borrow().last().unwrap().1.lines().count(), 1 + 2 * 6 * 3);
}

/// A clone that is not quick is made once training rests, and then stands in its panel.
#[test]
fn a_slow_clone_can_be_shown_in_a_panel() {
    let (mut page, here) = open(1280.0, 800.0);
    page.get_by_role_and_label(Role::ComboBox, "Who clones, panel 2").click_accesskit();
    page.run_steps(3);
    page.get_by_label_contains("bc_counts(1000000): behaviour").click_accesskit();
    page.run_steps(8);
    assert!(here.0.borrow().commands.contains(&Command::Export));
    page.get_by(|node| {
        node.role() == Role::Image && says(node).is_some_and(|text| text.starts_with("Clone (bc_counts(1000000))"))
    });
    // It tells no experts apart, and has nothing to say of them in a cell.
    page.state_mut().as_mut().unwrap().view.cell = Some(5);
    page.run_steps(4);
    page.get_by_label("p(2|s)");
    assert_eq!(page.query_all_by_label("–").count(), 2);
}

/// Who drags the timeline has no clone begun for each moment passed: it is made where the hand rests.
#[test]
fn a_slow_clone_waits_for_the_hand_to_rest() {
    let (mut page, here) = open(1280.0, 800.0);
    let app = page.state_mut().as_mut().unwrap();
    let clones = vec!["uniform".parse().unwrap(), "bc_counts(1000)".parse().unwrap()];
    app.view.clones = clones.clone();
    app.send(Command::Show(clones));
    page.run_steps(8);
    let asked = || here.0.borrow().commands.iter().filter(|&command| *command == Command::Export).count();
    assert_eq!(asked(), 1);
    for update in 100..130 {
        page.state_mut().as_mut().unwrap().seek(update);
        page.step();
    }
    assert_eq!(asked(), 1);
    page.run_steps(8);
    assert_eq!(asked(), 2);
    page.get_by(|node| {
        node.role() == Role::Image && says(node).is_some_and(|text| text.starts_with("Clone (bc_counts(1000))"))
    });
}

/// Results that are of another ensemble, or of other settings than those beside them, say so.
#[test]
fn old_results_say_that_they_are() {
    let (mut page, _) = open(1280.0, 800.0);
    let says_so = |page: &Page, what: &str| page.query_by_label_contains(what).is_some();
    let (changed, other) = ("The ensemble on the page has changed since", "Made with other settings");
    go_to(&mut page, "Attack bench");
    page.run_steps(3);
    only(&mut page, &["uniform"]);
    press(&mut page, "Attack the ensemble shown");
    text(&page, "The ensemble after update 732 returns");
    assert!(!says_so(&page, changed));
    go_to(&mut page, "β sweep");
    page.run_steps(3);
    press(&mut page, "Paper's table");
    page.run_steps(30);
    // Its own β are in the table.
    page.state_mut().as_mut().unwrap().set_beta(0.3);
    settle(&mut page);
    assert!(!says_so(&page, other));
    page.get_by(|node| says(node).is_some_and(|text| text == "−144.76 ± 55.68"));
    go_to(&mut page, "Attack bench");
    page.run_steps(3);
    assert!(says_so(&page, changed));
    // The paper's table is of the paper's reward.
    let config =
        Config { adversary_reward: "0,9=-1".parse().ok(), ..page.state().as_ref().unwrap().setup().config.clone() };
    page.state_mut().as_mut().unwrap().reconfigure(config);
    settle(&mut page);
    go_to(&mut page, "β sweep");
    page.run_steps(3);
    assert!(says_so(&page, other));
    press(&mut page, "Paper's table");
    page.run_steps(30);
    assert!(!says_so(&page, other) && !says_so(&page, "−144.76 ± 55.68"));
}

/// Two panels of one name would be one widget.
#[test]
fn a_link_shows_no_clone_twice() {
    let desktop = Desktop::default();
    desktop.visits.borrow_mut().push("v=1&clones=uniform;uniform".to_owned());
    let (mut page, _) = open_with(1280.0, 800.0, desktop);
    page.run_steps(6);
    let sentence = text(&page, "This link cannot be read");
    assert!(sentence.contains("clones=uniform;uniform: expected one cloner or two different ones"), "{sentence}");
}

/// A clone that could not be made is not waited for.
#[test]
fn a_slow_clone_that_fails_leaves_its_panel_with_a_sentence() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    desktop.tasks_fail.set(true);
    page.get_by_role_and_label(Role::ComboBox, "Who clones, panel 2").click_accesskit();
    page.run_steps(3);
    page.get_by_label_contains("bc_counts(1000000): behaviour").click_accesskit();
    page.run_steps(12);
    let sentence = "bc_counts(1000000) could not be made: Out of memory.";
    page.get_by(|node| node.role() == Role::Alert && says(node).is_some_and(|text| text == sentence));
    assert!(page.query_by(|node| says(node).is_some_and(|text| text.contains("being made"))).is_none());
}

/// A cell that another grid had and this one has not is in no link: who opens it would be refused all of it.
#[test]
fn a_link_has_no_cell_of_another_grid() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    let large = GridSpec { rows: 12, cols: 12, ..GridSpec::default() };
    page.state_mut().as_mut().unwrap().change_world(large).unwrap();
    settle(&mut page);
    page.state_mut().as_mut().unwrap().view.cell = Some(140);
    page.run_steps(60);
    assert!(desktop.address.borrow().contains("cell=11,8"), "{}", desktop.address.borrow());
    page.state_mut().as_mut().unwrap().load_preset(0);
    settle(&mut page);
    page.run_steps(60);
    assert!(!desktop.address.borrow().contains("cell"), "{}", desktop.address.borrow());
}

/// Of a clone that remembers two of the four returns are not known: a sweep over them says so instead of showing nothing.
#[test]
fn a_sweep_without_figures_says_why() {
    let (mut page, _) = open(1280.0, 800.0);
    let observer = "gru(2)".parse().unwrap();
    let config = Config { observer, total_steps: 8192, horizon: 20, ..Config::default() };
    page.state_mut().as_mut().unwrap().reconfigure(config);
    settle(&mut page);
    go_to(&mut page, "β sweep");
    page.get_by_role_and_label(Role::SpinButton, "Seeds of the sweep").set_value_accesskit(1.0);
    page.run_steps(3);
    press(&mut page, "Paper's table");
    page.run_steps(8);
    page.get_by_label_contains("choose within T or success");
    page.get_by_role_and_label(Role::RadioButton, "Return: success").click_accesskit();
    page.run_steps(4);
    assert!(page.query_by_label_contains("choose within T or success").is_none());
}

/// A given ensemble has no curve to be saved.
#[test]
fn what_is_not_there_cannot_be_saved() {
    let (mut page, _) = open(1280.0, 800.0);
    for (preset, has_curve) in [(0, true), (6, false)] {
        page.state_mut().as_mut().unwrap().load_preset(preset);
        settle(&mut page);
        press(&mut page, "Export and open");
        let line = page.get_by_label_contains("Curve as CSV").accesskit_node().is_disabled();
        assert_eq!(line, !has_curve);
        press(&mut page, "Export and open");
    }
}

/// What was wanted of a run that is gone comes no more, and its button works again.
#[test]
fn an_ensemble_that_never_came_can_be_asked_for_again() {
    let desktop = Desktop::default();
    let (mut page, here) = open_with(1280.0, 800.0, desktop.clone());
    let save = |page: &mut Page| {
        press(page, "Export and open");
        page.get_by_label_contains("Ensemble as JSON").click_accesskit();
        page.step();
    };
    let asked = || here.0.borrow().commands.iter().filter(|&command| *command == Command::Export).count();
    here.0.borrow_mut().hangs = true;
    save(&mut page);
    // The session's answer is lost, as with a session that has stopped.
    here.0.borrow_mut().session.events();
    here.0.borrow_mut().hangs = false;
    page.run_steps(3);
    assert_eq!((asked(), desktop.saved.borrow().len()), (1, 0));
    page.state_mut().as_mut().unwrap().load_preset(1);
    settle(&mut page);
    save(&mut page);
    page.run_steps(6);
    assert_eq!((asked(), desktop.saved.borrow().len()), (2, 1));
}

#[test]
fn the_algorithm_can_be_exact_and_brings_its_observer() {
    let (mut page, _) = open(1280.0, 800.0);
    page.get_by_label_contains("replay: remembers recent demonstrations").click_accesskit();
    settle(&mut page);
    page.get_by_role_and_label(Role::RadioButton, "Algorithm: exact").click_accesskit();
    page.run_steps(3);
    settle(&mut page);
    page.get_by(|node| says(node).is_some_and(|text| text.starts_with("trained, update 1500 of 1500")));
    page.get_by_label_contains("uniform: weighs the experts").click_accesskit();
    page.run_steps(3);
    settle(&mut page);
    assert!(figure(&page, "Ensemble capped") > -13.5 && figure(&page, "Clone (uniform) capped") < -90.0);
}

/// The text that starts so.
fn text(page: &Page, start: &str) -> String {
    says(&page.get_by(|node| says(node).is_some_and(|text| text.starts_with(start))).accesskit_node()).unwrap()
}

/// Draws until the race on the board is over.
fn finish(page: &mut Page) {
    for _ in 0..100 {
        page.step();
        if page.query_by_label("Pause the race").is_none() {
            return;
        }
    }
    panic!("the race did not end");
}

#[test]
fn a_race_runs_from_the_cell_that_was_chosen() {
    let (mut page, _) = open(1280.0, 800.0);
    go_to(&mut page, "Race");
    text(&page, "Nobody has raced yet");
    text(&page, "An expert, drawn anew");
    press(&mut page, "Race");
    page.get_by_role_and_label(Role::Button, "Pause the race");
    finish(&mut page);
    // From the far corner 18 steps are the fewest; the blind clone gets lost.
    assert_eq!(text(&page, "Optimal: "), "Optimal: 18 steps, arrived");
    assert_eq!(text(&page, "Clone (uniform): "), "Clone (uniform): lost: not there after 100 steps");
    assert!(text(&page, "Expert ").ends_with("steps, arrived"));
    page.get_by(|node| node.role() == Role::Label && says(node).as_deref() == Some("100 of 100"));

    // Another start by keyboard, and by its own clone: the honest one arrives.
    page.get_by_label_contains("start in row 9, column 9").focus();
    page.run_steps(2);
    for key in [egui::Key::ArrowUp, egui::Key::ArrowUp, egui::Key::ArrowUp, egui::Key::ArrowLeft] {
        page.key_press(key);
        page.run_steps(2);
    }
    page.get_by_label_contains("start in row 6, column 8");
    text(&page, "Start: row 6, column 8");
    page.get_by_role_and_label(Role::ComboBox, "Who clones in the race").click_accesskit();
    page.run_steps(3);
    page.get_by_role_and_label(Role::Button, "history: remembers its episode").click_accesskit();
    page.run_steps(3);
    press(&mut page, "Again with other luck");
    finish(&mut page);
    assert_eq!(text(&page, "Optimal: "), "Optimal: 14 steps, arrived");
    assert!(text(&page, "Clone (history): ").ends_with("steps, arrived"));
}

#[test]
fn a_thousand_races_agree_with_the_exact_figures() {
    let (mut page, here) = open(1280.0, 800.0);
    go_to(&mut page, "Race");
    press(&mut page, "Race 1,000");
    finish(&mut page);
    let number = |text: &str| -> f64 {
        let text = text.trim().trim_end_matches([' ', '%', ')']).trim_start_matches(['>', '<', ' ']);
        text.parse().unwrap_or_else(|_| panic!("{text:?}"))
    };
    let root = page.root();
    let sentences: Vec<String> = root
        .children_recursive()
        .filter_map(|node| says(&node.accesskit_node()))
        .filter(|text| text.contains("are lost;"))
        .collect();
    assert_eq!(sentences.len(), 3, "{sentences:?}");
    for sentence in &sentences {
        let (arrive, steps) = sentence.split_once(';').unwrap();
        let (sample, exact) = arrive.trim_start_matches("all experts: ").split_once("arrive (exact").unwrap();
        let exact = exact.split_once(')').unwrap().0;
        assert!((number(sample) - number(exact)).abs() < 5.0, "{sentence}");
        let (sample, exact) = steps.split_once("steps (exact").unwrap();
        assert!((number(sample) - number(exact)).abs() < 3.0, "{sentence}");
    }
    let clone = sentences[1].split_once("arrive").unwrap().0;
    assert!(number(clone) < 50.0, "most clones are lost: {clone}");
    assert_eq!(sentences[2], "100 % arrive (exact 100 %), 0 % are lost; 18.0 steps (exact 18.0)");
    text(
        &page,
        "Bars: 1,000 episodes by their steps to the goal; lines: exact; lost: not there by T = 100. uniform clone, from row 9, column 9",
    );
    // The page says so when its ensemble is another one than that which raced.
    let old = "The ensemble on the page has changed since";
    assert!(page.query_by_label_contains(old).is_none());
    press(&mut page, "One update");
    page.run_steps(8);
    assert!(here.0.borrow().commands.contains(&Command::Step));
    text(&page, old);
}

/// Where nothing may move, a race is over at once, and nothing asks for more frames.
#[test]
fn a_race_stands_still_where_nothing_may_move() {
    let (mut page, _) = open(1280.0, 800.0);
    page.ctx.all_styles_mut(|style| style.animation_time = 0.0);
    go_to(&mut page, "Race");
    press(&mut page, "Race");
    assert_eq!(text(&page, "Optimal: "), "Optimal: 18 steps, arrived");
    page.get_by_role_and_label(Role::Slider, "Step of the race");
    page.run_steps(20);
    assert!(!page.ctx.has_requested_repaint());
}

/// On a phone the board is as wide as the page, and nothing stands beyond it.
#[test]
fn the_race_fits_a_phone() {
    for (width, height) in [(390.0, 844.0), (820.0, 1180.0), (1000.0, 700.0), (1280.0, 800.0)] {
        let (mut page, _) = open(width, height);
        go_to(&mut page, "Race");
        press(&mut page, "Race 1,000");
        finish(&mut page);
        for node in page.root().children_recursive() {
            let Some(bounds) = node.accesskit_node().bounding_box() else { continue };
            let name = says(&node.accesskit_node()).unwrap_or_default();
            if !name.is_empty() {
                assert!(bounds.x0 >= -0.5 && bounds.x1 <= f64::from(width) + 0.5, "{width}: {name:?} {bounds:?}");
            }
        }
        let board = page.get_by_label_contains("Race board").accesskit_node().bounding_box().unwrap();
        assert!(board.x1 - board.x0 > if width < 720.0 { 330.0 } else { 0.3 * f64::from(width) }, "{width}: {board:?}");
    }
}

/// Draws until the status begins so.
fn until(page: &mut Page, start: &str) {
    for _ in 0..400 {
        page.step();
        if page
            .query_by(|node| node.role() == Role::Status && says(node).is_some_and(|text| text.starts_with(start)))
            .is_some()
        {
            return;
        }
    }
    panic!("no status begins with {start}");
}

#[test]
fn the_past_can_be_shown_and_left_by_another_way() {
    let (mut page, here) = open(1280.0, 800.0);
    let end = figure(&page, "Ensemble capped");
    page.key_press(egui::Key::Home);
    until(&mut page, "paused at update 0 of 732");
    assert!(figure(&page, "Ensemble capped") < -90.0);
    page.get_by_role_and_label(Role::Slider, "Timeline").set_value_accesskit(300.0);
    until(&mut page, "paused at update 300 of 732");
    page.key_press(egui::Key::ArrowRight);
    until(&mut page, "paused at update 301 of 732");
    press(&mut page, "One update back");
    until(&mut page, "paused at update 300 of 732");
    let there = figure(&page, "Ensemble capped");
    page.get_by_role_and_label(Role::SpinButton, "β of the branch").set_value_accesskit(0.05);
    page.run_steps(3);
    press(&mut page, "Continue from here");
    settle(&mut page);
    page.run_steps(8);
    assert!(here.0.borrow().commands.contains(&Command::Continue { beta: 0.05 }));
    // The branch is another run; the one it left is kept, as it was in the end.
    assert!(figure(&page, "Ensemble capped") > end && there < end);
    page.get_by(|node| says(node).is_some_and(|text| text == numbers_of(end)));
    assert_eq!(page.state().as_ref().unwrap().preset(), None);
    page.get_by_label("— β 0.6 · uniform · n 2 · seed 1");
    press(&mut page, "Show again: β 0.6 · uniform · n 2 · seed 1");
    settle(&mut page);
    page.run_steps(8);
    assert_eq!(figure(&page, "Ensemble capped"), end);
    press(&mut page, "Drop: β 0.6 · uniform · n 2 · seed 1");
    assert!(page.query_by_label("— β 0.6 · uniform · n 2 · seed 1").is_none());
}

/// As the page writes a return.
fn numbers_of(value: f64) -> String {
    format!("{value:.1}").replace('-', "−")
}

#[test]
fn an_address_brings_everything_back() {
    let first = Desktop::default();
    // Back to the start from a branch is a plain run again, and the address says so.
    let (mut page, _) = open_with(1280.0, 800.0, first.clone());
    page.key_press(egui::Key::Home);
    until(&mut page, "paused at update 0 of 732");
    page.state_mut().as_mut().unwrap().continue_with(0.3);
    settle(&mut page);
    press(&mut page, "Back to the start");
    until(&mut page, "paused at update 0 of 732");
    page.run_steps(40);
    assert!(first.address.borrow().starts_with("v=1&beta=0.3&at=0&digest="), "{}", first.address.borrow());
    // A moment that is sought while a new run begins: timeline and status agree in the end.
    page.key_press(egui::Key::ArrowUp);
    page.key_press(egui::Key::ArrowLeft);
    page.run_steps(80);
    let at = page.get_by_role_and_label(Role::Slider, "Timeline").accesskit_node().numeric_value().unwrap();
    page.get_by(|node| {
        node.role() == Role::Status && says(node).is_some_and(|text| text.contains(&format!("update {at} of 732")))
    });
    let fragment = "v=1&size=6x7&goal=2,3&walls=0:0-1;4:5&beta=0.4&seed=9&turns=100:0.2&tab=world&return=success&speed=1500&clones=occupancy&cell=1,2&at=321";
    first.visits.borrow_mut().push(fragment.to_owned());
    let (mut page, _) = open_with(1280.0, 800.0, first.clone());
    until(&mut page, "paused at update 321 of 732");
    page.get_by_label("Optimal success return: 100 %");
    page.run_steps(40);
    let written = first.address.borrow().clone();
    let (same, digest) = written.split_once("&digest=").unwrap();
    assert_eq!(same, fragment);
    // The same again, with its digest.
    let second = Desktop::default();
    second.visits.borrow_mut().push(written.clone());
    let (mut page, _) = open_with(1280.0, 800.0, second.clone());
    until(&mut page, &format!("paused at update 321 of 732, digest {digest}, the same as in the link"));
    page.run_steps(40);
    assert_eq!(*second.address.borrow(), written);
    // A branch whose run was longer than planned, and a preset with an ensemble.
    for fragment in ["v=1&turns=700:0.3&updates=900&digest=0000000000000000", "v=1&ensemble=trap&observer=occupancy"] {
        second.visits.borrow_mut().push(fragment.to_owned());
        page.run_steps(2);
        until(&mut page, if fragment.contains("trap") { "given" } else { "trained, update 900 of 900" });
        if !fragment.contains("trap") {
            page.get_by(|node| {
                says(node).is_some_and(|text| text.ends_with("but the link was made with 0000000000000000"))
            });
        }
        page.run_steps(40);
        assert_eq!(second.address.borrow().split("&digest").next(), fragment.split("&digest").next());
    }
    assert_eq!(page.state().as_ref().unwrap().preset(), Some(6));
    // An ensemble that is given has no updates; and a digest that it does not have is said.
    second.visits.borrow_mut().push("v=1&ensemble=trap&digest=0123456789abcdef".to_owned());
    page.run_steps(2);
    until(&mut page, "given ensemble, nothing to train, but the link was made with 0123456789abcdef");
    page.run_steps(40);
    assert_eq!(*second.address.borrow(), "v=1&ensemble=trap");
    second.visits.borrow_mut().push(format!("v=1&ensemble=trap&at=5&file={}", "A".repeat(1000)));
    page.run_steps(2);
    page.get_by(|node| says(node).is_some_and(|text| text.contains("at=5: expected none with a given ensemble")));
    second.visits.borrow_mut().push(format!("v=1&file={}", "A".repeat(1000)));
    page.run_steps(2);
    page.get_by(|node| says(node).is_some_and(|text| text.contains(&format!("of {}, which is not", "A".repeat(40)))));
}

/// Every step sets its stage, and every sentence of it has figures of the ensemble that is there.
#[test]
fn the_lesson_is_true_of_what_is_shown() {
    let (mut page, _) = open(1280.0, 800.0);
    go_to(&mut page, "Learn");
    settle(&mut page);
    let mut sentences = Vec::new();
    loop {
        page.run_steps(10);
        let app = page.state().as_ref().unwrap();
        let (_, snapshot) = app.shown().unwrap();
        let of =
            |name: &str| snapshot.clones.iter().find(|clone| clone.cloner.to_string() == name).unwrap().view.returns;
        let ensemble = snapshot.ensemble;
        match sentences.len() {
            0 => assert!(snapshot.experts.len() == 1 && of("uniform").capped_return == Some(ensemble.capped_return)),
            1 => assert!(of("uniform").capped_return.unwrap() > ensemble.capped_return - 0.5),
            3 => {
                // At the marked cell both experts know where they go, and it is opposite ways.
                let cell = app.view.cell.unwrap();
                let [left, right] =
                    [2, 3].map(|action| snapshot.experts.iter().map(|e| e.policy[cell][action]).fold(0.0, f32::max));
                assert!(left > 0.8 && right > 0.8, "{left} {right}");
            }
            2 | 4 => assert!(of("uniform").capped_return < Some(-90.0) && ensemble.capped_return > -20.0),
            5 => assert!((of("occupancy").capped_return.unwrap() - ensemble.capped_return).abs() < 0.1),
            6 | 9 => assert!((of("occupancy").horizon_return - ensemble.horizon_return).abs() < 0.1),
            7 => assert!(of("occupancy").capped_return < Some(-90.0) && of("occupancy").horizon_return > -11.0),
            8 => assert_eq!(of("history").horizon_return, ensemble.horizon_return),
            step => panic!("there is no step {step}"),
        }
        let live = page.query_all_by(|node| {
            says(node).is_some_and(|text| {
                ["The expert returns", "The ensemble returns", "Row 1", "Within T the", "Left: the", "The clone ("]
                    .iter()
                    .any(|start| text.starts_with(start))
            })
        });
        sentences.push(live.last().and_then(|node| says(&node.accesskit_node())));
        // Who looks back and goes on sees the next step's end of the run.
        if sentences.len() == 3 {
            page.state_mut().as_mut().unwrap().seek(110);
            until(&mut page, "paused at update 110");
            page.get_by_label("Show this step again");
        }
        let next = page.get_by_role_and_label(Role::Button, "Next");
        if next.accesskit_node().is_disabled() {
            break;
        }
        next.click_accesskit();
        page.run_steps(3);
        settle(&mut page);
    }
    assert_eq!(sentences.len(), 10);
    // The last has none.
    assert_eq!(sentences.iter().flatten().count(), 9, "{sentences:#?}");
}

#[test]
fn a_world_is_drawn_and_trained_in() {
    let (mut page, here) = open(1280.0, 800.0);
    go_to(&mut page, "World");
    page.run_steps(3);
    let bounds = |page: &Page| {
        let board = page.get_by(|node| says(node).is_some_and(|text| text.starts_with("World: row")));
        board.rect()
    };
    let rect = bounds(&page);
    let at = |row: f32, col: f32| rect.min + rect.size() * egui::vec2((col + 0.5) / 10.0, (row + 0.5) / 10.0);
    let stroke = |page: &mut Page, from: (f32, f32), to: (f32, f32)| {
        page.drag_at(at(from.0, from.1));
        page.step();
        page.hover_at(at(to.0, to.1));
        page.step();
        page.drop_at(at(to.0, to.1));
        page.run_steps(3);
    };
    stroke(&mut page, (4.0, 0.0), (4.0, 8.0));
    let walls = |here: &Here| {
        let desk = here.0.borrow();
        desk.commands.iter().rev().find_map(|command| match command {
            Command::Load { setup, .. } => Some(setup.grid.walls.len()),
            _ => None,
        })
    };
    assert_eq!(walls(&here), Some(9));
    let loads = here.0.borrow().commands.len();
    // The last gap stays open, with a sentence.
    stroke(&mut page, (4.0, 9.0), (4.0, 9.0));
    page.get_by(|node| {
        node.role() == Role::Alert
            && says(node).is_some_and(|text| text.starts_with("No wall in row 4, column 9: cell"))
    });
    assert!(!here.0.borrow().commands[loads..].iter().any(|command| matches!(command, Command::Load { .. })));
    stroke(&mut page, (4.0, 3.0), (4.0, 5.0));
    assert_eq!(walls(&here), Some(6));
    press(&mut page, "Undo");
    press(&mut page, "Undo");
    assert_eq!(walls(&here), Some(0));
    page.get_by_role_and_label(Role::SpinButton, "Rows").set_value_accesskit(4.0);
    page.run_steps(4);
    settle(&mut page);
    let app = page.state().as_ref().unwrap();
    assert_eq!((app.setup().grid.rows, app.setup().grid.cols), (4, 10));
    // A drag of a control is one edit, however many worlds it goes through.
    let slip = page.get_by_role_and_label(Role::Slider, "Slip").rect();
    page.drag_at(slip.left_center() + egui::vec2(8.0, 0.0));
    page.run_steps(2);
    for x in [0.3, 0.5, 0.7] {
        page.hover_at(egui::pos2(egui::lerp(slip.x_range(), x), slip.center().y));
        page.run_steps(2);
    }
    page.drop_at(egui::pos2(egui::lerp(slip.x_range(), 0.7), slip.center().y));
    page.run_steps(3);
    assert!(page.state().as_ref().unwrap().setup().grid.slip > 0.3);
    press(&mut page, "Undo");
    assert_eq!(page.state().as_ref().unwrap().setup().grid.slip, 0.0);
    // Who finds the board by a screen reader gets its keys.
    page.get_by(|node| says(node).is_some_and(|text| text.starts_with("World: row"))).click_accesskit();
    page.run_steps(2);
    page.key_press(egui::Key::ArrowRight);
    page.run_steps(2);
    text(&page, "World: row");
    assert!(
        page.get_by(|node| says(node).is_some_and(|text| text.starts_with("World: row"))).accesskit_node().is_focused()
    );
}

/// What was typed for one run does not go over into the next that has another value there.
#[test]
fn a_draft_is_gone_where_something_else_holds() {
    let (mut page, _) = open(1280.0, 800.0);
    page.get_by_label("Advanced").click_accesskit();
    page.run_steps(20);
    let field =
        |page: &Page| page.get_by_role_and_label(Role::TextInput, "Adversary reward r̃").accesskit_node().value();
    page.get_by_role_and_label(Role::TextInput, "Adversary reward r̃").focus();
    page.step();
    // Typed, taken back, and left.
    page.event(egui::Event::Text("x".to_owned()));
    page.run_steps(2);
    assert!(field(&page).unwrap().contains('x'), "{:?}", field(&page));
    page.key_press(egui::Key::Backspace);
    page.run_steps(2);
    assert_eq!(field(&page).as_deref(), Some("none"));
    page.key_press(egui::Key::Enter);
    page.run_steps(2);
    page.state_mut().as_mut().unwrap().load_preset(4);
    settle(&mut page);
    let app = page.state().as_ref().unwrap();
    assert_eq!((app.preset(), app.setup().config.adversary_reward.is_some()), (Some(4), true));
    assert_ne!(field(&page).as_deref(), Some("none"));
}

/// A stroke ends when the button is let go, not where the pointer leaves the board.
#[test]
fn a_stroke_may_leave_the_board() {
    let (mut page, here) = open(1280.0, 800.0);
    go_to(&mut page, "World");
    let rect = page.get_by(|node| says(node).is_some_and(|text| text.starts_with("World: row"))).rect();
    let at = |row: f32, col: f32| rect.min + rect.size() * egui::vec2((col + 0.5) / 10.0, (row + 0.5) / 10.0);
    let before = here.0.borrow().commands.len();
    page.drag_at(at(6.0, 1.0));
    page.step();
    // It comes back where it has built already, and farther down.
    for (row, col) in [(6.0, 0.0), (6.0, -1.0), (6.0, 0.0), (6.0, -1.0), (8.0, 0.0), (8.0, 1.0)] {
        page.hover_at(at(row, col));
        page.step();
    }
    page.drop_at(at(8.0, 1.0));
    page.run_steps(3);
    let desk = here.0.borrow();
    let loads: Vec<_> = desk.commands[before..]
        .iter()
        .filter_map(|command| match command {
            Command::Load { setup, .. } => Some(setup.grid.walls.clone()),
            _ => None,
        })
        .collect();
    assert_eq!(loads, [vec![(6, 0), (6, 1), (8, 0), (8, 1)]]);
}

/// A reload brings the file back with the clones that were looked at.
#[test]
fn a_reload_keeps_the_clones_of_a_file() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    let trap = (ape_lab::experiment::Preset::find("trap").unwrap().setup)().ensemble.unwrap();
    desktop.to_open.borrow_mut().push(("mine.json".to_owned(), Ok(serde_json::to_string(&trap).unwrap())));
    page.run_steps(2);
    settle(&mut page);
    page.get_by_role_and_label(Role::ComboBox, "Who clones, panel 2").click_accesskit();
    page.run_steps(3);
    page.get_by_label_contains("bc_counts(1000000): behaviour").click_accesskit();
    page.run_steps(60);
    let clones = page.state().as_ref().unwrap().view.clones.clone();
    let address = desktop.address.borrow().clone();
    assert!(address.contains("file=mine.json") && address.contains("clones="), "{address}");
    desktop.visits.borrow_mut().push(address);
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    until(&mut page, "given");
    assert_eq!(page.state().as_ref().unwrap().view.clones, clones);
    assert_eq!(page.state().as_ref().unwrap().opened.as_ref().map(|file| &*file.name), Some("mine.json"));
}

/// Two ensembles are two, also where no digest tells them apart; the same twice is one.
#[test]
fn given_ensembles_are_kept_under_their_names() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    page.state_mut().as_mut().unwrap().load_preset(6);
    settle(&mut page);
    page.state_mut().as_mut().unwrap().pin();
    let mut other = (ape_lab::experiment::Preset::find("trap").unwrap().setup)().ensemble.unwrap();
    other.experts.reverse();
    other.experts.truncate(1);
    desktop.to_open.borrow_mut().push(("mine.json".to_owned(), Ok(serde_json::to_string(&other).unwrap())));
    page.run_steps(2);
    settle(&mut page);
    for _ in 0..2 {
        page.state_mut().as_mut().unwrap().pin();
    }
    let names: Vec<&str> = page.state().as_ref().unwrap().kept.iter().map(|kept| &*kept.name).collect();
    assert_eq!(names, ["given: Trap", "given: mine.json"]);
}

/// Returns of different kinds are not subtracted from one another, nor drawn as if they were one.
#[test]
fn a_chart_mixes_no_returns() {
    let (mut page, _) = open(1280.0, 800.0);
    let observer = "gru(2)".parse().unwrap();
    let config = Config { observer, total_steps: 8192, horizon: 20, ..Config::default() };
    page.state_mut().as_mut().unwrap().reconfigure(config);
    settle(&mut page);
    page.state_mut().as_mut().unwrap().pin();
    page.run_steps(3);
    let lines = |page: &Page, name: &str| text(page, "Chart: ").contains(name);
    assert!(lines(&page, "clone (gru(2), within T)") && lines(&page, "ensemble, β 0.6"), "{}", text(&page, "Chart: "));
    assert!(!lines(&page, "J = ") && !lines(&page, "clone, β 0.6"), "{}", text(&page, "Chart: "));
    page.get_by_role_and_label(Role::RadioButton, "Return: within T").click_accesskit();
    page.run_steps(4);
    assert!(lines(&page, "J = ") && lines(&page, "clone, β 0.6"), "{}", text(&page, "Chart: "));
}

/// A key moves β by its step wherever it stands; a world from the palette keeps the slip.
#[test]
fn a_command_changes_no_more_than_it_says() {
    let (mut page, _) = open(1280.0, 800.0);
    page.state_mut().as_mut().unwrap().set_beta(1.5);
    settle(&mut page);
    page.key_press(egui::Key::ArrowUp);
    page.run_steps(2);
    assert_eq!(page.state().as_ref().unwrap().setup().last_beta(), 1.55);
    let slippery = GridSpec { slip: 0.25, ..GridSpec::default() };
    page.state_mut().as_mut().unwrap().change_world(slippery).unwrap();
    settle(&mut page);
    page.state_mut().as_mut().unwrap().palette.open();
    page.run_steps(2);
    let worlds = &ape_lab::experiment::WORLDS;
    let world = worlds.iter().find(|world| !world.grid().walls.is_empty()).unwrap();
    page.event(egui::Event::Text(format!("World: {}", world.title)));
    page.run_steps(2);
    page.key_press(egui::Key::Enter);
    page.run_steps(4);
    let grid = &page.state().as_ref().unwrap().setup().grid;
    assert_eq!((grid.slip, &grid.walls), (0.25, &world.grid().walls));
    // The last letters and Enter in one frame: what is written then counts, not what was before.
    page.state_mut().as_mut().unwrap().palette.open();
    page.run_steps(2);
    page.event(egui::Event::Text("Go to: Race".to_owned()));
    page.key_down(egui::Key::Enter);
    page.run_steps(2);
    page.key_up(egui::Key::Enter);
    page.run_steps(2);
    text(&page, "Nobody has raced yet");
    // Behind the table of policies no key does anything.
    page.key_press(egui::Key::T);
    page.run_steps(2);
    page.key_press(egui::Key::Num2);
    page.run_steps(2);
    text(&page, "Nobody has raced yet");
    page.key_press(egui::Key::T);
    page.run_steps(2);
    page.key_press(egui::Key::Num2);
    page.run_steps(2);
    assert!(page.query_by_label_contains("Nobody has raced yet").is_none());
}

/// Where a step's figures need a clone that the visitor has put away, it says which.
#[test]
fn the_lesson_says_what_it_needs() {
    let desktop = Desktop::default();
    for (fragment, sentence) in [
        ("v=1&tab=learn&step=7&clones=uniform", "Both sides are of the honest clone"),
        ("v=1&tab=learn&step=4&cell=1,1&clones=bc_counts(1000)", "Row 1, column 1. Expert 1"),
        ("v=1&tab=learn&step=8&clones=gru(2)", "The clone (gru(2)) returns – capped, "),
    ] {
        desktop.visits.borrow_mut().push(fragment.to_owned());
        let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
        settle(&mut page);
        page.run_steps(20);
        text(&page, sentence);
        assert!(page.query_by_label_contains("figures of this page").is_none(), "{fragment}");
    }
}

/// A β of the figures is the β of the run.
#[test]
fn a_caption_has_beta_in_full() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    page.state_mut().as_mut().unwrap().set_beta(0.0625);
    settle(&mut page);
    page.state_mut().as_mut().unwrap().export_picture();
    let svg = desktop.saved.borrow().last().unwrap().1.clone();
    assert!(svg.contains("β = 0.0625,"), "{svg}");
}

/// What a link promises is on its way for long at a slow speed: what the visitor does meanwhile is in the address, too, and
/// where they go themselves is where the next visit begins.
#[test]
fn an_address_follows_also_while_its_promise_is_outstanding() {
    let desktop = Desktop::default();
    desktop.visits.borrow_mut().push("v=1&speed=5&at=700&digest=0123456789abcdef".to_owned());
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    until(&mut page, "training, update 2");
    go_to(&mut page, "Race");
    page.run_steps(20);
    assert_eq!(*desktop.address.borrow(), "v=1&tab=race&speed=5&at=700&digest=0123456789abcdef");
    page.state_mut().as_mut().unwrap().send(Command::Pause);
    until(&mut page, "paused");
    page.run_steps(20);
    let update = page.state().as_ref().unwrap().moment();
    let start = format!("v=1&tab=race&speed=5&at={update}&digest=");
    let address = desktop.address.borrow().clone();
    assert!(address.starts_with(&start) && !address.ends_with("0123456789abcdef"), "{address}");
}

/// Another file of the same name is not what a link is about.
#[test]
fn a_link_to_a_file_is_not_shown_with_another_of_its_name() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    let trap = (ape_lab::experiment::Preset::find("trap").unwrap().setup)().ensemble.unwrap();
    let mut other = trap.clone();
    other.experts.truncate(1);
    let [trap, other] = [trap, other].map(|file| serde_json::to_string(&file).unwrap());
    desktop.to_open.borrow_mut().push(("mine.json".to_owned(), Ok(trap.clone())));
    page.run_steps(2);
    settle(&mut page);
    page.run_steps(40);
    let address = desktop.address.borrow().clone();
    assert!(address.contains("file=mine.json&sum="), "{address}");
    desktop.to_open.borrow_mut().push(("mine.json".to_owned(), Ok(other)));
    page.run_steps(2);
    settle(&mut page);
    desktop.visits.borrow_mut().push(address.clone());
    page.run_steps(2);
    text(&page, "This link shows the ensemble of mine.json, which is not in the link");
    assert_eq!(page.state().as_ref().unwrap().preset(), Some(0));
    // Another tab has it.
    desktop.kept_elsewhere.borrow_mut().insert("ensemble".to_owned(), format!("mine.json\n{trap}"));
    desktop.visits.borrow_mut().push("v=1".to_owned());
    page.run_steps(2);
    settle(&mut page);
    desktop.visits.borrow_mut().push(address);
    page.run_steps(2);
    settle(&mut page);
    let experts = page.state().as_ref().unwrap().setup().ensemble.as_ref().map(|file| file.experts.len());
    assert_eq!(experts, Some(2));
}

/// Who cannot be given the link is told where it stands.
#[test]
fn a_link_is_not_said_to_be_copied_where_there_is_no_clipboard() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    desktop.has_no_clipboard.set(true);
    page.key_press(egui::Key::L);
    page.run_steps(3);
    text(&page, "The browser lets only pages that come over https copy something. Copy the address");
    desktop.has_no_clipboard.set(false);
    page.key_press(egui::Key::L);
    page.run_steps(3);
    text(&page, "Link copied");
}

/// Arrow keys that come in the frame after the focus belong to the picture that has it: they do not move the focus on.
#[test]
fn a_picture_keeps_the_focus_from_its_first_key_on() {
    let (mut page, _) = open(1280.0, 800.0);
    page.state_mut().as_mut().unwrap().view.cell = Some(35);
    page.run_steps(4);
    let picture = |page: &Page| {
        let is_one = |text: String| text.starts_with("Expert 1");
        page.get_by(|node| node.role() == Role::Image && says(node).is_some_and(is_one)).is_focused()
    };
    page.get_by(|node| node.role() == Role::Image && says(node).is_some_and(|text| text.starts_with("Expert 1")))
        .focus();
    page.step();
    for (key, cell) in [(egui::Key::ArrowDown, 45), (egui::Key::ArrowLeft, 44)] {
        page.key_down(key);
        page.step();
        assert_eq!((page.state().as_ref().unwrap().view.cell, picture(&page)), (Some(cell), true));
    }
}

/// Of a clone whose hitting times are not known the picture says what its colours are.
#[test]
fn a_caption_says_what_the_colours_of_a_memory_are() {
    let desktop = Desktop::default();
    desktop.visits.borrow_mut().push("v=1&clones=uniform;history_k(1)".to_owned());
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    settle(&mut page);
    page.run_steps(20);
    page.state_mut().as_mut().unwrap().export_picture();
    let svg = desktop.saved.borrow().last().unwrap().1.clone();
    let texts = svg.split("</text>").filter_map(|part| part.rsplit_once('>')).map(|(_, words)| words);
    let words = texts.collect::<Vec<_>>().join(" ").replace('\u{a0}', " ");
    assert!(words.contains("Of a clone that remembers: expected steps within T"), "{words}");
}

/// A number that has more digits than one would type stays what it is when the focus passes by; one that is typed is taken.
#[test]
fn the_focus_changes_no_number() {
    let desktop = Desktop::default();
    let link = "v=1&size=4x4&slip=0.999&total_steps=6000&learning_rate=1e-7&beta=0.3333";
    desktop.visits.borrow_mut().push(link.to_owned());
    let (mut page, here) = open_with(1280.0, 800.0, desktop);
    settle(&mut page);
    let setup = |page: &Page| page.state().as_ref().unwrap().setup().clone();
    let before = setup(&page);
    let known = here.0.borrow().commands.len();
    let mut passed = 0;
    for tab in ["Train", "World"] {
        go_to(&mut page, tab);
        if tab == "Train" {
            page.get_by_label("Advanced").click_accesskit();
            page.run_steps(20);
        }
        let fields: Vec<_> =
            page.query_all_by_role(Role::SpinButton).map(|field| field.accesskit_node().label().unwrap()).collect();
        for name in fields {
            let field = page.query_all_by_role(Role::SpinButton);
            let field = { field }.find(|field| field.accesskit_node().label().as_ref() == Some(&name)).unwrap();
            field.focus();
            page.run_steps(3);
            page.key_press(egui::Key::Enter);
            page.run_steps(3);
            assert_eq!(setup(&page), before, "{name}");
            passed += 1;
        }
    }
    assert!(passed >= 12, "{passed}");
    let commands = here.0.borrow().commands[known..].to_vec();
    let is_run = |command: &Command| {
        matches!(command, Command::Load { .. } | Command::Retrain { .. } | Command::Continue { .. })
    };
    assert!(!commands.iter().any(is_run), "{commands:?}");

    page.get_by_role_and_label(Role::SpinButton, "Slip").focus();
    page.run_steps(2);
    page.event(egui::Event::Text("0.125".to_owned()));
    page.run_steps(2);
    page.key_press(egui::Key::Enter);
    page.run_steps(3);
    assert_eq!(setup(&page).grid.slip, 0.125);
    page.get_by_role_and_label(Role::SpinButton, "Slip").focus();
    page.run_steps(2);
    page.event(egui::Event::Text("1".to_owned()));
    page.run_steps(2);
    page.key_press(egui::Key::Enter);
    page.run_steps(3);
    text(&page, "Not done: grid: slip 1.0: must be");
    assert_eq!(setup(&page).grid.slip, 0.125);
}

/// An address holds 200 turns of β; with more of them it is of the β that is set now.
#[test]
fn a_reload_keeps_a_beta_that_was_moved_often() {
    let first = Desktop::default();
    let turns: Vec<String> = (0..200).map(|update| format!("{update}:0.{}", 100 + update)).collect();
    first.visits.borrow_mut().push(format!("v=1&turns={}", turns.join(";")));
    let (mut page, _) = open_with(1280.0, 800.0, first.clone());
    settle(&mut page);
    page.run_steps(60);
    assert!(first.address.borrow().contains("turns=0:0.1;"), "{}", first.address.borrow());
    page.state_mut().as_mut().unwrap().continue_with(0.25);
    settle(&mut page);
    page.run_steps(60);
    let address = first.address.borrow().clone();
    assert!(address.contains("beta=0.25") && !address.contains("turns"), "{address}");
    let second = Desktop::default();
    second.visits.borrow_mut().push(address);
    let (mut page, _) = open_with(1280.0, 800.0, second);
    settle(&mut page);
    assert_eq!(page.state().as_ref().unwrap().setup().last_beta(), 0.25);
}

/// The configuration alone does not make an ensemble whose β was moved, or whose run was not over: its file says so.
#[test]
fn a_saved_ensemble_says_which_moment_it_is_of() {
    let desktop = Desktop::default();
    let (mut page, _) = open_with(1280.0, 800.0, desktop.clone());
    let save = |page: &mut Page| {
        press(page, "Export and open");
        page.get_by_label_contains("Ensemble as JSON").click_accesskit();
        page.run_steps(12);
        let (name, text) = desktop.saved.borrow_mut().pop().unwrap();
        assert_eq!(name, "ape-ensemble.json");
        text
    };
    let moment = |text: &str| EnsembleFile::parse(text).unwrap().moment;
    assert_eq!(moment(&save(&mut page)), None);
    page.state_mut().as_mut().unwrap().seek(300);
    until(&mut page, "paused at update 300 of 732");
    assert_eq!(moment(&save(&mut page)), Some(Moment { update: 300, turns: vec![] }));
    page.state_mut().as_mut().unwrap().continue_with(0.2);
    until(&mut page, "trained, update 732 of 732");
    let turned = save(&mut page);
    assert_eq!(moment(&turned), Some(Moment { update: 732, turns: vec![(300, 0.2)] }));

    desktop.to_open.borrow_mut().push(("turned.json".to_owned(), Ok(turned.clone())));
    until(&mut page, "given ensemble");
    page.run_steps(4);
    page.state_mut().as_mut().unwrap().export_picture();
    let svg = desktop.saved.borrow_mut().pop().unwrap().1;
    assert!(svg.contains("β = 0.6, then 0.2, seed 1,") && svg.contains("update 732."), "{svg}");
    assert_eq!(moment(&save(&mut page)), moment(&turned));
    // What no β can be is not believed.
    assert_eq!(moment(&turned.replace("[300,0.2]", "[300,1e308]")), None);
}
