//! What the page tells of its speed, as entries of the browser's User Timing: only while `window.apeLabMeasures` is set,
//! as they are kept until somebody clears them. What a frame takes is measured by web/rest.js.

use js_sys::Reflect;

/// The frame being made shows this update of this run.
pub fn shown(run: u32, update: u32) {
    let Some(window) = web_sys::window() else { return };
    let is_asked_for = Reflect::get(&window, &"apeLabMeasures".into()).is_ok_and(|asked| asked.is_truthy());
    if let Some(performance) = window.performance().filter(|_| is_asked_for) {
        let _ = performance.mark(&format!("ape-lab: shown run {run} update {update}"));
    }
}
