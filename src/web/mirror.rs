//! The mirror: the page's widgets as transparent elements over the canvas, with role, name and value.
//!
//! eframe throws egui's accessibility tree away in a browser. This plugin takes it and keeps one element a
//! widget under `#mirror`, where it lies on the screen, for assistive technology and for tests.

use std::cell::RefCell;
use std::collections::HashMap;

use egui::accesskit::{Node, NodeId, Role, Toggled, TreeUpdate};
use egui::{Context, FullOutput, Plugin};
use web_sys::Element;

thread_local! {
    /// Elements cannot be sent between threads, as plugins must be: they live here, on the page's only one.
    static MIRROR: RefCell<Option<Elements>> = const { RefCell::new(None) };
}

struct Elements {
    parent: Element,
    /// The elements of the last frame, by widget.
    shown: HashMap<NodeId, (Element, Mirrored)>,
    /// Their order in the document.
    order: Vec<NodeId>,
}

/// What is said of one widget: attributes, text and place.
#[derive(Clone, Default, PartialEq)]
struct Mirrored {
    attributes: Vec<(&'static str, String)>,
    text: String,
    style: String,
}

/// The plugin.
pub struct Mirror(());

impl Mirror {
    /// `parent`: the empty element that will hold the mirror.
    pub fn new(parent: Element) -> Mirror {
        MIRROR.set(Some(Elements { parent, shown: HashMap::new(), order: Vec::new() }));
        Mirror(())
    }
}

impl Plugin for Mirror {
    fn debug_name(&self) -> &'static str {
        "mirror"
    }

    fn setup(&mut self, ctx: &Context) {
        ctx.enable_accesskit();
    }

    fn output_hook(&mut self, ctx: &Context, output: &mut FullOutput) {
        let Some(update) = &output.platform_output.accesskit_update else { return };
        let zoom = ctx.zoom_factor();
        MIRROR.with_borrow_mut(|elements| {
            if let Some(elements) = elements {
                elements.show(update, zoom);
            }
        });
    }
}

impl Elements {
    /// Makes the document say what the tree says; what has not changed is not touched.
    fn show(&mut self, update: &TreeUpdate, zoom: f32) {
        let nodes: HashMap<NodeId, &Node> = update.nodes.iter().map(|(id, node)| (*id, node)).collect();
        let root = update.tree.as_ref().map_or(update.focus, |tree| tree.root);
        let mut order = Vec::with_capacity(nodes.len());
        let mut stack = vec![root];
        while let Some(id) = stack.pop() {
            let Some(node) = nodes.get(&id) else { continue };
            stack.extend(node.children().iter().rev());
            if let Some(mirrored) = mirrored(node, &nodes, zoom) {
                order.push(id);
                self.show_widget(id, mirrored, id == update.focus);
            }
        }
        if order != self.order {
            let stay: std::collections::HashSet<_> = order.iter().copied().collect();
            self.shown.retain(|id, (element, _)| {
                let stays = stay.contains(id);
                if !stays {
                    element.remove();
                }
                stays
            });
            for id in &order {
                // Appending what is there already moves it to the end: all of them in order.
                let _ = self.parent.append_child(&self.shown[id].0);
            }
            self.order = order;
        }
    }

    fn show_widget(&mut self, id: NodeId, mut mirrored: Mirrored, has_focus: bool) {
        if has_focus {
            mirrored.attributes.push(("data-focus", "true".to_owned()));
        }
        let (element, old) = self.shown.entry(id).or_insert_with(|| {
            let document = self.parent.owner_document().expect("the mirror is in a document");
            let element = document.create_element("div").expect("div is a valid name");
            (element, Mirrored::default())
        });
        if *old == mirrored {
            return;
        }
        for (name, _) in &old.attributes {
            if mirrored.attributes.iter().all(|(new, _)| new != name) {
                let _ = element.remove_attribute(name);
            }
        }
        for (name, value) in &mirrored.attributes {
            let _ = element.set_attribute(name, value);
        }
        if old.text != mirrored.text {
            element.set_text_content(Some(&mirrored.text));
        }
        if old.style != mirrored.style {
            let _ = element.set_attribute("style", &mirrored.style);
        }
        *old = mirrored;
    }
}

/// The ARIA role of a widget; `None` for what only groups or decorates.
fn aria(role: Role) -> Option<&'static str> {
    Some(match role {
        Role::Label => "",
        Role::Button | Role::DefaultButton => "button",
        Role::CheckBox => "checkbox",
        Role::RadioButton => "radio",
        Role::Slider => "slider",
        Role::SpinButton => "spinbutton",
        Role::ComboBox => "combobox",
        Role::TextInput | Role::MultilineTextInput => "textbox",
        Role::Link => "link",
        Role::Image => "img",
        Role::ProgressIndicator => "progressbar",
        Role::Status => "status",
        Role::Alert => "alert",
        Role::ListBoxOption => "option",
        _ => return None,
    })
}

fn mirrored(node: &Node, nodes: &HashMap<NodeId, &Node>, zoom: f32) -> Option<Mirrored> {
    let role = aria(node.role()).filter(|_| !node.is_hidden())?;
    let bounds = node.bounds()?;
    let mut attributes = Vec::new();
    let mut put = |name, value: String| attributes.push((name, value));
    if !role.is_empty() {
        put("role", role.to_owned());
    }
    let named_by = node.labelled_by().iter().filter_map(|id| nodes.get(id)?.value()).collect::<Vec<_>>().join(" ");
    let label = node.label().map(str::to_owned).filter(|label| !label.is_empty()).unwrap_or(named_by);
    let value = node.value().unwrap_or_default();
    let text = match node.role() {
        Role::Label | Role::Status | Role::Alert => [&label, value].into_iter().find(|t| !t.is_empty())?.to_owned(),
        Role::ComboBox | Role::TextInput | Role::MultilineTextInput => value.to_owned(),
        _ => String::new(),
    };
    if !label.is_empty() && node.role() != Role::Label {
        put("aria-label", label);
    }
    if let Some(now) = node.numeric_value() {
        put("aria-valuenow", now.to_string());
        if !value.is_empty() {
            put("aria-valuetext", value.to_owned());
        }
    }
    if let Some(low) = node.min_numeric_value().filter(|low| low.is_finite()) {
        put("aria-valuemin", low.to_string());
    }
    if let Some(high) = node.max_numeric_value().filter(|high| high.is_finite()) {
        put("aria-valuemax", high.to_string());
    }
    if let Some(toggled) = node.toggled() {
        let name = if matches!(role, "checkbox" | "radio") { "aria-checked" } else { "aria-pressed" };
        put(name, (toggled == Toggled::True).to_string());
    }
    if node.is_disabled() {
        put("aria-disabled", "true".to_owned());
    }
    let zoom = f64::from(zoom);
    let style = format!(
        "left:{:.0}px;top:{:.0}px;width:{:.0}px;height:{:.0}px",
        bounds.x0 * zoom,
        bounds.y0 * zoom,
        (bounds.x1 - bounds.x0) * zoom,
        (bounds.y1 - bounds.y0) * zoom
    );
    Some(Mirrored { attributes, text, style })
}
