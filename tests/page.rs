#![cfg(all(feature = "page", not(target_arch = "wasm32")))]
//! The page as egui draws it, without a window: what it says, what its controls do, that nothing is cut off.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use ape_lab::lab::{Command, Event, Link, PROTOCOL, Session};
use ape_lab::ui::App;
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
        desk.starts += 1;
        desk.events = VecDeque::from([Ok(Event::Ready { protocol: PROTOCOL })]);
    }
}

type Page<'a> = Harness<'a, Option<App>>;

fn open<'a>(width: f32, height: f32) -> (Page<'a>, Here) {
    let here = Here::new();
    let link = here.clone();
    let mut page = Harness::builder().with_size(egui::vec2(width, height)).build_ui_state(
        move |ui, app: &mut Option<App>| {
            match app {
                Some(app) => {
                    app.hear();
                    app.show(ui);
                }
                // Fonts and styles hold from the next frame on.
                None => *app = Some(App::new(ui.ctx(), Box::new(link.clone()))),
            }
        },
        None,
    );
    settle(&mut page);
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
    panic!("training did not end");
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

/// From a phone to a 4K screen every widget lies within the page's width.
#[test]
fn nothing_is_cut_off() {
    for (width, height) in [(390.0, 844.0), (820.0, 1180.0), (1000.0, 700.0), (1280.0, 800.0), (3840.0, 2160.0)] {
        let (mut page, _) = open(width, height);
        for experts in ["2 experts", "8 experts"] {
            let node = page.get_by_role_and_label(Role::RadioButton, experts);
            node.click_accesskit();
            settle(&mut page);
            let root = page.root();
            for node in root.children_recursive() {
                let Some(bounds) = node.accesskit_node().bounding_box() else { continue };
                let name = says(&node.accesskit_node()).unwrap_or_default();
                if !name.is_empty() {
                    assert!(bounds.x0 >= -0.5 && bounds.x1 <= f64::from(width) + 0.5, "{width}: {name:?} {bounds:?}");
                }
            }
        }
    }
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
        ("Back to the start", Command::Reset),
        ("One update", Command::Step),
        ("Play", Command::Play),
        ("Pause", Command::Pause),
    ] {
        page.get_by_role_and_label(Role::Button, button).click_accesskit();
        page.run_steps(3);
        assert_eq!(here.0.borrow().commands.iter().rfind(|c| !matches!(c, Command::Seen(_))), Some(&command));
        if command == Command::Reset {
            // Uniform policies hardly arrive, and the page says so.
            page.get_by(|node| {
                says(node).is_some_and(|text| text.starts_with("The 2 experts arrive in 16 % of episodes"))
            });
        }
    }
}

/// A worker that dies leaves the page as it was, with a sentence and a button that brings a new one.
#[test]
fn a_dead_worker_can_be_replaced() {
    let (mut page, here) = open(1280.0, 800.0);
    let before = figure(&page, "Ensemble capped");
    here.0.borrow_mut().events.push_back(Err("The worker has stopped (out of memory).".to_owned()));
    page.run_steps(3);
    page.get_by(|node| node.role() == Role::Alert && says(node).is_some_and(|text| text.contains("out of memory")));
    assert_eq!(figure(&page, "Ensemble capped"), before);
    page.get_by(|node| says(node).is_some_and(|text| text == "stopped at update 732 of 732"));
    page.get_by_role_and_label(Role::Button, "Restart the worker").click_accesskit();
    page.run_steps(3);
    settle(&mut page);
    assert_eq!((here.0.borrow().starts, figure(&page, "Ensemble capped")), (2, before));
    assert!(page.query_by(|node| node.role() == Role::Alert).is_none());
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
