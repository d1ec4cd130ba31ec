//! The worlds on offer: grids drawn as text, a line of [`WORLDS`] each.

use crate::mdp::{Cell, GridSpec};

/// A grid with a name.
pub struct World {
    /// As in tests.
    pub name: &'static str,
    pub title: &'static str,
    pub summary: &'static str,
    /// A line a row: `#` a wall, `G` the goal, `.` free.
    map: &'static str,
}

/// Every world; the first is the paper's.
pub static WORLDS: [World; 5] = [
    World {
        name: "paper",
        title: "Paper",
        summary: "10 × 10 cells, no walls, the goal in a corner: room for many ways, and so for experts to differ.",
        map: "G.........
              ..........
              ..........
              ..........
              ..........
              ..........
              ..........
              ..........
              ..........
              ..........",
    },
    World {
        name: "corridor",
        title: "Corridor",
        summary: "One way to the goal. Experts can only waste steps together: there is nothing to hide behind.",
        map: "................
              ###############.
              ................
              .###############
              ...............G",
    },
    World {
        name: "four-rooms",
        title: "Four rooms",
        summary: "Four rooms and four doors. The doors are where the experts must meet and the clone gets its way back.",
        map: ".....#.....
              .....#.....
              ...........
              .....#.....
              .....#.....
              #.####.....
              .....###.##
              .....#.....
              .....#.....
              ...........
              .....#....G",
    },
    World {
        name: "maze",
        title: "Maze",
        summary: "A maze with a single path from each cell. All that differs is how long one stands still.",
        map: "G#.......#.
              .#.###.#.#.
              .#...#.#...
              .###.#.####
              ...#.#.....
              ##.#.#####.
              ...#.....#.
              .#######.#.
              .#.......#.
              .#.#######.
              .....#.....",
    },
    World {
        name: "bridge",
        title: "Bridge",
        summary: "Two fields and a bridge of one cell. Only on the far side is there room to disagree, and on the near side.",
        map: "....###....
              ....###....
              ....###....
              ...........
              ....###....
              ....###....
              ....###...G",
    },
];

impl World {
    /// The grid that is drawn, without slip.
    pub fn grid(&self) -> GridSpec {
        let rows: Vec<&str> = self.map.lines().map(str::trim).collect();
        let mut grid = GridSpec { rows: rows.len() as u32, cols: rows[0].len() as u32, ..GridSpec::default() };
        for (row, line) in rows.iter().enumerate() {
            for (col, sign) in line.chars().enumerate() {
                let cell: Cell = (row as u32, col as u32);
                match sign {
                    '#' => grid.walls.push(cell),
                    'G' => grid.goal = cell,
                    _ => {}
                }
            }
        }
        grid
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mdp::Grid;

    #[test]
    fn every_world_is_a_grid() {
        for world in &WORLDS {
            let lines: Vec<&str> = world.map.lines().map(str::trim).collect();
            assert!(lines.iter().all(|line| line.len() == lines[0].len()), "{}", world.name);
            assert_eq!(world.map.matches('G').count(), 1, "{}", world.name);
            let grid = Grid::new(world.grid());
            assert!(grid.is_ok(), "{}: {:?}", world.name, grid.err());
        }
        assert_eq!(WORLDS[0].grid(), GridSpec::default());
        // In the maze no two ways lead to the goal: a tree has one edge less than cells.
        let maze = Grid::new(WORLDS[3].grid()).unwrap();
        let cells = (0..maze.cells()).filter(|&cell| !maze.is_wall(cell));
        let edges =
            cells.map(|cell| maze.next(cell).iter().filter(|&&next| next as usize > cell).count()).sum::<usize>();
        assert_eq!(edges, maze.free_cells() - 1);
    }
}
