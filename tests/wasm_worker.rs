#![cfg(target_arch = "wasm32")]
//! The session's side in a dedicated worker of Chrome.

mod golden;

use ape_lab::experiment::Setup;
use ape_lab::lab::{Command, Event, Pace, RunState, Session};
use wasm_bindgen::JsCast;
use wasm_bindgen_test::{wasm_bindgen_test, wasm_bindgen_test_configure};
use web_sys::DedicatedWorkerGlobalScope;

wasm_bindgen_test_configure!(run_in_dedicated_worker);

#[wasm_bindgen_test]
fn a_seed_gives_the_same_bits_in_a_worker() {
    golden::check();
    golden::check_presets();
    golden::check_clones();
}

/// The default run, driven by the worker's own clock, in stretches that leave room for messages.
#[wasm_bindgen_test]
fn a_whole_run_ends_with_the_ensemble_good_and_the_clone_lost() {
    let scope: DedicatedWorkerGlobalScope = js_sys::global().unchecked_into();
    let performance = scope.performance().unwrap();
    let mut session = Session::new();
    session.handle(Command::Load { setup: Box::new(Setup::default()), play: true });
    let last = loop {
        let pace = session.advance(&|| performance.now());
        let mut last = None;
        for event in session.events() {
            if let Event::Snapshot(snapshot) = event {
                session.handle(Command::Seen(snapshot.number));
                last = Some(snapshot);
            }
        }
        match last {
            Some(snapshot) if snapshot.state == RunState::Finished => break snapshot,
            _ => assert_ne!(pace, Pace::Idle),
        }
    };
    assert_eq!((last.update, last.experts.len()), (732, 2));
    let (ensemble, clone) = (last.ensemble, last.clones[0].view.returns);
    assert!(ensemble.capped_return > -20.0 && clone.capped_return.unwrap() < -90.0, "{ensemble:?} {clone:?}");
}
