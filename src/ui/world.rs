//! The world: walls, goal, size and slip, by pointer, finger or keyboard. What was drawn is trained in at once.

use egui::{
    ComboBox, DragValue, EventFilter, Key, Modifiers, Pos2, Rect, Response, RichText, Role, Sense, Shape, Slider,
    Stroke, StrokeKind, Ui, UiBuilder, Vec2, WidgetInfo, pos2, vec2,
};

use super::app::App;
use super::heatmap;
use super::numbers;
use super::panels::{self, Plan};
use super::theme::{self, GAP, NARROW, Palette};
use super::widgets::heading;
use crate::experiment::WORLDS;
use crate::mdp::{Cell, Grid, GridSpec};

/// What a stroke does.
#[derive(Clone, Copy, PartialEq)]
enum Stroking {
    Build,
    Clear,
    MoveGoal,
}

/// The tab.
#[derive(Default)]
pub struct WorldTab {
    /// The world as it is being drawn; between strokes it is that of the page.
    draft: Option<GridSpec>,
    stroke: Option<Stroking>,
    /// Where the stroke was last.
    last: Option<Cell>,
    /// The cell that the keyboard acts on.
    cursor: Cell,
    /// Worlds before the last edits, and the one that they led to.
    before: Vec<GridSpec>,
    known: Option<GridSpec>,
    /// Whether a control that is still held down has changed the world: all that it does is one edit.
    is_one_edit: bool,
    /// Why the last edit was not made, or not all of it.
    refusal: Option<String>,
}

/// Edits that can be taken back.
const MOST_UNDONE: usize = 100;

impl WorldTab {
    pub fn show(&mut self, ui: &mut Ui, app: &mut App) {
        heading(ui, 2, RichText::new("World").heading());
        let text = "Draw walls and take them away, drag the flag: the experts are trained anew in what you drew.";
        ui.label(RichText::new(text).color(Palette::of(ui).muted));
        // What was changed elsewhere cannot be undone here.
        if self.known.as_ref() != Some(&app.setup().grid) {
            self.before.clear();
            self.known = Some(app.setup().grid.clone());
            // Nor does a stroke go on that was begun on another world.
            (self.draft, self.stroke, self.last) = (None, None, None);
        }
        self.show_controls(ui, app);
        let is_narrow = ui.ctx().content_rect().width() < NARROW;
        let grid = self.draft.clone().unwrap_or_else(|| app.setup().grid.clone());
        let area = ui.available_rect_before_wrap();
        let screen = ui.ctx().content_rect().height();
        let room = match is_narrow {
            true => Vec2::splat(area.width()),
            false => vec2(0.46 * area.width(), (screen - area.top() - 60.0).max(260.0)),
        };
        let cell = (room.x / grid.cols as f32).min(room.y / grid.rows as f32).floor().max(4.0);
        let size = cell * vec2(grid.cols as f32, grid.rows as f32);
        let draw = |tab: &mut WorldTab, ui: &mut Ui, app: &mut App| {
            tab.show_board(ui, app, &grid, size);
            tab.show_refusal(ui);
        };
        if is_narrow {
            draw(self, ui, app);
            ui.add_space(GAP);
            show_panels(ui, app);
        } else {
            let (left, right) = area.split_left_right_at_x(area.left() + size.x.max(240.0) + 2.0 * GAP);
            ui.scope_builder(UiBuilder::new().max_rect(left), |ui| draw(self, ui, app));
            ui.scope_builder(UiBuilder::new().max_rect(right.with_max_y(area.top() + room.y)), |ui| {
                show_panels(ui, app)
            });
        }
    }

    /// Worlds on offer, size, slip, undo.
    fn show_controls(&mut self, ui: &mut Ui, app: &mut App) {
        let old = app.setup().grid.clone();
        let mut grid = old.clone();
        let is_narrow = ui.ctx().content_rect().width() < NARROW;
        ui.horizontal_wrapped(|ui| {
            let world = WORLDS.iter().find(|world| world.grid() == GridSpec { slip: 0.0, ..grid.clone() });
            let response = ComboBox::from_id_salt("world")
                .width(110.0)
                .height(theme::MENU)
                .selected_text(world.map_or("your own", |world| world.title))
                .show_ui(ui, |ui| {
                    for world in &WORLDS {
                        let is_chosen = world.grid() == app.setup().grid;
                        if ui.selectable_label(is_chosen, world.title).on_hover_text(world.summary).clicked() {
                            self.change(app, GridSpec { slip: grid.slip, ..world.grid() });
                        }
                    }
                })
                .response;
            response.accessible_name("World").on_hover_text("Worlds to begin with");
            for (label, name, side) in [("rows", "Rows", &mut grid.rows), ("columns", "Columns", &mut grid.cols)] {
                let drag = DragValue::new(side).range(Grid::MIN_SIDE..=Grid::MAX_SIDE).speed(0.1);
                ui.add(drag.update_while_editing(false)).accessible_name(name).on_hover_text("2 to 32 (paper: 10)");
                ui.label(RichText::new(label).small().color(Palette::of(ui).muted));
            }
            if is_narrow {
                ui.end_row();
            }
            ui.spacing_mut().slider_width = 90.0;
            let slip = Slider::new(&mut grid.slip, 0.0..=0.9)
                .step_by(0.05)
                .clamping(egui::SliderClamping::Never)
                .show_value(false);
            let tip = "ε: with this probability the move that is made is drawn from all five instead (paper: 0)";
            ui.add(slip).accessible_name("Slip").on_hover_text(tip);
            let drag = numbers::exact(&mut grid.slip).range(0.0..=1.0).speed(0.01);
            ui.add(drag).accessible_name("Slip").on_hover_text(tip);
            ui.label(RichText::new("slip").small().color(Palette::of(ui).muted));
            if is_narrow {
                ui.end_row();
            }
            if ui.add_enabled(!self.before.is_empty(), egui::Button::new("Undo")).clicked()
                && let Some(before) = self.before.pop()
            {
                self.refusal = app.change_world(before).err();
                self.known = Some(app.setup().grid.clone());
            }
            let has_walls = !app.setup().grid.walls.is_empty();
            if ui.add_enabled(has_walls, egui::Button::new("No walls")).clicked() {
                self.change(app, GridSpec { walls: Vec::new(), ..app.setup().grid.clone() });
            }
        });
        // What lies outside a smaller world goes; the flag comes along.
        let (rows, cols) = (grid.rows, grid.cols);
        grid.goal = (grid.goal.0.min(rows - 1), grid.goal.1.min(cols - 1));
        let goal = grid.goal;
        // Only what was changed here counts: a menu above may have changed the world already.
        grid.walls.retain(|&(row, col)| row < rows && col < cols && (row, col) != goal);
        let is_held = ui.input(|input| input.pointer.any_down());
        self.is_one_edit &= is_held;
        if grid != old && self.stroke.is_none() {
            self.change(app, grid);
            self.is_one_edit = is_held;
        }
    }

    /// Trains in another world, or says why not.
    pub fn change(&mut self, app: &mut App, grid: GridSpec) {
        let before = app.setup().grid.clone();
        if grid == before && app.setup().ensemble.is_none() {
            return;
        }
        self.refusal = app.change_world(grid).err().map(|error| format!("Not done: {error}."));
        if self.refusal.is_none() {
            if self.known.as_ref() != Some(&before) {
                self.before.clear();
            }
            self.known = Some(app.setup().grid.clone());
            if !self.is_one_edit {
                self.before.push(before);
            }
            if self.before.len() > MOST_UNDONE {
                self.before.remove(0);
            }
        }
    }

    fn show_board(&mut self, ui: &mut Ui, app: &mut App, grid: &GridSpec, size: Vec2) {
        let (rect, response) = ui.allocate_exact_size(size, Sense::click_and_drag());
        self.cursor = (self.cursor.0.min(grid.rows - 1), self.cursor.1.min(grid.cols - 1));
        let what = match self.cursor {
            cursor if cursor == grid.goal => "the goal",
            cursor if grid.walls.contains(&cursor) => "a wall",
            _ => "free",
        };
        let name = format!(
            "World: row {}, column {}, {what}. Arrows move, Enter puts a wall or takes it away, G puts the goal.",
            self.cursor.0, self.cursor.1
        );
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        paint(ui, rect, grid);
        if response.clicked() && response.interact_pointer_pos().is_none() {
            // By a screen reader, which has pointed at no cell: the keys choose one.
            response.request_focus();
        }
        if response.has_focus() {
            paint_cursor(ui, cell_rect(rect, grid, self.cursor));
            self.listen(ui, app, &response);
        }
        self.stroke_on(app, grid, rect, &response);
        if let Some(cell) = response.hover_pos().and_then(|at| cell_at(rect, grid, at)) {
            ui.painter().rect_stroke(
                cell_rect(rect, grid, cell),
                0.0,
                Stroke::new(2.0, Palette::of(ui).accent),
                StrokeKind::Inside,
            );
        }
    }

    /// What a pointer or finger does.
    fn stroke_on(&mut self, app: &mut App, grid: &GridSpec, rect: Rect, response: &Response) {
        if response.is_pointer_button_down_on() {
            // Where the pointer comes back to the board, the stroke goes on from there.
            let Some(cell) = response.interact_pointer_pos().and_then(|at| cell_at(rect, grid, at)) else {
                self.last = None;
                return;
            };
            if self.stroke.is_none() {
                self.refusal = None;
                self.stroke = Some(match cell {
                    cell if cell == grid.goal => Stroking::MoveGoal,
                    cell if grid.walls.contains(&cell) => Stroking::Clear,
                    _ => Stroking::Build,
                });
                self.cursor = cell;
            }
            if self.last != Some(cell) {
                let mut draft = grid.clone();
                for cell in between(self.last.unwrap_or(cell), cell) {
                    self.apply(&mut draft, cell);
                }
                self.last = Some(cell);
                self.draft = Some(draft);
            }
        } else if self.stroke.take().is_some() {
            self.last = None;
            let refusal = self.refusal.take();
            if let Some(draft) = self.draft.take() {
                self.change(app, draft);
            }
            self.refusal = self.refusal.take().or(refusal);
        }
    }

    /// What the keys do while the board has the focus.
    fn listen(&mut self, ui: &mut Ui, app: &mut App, response: &Response) {
        let filter = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, filter));
        let pressed = |key: Key| ui.input_mut(|input| input.consume_key(Modifiers::NONE, key));
        let grid = app.setup().grid.clone();
        let (row, col) = &mut self.cursor;
        if pressed(Key::ArrowUp) {
            *row = row.saturating_sub(1);
        }
        if pressed(Key::ArrowDown) {
            *row = (*row + 1).min(grid.rows - 1);
        }
        if pressed(Key::ArrowLeft) {
            *col = col.saturating_sub(1);
        }
        if pressed(Key::ArrowRight) {
            *col = (*col + 1).min(grid.cols - 1);
        }
        let toggles = pressed(Key::Enter) || pressed(Key::Space);
        let moves_goal = pressed(Key::G);
        if toggles || moves_goal {
            let is_wall = grid.walls.contains(&self.cursor);
            self.stroke = Some(match () {
                () if moves_goal => Stroking::MoveGoal,
                () if is_wall => Stroking::Clear,
                () => Stroking::Build,
            });
            self.refusal = None;
            let mut draft = grid;
            let cursor = self.cursor;
            self.apply(&mut draft, cursor);
            self.stroke = None;
            let refusal = self.refusal.take();
            self.change(app, draft);
            self.refusal = self.refusal.take().or(refusal);
        }
    }

    /// One cell of a stroke; what would spoil the world is left out and said.
    fn apply(&mut self, draft: &mut GridSpec, cell: Cell) {
        let mut next = draft.clone();
        match self.stroke {
            Some(Stroking::Build) if cell != draft.goal && !draft.walls.contains(&cell) => next.walls.push(cell),
            Some(Stroking::Build) if cell == draft.goal => {
                self.refusal = Some("The goal cannot be walled in: drag the flag elsewhere first.".to_owned());
                return;
            }
            Some(Stroking::Clear) => next.walls.retain(|wall| *wall != cell),
            Some(Stroking::MoveGoal) if draft.walls.contains(&cell) => {
                self.refusal = Some("The goal stands on a free cell: take the wall away first.".to_owned());
                return;
            }
            Some(Stroking::MoveGoal) => next.goal = cell,
            _ => return,
        }
        next.walls.sort_unstable();
        match Grid::new(next.clone()) {
            Ok(_) => *draft = next,
            // Taking walls away one by one may have to pass through worlds that are no good.
            Err(_) if self.stroke == Some(Stroking::Clear) => *draft = next,
            Err(error) => {
                let (row, col) = cell;
                let what = if self.stroke == Some(Stroking::Build) { "No wall" } else { "No goal" };
                self.refusal = Some(format!("{what} in row {row}, column {col}: {error}."));
            }
        }
    }

    fn show_refusal(&self, ui: &mut Ui) {
        let palette = Palette::of(ui);
        match &self.refusal {
            Some(sentence) => {
                let label = ui.label(RichText::new(sentence).color(palette.warning));
                ui.ctx().accesskit_node_builder(label.id, |node| node.set_role(Role::Alert));
            }
            None => {
                let text = "Press and drag: walls on free cells, free cells on walls, or the flag. By keyboard: arrows, Enter, G.";
                ui.label(RichText::new(text).small().color(palette.muted));
            }
        }
    }
}

/// What is being trained in it, beside the board.
fn show_panels(ui: &mut Ui, app: &mut App) {
    let Some(shown) = &app.shown else { return };
    let panels = panels::list(&shown.started, &shown.snapshot, &app.view);
    let area = ui.available_size();
    let is_narrow = ui.ctx().content_rect().width() < NARROW;
    let plan = if is_narrow {
        Plan::stacked(area.x, 2, shown.grid())
    } else {
        Plan::filling(ui, area, panels.len(), shown.grid())
    };
    heatmap::color_bar(ui, app.view.color_map);
    let touched = shown.show_panels(ui, &panels, &plan, &app.view, &mut app.pictures);
    app.touch(touched);
}

fn cell_rect(rect: Rect, grid: &GridSpec, (row, col): Cell) -> Rect {
    let cell = rect.size() / vec2(grid.cols as f32, grid.rows as f32);
    Rect::from_min_size(rect.min + cell * vec2(col as f32, row as f32), cell)
}

fn cell_at(rect: Rect, grid: &GridSpec, at: Pos2) -> Option<Cell> {
    let place = (at - rect.min) / rect.size();
    let (row, col) = (place.y * grid.rows as f32, place.x * grid.cols as f32);
    let is_inside = row >= 0.0 && col >= 0.0 && row < grid.rows as f32 && col < grid.cols as f32;
    is_inside.then_some((row as u32, col as u32))
}

/// The cells that a straight stroke passes, both ends included.
fn between((r0, c0): Cell, (r1, c1): Cell) -> Vec<Cell> {
    let steps = r0.abs_diff(r1).max(c0.abs_diff(c1)).max(1);
    let at = |from: u32, to: u32, step: u32| {
        let t = f64::from(step) / f64::from(steps);
        libm::round(f64::from(from) + t * (f64::from(to) - f64::from(from))) as u32
    };
    (0..=steps).map(|step| (at(r0, r1, step), at(c0, c1, step))).collect()
}

fn paint(ui: &Ui, rect: Rect, grid: &GridSpec) {
    let palette = Palette::of(ui);
    let painter = ui.painter();
    painter.rect_filled(rect, 0.0, palette.raised);
    let line = Stroke::new(1.0, palette.line);
    for row in 0..=grid.rows {
        painter.hline(rect.x_range(), egui::lerp(rect.y_range(), row as f32 / grid.rows as f32), line);
    }
    for col in 0..=grid.cols {
        painter.vline(egui::lerp(rect.x_range(), col as f32 / grid.cols as f32), rect.y_range(), line);
    }
    for &wall in &grid.walls {
        painter.rect_filled(cell_rect(rect, grid, wall), 0.0, palette.muted);
    }
    let goal = cell_rect(rect, grid, grid.goal);
    painter.rect_filled(goal, 0.0, palette.accent);
    painter.extend(heatmap::flag(goal, palette.on_accent));
    painter.rect_stroke(rect, 0.0, Stroke::new(1.0, palette.edge), StrokeKind::Outside);
}

fn paint_cursor(ui: &Ui, cell: Rect) {
    let palette = Palette::of(ui);
    ui.painter().rect_stroke(cell, 0.0, Stroke::new(3.0, palette.ink), StrokeKind::Inside);
    let dot = cell.center();
    ui.painter().add(Shape::circle_filled(pos2(dot.x, dot.y), 2.0, palette.ink));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_stroke_leaves_no_gap() {
        let cells = between((0, 0), (3, 7));
        assert_eq!((cells[0], cells[cells.len() - 1]), ((0, 0), (3, 7)));
        assert!(cells.windows(2).all(|pair| pair[0].0.abs_diff(pair[1].0) <= 1 && pair[0].1.abs_diff(pair[1].1) <= 1));
        assert_eq!(between((2, 2), (2, 2)), [(2, 2), (2, 2)]);
    }

    #[test]
    fn a_wall_that_cuts_off_is_left_out() {
        let mut tab = WorldTab { stroke: Some(Stroking::Build), ..WorldTab::default() };
        let mut draft = GridSpec { rows: 2, cols: 3, ..GridSpec::default() };
        tab.apply(&mut draft, (0, 1));
        assert_eq!((draft.walls.len(), &tab.refusal), (1, &None));
        tab.apply(&mut draft, (1, 1));
        assert_eq!(draft.walls, [(0, 1)]);
        assert!(
            tab.refusal.as_ref().unwrap().contains("row 1, column 1: cell (row 0, column 2) cannot reach the goal")
        );
        tab.apply(&mut draft, (0, 0));
        assert!(tab.refusal.as_ref().unwrap().contains("cannot be walled in"));
        tab.stroke = Some(Stroking::MoveGoal);
        tab.apply(&mut draft, (1, 2));
        assert_eq!(draft.goal, (1, 2));
    }
}
