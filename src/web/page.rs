//! Starts the page: the app on its canvas, with a worker behind it; and puts it on a new canvas when the browser has taken
//! the old one's graphics away.

use std::cell::RefCell;
use std::rc::Rc;

use eframe::{WebOptions, WebRunner};
use egui::Context;
use wasm_bindgen::prelude::*;
use web_sys::{Document, Element, HtmlCanvasElement};

use super::faults;
use super::files::Files;
use super::hands::Hands;
use super::mirror::Mirror;
use super::textures::Unsmoothed;
use super::worker::{WorkerLink, worker_pool};
use crate::ui::App;

#[wasm_bindgen]
extern "C" {
    /// Shows a sentence in place of the page (web/failures.js).
    #[wasm_bindgen(js_name = failPage)]
    fn fail_page(sentence: &str);

    /// Settles when the program may start: a newer version that waits takes over before (web/offline.js).
    #[wasm_bindgen(catch, js_name = newestVersion)]
    async fn newest_version() -> Result<JsValue, JsValue>;

    /// Says that there will be something to paint in so many milliseconds (web/rest.js).
    #[wasm_bindgen(js_name = wakePage)]
    fn wake_page(delay: f64);

    /// Says that a frame begins (web/rest.js).
    #[wasm_bindgen(js_name = pagePaints)]
    fn page_paints();

    /// Nothing is painted while this canvas has lost its graphics (web/faults.js).
    #[wasm_bindgen(js_name = watchGraphics)]
    fn watch_graphics(canvas: &HtmlCanvasElement);

    /// Says that the graphics are lost, and no longer (web/faults.js).
    #[wasm_bindgen(js_name = graphicsAreLost)]
    fn graphics_are_lost();

    #[wasm_bindgen(js_name = graphicsAreBack)]
    fn graphics_are_back();
}

/// Starts the app; what keeps it from starting is shown as a sentence.
pub fn start() {
    faults::tell_panics();
    wasm_bindgen_futures::spawn_local(async {
        if let Err(sentence) = run().await {
            fail_page(&sentence);
        }
    });
}

async fn run() -> Result<(), String> {
    let window = web_sys::window().ok_or("There is no window.")?;
    let document = window.document().ok_or("There is no document.")?;
    let tell = |name: &str, value: JsValue| {
        js_sys::Reflect::set(&window, &name.into(), &value).map(|_| ()).map_err(|error| format!("{error:?}"))
    };
    tell("pageVersion", env!("CARGO_PKG_VERSION").into())?;
    let message = element(&document, "message")?;
    let says_why = || message.get_attribute("role").as_deref() == Some("alert");
    if says_why() {
        // web/failures.js has found something missing.
        return Ok(());
    }
    // Whatever keeps it from telling, the version that is here starts.
    let _ = newest_version().await;
    let stage = Rc::new(Stage { runner: WebRunner::new(), app: Rc::default(), ctx: Rc::default() });
    stage.raise(&document).await?;
    if !says_why() {
        message.set_attribute("hidden", "").map_err(|error| format!("{error:?}"))?;
    }
    tell("pageHasStarted", true.into())
}

fn element(document: &Document, id: &str) -> Result<Element, String> {
    document.get_element_by_id(id).ok_or(format!("The page has no element {id:?}."))
}

/// The app, which lasts, and what it is shown with, which the browser may take away.
struct Stage {
    runner: WebRunner,
    app: Rc<RefCell<Option<App>>>,
    /// egui's context of the canvas that is there now.
    ctx: Rc<RefCell<Context>>,
}

impl Stage {
    /// Puts the app on the page's canvas.
    async fn raise(self: Rc<Self>, document: &Document) -> Result<(), String> {
        let canvas: HtmlCanvasElement =
            element(document, "canvas")?.dyn_into().map_err(|_| "The element \"canvas\" is no canvas.")?;
        without_antialiasing(&canvas).map_err(|error| format!("{error:?}"))?;
        watch_graphics(&canvas);
        self.clone().listen(&canvas, document).map_err(|error| format!("{error:?}"))?;
        let end = |id: &str| {
            element(document, id)?.dyn_into().map_err(|_| format!("The element {id:?} cannot have the focus."))
        };
        let hands = Hands::new(canvas.clone().into(), end("start")?, end("end")?);
        let mirror = Mirror::new(element(document, "mirror")?, element(document, "announcer")?, hands);
        let (app, ctx) = (self.app.clone(), self.ctx.clone());
        self.runner
            .start(
                canvas.clone(),
                WebOptions::default(),
                Box::new(move |cc| {
                    cc.egui_ctx.add_plugin(mirror);
                    cc.egui_ctx.add_plugin(Unsmoothed);
                    cc.egui_ctx.set_repaint_observer(|info| wake_page(1000.0 * info.delay.as_secs_f64()));
                    let before = ctx.replace(cc.egui_ctx.clone());
                    let is_first = app.borrow().is_none();
                    if is_first {
                        let waker = || {
                            let ctx = ctx.clone();
                            move || ctx.borrow().request_repaint()
                        };
                        let (link, pool) = (WorkerLink::new(waker()), worker_pool(waker()));
                        let new = App::new(&cc.egui_ctx, Box::new(link), pool, Box::new(Files::new(waker())));
                        app.replace(Some(new));
                    } else if let Some(app) = &mut *app.borrow_mut() {
                        app.move_to(&cc.egui_ctx);
                        // What is open and how far it is scrolled.
                        let data = before.data(|data| data.clone());
                        cc.egui_ctx.data_mut(|own| *own = data);
                    }
                    Ok(Box::new(OnStage(app)))
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
        Ok(())
    }

    /// When its graphics are lost the canvas is left, and when the browser has some again another takes its place: neither
    /// eframe nor the listeners of the old one outlive that.
    fn listen(self: Rc<Self>, canvas: &HtmlCanvasElement, document: &Document) -> Result<(), JsValue> {
        let stage = self.clone();
        let on_lost = Closure::<dyn Fn(web_sys::Event)>::new(move |event: web_sys::Event| {
            let canvas = event.target().and_then(|target| target.dyn_into::<Element>().ok());
            if canvas.is_none_or(|canvas| !canvas.is_connected()) {
                // Another has taken its place, and its graphics were given back (web/faults.js).
                return;
            }
            // Otherwise the browser gives nothing back.
            event.prevent_default();
            stage.runner.destroy();
            graphics_are_lost();
        });
        let document = document.clone();
        let on_restored = Closure::<dyn Fn()>::new(move || {
            let (stage, document) = (self.clone(), document.clone());
            wasm_bindgen_futures::spawn_local(async move {
                let raised = match replace(&document, &["canvas", "mirror"]) {
                    Ok(()) => stage.raise(&document).await,
                    Err(error) => Err(format!("{error:?}")),
                };
                match raised {
                    Ok(()) => graphics_are_back(),
                    Err(sentence) => fail_page(&sentence),
                }
            });
        });
        // As long as the canvas lives.
        let (on_lost, on_restored) = (on_lost.into_js_value(), on_restored.into_js_value());
        canvas.add_event_listener_with_callback("webglcontextlost", on_lost.unchecked_ref())?;
        canvas.add_event_listener_with_callback("webglcontextrestored", on_restored.unchecked_ref())
    }
}

/// Puts empty elements of the same kind in the place of these, without listeners.
fn replace(document: &Document, ids: &[&str]) -> Result<(), JsValue> {
    for id in ids {
        let old = element(document, id)?;
        old.replace_with_with_node_1(&old.clone_node()?)?;
    }
    Ok(())
}

/// The app as eframe has it.
struct OnStage(Rc<RefCell<Option<App>>>);

impl OnStage {
    fn with<R>(&self, act: impl FnOnce(&mut App) -> R) -> R {
        act(self.0.borrow_mut().as_mut().expect("the app is made before it is on stage"))
    }
}

impl eframe::App for OnStage {
    /// Once a frame, before all else.
    fn raw_input_hook(&mut self, _ctx: &Context, _input: &mut egui::RawInput) {
        page_paints();
    }

    fn logic(&mut self, ctx: &Context, frame: &mut eframe::Frame) {
        self.with(|app| app.logic(ctx, frame));
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        self.with(|app| app.ui(ui, frame));
    }

    fn clear_color(&self, visuals: &egui::Visuals) -> [f32; 4] {
        self.with(|app| app.clear_color(visuals))
    }
}

/// Makes the canvas's drawing context before eframe asks for it, which then gets this one: egui smooths its edges itself,
/// and to do so four times over makes a weak graphics card twice as slow.
fn without_antialiasing(canvas: &HtmlCanvasElement) -> Result<(), JsValue> {
    let options = js_sys::Object::new();
    js_sys::Reflect::set(&options, &"antialias".into(), &false.into())?;
    canvas.get_context_with_context_options("webgl2", &options)?;
    Ok(())
}
