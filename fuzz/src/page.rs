//! A page without a window: it opens what it is given, trains a little, draws, and exports.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use ape_lab::ape::Config;
use ape_lab::experiment::{Setup, Task};
use ape_lab::lab::{Command, Event, Hand, Link, PROTOCOL, Pool, Session, TaskEvent};
use ape_lab::mdp::Grid;
use ape_lab::ui::{App, Host};
use egui::{Context, FullOutput, RawInput, Shape};

/// What a page finds when it is opened.
#[derive(Default)]
pub struct Visit {
    pub fragment: String,
    /// A file that the visitor opens.
    pub file: Option<String>,
    /// What was kept from an earlier visit, each with its name.
    pub kept: Vec<(&'static str, String)>,
    /// What the worker says; where there is nothing, a real one is asked.
    pub events: Vec<Result<Event, String>>,
}

/// Steps of a batch and of an episode with which a fuzzer gets on.
const FEW_STEPS: u32 = 300;
const SHORT: u32 = 60;

/// Fewer steps where there are many; what is not allowed stays so.
pub fn shrink_setup(setup: &mut Setup) {
    if setup.check().is_err() {
        return;
    }
    let updates = setup.config.updates();
    let config = &mut setup.config;
    config.horizon = config.horizon.min(SHORT);
    config.batch_steps = config.batch_steps.min(FEW_STEPS);
    config.total_steps = updates.saturating_mul(config.batch_steps);
}

pub fn shrink(mut command: Command) -> Command {
    if let Command::Load { setup, .. } = &mut command {
        shrink_setup(setup);
    }
    command
}

/// What a session says must be what a page takes: of the right shapes, and made of numbers. `grid` is that of its run.
pub fn check_events(grid: &mut Option<Grid>, events: &[Event]) {
    for event in events {
        match event {
            Event::Started(started) => *grid = Some(started.check().expect("a session sends what can be shown")),
            Event::Snapshot(snapshot) => {
                let grid = grid.as_ref().expect("runs start before they are shown");
                snapshot.check(grid).expect("a session sends what can be shown");
            }
            Event::Exported(exported) => exported.check().expect("a session sends what can be saved"),
            Event::Refused(sentence) => assert!(sentence.len() < 2000, "{sentence}"),
            Event::Remade(updates) => assert!(*updates <= Config::MOST_UPDATES),
            Event::Ready { .. } => unreachable!("drivers say so"),
        }
    }
}

/// No text for a visitor or a file says that something is no number.
pub fn assert_numbers(text: &str) {
    let mut words = text.split(|c: char| !c.is_alphanumeric());
    assert!(!words.any(|word| ["NaN", "inf"].contains(&word)), "{text}");
}

struct Worker {
    session: Option<Session>,
    events: VecDeque<Result<Event, String>>,
    grid: Option<Grid>,
    now: f64,
    /// Turns that the session may still take.
    turns: u32,
}

#[derive(Clone)]
struct Here(Rc<RefCell<Worker>>);

impl Link for Here {
    fn send(&mut self, command: &Command) {
        if let Some(session) = &mut self.0.borrow_mut().session {
            session.handle(shrink(command.clone()));
        }
    }

    fn receive(&mut self) -> Option<Result<Event, String>> {
        let worker = &mut *self.0.borrow_mut();
        if worker.events.is_empty()
            && worker.turns > 0
            && let Some(session) = &mut worker.session
        {
            worker.turns -= 1;
            let now = std::cell::Cell::new(worker.now + 20.0);
            session.advance(&|| {
                now.set(now.get() + 2.0);
                now.get()
            });
            worker.now = now.get();
            let events = session.events();
            check_events(&mut worker.grid, &events);
            worker.events.extend(events.into_iter().map(Ok));
        }
        worker.events.pop_front()
    }

    fn restart(&mut self) {}
}

/// Nobody works beside the session.
struct Idle;

impl Hand for Idle {
    fn begin(&mut self, _task: &Task) {}

    fn receive(&mut self) -> Option<Result<TaskEvent, String>> {
        None
    }

    fn stop(&mut self) {}
}

struct Desktop {
    fragment: Option<String>,
    file: Option<String>,
    kept: Vec<(&'static str, String)>,
}

impl Host for Desktop {
    fn save(&mut self, name: &str, text: &str) -> Result<(), String> {
        assert!(!text.is_empty(), "{name}");
        assert_numbers(text);
        Ok(())
    }

    fn save_picture(&mut self, name: &str, svg: &str) -> Result<(), String> {
        self.save(name, svg)
    }

    fn ask_for_file(&mut self) -> Result<(), String> {
        Ok(())
    }

    fn read(&mut self, _file: egui::DroppedFileHandle) {}

    fn opened(&mut self) -> Option<(String, Result<String, String>)> {
        self.file.take().map(|text| ("file.json".to_owned(), Ok(text)))
    }

    fn visited(&mut self) -> Option<String> {
        self.fragment.take()
    }

    fn kept(&self, name: &str) -> Option<String> {
        self.kept.iter().find(|(kept, _)| *kept == name).map(|(_, text)| text.clone())
    }
}

thread_local! {
    /// Fonts are read once.
    static CONTEXT: Context = Context::default();
}

impl Visit {
    pub fn play(self) {
        CONTEXT.with(|ctx| self.play_in(ctx));
    }

    fn play_in(self, ctx: &Context) {
        let Visit { fragment, file, kept, events } = self;
        let session = events.is_empty().then(Session::new);
        let mut inbox = VecDeque::from([Ok(Event::Ready { protocol: PROTOCOL })]);
        inbox.extend(events);
        let here = Here(Rc::new(RefCell::new(Worker { session, events: inbox, grid: None, now: 0.0, turns: 0 })));
        let mut host = Some(Desktop { fragment: Some(fragment), file, kept });
        let mut app = None;
        draw(ctx, |ui| {
            let pool = Pool::new(1, || Box::new(Idle));
            app = Some(App::new(
                ui.ctx(),
                Box::new(here.clone()),
                pool,
                Box::new(host.take().expect("a page is opened once")),
            ));
        });
        let Some(mut app) = app else { return };
        let frame = |app: &mut App| {
            here.0.borrow_mut().turns = 2;
            draw(ctx, |ui| {
                app.hear();
                app.show(ui);
            });
        };
        frame(&mut app);
        // What a visitor may do next.
        app.pin();
        app.export_picture();
        app.export_curve();
        app.export_model();
        app.seek(1);
        frame(&mut app);
        app.continue_with(0.3);
        frame(&mut app);
    }
}

/// One frame; every text in it is looked at.
fn draw(ctx: &Context, run: impl FnMut(&mut egui::Ui)) {
    let screen = egui::Rect::from_min_size(egui::Pos2::ZERO, egui::vec2(1280.0, 800.0));
    let input = RawInput { screen_rect: Some(screen), ..RawInput::default() };
    let FullOutput { shapes, mut textures_delta, .. } = ctx.run_ui(input, run);
    // There is no screen that needs them.
    textures_delta.clear();
    shapes.iter().for_each(|clipped| look(&clipped.shape));
}

fn look(shape: &Shape) {
    match shape {
        Shape::Vec(shapes) => shapes.iter().for_each(look),
        // A sentence may say what somebody has written.
        Shape::Text(text)
            if ["expected", "must be", "link", "file.json"].iter().any(|word| text.galley.text().contains(word)) => {}
        Shape::Text(text) => assert_numbers(text.galley.text()),
        _ => {}
    }
}
