//! Both ends of the Web Worker. Messages are bytes in transferred buffers; a string is a failure's sentence.

use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;

use js_sys::{Array, ArrayBuffer, Uint8Array};
use wasm_bindgen::prelude::*;
use web_sys::{DedicatedWorkerGlobalScope, ErrorEvent, MessageChannel, MessageEvent, Worker};

use crate::lab::{Command, Event, Link, PROTOCOL, Pace, Session, decode, encode};

/// The page's end of a worker.
pub struct WorkerLink {
    wake: Rc<dyn Fn()>,
    inbox: Rc<RefCell<VecDeque<Result<Event, String>>>>,
    worker: Option<Worker>,
    handlers: Option<Handlers>,
}

/// What a worker calls; kept as long as it may.
struct Handlers {
    _on_message: Closure<dyn Fn(MessageEvent)>,
    _on_error: Closure<dyn Fn(ErrorEvent)>,
}

impl WorkerLink {
    const SCRIPT: &str = "./worker_loader.js";

    /// Starts the worker; `wake` is called when an event has arrived.
    pub fn new(wake: impl Fn() + 'static) -> WorkerLink {
        let mut link = WorkerLink { wake: Rc::new(wake), inbox: Rc::default(), worker: None, handlers: None };
        link.restart();
        link
    }
}

impl Link for WorkerLink {
    fn send(&mut self, command: &Command) {
        let Some(worker) = &self.worker else { return };
        let buffer = Uint8Array::from(&encode(command)[..]).buffer();
        if let Err(error) = worker.post_message_with_transfer(&buffer, &Array::of1(&buffer)) {
            self.inbox.borrow_mut().push_back(Err(format!("The worker could not be reached ({error:?}).")));
        }
    }

    fn receive(&mut self) -> Option<Result<Event, String>> {
        let event = self.inbox.borrow_mut().pop_front()?;
        if event.is_err() {
            self.stop();
        }
        Some(event)
    }

    fn restart(&mut self) {
        self.stop();
        self.inbox = Rc::default();
        let worker = match Worker::new(Self::SCRIPT) {
            Ok(worker) => worker,
            Err(error) => {
                let sentence = format!("The worker could not be started ({error:?}).");
                self.inbox.borrow_mut().push_back(Err(sentence));
                return;
            }
        };
        let deliver = {
            let (inbox, wake) = (self.inbox.clone(), self.wake.clone());
            move |event: Result<Event, String>| {
                inbox.borrow_mut().push_back(event);
                wake();
            }
        };
        let on_error = deliver.clone();
        let on_message = Closure::<dyn Fn(MessageEvent)>::new(move |message: MessageEvent| {
            deliver(match message.data().dyn_into::<ArrayBuffer>() {
                Ok(buffer) => decode(&Uint8Array::new(&buffer).to_vec()),
                Err(other) => Err(other.as_string().unwrap_or_default()),
            });
        });
        let on_error = Closure::<dyn Fn(ErrorEvent)>::new(move |error: ErrorEvent| {
            error.prevent_default();
            // A script that could not be fetched comes without a message.
            let reason = error.message();
            let reason = if reason.is_empty() { "its script could not be loaded".to_owned() } else { reason };
            on_error(Err(format!("The worker has stopped ({reason}).")));
        });
        worker.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
        worker.set_onerror(Some(on_error.as_ref().unchecked_ref()));
        self.handlers = Some(Handlers { _on_message: on_message, _on_error: on_error });
        self.worker = Some(worker);
    }
}

impl WorkerLink {
    fn stop(&mut self) {
        if let Some(worker) = self.worker.take() {
            worker.set_onmessage(None);
            worker.set_onerror(None);
            worker.terminate();
        }
    }
}

/// The worker's end: runs a session until the page ends it.
pub fn run() {
    console_error_panic_hook::set_once();
    let scope: DedicatedWorkerGlobalScope = js_sys::global().unchecked_into();
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
        match decode(&Uint8Array::new(&message.data()).to_vec()) {
            Ok(command) => receiver.session.borrow_mut().handle(command),
            Err(sentence) => receiver.post(&Event::Refused(sentence)),
        }
        receiver.come_back();
    });
    driver.scope.set_onmessage(Some(on_message.as_ref().unchecked_ref()));
    on_message.forget();
    driver.post(&Event::Ready { protocol: PROTOCOL });
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
    fn post(&self, event: &Event) {
        let buffer = Uint8Array::from(&encode(event)[..]).buffer();
        // It fails only for values that cannot be transferred, and a buffer can.
        let _ = self.scope.post_message_with_transfer(&buffer, &Array::of1(&buffer));
    }

    fn advance(&self) {
        let pace = self.session.borrow_mut().advance(&|| self.clock.now());
        for event in self.session.borrow_mut().events() {
            self.post(&event);
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
