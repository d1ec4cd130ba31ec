//! One policy on one grid: the colour of a cell is its capped hitting time, arrows are the policy.
//!
//! A picture is tessellated once and kept until what it shows or where it stands changes.

use std::collections::HashMap;
use std::sync::Arc;

use egui::emath::GuiRounding as _;
use egui::epaint::{Mesh, Tessellator};
use egui::{
    Color32, EventFilter, Id, Pos2, Rect, Response, Role, Sense, Shape, Stroke, StrokeKind, TextureId, Ui, Vec2,
    WidgetInfo, pos2, vec2,
};

use super::arrows::Pen;
use super::theme::Palette;
use crate::lab::PolicyView;
use crate::mdp::Grid;
use crate::picture::COLOR_MAPS;

/// Pictures of the last frame, by panel.
#[derive(Default)]
pub struct Pictures {
    kept: HashMap<Id, (Key, Arc<Mesh>)>,
    pen: Option<Pen>,
}

/// All that a picture depends on besides the policy; `version` stands for that.
#[derive(Clone, Copy, PartialEq)]
struct Key {
    version: u64,
    rect: Rect,
    is_dark: bool,
    color_map: usize,
    pixels_per_point: f32,
}

/// What one heatmap shows.
pub struct Heatmap<'a> {
    /// Its own among all on the page.
    pub id: Id,
    /// Its accessible name.
    pub name: &'a str,
    pub grid: &'a Grid,
    pub policy: &'a PolicyView,
    /// Changes whenever the policy does.
    pub version: u64,
    /// The cell marked in every panel.
    pub marked: Option<usize>,
    /// Cells with a reward of their own, r̃: it is written there.
    pub rewards: &'a [(usize, f64)],
    /// Place in [`COLOR_MAPS`].
    pub color_map: usize,
}

impl Pictures {
    /// Forgets those of panels that are gone.
    pub fn keep_only(&mut self, panels: &[Id]) {
        self.kept.retain(|id, _| panels.contains(id));
    }
}

impl Heatmap<'_> {
    /// Draws into `rect`; returns the cell under the pointer, or that which arrow keys move to.
    pub fn show(self, ui: &mut Ui, rect: Rect, pictures: &mut Pictures) -> Option<usize> {
        let response = ui.interact(rect, self.id, Sense::click());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, self.name));
        let cell = rect.size() / vec2(self.grid.cols() as f32, self.grid.rows() as f32);
        let pixels_per_point = ui.ctx().pixels_per_point();
        let Heatmap { version, color_map, .. } = self;
        let key = Key { version, rect, is_dark: ui.visuals().dark_mode, color_map, pixels_per_point };
        let picture = match pictures.kept.remove(&response.id) {
            Some((old, mesh)) if old == key => mesh,
            before => {
                // The buffers of the picture before serve again.
                let mut mesh = before.and_then(|(_, mesh)| Arc::into_inner(mesh)).unwrap_or_default();
                let pen = pictures.pen.get_or_insert_with(|| Pen::new(ui.ctx()));
                mesh.clear();
                mesh.texture_id = TextureId::default();
                self.tessellate(ui, rect, cell, pen, &mut mesh);
                mesh.texture_id = pen.texture();
                Arc::new(mesh)
            }
        };
        pictures.kept.insert(response.id, (key, picture.clone()));
        ui.painter().add(Shape::Mesh(picture));
        for &(state, reward) in self.rewards.iter().filter(|(state, _)| *state < self.grid.cells()) {
            let place = self.cell_rect(rect, cell, state);
            // What the experts lure the clone to is light, what they keep it from is dark.
            let color = if reward < 0.0 { Color32::WHITE } else { Color32::BLACK };
            ui.painter().rect_stroke(place.shrink(1.0), 0.0, Stroke::new(2.0, color), StrokeKind::Inside);
        }
        if let Some(state) = self.marked.filter(|&state| state < self.grid.cells()) {
            let mark = self.cell_rect(rect, cell, state);
            ui.painter().rect_stroke(mark, 2.0, Stroke::new(4.0, Color32::BLACK), StrokeKind::Outside);
            ui.painter().rect_stroke(mark, 2.0, Stroke::new(2.0, Color32::WHITE), StrokeKind::Outside);
        }
        let pointed = response.hover_pos().or(response.interact_pointer_pos()).filter(|at| rect.contains(*at));
        self.cell_by_key(ui, &response).or(pointed.map(|at| {
            let place = (at - rect.min) / cell;
            let row = (place.y as usize).min(self.grid.rows() - 1);
            let col = (place.x as usize).min(self.grid.cols() - 1);
            row * self.grid.cols() + col
        }))
    }

    fn cell_by_key(&self, ui: &Ui, response: &Response) -> Option<usize> {
        if !response.has_focus() {
            return None;
        }
        let arrows = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
        let presses = |key| ui.input(|input| input.num_presses(key));
        let [up, down, left, right] =
            [egui::Key::ArrowUp, egui::Key::ArrowDown, egui::Key::ArrowLeft, egui::Key::ArrowRight].map(presses);
        let (row, col) = self.grid.cell(self.marked.filter(|&state| state < self.grid.cells()).unwrap_or(0));
        let row = (row as usize + down).min(self.grid.rows() - 1).saturating_sub(up);
        let col = (col as usize + right).min(self.grid.cols() - 1).saturating_sub(left);
        (up + down + left + right > 0).then_some(row * self.grid.cols() + col)
    }

    fn cell_rect(&self, rect: Rect, cell: Vec2, state: usize) -> Rect {
        let (row, col) = self.grid.cell(state);
        Rect::from_min_size(rect.min + cell * vec2(col as f32, row as f32), cell)
    }

    fn tessellate(&self, ui: &Ui, rect: Rect, cell: Vec2, pen: &Pen, mesh: &mut Mesh) {
        let palette = Palette::of(ui);
        let options = ui.ctx().tessellation_options(|options| *options);
        let pixels_per_point = ui.ctx().pixels_per_point();
        let font_size = ui.ctx().fonts(|fonts| fonts.font_image_size());
        let mut tessellator = Tessellator::new(pixels_per_point, options, font_size, vec![]);
        let colors = &COLOR_MAPS[self.color_map];
        // What lies below, or what the colours have for it, shows between cells as a thin line, where there is room for one.
        if let Some(lines) = colors.lines {
            mesh.add_colored_rect(rect.round_to_pixels(pixels_per_point), rgb(lines));
        }
        let gap = if cell.x >= 12.0 { 0.5 } else { 0.0 };
        for state in 0..self.grid.cells() {
            let place = self.cell_rect(rect, cell, state).shrink(gap).round_to_pixels(pixels_per_point);
            if self.grid.is_wall(state) {
                mesh.add_colored_rect(place, palette.wall);
                // Struck through: no colour map may take a wall for a cell.
                let across = [place.left_bottom(), place.right_top()];
                let stroke = Stroke::new((0.05 * cell.x).max(0.7), palette.muted);
                tessellator.tessellate_line_segment(across, stroke, mesh);
                continue;
            }
            let color = colors.of_steps(f64::from(self.policy.hitting_time[state]));
            mesh.add_colored_rect(place, rgb(color));
            let ink = rgb(colors.ink_on(color));
            if state == self.grid.goal() {
                flag(place, ink).into_iter().for_each(|shape| tessellator.tessellate_shape(shape, mesh));
            } else {
                pen.arrows(mesh, place, &self.policy.policy[state], ink, pixels_per_point);
            }
        }
    }
}

/// The goal: a flag.
pub fn flag(cell: Rect, ink: Color32) -> Vec<Shape> {
    let at = |x: f32, y: f32| -> Pos2 { pos2(egui::lerp(cell.x_range(), x), egui::lerp(cell.y_range(), y)) };
    let pole = Stroke::new((cell.width() * 0.08).max(1.0), ink);
    vec![
        Shape::line_segment([at(0.32, 0.84), at(0.32, 0.16)], pole),
        Shape::convex_polygon(vec![at(0.34, 0.16), at(0.8, 0.34), at(0.34, 0.54)], ink, Stroke::NONE),
    ]
}

fn rgb([r, g, b]: [u8; 3]) -> Color32 {
    Color32::from_rgb(r, g, b)
}

/// The scale of the heatmaps' colours, with its ends and what it measures. `color_map`: place in [`COLOR_MAPS`].
pub fn color_bar(ui: &mut Ui, color_map: usize) {
    let palette = Palette::of(ui);
    let text = |ui: &mut Ui, words: &str| {
        ui.label(egui::RichText::new(words).small().color(palette.muted));
    };
    ui.horizontal(|ui| {
        ui.spacing_mut().item_spacing.x = 6.0;
        text(ui, "Return from a cell, capped:");
        text(ui, "−100");
        // There is room for what stands behind it.
        let width = (ui.available_width() - 54.0).clamp(40.0, 110.0);
        let (rect, _) = ui.allocate_exact_size(vec2(width, 10.0), Sense::hover());
        let mut mesh = Mesh::default();
        const STOPS: u32 = 24;
        for i in 0..=STOPS {
            let t = i as f32 / STOPS as f32;
            let x = egui::lerp(rect.x_range(), t);
            let color = rgb((COLOR_MAPS[color_map].color)(f64::from(t)));
            mesh.colored_vertex(pos2(x, rect.top()), color);
            mesh.colored_vertex(pos2(x, rect.bottom()), color);
            if i > 0 {
                let first = 2 * i - 2;
                mesh.add_triangle(first, first + 1, first + 2);
                mesh.add_triangle(first + 1, first + 2, first + 3);
            }
        }
        ui.painter().add(Shape::mesh(mesh));
        text(ui, "0 steps");
    });
}
