//! What a browser gives the page: downloads, pictures drawn by the browser itself, a file picker, files dropped on it, and
//! storage.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use egui::{DroppedFileHandle, ThemePreference};
use js_sys::{Array, Promise};
use wasm_bindgen::prelude::*;
use wasm_bindgen_futures::{JsFuture, spawn_local};
use web_sys::{
    Blob, BlobPropertyBag, CanvasRenderingContext2d, File, HtmlAnchorElement, HtmlCanvasElement, HtmlImageElement,
    HtmlInputElement, Url,
};

use super::place::Place;
use crate::ui::{Host, check_length};

type Inbox = Rc<RefCell<VecDeque<(String, Result<String, String>)>>>;

/// The browser's files.
pub struct Files {
    wake: Rc<dyn Fn()>,
    inbox: Inbox,
    failures: Rc<RefCell<VecDeque<String>>>,
    picker: Option<(HtmlInputElement, Closure<dyn Fn()>)>,
    place: Place,
}

impl Files {
    /// `wake` is called when a file has been read, and when something has failed.
    pub fn new(wake: impl Fn() + 'static) -> Files {
        let wake: Rc<dyn Fn()> = Rc::new(wake);
        let place = Place::new(wake.clone());
        Files { place, wake, inbox: Inbox::default(), failures: Rc::default(), picker: None }
    }

    fn pick(&mut self) -> Result<(), JsValue> {
        let document = web_sys::window().and_then(|window| window.document()).ok_or("no document")?;
        let input: HtmlInputElement = document.create_element("input")?.unchecked_into();
        input.set_type("file");
        input.set_accept(".json,application/json");
        let (inbox, wake, chosen) = (self.inbox.clone(), self.wake.clone(), input.clone());
        let on_change = Closure::<dyn Fn()>::new(move || {
            if let Some(file) = chosen.files().and_then(|files| files.get(0)) {
                take(file, inbox.clone(), wake.clone());
            }
        });
        input.set_onchange(Some(on_change.as_ref().unchecked_ref()));
        input.click();
        // Kept until the next one: the picker may stay open for long.
        self.picker = Some((input, on_change));
        Ok(())
    }
}

impl Host for Files {
    fn save(&mut self, name: &str, text: &str) -> Result<(), String> {
        download(name, text).map_err(|error| format!("{name} could not be saved ({error:?})."))
    }

    fn save_picture(&mut self, name: &str, svg: &str) -> Result<(), String> {
        let (name, svg) = (name.to_owned(), svg.to_owned());
        let (failures, wake) = (self.failures.clone(), self.wake.clone());
        spawn_local(async move {
            let saved = match rasterize(&svg).await {
                Ok(png) => offer(&name, &png),
                Err(error) => Err(error),
            };
            if let Err(error) = saved {
                let why = error.as_string().unwrap_or_else(|| format!("{error:?}"));
                failures.borrow_mut().push_back(format!("{name} could not be drawn ({why}); take the SVG instead."));
                wake();
            }
        });
        Ok(())
    }

    fn failure(&mut self) -> Option<String> {
        self.failures.borrow_mut().pop_front()
    }

    fn ask_for_file(&mut self) -> Result<(), String> {
        self.pick().map_err(|error| format!("No file can be chosen here ({error:?})."))
    }

    fn read(&mut self, file: DroppedFileHandle) {
        if let Some(file) = file.web_file() {
            take(file.clone(), self.inbox.clone(), self.wake.clone());
        }
    }

    fn opened(&mut self) -> Option<(String, Result<String, String>)> {
        self.inbox.borrow_mut().pop_front()
    }

    fn visited(&mut self) -> Option<String> {
        self.place.visited()
    }

    fn set_address(&mut self, fragment: &str) {
        self.place.set(fragment);
    }

    fn link(&self, fragment: &str) -> String {
        self.place.link(fragment)
    }

    fn can_copy(&self) -> bool {
        // Elsewhere browsers have no clipboard for pages.
        web_sys::window().is_some_and(|window| window.is_secure_context())
    }

    fn keep(&mut self, name: &str, text: &str) -> Result<(), String> {
        // A reload of this tab comes back to what it had, whatever other tabs have kept since.
        if let Some(own) = own_storage() {
            let _ = own.remove_item(&key(name)).and_then(|()| own.set_item(&key(name), text));
        }
        let storage = storage().ok_or("This browser keeps nothing for the next visit.")?;
        storage.set_item(&key(name), text).map_err(|_| "There is no room left in this browser's storage.".to_owned())
    }

    fn kept(&self, name: &str) -> Option<String> {
        let kept = |storage: web_sys::Storage| storage.get_item(&key(name)).ok()?;
        own_storage().and_then(kept).or_else(|| storage().and_then(kept))
    }

    fn kept_elsewhere(&self, name: &str) -> Option<String> {
        storage()?.get_item(&key(name)).ok()?
    }

    fn now(&self) -> Option<f64> {
        Some(web_sys::window()?.performance()?.now() / 1000.0)
    }

    fn report(&self, fault: &str) -> String {
        super::faults::report(fault)
    }

    fn set_theme(&mut self, theme: ThemePreference) {
        let Some(root) = web_sys::window().and_then(|window| window.document()?.document_element()) else { return };
        // The style sheet knows these names (web/page.css); without one it goes by the system.
        let _ = match theme {
            ThemePreference::System => root.remove_attribute("data-theme"),
            ThemePreference::Light => root.set_attribute("data-theme", "light"),
            ThemePreference::Dark => root.set_attribute("data-theme", "dark"),
        };
    }

    fn wants_less_motion(&self) -> bool {
        let query = web_sys::window().and_then(|window| window.match_media("(prefers-reduced-motion: reduce)").ok()?);
        query.is_some_and(|query| query.matches())
    }
}

/// What the page keeps, under names of its own.
fn storage() -> Option<web_sys::Storage> {
    web_sys::window()?.local_storage().ok()?
}

/// What this tab alone keeps, until it is closed.
fn own_storage() -> Option<web_sys::Storage> {
    web_sys::window()?.session_storage().ok()?
}

fn key(name: &str) -> String {
    format!("ape-lab.{name}")
}

/// Reads a file, if it is not too long, and puts it in the inbox.
fn take(file: File, inbox: Inbox, wake: Rc<dyn Fn()>) {
    spawn_local(async move {
        let text = match check_length(file.size()) {
            Ok(()) => JsFuture::from(file.text())
                .await
                .map(|text| text.as_string().unwrap_or_default())
                .map_err(|error| format!("could not be read ({error:?})")),
            Err(sentence) => Err(sentence),
        };
        inbox.borrow_mut().push_back((file.name(), text));
        wake();
    });
}

fn download(name: &str, text: &str) -> Result<(), JsValue> {
    offer(name, &Blob::new_with_str_sequence(&Array::of1(&text.into()))?)
}

fn offer(name: &str, blob: &Blob) -> Result<(), JsValue> {
    let document = web_sys::window().and_then(|window| window.document()).ok_or("no document")?;
    let address = Url::create_object_url_with_blob(blob)?;
    let link: HtmlAnchorElement = document.create_element("a")?.unchecked_into();
    link.set_href(&address);
    link.set_download(name);
    link.click();
    Url::revoke_object_url(&address)
}

/// An SVG document as PNG, two pixels for one.
async fn rasterize(svg: &str) -> Result<Blob, JsValue> {
    const SCALE: u32 = 2;
    let document = web_sys::window().and_then(|window| window.document()).ok_or("no document")?;
    let options = BlobPropertyBag::new();
    options.set_type("image/svg+xml");
    let blob = Blob::new_with_str_sequence_and_options(&Array::of1(&svg.into()), &options)?;
    let address = Url::create_object_url_with_blob(&blob)?;
    let image = HtmlImageElement::new()?;
    let loaded = Promise::new(&mut |resolve, reject| {
        image.set_onload(Some(&resolve));
        image.set_onerror(Some(&reject));
    });
    image.set_src(&address);
    let loaded = JsFuture::from(loaded).await;
    Url::revoke_object_url(&address)?;
    // The event that comes with a failure says nothing.
    loaded.map_err(|_| "the browser does not take it")?;
    let (width, height) = (SCALE * image.natural_width(), SCALE * image.natural_height());
    let canvas: HtmlCanvasElement = document.create_element("canvas")?.unchecked_into();
    canvas.set_width(width);
    canvas.set_height(height);
    let context: CanvasRenderingContext2d = canvas.get_context("2d")?.ok_or("no canvas to draw on")?.unchecked_into();
    context.draw_image_with_html_image_element_and_dw_and_dh(&image, 0.0, 0.0, f64::from(width), f64::from(height))?;
    let drawn = Promise::new(&mut |resolve, reject| {
        if let Err(error) = canvas.to_blob(&resolve) {
            // Nobody waits for more than one answer.
            let _ = reject.call1(&JsValue::UNDEFINED, &error);
        }
    });
    // A canvas that is too large gives nothing.
    JsFuture::from(drawn).await?.dyn_into().map_err(|_| "it is too large".into())
}
