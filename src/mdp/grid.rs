//! The gridworld: which cells there are, which is the goal, and where an action leads.

use serde::{Deserialize, Serialize};

use super::ACTIONS;

/// A move of the agent, in the order in which policies list their probabilities.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Action {
    Up,
    Down,
    Left,
    Right,
    Stay,
}

impl Action {
    pub const ALL: [Action; ACTIONS] = [Action::Up, Action::Down, Action::Left, Action::Right, Action::Stay];

    pub fn name(self) -> &'static str {
        ["Up", "Down", "Left", "Right", "Stay"][self as usize]
    }

    /// Change of row and column.
    pub fn direction(self) -> (i32, i32) {
        [(-1, 0), (1, 0), (0, -1), (0, 1), (0, 0)][self as usize]
    }
}

/// A cell as (row, column), row 0 on top.
pub type Cell = (u32, u32);

/// A grid as it is written in files and messages; [`Grid::new`] checks it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GridSpec {
    pub rows: u32,
    pub cols: u32,
    pub goal: Cell,
    #[serde(default)]
    pub walls: Vec<Cell>,
    /// Probability that the executed action is drawn uniformly instead.
    #[serde(default)]
    pub slip: f64,
}

impl Default for GridSpec {
    /// The paper's grid: 10 × 10, goal in the top left corner, no walls, no slip.
    fn default() -> Self {
        GridSpec { rows: 10, cols: 10, goal: (0, 0), walls: Vec::new(), slip: 0.0 }
    }
}

/// Why a grid is refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GridError {
    #[error(
        "a grid of {rows} × {cols} cells: rows and columns must each be from {} to {}",
        Grid::MIN_SIDE,
        Grid::MAX_SIDE
    )]
    Size { rows: u32, cols: u32 },
    #[error("{0} walls: must be at most {most}, one for each cell of the largest grid", most = Grid::MOST_WALLS)]
    Walls(usize),
    #[error("slip {0:?}: must be at least 0 and below 1")]
    Slip(f64),
    #[error("goal (row {}, column {}) lies outside the grid of {rows} × {cols} cells", .goal.0, .goal.1)]
    GoalOutside { goal: Cell, rows: u32, cols: u32 },
    #[error("wall (row {}, column {}) lies outside the grid of {rows} × {cols} cells", .wall.0, .wall.1)]
    WallOutside { wall: Cell, rows: u32, cols: u32 },
    #[error("goal (row {}, column {}) is a wall", .0.0, .0.1)]
    GoalIsWall(Cell),
    #[error("no free cell besides the goal: an episode has nowhere to start")]
    NoStart,
    #[error("cell (row {}, column {}) cannot reach the goal: walls cut it off", .0.0, .0.1)]
    Unreachable(Cell),
}

/// A valid gridworld. States are `row * cols + col`; walls are not states, though they have a number.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    spec: GridSpec,
    goal: usize,
    is_wall: Vec<bool>,
    /// Free cells that are not the goal, ascending: where episodes start.
    starts: Vec<u32>,
    /// `[S][5]`: the cell an executed action leads to.
    next: Vec<[u32; ACTIONS]>,
}

impl Grid {
    pub const MIN_SIDE: u32 = 2;
    pub const MAX_SIDE: u32 = 32;
    /// Most walls in a list, those that stand there twice included.
    pub const MOST_WALLS: usize = (Self::MAX_SIDE * Self::MAX_SIDE) as usize;

    /// Checks a grid: sizes, places, slip, and that every free cell can reach the goal.
    pub fn new(spec: GridSpec) -> Result<Grid, GridError> {
        let GridSpec { rows, cols, goal, .. } = spec;
        let sides = Self::MIN_SIDE..=Self::MAX_SIDE;
        if !sides.contains(&rows) || !sides.contains(&cols) {
            return Err(GridError::Size { rows, cols });
        }
        if spec.walls.len() > Self::MOST_WALLS {
            return Err(GridError::Walls(spec.walls.len()));
        }
        if !(0.0..1.0).contains(&spec.slip) {
            return Err(GridError::Slip(spec.slip));
        }
        let inside = |(row, col): Cell| row < rows && col < cols;
        if !inside(goal) {
            return Err(GridError::GoalOutside { goal, rows, cols });
        }
        let state = |(row, col): Cell| (row * cols + col) as usize;
        let mut is_wall = vec![false; (rows * cols) as usize];
        for &wall in &spec.walls {
            if !inside(wall) {
                return Err(GridError::WallOutside { wall, rows, cols });
            }
            is_wall[state(wall)] = true;
        }
        if is_wall[state(goal)] {
            return Err(GridError::GoalIsWall(goal));
        }
        let lead = |cell: usize, action: Action| {
            let (down, right) = action.direction();
            let row = (cell as u32 / cols).checked_add_signed(down);
            let col = (cell as u32 % cols).checked_add_signed(right);
            match (row, col) {
                (Some(row), Some(col)) if inside((row, col)) && !is_wall[state((row, col))] => row * cols + col,
                _ => cell as u32,
            }
        };
        let next: Vec<[u32; ACTIONS]> =
            (0..is_wall.len()).map(|cell| Action::ALL.map(|action| lead(cell, action))).collect();
        let goal = state(goal);
        let starts: Vec<u32> =
            (0..is_wall.len()).filter(|&cell| !is_wall[cell] && cell != goal).map(|cell| cell as u32).collect();
        if starts.is_empty() {
            return Err(GridError::NoStart);
        }
        let grid = Grid { spec, goal, is_wall, starts, next };
        let distance = grid.distances();
        match grid.starts.iter().find(|&&cell| distance[cell as usize] == u32::MAX) {
            Some(&cell) => Err(GridError::Unreachable(grid.cell(cell as usize))),
            None => Ok(grid),
        }
    }

    pub fn spec(&self) -> &GridSpec {
        &self.spec
    }

    pub fn rows(&self) -> usize {
        self.spec.rows as usize
    }

    pub fn cols(&self) -> usize {
        self.spec.cols as usize
    }

    /// Number of cells S, walls and goal included: the length of every per-state table.
    pub fn cells(&self) -> usize {
        self.is_wall.len()
    }

    pub fn goal(&self) -> usize {
        self.goal
    }

    pub fn slip(&self) -> f64 {
        self.spec.slip
    }

    pub fn is_wall(&self, cell: usize) -> bool {
        self.is_wall[cell]
    }

    pub fn cell(&self, state: usize) -> Cell {
        (state as u32 / self.spec.cols, state as u32 % self.spec.cols)
    }

    /// Free cells that are not the goal, ascending: where episodes start, each as likely as the others.
    pub fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Number of free cells, the goal included: what the returns are averaged over.
    pub fn free_cells(&self) -> usize {
        self.starts.len() + 1
    }

    /// Where each executed action leads from `cell`.
    pub fn next(&self, cell: usize) -> &[u32; ACTIONS] {
        &self.next[cell]
    }

    /// Probability that each action is executed when an agent means to act by `row`: slip mixed in.
    pub fn executed(&self, row: &[f64; ACTIONS]) -> [f64; ACTIONS] {
        let slip = self.slip();
        row.map(|p| (1.0 - slip) * p + slip / ACTIONS as f64)
    }

    /// Steps to the goal along a shortest path, ignoring slip; `u32::MAX` for walls and cut-off cells.
    pub fn distances(&self) -> Vec<u32> {
        let mut distance = vec![u32::MAX; self.cells()];
        distance[self.goal] = 0;
        let mut queue = vec![self.goal];
        let mut head = 0;
        while let Some(&cell) = queue.get(head) {
            head += 1;
            // Moves are symmetric: where an action leads from here, its opposite leads back.
            for &next in &self.next[cell] {
                if distance[next as usize] == u32::MAX {
                    distance[next as usize] = distance[cell] + 1;
                    queue.push(next as usize);
                }
            }
        }
        distance
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_move_into_a_wall_or_border_stays() {
        let grid = Grid::new(GridSpec { rows: 2, cols: 3, goal: (0, 0), walls: vec![(1, 1)], slip: 0.0 }).unwrap();
        assert_eq!(grid.next(0), &[0, 3, 0, 1, 0]);
        assert_eq!(grid.next(1), &[1, 1, 0, 2, 1]);
        assert_eq!(grid.starts(), &[1, 2, 3, 5]);
    }

    #[test]
    fn every_bad_grid_is_named() {
        let paper = GridSpec::default;
        let refused = |spec| Grid::new(spec).unwrap_err();
        assert_eq!(refused(GridSpec { rows: 1, ..paper() }), GridError::Size { rows: 1, cols: 10 });
        assert_eq!(refused(GridSpec { cols: 33, ..paper() }), GridError::Size { rows: 10, cols: 33 });
        assert_eq!(refused(GridSpec { slip: 1.0, ..paper() }), GridError::Slip(1.0));
        assert!(matches!(refused(GridSpec { slip: f64::NAN, ..paper() }), GridError::Slip(_)));
        assert!(matches!(refused(GridSpec { goal: (10, 0), ..paper() }), GridError::GoalOutside { .. }));
        assert!(matches!(refused(GridSpec { walls: vec![(0, 10)], ..paper() }), GridError::WallOutside { .. }));
        assert_eq!(refused(GridSpec { walls: vec![(0, 0)], ..paper() }), GridError::GoalIsWall((0, 0)));
        assert_eq!(refused(GridSpec { walls: vec![(1, 1); 1025], ..paper() }), GridError::Walls(1025));
        let corner = vec![(8, 9), (9, 8)];
        assert_eq!(refused(GridSpec { walls: corner, ..paper() }), GridError::Unreachable((9, 9)));
        let walled_in = vec![(0, 1), (1, 0), (1, 1)];
        assert_eq!(refused(GridSpec { rows: 2, cols: 2, walls: walled_in, ..paper() }), GridError::NoStart);
        assert!(refused(GridSpec { slip: 1.5, ..paper() }).to_string().contains("slip 1.5"));
    }
}
