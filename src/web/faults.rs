//! What the program tells of faults, its own and its workers'; web/faults.js shows them.

use std::fmt::{Debug, Write};
use std::panic::PanicHookInfo;

use wasm_bindgen::prelude::*;

#[wasm_bindgen]
extern "C" {
    /// Shows that the program has crashed, with a report.
    #[wasm_bindgen(catch, js_name = programHasCrashed)]
    fn program_has_crashed(sentence: &str) -> Result<(), JsValue>;

    /// Keeps the name of a message for reports.
    #[wasm_bindgen(catch, js_name = noteMessage)]
    fn note_message(text: &str) -> Result<(), JsValue>;

    /// A fault, and what helps to find it.
    #[wasm_bindgen(catch, js_name = faultReport)]
    fn fault_report(sentence: &str) -> Result<String, JsValue>;

    /// Calls back when the worker of this name is gone; never where the browser has no locks.
    #[wasm_bindgen(catch, js_name = whenGone)]
    fn when_gone(name: &str, callback: &JsValue) -> Result<(), JsValue>;
}

/// Has every panic of the page told on it.
#[cfg(feature = "page")]
pub fn tell_panics() {
    std::panic::set_hook(Box::new(|info| {
        console_error_panic_hook::hook(info);
        let _ = program_has_crashed(&words(info));
    }));
}

/// What a panic says, and where it was.
pub fn words(info: &PanicHookInfo<'_>) -> String {
    let message = info.payload_as_str().unwrap_or("a panic");
    info.location().map_or(message.to_owned(), |place| {
        format!("{message}, {}:{}:{}", of_crate(place.file()), place.line(), place.column())
    })
}

/// A file's path without where it lay when the program was built.
fn of_crate(file: &str) -> &str {
    let behind = |folder: &str| file.split_once(folder)?.1.split_once('/').map(|(_, rest)| rest);
    behind("/registry/src/").or(behind("/rustc/")).unwrap_or(file)
}

/// Notes a message, by its name alone. `way`: from or to whom.
pub fn note(way: &str, worker: &str, message: &impl Debug) {
    let name = name(message);
    // Those only answer snapshots.
    if name != "Seen" {
        // Where there is no page around the program, as in tests, nobody asks for it.
        let _ = note_message(&format!("{way} {worker}: {name}"));
    }
}

/// The report of a fault.
#[cfg(feature = "page")]
pub fn report(fault: &str) -> String {
    fault_report(fault).unwrap_or_default()
}

/// Calls back once when a worker is gone without a word. Needs the browser's locks, which pages have that come over
/// https or from this machine.
pub fn on_gone(worker: &str, callback: impl FnOnce() + 'static) {
    let _ = when_gone(worker, &Closure::once_into_js(callback));
}

/// The name of a message: that of its variant.
fn name(message: &impl Debug) -> String {
    struct Name(String);
    impl Write for Name {
        fn write_str(&mut self, text: &str) -> std::fmt::Result {
            let end = text.find(|letter: char| !letter.is_alphanumeric());
            self.0.push_str(&text[..end.unwrap_or(text.len())]);
            // What comes after the name is not even written.
            end.map_or(Ok(()), |_| Err(std::fmt::Error))
        }
    }
    let mut name = Name(String::new());
    let _ = write!(name, "{message:?}");
    name.0
}
