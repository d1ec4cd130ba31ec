//! The address of the page.

use std::cell::RefCell;
use std::rc::Rc;

use wasm_bindgen::prelude::*;
use web_sys::Window;

/// The address: what follows `#` says what is on the page.
pub struct Place {
    /// What the visitor has put there, and the page has not read yet.
    visited: Rc<RefCell<Option<String>>>,
    /// What the page has put there.
    own: Rc<RefCell<String>>,
    _on_change: Closure<dyn Fn()>,
}

impl Place {
    /// `wake` is called when the visitor has changed the address.
    pub fn new(wake: Rc<dyn Fn()>) -> Place {
        let visited = Rc::new(RefCell::new(Some(fragment())));
        let own = Rc::new(RefCell::new(String::new()));
        let (inbox, ours) = (visited.clone(), own.clone());
        let on_change = Closure::<dyn Fn()>::new(move || {
            let fragment = fragment();
            if fragment != *ours.borrow() {
                *inbox.borrow_mut() = Some(fragment);
                wake();
            }
        });
        if let Some(window) = web_sys::window() {
            window.set_onhashchange(Some(on_change.as_ref().unchecked_ref()));
        }
        Place { visited, own, _on_change: on_change }
    }

    pub fn visited(&mut self) -> Option<String> {
        let visited = self.visited.borrow_mut().take()?;
        // That is what stands there now.
        *self.own.borrow_mut() = visited.clone();
        Some(visited)
    }

    pub fn set(&mut self, fragment: &str) {
        if *self.own.borrow() == fragment {
            return;
        }
        *self.own.borrow_mut() = fragment.to_owned();
        let history = web_sys::window().and_then(|window| window.history().ok());
        if let Some(history) = history {
            // Browsers refuse when it is asked too often: the next change tries again.
            let _ = history.replace_state_with_url(&JsValue::NULL, "", Some(&format!("#{fragment}")));
        }
    }

    pub fn link(&self, fragment: &str) -> String {
        let href = web_sys::window().and_then(|window| window.location().href().ok()).unwrap_or_default();
        format!("{}#{fragment}", href.split('#').next().unwrap_or_default())
    }
}

fn fragment() -> String {
    let hash = web_sys::window().and_then(|window: Window| window.location().hash().ok()).unwrap_or_default();
    hash.trim_start_matches('#').to_owned()
}
