//! Starts the page: the app on its canvas, with a worker behind it.

use eframe::{WebOptions, WebRunner};
use wasm_bindgen::prelude::*;
use web_sys::HtmlCanvasElement;

use super::files::Files;
use super::hands::Hands;
use super::mirror::Mirror;
use super::textures::Unsmoothed;
use super::worker::{WorkerLink, worker_pool};
use crate::ui::App;

#[wasm_bindgen]
extern "C" {
    /// Shows a sentence in place of the page (index.html).
    #[wasm_bindgen(js_name = failPage)]
    fn fail_page(sentence: &str);

    /// Settles when the program may start: a newer version that waits takes over before (web/offline.js).
    #[wasm_bindgen(catch, js_name = newestVersion)]
    async fn newest_version() -> Result<JsValue, JsValue>;

    /// Says that there will be something to paint in so many milliseconds (web/rest.js).
    #[wasm_bindgen(js_name = wakePage)]
    fn wake_page(delay: f64);
}

/// Starts the app; what keeps it from starting is shown as a sentence.
pub fn start() {
    console_error_panic_hook::set_once();
    wasm_bindgen_futures::spawn_local(async {
        if let Err(sentence) = run().await {
            fail_page(&sentence);
        }
    });
}

async fn run() -> Result<(), String> {
    let window = web_sys::window().ok_or("There is no window.")?;
    let document = window.document().ok_or("There is no document.")?;
    let element = |id: &str| document.get_element_by_id(id).ok_or(format!("The page has no element {id:?}."));
    if element("message")?.get_attribute("role").as_deref() == Some("alert") {
        // index.html has found something missing and says so.
        return Ok(());
    }
    // Whatever keeps it from telling, the version that is here starts.
    let _ = newest_version().await;
    let canvas: HtmlCanvasElement =
        element("canvas")?.dyn_into().map_err(|_| "The element \"canvas\" is no canvas.")?;
    without_antialiasing(&canvas).map_err(|error| format!("{error:?}"))?;
    let end = |id: &str| element(id)?.dyn_into().map_err(|_| format!("The element {id:?} cannot have the focus."));
    let hands = Hands::new(canvas.clone().into(), end("start")?, end("end")?);
    let mirror = Mirror::new(element("mirror")?, element("announcer")?, hands);
    WebRunner::new()
        .start(
            canvas.clone(),
            WebOptions::default(),
            Box::new(|cc| {
                cc.egui_ctx.add_plugin(mirror);
                cc.egui_ctx.add_plugin(Unsmoothed);
                cc.egui_ctx.set_repaint_observer(|info| wake_page(1000.0 * info.delay.as_secs_f64()));
                let waker = || {
                    let ctx = cc.egui_ctx.clone();
                    move || ctx.request_repaint()
                };
                let link = WorkerLink::new(waker());
                Ok(Box::new(App::new(
                    &cc.egui_ctx,
                    Box::new(link),
                    worker_pool(waker()),
                    Box::new(Files::new(waker())),
                )))
            }),
        )
        .await
        .map_err(|error| format!("The page could not be drawn ({error:?})."))?;
    // eframe's field for typing gets the focus from the canvas: Tab must not stop at it too.
    if let Some(field) = canvas.next_element_sibling() {
        let names = [("tabindex", "-1"), ("aria-label", "Text")];
        names
            .iter()
            .try_for_each(|(name, value)| field.set_attribute(name, value))
            .map_err(|error| format!("{error:?}"))?;
    }
    element("message")?.set_attribute("hidden", "").map_err(|error| format!("{error:?}"))?;
    js_sys::Reflect::set(&window, &"pageHasStarted".into(), &true.into()).map_err(|error| format!("{error:?}"))?;
    Ok(())
}

/// Makes the canvas's drawing context before eframe asks for it, which then gets this one: egui smooths its edges itself,
/// and to do so four times over makes a weak graphics card twice as slow.
fn without_antialiasing(canvas: &HtmlCanvasElement) -> Result<(), JsValue> {
    let options = js_sys::Object::new();
    js_sys::Reflect::set(&options, &"antialias".into(), &false.into())?;
    canvas.get_context_with_context_options("webgl2", &options)?;
    Ok(())
}
