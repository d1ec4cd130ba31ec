//! The way back from the mirror: what is done to its elements reaches egui, and the keyboard can leave the page.
//!
//! The document's focus stays on the canvas, as eframe needs it; which widget has it is said by
//! `aria-activedescendant`. An element of the mirror that is given the focus hands it on to its widget.
//! egui's Tab goes round and round: at either end the focus goes to an element beside the canvas, from where the
//! next Tab leaves.

use std::cell::RefCell;

use egui::accesskit::{Action, ActionData, ActionRequest, NodeId, TreeId, TreeUpdate};
use egui::{Context, Event, Key, Modifiers, RawInput};
use wasm_bindgen::convert::FromWasmAbi;
use wasm_bindgen::prelude::*;
use web_sys::{Element, FocusEvent, FocusOptions, HtmlElement, KeyboardEvent};

use super::aria;

thread_local! {
    /// What egui has not been told yet.
    static WAITING: RefCell<Vec<Event>> = const { RefCell::new(Vec::new()) };
}

/// What has to do with the focus.
pub struct Hands {
    canvas: HtmlElement,
    /// The elements before and behind the canvas.
    start: HtmlElement,
    end: HtmlElement,
    /// The node that had the focus in the last frame.
    focus: Option<NodeId>,
    /// Whether Tab was the last key, and with Shift, until the focus has moved.
    tab: Option<bool>,
    /// Whether the last widget has just lost the focus: egui gives it to the first one a frame later, whatever
    /// else it is told in between.
    is_between: bool,
}

impl Hands {
    pub fn new(canvas: HtmlElement, start: HtmlElement, end: HtmlElement) -> Hands {
        Hands { canvas, start, end, focus: None, tab: None, is_between: false }
    }

    /// Listens to the mirror and to the canvas, for as long as the page lives.
    pub fn listen(&self, mirror: &Element, ctx: &Context) {
        let repaint = |ctx: &Context| {
            let ctx = ctx.clone();
            move |events: Vec<Event>| {
                WAITING.with_borrow_mut(|waiting| waiting.extend(events));
                ctx.request_repaint();
            }
        };
        let tell = repaint(ctx);
        listen(mirror, "click", move |event: web_sys::Event| {
            if let Some((element, node)) = target(&event) {
                let is_moved_in = ["textbox", "slider"].map(str::to_owned).contains(&role(&element));
                let focus = is_moved_in.then(|| request(node, Action::Focus, None));
                tell([request(node, Action::Click, None)].into_iter().chain(focus).collect());
            }
        });
        let tell = repaint(ctx);
        let canvas = self.canvas.clone();
        listen(mirror, "focusin", move |event: FocusEvent| {
            if let Some((_, node)) = target(&event) {
                tell(vec![request(node, Action::Focus, None)]);
                focus(&canvas);
            }
        });
        // The focus does not stay here: these are keys that a screen reader makes up, for a swipe up say.
        let tell = repaint(ctx);
        listen(mirror, "keydown", move |event: KeyboardEvent| {
            if let Some((element, node)) = target(&event)
                && let Some((action, data)) = action(&element, &event.key())
            {
                event.prevent_default();
                tell(vec![request(node, action, data)]);
            }
        });
        let tell = repaint(ctx);
        let ends = [(self.start.clone(), Modifiers::NONE), (self.end.clone(), Modifiers::SHIFT)];
        listen(&self.canvas, "focus", move |event: FocusEvent| {
            let from = event.related_target();
            let from = ends.iter().find(|(end, _)| from.as_ref() == Some(end.as_ref()));
            if let Some(&(_, modifiers)) = from {
                tell(vec![Event::Key { key: Key::Tab, physical_key: None, pressed: true, repeat: false, modifiers }]);
            }
        });
    }

    /// Gives egui what was done to the mirror.
    pub fn give(&mut self, ctx: &Context, input: &mut RawInput) {
        for event in &input.events {
            if let Event::Key { key, pressed: true, modifiers, .. } = event {
                self.tab = (*key == Key::Tab).then_some(modifiers.shift);
            }
        }
        if self.is_between {
            ctx.request_repaint();
        } else {
            input.events.append(&mut WAITING.take());
        }
    }

    /// Says where the focus is. `order`: the tree's nodes.
    pub fn follow(&mut self, ctx: &Context, update: &TreeUpdate, order: &[NodeId]) {
        let was_between = std::mem::take(&mut self.is_between);
        let place = |node: NodeId| order.iter().position(|other| *other == node);
        let is_root = update.tree.as_ref().is_some_and(|tree| tree.root == update.focus);
        let focused = (!is_root).then_some(update.focus);
        if focused == self.focus {
            return;
        }
        let before = self.focus.and_then(place);
        let now = focused.and_then(place);
        let has_gone_round = match (self.tab.take(), before) {
            (Some(false), Some(before)) => now.is_none_or(|now| now <= before),
            (Some(true), Some(before)) => now.is_some_and(|now| now >= before),
            _ => false,
        };
        let document = self.canvas.owner_document().expect("the canvas is in a document");
        let active = document.active_element();
        let is_at = |end: &HtmlElement| active.as_ref() == Some(end.as_ref());
        if has_gone_round {
            self.is_between = now.is_none();
            focus(if now < before { &self.end } else { &self.start });
        }
        if has_gone_round || was_between || is_at(&self.start) || is_at(&self.end) {
            // Nothing on the page has it until it comes back.
            ctx.memory_mut(|memory| memory.stop_text_input());
            ctx.request_repaint();
            self.focus = None;
        } else {
            self.focus = focused;
        }
        let _ = match self.focus {
            Some(node) => self.canvas.set_attribute("aria-activedescendant", &aria::element_id(node)),
            None => self.canvas.remove_attribute("aria-activedescendant"),
        };
        let Some(node) = self.focus else { return };
        // eframe's field for typing stands in for the widget that is typed in.
        let name = update.nodes.iter().find(|(id, _)| *id == node).and_then(|(_, node)| node.label());
        if let Some(field) = self.canvas.next_element_sibling() {
            let _ = field.set_attribute("aria-label", name.unwrap_or("Text"));
        }
        let response = ctx.memory(|memory| memory.focused()).and_then(|id| ctx.read_response(id));
        if response.is_some_and(|response| !response.interact_rect.contains_rect(response.rect)) {
            WAITING.with_borrow_mut(|waiting| waiting.push(request(node, Action::ScrollIntoView, None)));
            ctx.request_repaint();
        }
    }
}

fn listen<E: FromWasmAbi + 'static>(target: &Element, name: &str, heard: impl FnMut(E) + 'static) {
    let closure = Closure::<dyn FnMut(E)>::new(heard);
    // As long as the target lives.
    let _ = target.add_event_listener_with_callback(name, closure.into_js_value().unchecked_ref());
}

fn focus(element: &HtmlElement) {
    let options = FocusOptions::new();
    options.set_prevent_scroll(true);
    let _ = element.focus_with_options(&options);
}

/// The element that an event is about, and its node.
fn target(event: &web_sys::Event) -> Option<(Element, NodeId)> {
    let element: Element = event.target()?.dyn_into().ok()?;
    let node = aria::node_id(&element.id())?;
    Some((element, node))
}

fn role(element: &Element) -> String {
    element.get_attribute("role").unwrap_or_default()
}

fn request(target_node: NodeId, action: Action, data: Option<ActionData>) -> Event {
    Event::AccessKitActionRequest(ActionRequest { action, target_tree: TreeId::ROOT, target_node, data })
}

/// What a key does to an element.
fn action(element: &Element, key: &str) -> Option<(Action, Option<ActionData>)> {
    let bound = |name: &str| {
        let value = element.get_attribute(name)?.parse().ok()?;
        Some((Action::SetValue, Some(ActionData::NumericValue(value))))
    };
    match (role(element).as_str(), key) {
        ("slider" | "spinbutton", "ArrowUp" | "ArrowRight") => Some((Action::Increment, None)),
        ("slider" | "spinbutton", "ArrowDown" | "ArrowLeft") => Some((Action::Decrement, None)),
        ("slider" | "spinbutton", "Home") => bound("aria-valuemin"),
        ("slider" | "spinbutton", "End") => bound("aria-valuemax"),
        (_, "Enter" | " ") => Some((Action::Click, None)),
        _ => None,
    }
}
