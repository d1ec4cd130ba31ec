//! The mirror: the page's widgets as unseen elements over the canvas, with role, name and value.
//!
//! eframe throws egui's accessibility tree away in a browser. This plugin takes it and keeps one element a
//! widget under `#mirror`, where it lies on the screen, for assistive technology and for tests. What is done to
//! the elements comes back through [`super::hands`].

use std::cell::RefCell;

use egui::accesskit::{Live, Node, NodeId, Role, TreeUpdate};
use egui::{Context, FullOutput, Plugin, RawInput};
use fnv::{FnvHashMap as HashMap, FnvHashSet as HashSet};
use wasm_bindgen::JsCast as _;
use web_sys::{Element, HtmlElement};

use super::aria::{self, Kind, Relations, Said};
use super::hands::Hands;

thread_local! {
    /// Elements cannot be sent between threads, as plugins must be: they live here, on the page's only one.
    static MIRROR: RefCell<Option<(Elements, Hands)>> = const { RefCell::new(None) };
}

/// The elements of the last frame.
struct Elements {
    parent: Element,
    shown: HashMap<NodeId, Shown>,
    /// What each container holds, in order; `None` is the mirror itself.
    children: HashMap<Option<NodeId>, Vec<NodeId>>,
    announcer: Announcer,
}

/// An element, and what it was made of: as long as that stays, it is not touched.
struct Shown {
    element: Element,
    kind: Kind,
    node: Node,
    relations: Relations,
    zoom: f32,
    said: Said,
}

/// The live region: speaks what comes to rest, at most once a second.
struct Announcer {
    element: Element,
    /// What is live on the page, each with its words.
    live: Vec<(NodeId, String)>,
    /// What is still to be said.
    waiting: Vec<(NodeId, String)>,
    /// When it last spoke, in seconds.
    spoke: f64,
}

/// The plugin.
pub struct Mirror(());

impl Mirror {
    /// `parent`: the empty element that will hold the mirror; `announcer`: the live region.
    pub fn new(parent: Element, announcer: Element, hands: Hands) -> Mirror {
        let announcer =
            Announcer { element: announcer, live: Vec::new(), waiting: Vec::new(), spoke: f64::NEG_INFINITY };
        let elements = Elements { parent, shown: HashMap::default(), children: HashMap::default(), announcer };
        MIRROR.set(Some((elements, hands)));
        Mirror(())
    }
}

impl Plugin for Mirror {
    fn debug_name(&self) -> &'static str {
        "mirror"
    }

    fn setup(&mut self, ctx: &Context) {
        ctx.enable_accesskit();
        MIRROR.with_borrow_mut(|mirror| {
            if let Some((elements, hands)) = mirror {
                hands.listen(&elements.parent, ctx);
            }
        });
    }

    fn input_hook(&mut self, ctx: &Context, input: &mut RawInput) {
        MIRROR.with_borrow_mut(|mirror| {
            if let Some((_, hands)) = mirror {
                hands.give(ctx, input);
            }
        });
    }

    fn output_hook(&mut self, ctx: &Context, output: &mut FullOutput) {
        let Some(update) = output.platform_output.accesskit_update.take() else { return };
        MIRROR.with_borrow_mut(|mirror| {
            if let Some((elements, hands)) = mirror {
                let order = elements.show(&update, ctx);
                hands.follow(ctx, &update, &order);
            }
        });
    }
}

impl Elements {
    /// Makes the document say what the tree says; what has not changed is not touched. Returns the tree's nodes, in
    /// order.
    fn show(&mut self, update: &TreeUpdate, ctx: &Context) -> Vec<NodeId> {
        let zoom = ctx.zoom_factor();
        let nodes: HashMap<NodeId, &Node> = update.nodes.iter().map(|(id, node)| (*id, node)).collect();
        let root = update.tree.as_ref().map_or(update.focus, |tree| tree.root);
        let mut order = Vec::with_capacity(nodes.len());
        let mut children = HashMap::from_iter([(None, Vec::new())]);
        let mut owners = HashMap::default();
        let mut live = Vec::new();
        let mut stack = vec![(root, None)];
        while let Some((id, mut parent)) = stack.pop() {
            let Some(&node) = nodes.get(&id) else { continue };
            let popup = if node.role() == Role::ComboBox { list_below(node, &nodes) } else { None };
            owners.extend(popup.map(|popup| (popup, id)));
            let named_by = node.labelled_by().iter().chain(owners.get(&id));
            let names: Vec<&str> = named_by.filter_map(|id| nodes.get(id)).map(|node| name(node)).collect();
            let relations = Relations { has_focus: id == update.focus, named_by: names.join(" "), popup };
            order.push(id);
            if let Some(kind) = aria::kind(node, &relations) {
                children.entry(parent).or_insert_with(Vec::new).push(id);
                if matches!(kind, Kind::Container(_)) {
                    parent = Some(id);
                    children.entry(parent).or_default();
                }
                if node.live() == Some(Live::Polite) {
                    live.push((id, aria::text(node).to_owned()));
                }
                self.show_node(id, kind, node, relations, zoom);
            }
            stack.extend(node.children().iter().rev().map(|child| (*child, parent)));
        }
        if children != self.children {
            self.arrange(children);
        }
        self.announcer.hear(live, ctx);
        order
    }

    fn show_node(&mut self, id: NodeId, kind: Kind, node: &Node, relations: Relations, zoom: f32) {
        let old = self.shown.get(&id);
        if old.is_some_and(|old| old.node == *node && old.relations == relations && old.zoom == zoom) {
            return;
        }
        // Text and children do not mix: what becomes a container, or ceases to be one, is a new element.
        let is_container = |kind| matches!(kind, Kind::Container(_));
        let old = self.shown.remove(&id).filter(|old| {
            let stays = is_container(old.kind) == is_container(kind);
            if !stays {
                old.element.remove();
                self.children.clear();
            }
            stays
        });
        let said = aria::said(id, kind, node, &relations, zoom);
        let (element, old) = old.map_or_else(
            || {
                let document = self.parent.owner_document().expect("the mirror is in a document");
                (document.create_element("div").expect("div is a valid name"), Said::default())
            },
            |old| (old.element, old.said),
        );
        for (name, _) in &old.attributes {
            if said.attributes.iter().all(|(new, _)| new != name) {
                let _ = element.remove_attribute(name);
            }
        }
        for attribute in &said.attributes {
            if !old.attributes.contains(attribute) {
                match attribute {
                    // The page's policy allows no style that is given as text, as HTML would (index.html).
                    ("style", style) => element.unchecked_ref::<HtmlElement>().style().set_css_text(style),
                    (name, value) => element.set_attribute(name, value).unwrap_or_default(),
                }
            }
        }
        if old.text != said.text {
            element.set_text_content(Some(&said.text));
        }
        self.shown.insert(id, Shown { element, kind, node: node.clone(), relations, zoom, said });
    }

    /// Puts every element where it belongs; those that are there already stay.
    fn arrange(&mut self, children: HashMap<Option<NodeId>, Vec<NodeId>>) {
        let stay: HashSet<_> = children.values().flatten().copied().collect();
        self.shown.retain(|id, shown| {
            let stays = stay.contains(id);
            if !stays {
                shown.element.remove();
            }
            stays
        });
        #[expect(clippy::iter_over_hash_type, reason = "each container is arranged by itself")]
        for (container, inside) in &children {
            if self.children.get(container) == Some(inside) {
                continue;
            }
            let parent = container.map_or(&self.parent, |id| &self.shown[&id].element);
            let mut next = parent.first_element_child();
            for id in inside {
                let element = &self.shown[id].element;
                if next.as_ref() == Some(element) {
                    next = element.next_element_sibling();
                } else {
                    let _ = parent.insert_before(element, next.as_deref());
                }
            }
        }
        self.children = children;
    }
}

impl Announcer {
    /// Takes in what is live now, in the order of the page; what is new among it is said, the latest of each node.
    fn hear(&mut self, live: Vec<(NodeId, String)>, ctx: &Context) {
        for new in live.iter().filter(|new| !self.live.contains(new)) {
            self.waiting.retain(|(waiting, _)| *waiting != new.0);
            self.waiting.push(new.clone());
        }
        self.waiting.retain(|(waiting, _)| live.iter().any(|(id, _)| id == waiting));
        self.live = live;
        if self.waiting.is_empty() {
            return;
        }
        let now = ctx.input(|input| input.time);
        if now - self.spoke >= 1.0 {
            let words: Vec<String> = self.waiting.drain(..).map(|(_, words)| words).collect();
            self.element.set_text_content(Some(&words.join(" ")));
            self.spoke = now;
        } else {
            ctx.request_repaint_after_secs((1.0 - (now - self.spoke)) as f32);
        }
    }
}

fn name(node: &Node) -> &str {
    node.label().or(node.value()).unwrap_or_default()
}

/// The list that a combobox has opened.
fn list_below(node: &Node, nodes: &HashMap<NodeId, &Node>) -> Option<NodeId> {
    let mut below = node.children().to_vec();
    while let Some(id) = below.pop() {
        let Some(node) = nodes.get(&id) else { continue };
        if node.role() == Role::ListBox {
            return Some(id);
        }
        below.extend(node.children());
    }
    None
}
