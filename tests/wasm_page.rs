#![cfg(target_arch = "wasm32")]
//! The page's side on Chrome's main thread.

mod golden;

use std::cell::Cell;
use std::rc::Rc;

use ape_lab::lab::{Command, Link};
use ape_lab::web::worker::WorkerLink;
use wasm_bindgen_futures::JsFuture;
use wasm_bindgen_test::{wasm_bindgen_test, wasm_bindgen_test_configure};

wasm_bindgen_test_configure!(run_in_browser);

#[wasm_bindgen_test]
fn a_seed_gives_the_same_bits_on_a_page() {
    golden::check();
    golden::check_presets();
    golden::check_clones();
}

/// Waits for the next turn of the browser's event loop.
async fn turn() {
    let promise = js_sys::Promise::new(&mut |resolve, _| {
        let window = web_sys::window().unwrap();
        window.set_timeout_with_callback_and_timeout_and_arguments_0(&resolve, 10).unwrap();
    });
    JsFuture::from(promise).await.unwrap();
}

/// There is no worker script where tests run: the page hears so, in a sentence, and again after a restart.
#[wasm_bindgen_test]
async fn a_worker_that_cannot_be_loaded_is_reported() {
    let woken = Rc::new(Cell::new(0));
    let counter = woken.clone();
    let mut link = WorkerLink::new(move || counter.set(counter.get() + 1));
    for attempt in 1..=2 {
        link.send(&Command::Play);
        let sentence = loop {
            match link.receive() {
                Some(event) => break event.expect_err("no worker can be there"),
                None => turn().await,
            }
        };
        assert!(sentence.contains("worker") && sentence.ends_with('.'), "{sentence}");
        assert_eq!(woken.get(), attempt);
        link.restart();
    }
}
