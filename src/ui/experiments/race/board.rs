//! The board of the race: the grid, the start, which can be moved, and the racers with their trails.

use egui::{
    Color32, CursorIcon, EventFilter, Key, Modifiers, Pos2, Rect, Role, Sense, Shape, Stroke, StrokeKind, Ui, Vec2,
    WidgetInfo, pos2, vec2,
};

use crate::experiment::Racer;
use crate::mdp::{Action, Grid};
use crate::ui::heatmap;
use crate::ui::theme::Palette;

/// What the board shows.
pub struct Board<'a> {
    pub grid: &'a Grid,
    /// The cell where the next race starts.
    pub start: usize,
    /// Cells of every racer, in the order of [`Racer`]; empty before the first race.
    pub paths: [&'a [u32]; 3],
    /// Steps since the start; between two whole numbers a racer is between two cells.
    pub step: f64,
}

/// A racer's colour.
pub fn color(racer: Racer, palette: &Palette) -> Color32 {
    match racer {
        Racer::Expert => palette.accent,
        Racer::Clone => palette.clone,
        Racer::Optimal => palette.ink,
    }
}

/// A racer's token: a circle, a diamond or a square, with an edge that sets it off.
pub fn token(racer: Racer, at: Pos2, radius: f32, palette: &Palette) -> Shape {
    let (fill, edge) = (color(racer, palette), Stroke::new((radius * 0.2).max(1.0), palette.card));
    let polygon = |corners: [Vec2; 4], radius: f32| {
        Shape::convex_polygon(corners.map(|corner| at + corner * radius).to_vec(), fill, edge)
    };
    match racer {
        Racer::Expert => {
            Shape::Vec(vec![Shape::circle_filled(at, radius, fill), Shape::circle_stroke(at, radius, edge)])
        }
        Racer::Clone => polygon([vec2(0.0, -1.0), vec2(1.0, 0.0), vec2(0.0, 1.0), vec2(-1.0, 0.0)], radius * 1.2),
        Racer::Optimal => polygon([vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(1.0, 1.0), vec2(-1.0, 1.0)], radius * 0.85),
    }
}

impl Board<'_> {
    /// Draws the board of this size; returns the cell to start from, when another one was chosen.
    pub fn show(&self, ui: &mut Ui, size: Vec2) -> Option<usize> {
        let (rect, response) = ui.allocate_exact_size(size, Sense::click());
        let (row, col) = self.grid.cell(self.start);
        let name = format!(
            "Race board, {} rows and {} columns: start in row {row}, column {col}. Arrow keys move it",
            self.grid.rows(),
            self.grid.cols()
        );
        response.widget_info(|| WidgetInfo::labeled(Role::Button, true, &name));
        let cell = rect.size() / vec2(self.grid.cols() as f32, self.grid.rows() as f32);
        let pointed = response.hover_pos().or(response.interact_pointer_pos()).filter(|at| rect.contains(*at));
        let pointed = pointed.map(|at| {
            let place = (at - rect.min) / cell;
            let row = (place.y as usize).min(self.grid.rows() - 1);
            row * self.grid.cols() + (place.x as usize).min(self.grid.cols() - 1)
        });
        let pointed = pointed.filter(|&state| self.is_free(state));
        if pointed.is_some() {
            ui.ctx().set_cursor_icon(CursorIcon::PointingHand);
        }
        self.paint(ui, rect, cell, pointed.filter(|_| response.hovered()));
        if response.clicked() {
            response.request_focus();
            // A screen reader has pointed at no cell: the keys choose one.
            if pointed.is_some() {
                return pointed;
            }
        }
        if !response.has_focus() {
            return None;
        }
        let arrows = EventFilter { horizontal_arrows: true, vertical_arrows: true, ..Default::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
        let keys = [Key::ArrowUp, Key::ArrowDown, Key::ArrowLeft, Key::ArrowRight];
        let pressed = |key: Key| ui.input_mut(|input| input.count_and_consume_key(Modifiers::NONE, key));
        let mut start = self.start;
        for (key, action) in keys.into_iter().zip(Action::ALL) {
            for _ in 0..pressed(key) {
                start = self.beside(start, action);
            }
        }
        (start != self.start).then_some(start)
    }

    fn is_free(&self, state: usize) -> bool {
        state != self.grid.goal() && !self.grid.is_wall(state)
    }

    /// The next cell in a direction where a race can start, over walls and goal; the same where there is none.
    fn beside(&self, state: usize, action: Action) -> usize {
        let (down, right) = action.direction();
        let (mut row, mut col) = self.grid.cell(state);
        loop {
            let ahead = (row.checked_add_signed(down), col.checked_add_signed(right));
            let (Some(r), Some(c)) = ahead else { return state };
            if r as usize >= self.grid.rows() || c as usize >= self.grid.cols() {
                return state;
            }
            (row, col) = (r, c);
            let next = r as usize * self.grid.cols() + c as usize;
            if self.is_free(next) {
                return next;
            }
        }
    }

    fn paint(&self, ui: &Ui, rect: Rect, cell: Vec2, pointed: Option<usize>) {
        let palette = Palette::of(ui);
        let painter = ui.painter_at(rect.expand(1.0));
        let place = |state: usize| {
            let (row, col) = self.grid.cell(state);
            Rect::from_min_size(rect.min + cell * vec2(col as f32, row as f32), cell)
        };
        painter.rect_filled(rect, 0.0, palette.line);
        for state in 0..self.grid.cells() {
            let fill = match state {
                _ if self.grid.is_wall(state) => palette.wall,
                _ if state == self.grid.goal() => palette.card.lerp_to_gamma(palette.warning, 0.15),
                _ if pointed == Some(state) => palette.raised,
                _ => palette.card,
            };
            painter.rect_filled(place(state).shrink(0.5), 0.0, fill);
        }
        painter.extend(heatmap::flag(place(self.grid.goal()), palette.warning));
        let start = place(self.start).shrink(1.0);
        painter.rect_filled(start, 3.0, palette.raised);
        painter.rect_stroke(start, 3.0, Stroke::new(2.0, palette.muted), StrokeKind::Inside);
        painter.rect_stroke(rect, 0.0, Stroke::new(1.0, palette.edge), StrokeKind::Outside);
        let side = cell.min_elem();
        // The clone, which has most to wander, is on top.
        let order = [Racer::Optimal, Racer::Expert, Racer::Clone];
        let center = |racer: Racer, state: usize| place(state).center() + offset(racer) * side;
        for racer in order {
            let width = (side * 0.07).clamp(1.5, 4.0);
            let color = color(racer, palette);
            let mut trail = self.trail(racer);
            trail.sort_by_key(|(.., age)| std::cmp::Reverse(*age));
            for (a, b, age) in trail {
                // Mixed, not transparent: where two pieces meet nothing shines through.
                let stroke = Stroke::new(width, palette.card.lerp_to_gamma(color, faded(age)));
                painter.line_segment([center(racer, a), center(racer, b)], stroke);
            }
        }
        for racer in order {
            let (from, to, part) = self.at(racer);
            let (from, to) = (center(racer, from), center(racer, to));
            let on_the_way = (to - from) * part;
            if part > 0.0 {
                painter.line_segment([from, from + on_the_way], Stroke::new(2.0, color(racer, palette)));
            }
            painter.add(token(racer, from + on_the_way, (side * 0.2).max(3.5), palette));
        }
    }

    /// The last cell a racer was in, the one it goes to, and how much of the way it has gone.
    fn at(&self, racer: Racer) -> (usize, usize, f32) {
        let path = self.paths[racer as usize];
        let Some(last) = path.len().checked_sub(1) else { return (self.start, self.start, 0.0) };
        let done = self.step as usize;
        if done >= last {
            return (path[last] as usize, path[last] as usize, 0.0);
        }
        (path[done] as usize, path[done + 1] as usize, self.step.fract() as f32)
    }

    /// The ways between neighbours that a racer has gone, each once, with the steps since it last went there.
    fn trail(&self, racer: Racer) -> Vec<(usize, usize, u32)> {
        const NEVER: u32 = u32::MAX;
        let path = self.paths[racer as usize];
        let done = (self.step as usize + 1).min(path.len());
        // To the right of each cell, and below it.
        let mut last = vec![[NEVER; 2]; self.grid.cells()];
        for (t, pair) in path[..done].windows(2).enumerate() {
            let (low, high) = (pair[0].min(pair[1]) as usize, pair[0].max(pair[1]) as usize);
            if low != high {
                last[low][usize::from(high - low == self.grid.cols())] = t as u32;
            }
        }
        let cols = self.grid.cols();
        let ways =
            last.into_iter().enumerate().flat_map(|(s, [right, below])| [(s, s + 1, right), (s, s + cols, below)]);
        let gone = ways.filter(|(.., t)| *t != NEVER);
        gone.map(|(a, b, t)| (a, b, done.saturating_sub(2) as u32 - t)).collect()
    }
}

/// How far a racer's trail runs beside the middle of the cells, in cells: so that those on the same way are all seen.
fn offset(racer: Racer) -> Vec2 {
    match racer {
        Racer::Expert => vec2(-0.17, -0.17),
        Racer::Clone => Vec2::ZERO,
        Racer::Optimal => vec2(0.17, 0.17),
    }
}

/// How strong a trail is after so many steps.
fn faded(age: u32) -> f32 {
    (1.0 - age as f32 / 40.0).max(0.3)
}

/// The size of a board of this width, no higher than `height`.
pub fn size(grid: &Grid, width: f32, height: f32) -> Vec2 {
    let aspect = grid.cols() as f32 / grid.rows() as f32;
    let width = width.min(height * aspect).max(120.0).floor();
    pos2(width, (width / aspect).floor()).to_vec2()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::GridSpec;

    #[test]
    fn the_start_moves_over_walls_and_goal() {
        let spec = GridSpec { rows: 2, cols: 5, goal: (0, 2), walls: vec![(0, 1), (0, 4)], slip: 0.0 };
        let grid = Grid::new(spec).unwrap();
        let board = Board { grid: &grid, start: 0, paths: [&[]; 3], step: 0.0 };
        let beside = |state, action| board.beside(state, action);
        assert_eq!((beside(0, Action::Right), beside(3, Action::Left)), (3, 0));
        // Nothing but a wall is there.
        assert_eq!((beside(3, Action::Right), beside(0, Action::Up), beside(9, Action::Down)), (3, 0, 9));
        assert_eq!((beside(0, Action::Down), beside(6, Action::Up)), (5, 6));
    }

    #[test]
    fn a_way_gone_twice_is_drawn_once_and_as_young_as_the_last_time() {
        let grid = Grid::new(GridSpec { rows: 2, cols: 3, ..GridSpec::default() }).unwrap();
        let path = [5, 4, 5, 5, 2, 1, 0];
        let board = |step| Board { grid: &grid, start: 5, paths: [&path, &[], &[]], step };
        assert_eq!(board(0.9).trail(Racer::Expert), vec![]);
        assert_eq!(board(1.0).trail(Racer::Expert), vec![(4, 5, 0)]);
        assert_eq!(board(4.5).trail(Racer::Expert), vec![(2, 5, 0), (4, 5, 2)]);
        assert_eq!(board(99.0).trail(Racer::Expert).len(), 4);
        assert_eq!((board(99.0).at(Racer::Expert), board(4.5).at(Racer::Expert)), ((0, 0, 0.0), (2, 1, 0.5)));
        assert_eq!(board(99.0).trail(Racer::Clone), vec![]);
    }
}
