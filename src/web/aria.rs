//! What a widget is called in a document: role, states, words and place of a node of egui's accessibility tree.

use egui::accesskit::{Action, Node, NodeId, Role, SortDirection, Toggled};

/// What is said of one widget: attributes and text.
#[derive(Default)]
pub struct Said {
    pub attributes: Vec<(&'static str, String)>,
    pub text: String,
}

/// What a node says only together with others.
#[derive(Default, PartialEq)]
pub struct Relations {
    pub has_focus: bool,
    /// The name that other nodes give it.
    pub named_by: String,
    /// The list that a combobox has opened.
    pub popup: Option<NodeId>,
}

/// The id of a node's element.
pub fn element_id(id: NodeId) -> String {
    format!("w{:x}", id.0)
}

/// The node of an element's id.
pub fn node_id(element_id: &str) -> Option<NodeId> {
    u64::from_str_radix(element_id.strip_prefix('w')?, 16).ok().map(NodeId)
}

/// What of the tree is shown: leaves lie where their widget lies, containers only hold what is in them.
#[derive(Clone, Copy, PartialEq)]
pub enum Kind {
    Leaf(&'static str),
    Container(&'static str),
}

/// Role and kind of a node's element; `None` for what only groups or decorates.
pub fn kind(node: &Node, relations: &Relations) -> Option<Kind> {
    let container = match node.role() {
        Role::Table => "table",
        Role::Row => "row",
        Role::Cell => "cell",
        Role::ColumnHeader => "columnheader",
        Role::RowHeader => "rowheader",
        // Every popup of egui's is a dialog; those that say so have a name.
        Role::Dialog if node.label().is_some() => "dialog",
        // What a combobox opens: its lines are buttons among which Tab moves.
        Role::ListBox if !relations.named_by.is_empty() => "dialog",
        _ => "",
    };
    if !container.is_empty() {
        return Some(Kind::Container(container));
    }
    let leaf = match node.role() {
        Role::Label => "",
        Role::Heading => "heading",
        Role::Button | Role::DefaultButton | Role::DisclosureTriangle => "button",
        Role::CheckBox => "checkbox",
        Role::RadioButton => "radio",
        Role::Slider => "slider",
        Role::SpinButton => "spinbutton",
        Role::ComboBox => "combobox",
        Role::TextInput | Role::MultilineTextInput => "textbox",
        Role::Link => "link",
        Role::Image => "img",
        Role::Figure => "figure",
        Role::ProgressIndicator => "progressbar",
        Role::Status => "status",
        Role::Alert => "alert",
        _ => return None,
    };
    let is_empty = text(node).is_empty() && matches!(leaf, "" | "heading" | "status" | "alert");
    (node.bounds().is_some() && !node.is_hidden() && !is_empty).then_some(Kind::Leaf(leaf))
}

/// The words on the page of what is read rather than used.
pub fn text(node: &Node) -> &str {
    let value = node.value().unwrap_or_default();
    match node.role() {
        Role::Label | Role::Heading | Role::Status | Role::Alert => {
            node.label().filter(|label| !label.is_empty()).unwrap_or(value)
        }
        Role::ComboBox | Role::TextInput | Role::MultilineTextInput => value,
        _ => "",
    }
}

/// All that is said of a node. `zoom`: CSS pixels to a point of egui's.
pub fn said(id: NodeId, kind: Kind, node: &Node, relations: &Relations, zoom: f32) -> Said {
    let mut attributes = vec![("id", element_id(id))];
    let mut put = |name, value: String| attributes.push((name, value));
    let (Kind::Leaf(role) | Kind::Container(role)) = kind;
    if !role.is_empty() {
        put("role", role.to_owned());
    }
    let text = text(node).to_owned();
    let is_read = matches!(role, "" | "heading" | "status" | "alert");
    let label = node.label().filter(|label| !label.is_empty()).unwrap_or(&relations.named_by);
    if !label.is_empty() && !is_read {
        put("aria-label", label.to_owned());
    }
    // ARIA forbids it where there is no role.
    if let Some(description) = node.description().filter(|description| *description != label && !role.is_empty()) {
        put("aria-description", description.to_owned());
    }
    match role {
        "heading" => put("aria-level", node.level().unwrap_or(2).to_string()),
        // The announcer speaks for it, when there is something to say.
        "status" => put("aria-live", "off".to_owned()),
        "combobox" => {
            put("aria-haspopup", "dialog".to_owned());
            put("aria-expanded", relations.popup.is_some().to_string());
        }
        "checkbox" | "radio" => put("aria-checked", (node.toggled() == Some(Toggled::True)).to_string()),
        "button" => {
            if let Some(toggled) = node.toggled() {
                put("aria-pressed", (toggled == Toggled::True).to_string());
            }
            if let Some(is_expanded) = node.is_expanded() {
                put("aria-expanded", is_expanded.to_string());
            }
        }
        "columnheader" => match node.sort_direction() {
            Some(SortDirection::Ascending) => put("aria-sort", "ascending".to_owned()),
            Some(SortDirection::Descending) => put("aria-sort", "descending".to_owned()),
            _ => {}
        },
        _ => {}
    }
    if let Some(popup) = relations.popup {
        put("aria-controls", element_id(popup));
    }
    if node.is_modal() {
        put("aria-modal", "true".to_owned());
    }
    if let Some(now) = node.numeric_value() {
        put("aria-valuenow", now.to_string());
        if let Some(value) = node.value().filter(|value| !value.is_empty()) {
            put("aria-valuetext", value.to_owned());
        }
    }
    for (name, bound) in [("aria-valuemin", node.min_numeric_value()), ("aria-valuemax", node.max_numeric_value())] {
        if let Some(bound) = bound.filter(|bound| bound.is_finite()) {
            put(name, bound.to_string());
        }
    }
    if node.is_disabled() {
        put("aria-disabled", "true".to_owned());
    } else if node.supports_action(Action::Focus) && !is_read {
        put("tabindex", "-1".to_owned());
    }
    if relations.has_focus {
        put("data-focus", "true".to_owned());
    }
    if let (Kind::Leaf(_), Some(bounds)) = (kind, node.bounds()) {
        let zoom = f64::from(zoom);
        put(
            "style",
            format!(
                "left:{:.0}px;top:{:.0}px;width:{:.0}px;height:{:.0}px",
                bounds.x0 * zoom,
                bounds.y0 * zoom,
                (bounds.x1 - bounds.x0) * zoom,
                (bounds.y1 - bounds.y0) * zoom
            ),
        );
    }
    Said { attributes, text }
}
