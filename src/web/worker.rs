//! Both ends of the Web Workers: one runs the session, others do tasks. Messages are bytes in transferred buffers; a
//! string is a failure's sentence. Which of the two a worker is, its name says.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::fmt::Debug;
use std::rc::Rc;

use js_sys::{Array, ArrayBuffer, Uint8Array};
use serde::Serialize;
use serde::de::DeserializeOwned;
use wasm_bindgen::prelude::*;
use web_sys::{DedicatedWorkerGlobalScope, MessageChannel, MessageEvent, Worker, WorkerOptions};

use super::{faults, measures};
use crate::experiment::Task;
use crate::lab::{
    Command, Event, Hand, Link, OTHER_VERSION, PROTOCOL, Pace, Pool, Session, TaskEvent, check_length, decode, encode,
    unreadable,
};

const SESSION: &str = "session";
const TASKS: &str = "tasks";

/// How long the page paints nothing but what its visitor does, to leave the machine to a retraining, in milliseconds.
const HOLD: f64 = 200.0;

#[wasm_bindgen]
extern "C" {
    /// Says that news is awaited, for so many milliseconds at most (web/rest.js).
    #[wasm_bindgen(catch, js_name = holdPage)]
    fn hold_page(most: f64) -> Result<(), JsValue>;

    /// Says that there is news; whether it is to be painted now (web/rest.js).
    #[wasm_bindgen(catch, js_name = tellPage)]
    fn tell_page(can_wait: bool) -> Result<bool, JsValue>;
}

/// What is called with each message that arrives.
type Wake<E> = Rc<dyn Fn(&Result<E, String>)>;

/// A worker, and what it has said: messages of type `E`.
struct Line<E> {
    /// What it does: [`SESSION`] or [`TASKS`].
    role: &'static str,
    worker: Option<Worker>,
    /// Whether what it says, or that it is gone, is of interest.
    is_open: Rc<Cell<bool>>,
    inbox: Rc<RefCell<VecDeque<Result<E, String>>>>,
    /// What the worker calls; kept as long as it may.
    handlers: Option<Handlers>,
}

struct Handlers {
    _on_message: Closure<dyn Fn(MessageEvent)>,
    _on_error: Closure<dyn Fn(web_sys::Event)>,
}

impl<E: DeserializeOwned + Debug + 'static> Line<E> {
    const SCRIPT: &str = "./worker_loader.js";

    /// Starts a worker; `wake` is called with each message that arrives.
    fn open(role: &'static str, wake: Wake<E>) -> Line<E> {
        let is_open = Rc::new(Cell::new(true));
        let mut line = Line { role, worker: None, is_open: is_open.clone(), inbox: Rc::default(), handlers: None };
        let options = WorkerOptions::new();
        // The worker holds a lock of its name (web/worker_loader.js): no two have the same.
        let name = format!("{role} {}", js_sys::Math::random());
        options.set_name(&name);
        let worker = match Worker::new_with_options(Self::SCRIPT, &options) {
            Ok(worker) => worker,
            Err(error) => {
                let sentence = format!("The worker could not be started ({error:?}).");
                line.inbox.borrow_mut().push_back(Err(sentence));
                return line;
            }
        };
        let deliver = {
            let inbox = line.inbox.clone();
            move |event: Result<E, String>| {
                match &event {
                    Ok(event) => faults::note("from", role, event),
                    Err(_) => faults::note("from", role, &format_args!("failure")),
                }
                wake(&event);
                inbox.borrow_mut().push_back(event);
            }
        };
        let on_error = deliver.clone();
        let is_heard = Cell::new(false);
        let on_message = Closure::<dyn Fn(MessageEvent)>::new(move |message: MessageEvent| {
            if !is_heard.replace(true) {
                let (deliver, is_open) = (deliver.clone(), is_open.clone());
                faults::on_gone(&name, move || {
                    if is_open.get() {
                        deliver(Err("The worker has stopped (the browser has ended it).".to_owned()));
                    }
                });
            }
            let failure = message.data().as_string();
            deliver(failure.map_or_else(|| read(&message), Err));
        });
        let on_error = Closure::<dyn Fn(web_sys::Event)>::new(move |error: web_sys::Event| {
            error.prevent_default();
            // A script that could not be fetched comes as a plain event, which has no message.
            let message = js_sys::Reflect::get(&error, &"message".into()).ok().and_then(|message| message.as_string());
            let reason = message.filter(|message| !message.is_empty());
            let reason = reason.unwrap_or_else(|| "its script could not be loaded".to_owned());
            on_error(Err(format!("The worker has stopped ({reason}).")));
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
        line.handlers = Some(Handlers { _on_message: on_message, _on_error: on_error });
        line.worker = Some(worker);
        line
    }

    fn send(&self, message: &(impl Serialize + Debug)) {
        let Some(worker) = &self.worker else { return };
        faults::note("to", self.role, message);
        let buffer = Uint8Array::from(&encode(message)[..]).buffer();
        if let Err(error) = worker.post_message_with_transfer(&buffer, &Array::of1(&buffer)) {
            self.inbox.borrow_mut().push_back(Err(format!("The worker could not be reached ({error:?}).")));
        }
    }

    /// The next message; after a failure the worker is gone, and its first reason is the one that counts.
    fn receive(&mut self) -> Option<Result<E, String>> {
        if !self.is_open.get() {
            return None;
        }
        let event = self.inbox.borrow_mut().pop_front()?;
        if event.is_err() {
            self.close();
        }
        Some(event)
    }
}

impl<E> Line<E> {
    fn close(&mut self) {
        self.is_open.set(false);
        if let Some(worker) = self.worker.take() {
            worker.set_onmessage(None);
            worker.set_onerror(None);
            worker.terminate();
        }
    }
}

impl<E> Drop for Line<E> {
    fn drop(&mut self) {
        self.close();
    }
}

/// The bytes of a message, read; a sentence when they are none, or too many to be copied.
fn read<T: DeserializeOwned>(message: &MessageEvent) -> Result<T, String> {
    let buffer = message.data().dyn_into::<ArrayBuffer>().map_err(|_| unreadable("expected bytes"))?;
    check_length(buffer.byte_length() as usize)?;
    decode(&Uint8Array::new(&buffer).to_vec())
}

/// The page's end of the session.
pub struct WorkerLink {
    wake: Wake<Event>,
    line: Line<Event>,
    /// Run and update of the snapshot that has come last.
    latest: Option<(u32, u32)>,
}

impl WorkerLink {
    /// Starts the worker; `wake` is called when an event has arrived that is to be painted.
    pub fn new(wake: impl Fn() + 'static) -> WorkerLink {
        let wake: Wake<Event> = Rc::new(move |event| {
            // A run that has begun has nothing to show yet. Where there is no page around, as in tests, nothing rests.
            if tell_page(matches!(event, Ok(Event::Started(_)))).unwrap_or(true) {
                wake();
            }
        });
        WorkerLink { line: Line::open(SESSION, wake.clone()), wake, latest: None }
    }
}

impl Link for WorkerLink {
    fn send(&mut self, command: &Command) {
        if let (Command::Seen(_), Some((run, update))) = (command, self.latest) {
            measures::shown(run, update);
        }
        if let Command::Retrain { .. } = command {
            let _ = hold_page(HOLD);
        }
        self.line.send(command);
    }

    fn receive(&mut self) -> Option<Result<Event, String>> {
        let event = self.line.receive()?;
        if let Ok(Event::Snapshot(snapshot)) = &event {
            self.latest = Some((snapshot.run, snapshot.update));
        }
        Some(event)
    }

    fn restart(&mut self) {
        self.line = Line::open(SESSION, self.wake.clone());
    }
}

/// A pool of workers, one for each core: while they work the session mostly rests.
pub fn worker_pool(wake: impl Fn() + 'static) -> Pool {
    let wake: Wake<TaskEvent> = Rc::new(move |_| wake());
    let cores = web_sys::window().map_or(1.0, |window| window.navigator().hardware_concurrency());
    Pool::new(cores as usize, move || {
        Box::new(WorkerHand { wake: wake.clone(), line: None, is_ready: false, next: None })
    })
}

/// A worker that does tasks.
struct WorkerHand {
    wake: Wake<TaskEvent>,
    line: Option<Line<TaskEvent>>,
    is_ready: bool,
    /// A task for when the worker listens.
    next: Option<Task>,
}

impl Hand for WorkerHand {
    fn begin(&mut self, task: &Task) {
        let line = self.line.get_or_insert_with(|| Line::open(TASKS, self.wake.clone()));
        if self.is_ready {
            line.send(task);
        } else {
            self.next = Some(task.clone());
        }
    }

    fn receive(&mut self) -> Option<Result<TaskEvent, String>> {
        let line = self.line.as_mut()?;
        match line.receive()? {
            Ok(TaskEvent::Ready { protocol }) if protocol == PROTOCOL => {
                self.is_ready = true;
                self.next.take().iter().for_each(|task| line.send(task));
                line.receive()
            }
            Ok(TaskEvent::Ready { .. }) => Some(Err(OTHER_VERSION.to_owned())),
            event => Some(event),
        }
    }

    fn is_starting(&self) -> bool {
        self.line.is_some() && !self.is_ready
    }

    /// A worker at work hears nothing: it is ended, and the next task gets a new one.
    fn stop(&mut self) {
        (self.line, self.is_ready, self.next) = (None, false, None);
    }
}

/// The worker's end: what its name says.
pub fn run() {
    let scope: DedicatedWorkerGlobalScope = js_sys::global().unchecked_into();
    let page = scope.clone();
    std::panic::set_hook(Box::new(move |info| {
        console_error_panic_hook::hook(info);
        // A string is a failure's sentence.
        let _ = page.post_message(&format!("The worker has stopped ({}).", faults::words(info)).into());
    }));
    if scope.name().starts_with(TASKS) { do_tasks(scope) } else { run_session(scope) }
}

fn post(scope: &DedicatedWorkerGlobalScope, event: &impl Serialize) {
    let buffer = Uint8Array::from(&encode(event)[..]).buffer();
    // It fails only for values that cannot be transferred, and a buffer can.
    let _ = scope.post_message_with_transfer(&buffer, &Array::of1(&buffer));
}

/// Does one task after another until the page ends it.
fn do_tasks(scope: DedicatedWorkerGlobalScope) {
    let clock = scope.performance().expect("every worker has a clock");
    let listener = scope.clone();
    let on_message = Closure::<dyn Fn(MessageEvent)>::new(move |message: MessageEvent| {
        let scope = &scope;
        let now = || clock.now();
        // News of progress at most twenty times a second.
        let begun = now();
        let told = Cell::new(begun);
        let mut progress = |done: f64| {
            if now() - told.get() > 50.0 {
                told.set(now());
                post(scope, &TaskEvent::Progress(done as f32));
            }
            true
        };
        let outcome = read(&message).and_then(|task: Task| task.run(&now, &mut progress));
        match outcome {
            Ok(Some(outcome)) => post(scope, &TaskEvent::Done(Box::new(outcome), now() - begun)),
            Ok(None) => {}
            Err(sentence) => post(scope, &TaskEvent::Failed(sentence)),
        }
    });
    listener.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
    on_message.forget();
    post(&listener, &TaskEvent::Ready { protocol: PROTOCOL });
}

/// Runs a session until the page ends it.
fn run_session(scope: DedicatedWorkerGlobalScope) {
    let channel = MessageChannel::new().expect("every browser with workers has message channels");
    let driver = Rc::new(Driver {
        clock: scope.performance().expect("every worker has a clock"),
        session: RefCell::new(Session::new()),
        // Messages to ourselves come back at once, where timers of 0 ms wait for 4.
        next_turn: channel.port2(),
        is_turn_coming: Cell::new(false),
        timer: Cell::new(None),
        on_timer: RefCell::new(None),
        scope,
    });
    let turn = driver.clone();
    let on_turn = Closure::<dyn Fn()>::new(move || {
        turn.is_turn_coming.set(false);
        turn.advance();
    });
    channel.port1().set_onmessage(Some(on_turn.as_ref().unchecked_ref()));
    on_turn.forget();
    let turn = driver.clone();
    *driver.on_timer.borrow_mut() = Some(Closure::new(move || {
        turn.timer.set(None);
        turn.come_back();
    }));
    let receiver = driver.clone();
    let on_message = Closure::<dyn Fn(MessageEvent)>::new(move |message: MessageEvent| {
        match read(&message) {
            Ok(command) => receiver.session.borrow_mut().handle(command),
            Err(sentence) => post(&receiver.scope, &Event::Refused(sentence)),
        }
        receiver.come_back();
    });
    driver.scope.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
    on_message.forget();
    post(&driver.scope, &Event::Ready { protocol: PROTOCOL });
}

/// Gives the session its turns: between two of them the browser delivers the page's commands.
struct Driver {
    scope: DedicatedWorkerGlobalScope,
    clock: web_sys::Performance,
    session: RefCell<Session>,
    next_turn: web_sys::MessagePort,
    is_turn_coming: Cell<bool>,
    timer: Cell<Option<i32>>,
    on_timer: RefCell<Option<Closure<dyn Fn()>>>,
}

impl Driver {
    fn advance(&self) {
        let pace = self.session.borrow_mut().advance(&|| self.clock.now());
        for event in self.session.borrow_mut().events() {
            post(&self.scope, &event);
        }
        match pace {
            Pace::Now => self.come_back(),
            Pace::After(ms) => {
                let on_timer = self.on_timer.borrow();
                let callback = on_timer.as_ref().expect("set before the first turn").as_ref().unchecked_ref();
                let timer =
                    self.scope.set_timeout_with_callback_and_timeout_and_arguments_0(callback, ms.ceil() as i32);
                self.timer.set(timer.ok());
            }
            Pace::Idle => {}
        }
    }

    /// Asks for a turn, once.
    fn come_back(&self) {
        if let Some(timer) = self.timer.take() {
            self.scope.clear_timeout_with_handle(timer);
        }
        if !self.is_turn_coming.replace(true) {
            // As above: null can be sent.
            let _ = self.next_turn.post_message(&JsValue::NULL);
        }
    }
}
