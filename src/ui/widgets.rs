//! Small pieces that several parts of the page use.

use egui::{
    Align2, Color32, Painter, Rect, Response, Role, Sense, Shape, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2,
};

use super::theme::{self, Palette};

/// The signs on icon buttons, drawn as shapes: no font has to have them.
#[derive(Clone, Copy, PartialEq)]
pub enum Icon {
    Play,
    Pause,
    Step,
    Reset,
    Help,
    Add,
    Remove,
    Dice,
    Earlier,
    Later,
    Pin,
    Link,
    Save,
    Settings,
    Search,
    Table,
}

impl Icon {
    fn paint(self, painter: &Painter, rect: Rect, color: Color32) {
        let c = rect.center();
        let r = rect.height() * 0.24;
        let stroke = Stroke::new(r * 0.32, color);
        let triangle = |x0: f32, x1: f32| {
            let points = vec![pos2(x0, c.y - r), pos2(x1, c.y), pos2(x0, c.y + r)];
            painter.add(Shape::convex_polygon(points, color, Stroke::NONE));
        };
        let bar = |x: f32| {
            painter.rect_filled(Rect::from_center_size(pos2(x, c.y), vec2(r * 0.5, r * 2.0)), 1.0, color);
        };
        let arc = |from: f32, to: f32, radius: f32| {
            let point = |i: i32| {
                let angle = egui::lerp(from..=to, i as f32 / 20.0);
                c + radius * egui::Vec2::angled(angle)
            };
            painter.add(Shape::line((0..=20).map(point).collect(), stroke));
            point(20)
        };
        let text = |text: &str| {
            let font = egui::FontId::new(r * 2.4, theme::semibold());
            painter.text(c, Align2::CENTER_CENTER, text, font, color);
        };
        match self {
            Icon::Play => triangle(c.x - r * 0.7, c.x + r),
            Icon::Pause => {
                bar(c.x - r * 0.5);
                bar(c.x + r * 0.5);
            }
            Icon::Step => {
                triangle(c.x - r, c.x + r * 0.5);
                bar(c.x + r * 0.8);
            }
            Icon::Reset => {
                let tip = arc(-0.9, 4.2, r);
                let points =
                    vec![tip + vec2(-r * 0.65, r * 0.1), tip + vec2(r * 0.5, r * 0.45), tip + vec2(r * 0.1, -r * 0.7)];
                painter.add(Shape::convex_polygon(points, color, Stroke::NONE));
            }
            Icon::Later => {
                painter.add(Shape::line(
                    vec![pos2(c.x - r * 0.4, c.y - r), pos2(c.x + r * 0.6, c.y), pos2(c.x - r * 0.4, c.y + r)],
                    stroke,
                ));
            }
            Icon::Earlier => {
                painter.add(Shape::line(
                    vec![pos2(c.x + r * 0.4, c.y - r), pos2(c.x - r * 0.6, c.y), pos2(c.x + r * 0.4, c.y + r)],
                    stroke,
                ));
            }
            Icon::Pin => {
                painter.circle_filled(c - vec2(0.0, r * 0.45), r * 0.62, color);
                painter.line_segment([c, c + vec2(0.0, r * 1.15)], stroke);
            }
            Icon::Link => {
                let to = c + vec2(r * 0.75, -r * 0.7);
                for at in [c - vec2(r * 0.75, 0.0), to, c + vec2(r * 0.75, r * 0.7)] {
                    painter.line_segment([c - vec2(r * 0.75, 0.0), at], stroke);
                    painter.circle_filled(at, r * 0.36, color);
                }
            }
            Icon::Save => {
                painter.line_segment([c - vec2(0.0, r), c + vec2(0.0, r * 0.3)], stroke);
                let tip = c + vec2(0.0, r * 0.5);
                painter
                    .add(Shape::line(vec![tip + vec2(-r * 0.6, -r * 0.6), tip, tip + vec2(r * 0.6, -r * 0.6)], stroke));
                painter.line_segment([c + vec2(-r, r), c + vec2(r, r)], stroke);
            }
            Icon::Settings => {
                for (row, at) in [(-0.7, 0.4), (0.0, -0.4), (0.7, 0.1)] {
                    painter.line_segment([c + vec2(-r, r * row), c + vec2(r, r * row)], stroke);
                    painter.circle_filled(c + vec2(r * at, r * row), r * 0.32, color);
                }
            }
            Icon::Search => {
                let middle = c - vec2(r * 0.2, r * 0.2);
                painter.circle_stroke(middle, r * 0.68, stroke);
                painter.line_segment([middle + vec2(r * 0.5, r * 0.5), c + vec2(r, r)], stroke);
            }
            Icon::Table => {
                let frame = Rect::from_center_size(c, vec2(r, r * 0.85) * 2.0);
                painter.rect_stroke(frame, 1.0, stroke, StrokeKind::Middle);
                painter.line_segment([pos2(frame.left(), c.y - r * 0.25), pos2(frame.right(), c.y - r * 0.25)], stroke);
                painter.line_segment([pos2(c.x - r * 0.25, frame.top()), pos2(c.x - r * 0.25, frame.bottom())], stroke);
            }
            Icon::Help => text("?"),
            Icon::Add => text("+"),
            Icon::Remove => text("×"),
            Icon::Dice => {
                let square = Rect::from_center_size(c, vec2(r, r) * 2.0);
                painter.rect_stroke(square, r * 0.4, stroke, StrokeKind::Middle);
                for at in [vec2(-0.4, -0.4), vec2(0.4, 0.4), vec2(0.0, 0.0)] {
                    painter.circle_filled(c + at * r, r * 0.2, color);
                }
            }
        }
    }
}

/// A square button with an icon; `name` is its accessible name and its tooltip.
pub fn icon_button(ui: &mut Ui, icon: Icon, name: &str, is_main: bool) -> Response {
    let (rect, response) = ui.allocate_exact_size(theme::icon_size(ui), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), name));
    let palette = Palette::of(ui);
    let visuals = ui.style().interact(&response);
    let (fill, ink) =
        if is_main { (palette.accent, palette.on_accent) } else { (visuals.weak_bg_fill, visuals.fg_stroke.color) };
    ui.painter().rect(rect, visuals.corner_radius, fill, visuals.bg_stroke, StrokeKind::Inside);
    icon.paint(ui.painter(), rect, ink);
    response.on_hover_text(name)
}

/// A heading above a group of controls.
pub fn section(ui: &mut Ui, title: &str) {
    ui.add_space(4.0);
    heading(ui, 2, egui::RichText::new(title).text_style(theme::strong()));
}

/// Text that assistive technology can jump to. The page itself is level 1, its parts are level 2.
pub fn heading(ui: &mut Ui, level: usize, text: egui::RichText) {
    let response = ui.label(text);
    ui.ctx().accesskit_node_builder(response.id, |node| {
        node.set_role(Role::Heading);
        node.set_level(level);
    });
}

/// Says that `ui` is a dialog over the page, and what it is called.
pub fn dialog(ui: &Ui, name: &str) {
    ui.ctx().accesskit_node_builder(ui.unique_id(), |node| {
        node.set_role(Role::Dialog);
        node.set_label(name);
        node.set_modal();
    });
}

/// A row of words of which one is chosen.
pub fn choose<T: PartialEq + Copy>(ui: &mut Ui, name: &str, chosen: &mut T, options: &[(T, &str, &str)]) {
    ui.horizontal(|ui| choose_wrapped(ui, name, chosen, options));
}

/// The same among what stands in a line already.
pub fn choose_wrapped<T: PartialEq + Copy>(ui: &mut Ui, name: &str, chosen: &mut T, options: &[(T, &str, &str)]) {
    ui.scope(|ui| {
        ui.spacing_mut().item_spacing.x = 2.0;
        ui.spacing_mut().button_padding.x = 9.0;
        for &(value, label, help) in options {
            let is_chosen = *chosen == value;
            let response = ui.add(egui::Button::selectable(is_chosen, label).frame_when_inactive(true));
            response
                .widget_info(|| WidgetInfo::selected(Role::RadioButton, true, is_chosen, format!("{name}: {label}")));
            if response.on_hover_text(help).clicked() {
                *chosen = value;
            }
        }
    });
}

/// A label whose words for assistive technology say more than its looks do.
pub fn spoken(ui: &mut Ui, text: egui::RichText, spoken: &str) -> Response {
    let response = ui.add(egui::Label::new(text).extend());
    let id = response.id;
    ui.ctx().accesskit_node_builder(id, |node| node.set_value(spoken));
    response
}
