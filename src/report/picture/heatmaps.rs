//! Policies as heat maps, as on the page.

use std::collections::BTreeMap;

use super::{BOLD, QUIET, document, hex, list, n, path, text};
use crate::mdp::{ACTIONS, Action, CAP, Grid, Policy};

const MARGIN: f64 = 16.0;

/// One heat map.
pub struct Panel<'a> {
    pub title: String,
    pub subtitle: String,
    pub policy: &'a Policy,
    /// Expected steps to the goal, `[S]`.
    pub steps: &'a [f64],
}

/// Heat maps side by side, three a row. The colour of a cell is its steps to the goal, cut at 100; the length
/// of an arrow is the probability of its move, the radius of a dot that of Stay.
pub fn heatmaps(grid: &Grid, panels: &[Panel]) -> String {
    const SIDE: f64 = 240.0;
    const GAP: f64 = 24.0;
    const PER_ROW: usize = 3;
    let cell = SIDE / grid.rows().max(grid.cols()) as f64;
    let head = if panels.iter().all(|panel| panel.subtitle.is_empty()) { 18.0 } else { 34.0 };
    let pitch = head + grid.rows() as f64 * cell + GAP;
    let mut body = String::new();
    for (i, panel) in panels.iter().enumerate() {
        let x = MARGIN + (i % PER_ROW) as f64 * (SIDE + GAP);
        let y = MARGIN + (i / PER_ROW) as f64 * pitch;
        body += &text(x, y + 10.0, BOLD, &panel.title, SIDE);
        body += &text(x, y + 26.0, QUIET, &panel.subtitle, SIDE);
        body += &format!("<g transform=\"translate({})\">{}</g>\n", list(&[x, y + head]), heatmap(grid, panel, cell));
    }
    let bar = MARGIN + panels.len().div_ceil(PER_ROW) as f64 * pitch;
    let tenth = |i| format!("<stop offset=\".{i}\" stop-color=\"{}\"/>", hex(viridis(f64::from(i) * CAP / 9.0)));
    let stops: String = (0..10).map(tenth).collect();
    body += &format!("<linearGradient id=\"steps\" x2=\"1.11\">{stops}</linearGradient>");
    body += &format!("<path fill=\"url(#steps)\" d=\"M30 {}h120v12h-120z\"/>", n(bar - 10.0));
    body += &text(MARGIN, bar, QUIET, "0", SIDE);
    body += &text(156.0, bar, QUIET, &format!("{CAP} or more steps to the goal"), SIDE);
    let width = 2.0 * MARGIN + panels.len().clamp(1, PER_ROW) as f64 * (SIDE + GAP) - GAP;
    document(width.max(380.0), bar + MARGIN, &body)
}

/// Cells of one colour are one path, as are the arrows of one ink: that keeps the file small.
fn heatmap(grid: &Grid, panel: &Panel, cell: f64) -> String {
    const WALL: [u8; 3] = [0x9a, 0x9f, 0xa8];
    let mut fills = BTreeMap::<[u8; 3], String>::new();
    let mut inks = BTreeMap::<&str, String>::new();
    let stroke = (0.05 * cell).max(0.7);
    for state in 0..grid.cells() {
        let (row, col) = grid.cell(state);
        let (x, y) = (f64::from(col) * cell, (f64::from(row) + 0.5) * cell);
        let color = if grid.is_wall(state) { WALL } else { viridis(panel.steps[state]) };
        *fills.entry(color).or_default() += &format!("M{}h{}", list(&[x, y]), n(cell));
        if !grid.is_wall(state) && state != grid.goal() {
            let arrows = arrows(x + cell / 2.0, y, cell, panel.policy.row(state), stroke);
            *inks.entry(ink_on(color)).or_default() += &arrows;
        }
    }
    let mut map = format!("<g stroke-width=\"{}\" shape-rendering=\"crispEdges\">", n(cell));
    for (color, cells) in fills {
        map += &format!("<path stroke=\"{}\" d=\"{cells}\"/>", hex(color));
    }
    map += "</g>";
    // White shows between cells as a thin line, where there is room for one.
    if cell >= 12.0 {
        let (width, height) = (n(grid.cols() as f64 * cell), n(grid.rows() as f64 * cell));
        let across = (1..grid.rows()).map(|row| format!("M0 {}h{width}", n(row as f64 * cell)));
        let down = (1..grid.cols()).map(|col| format!("M{} 0v{height}", n(col as f64 * cell)));
        map += &format!("<path stroke=\"#fff\" d=\"{}\"/>", across.chain(down).collect::<String>());
    }
    for (ink, arrows) in inks {
        let style = format!("fill=\"{ink}\" stroke=\"{ink}\" stroke-width=\"{}\"", n(stroke));
        map += &format!("<path {style} stroke-linejoin=\"round\" d=\"{arrows}\"/>");
    }
    let (row, col) = grid.cell(grid.goal());
    let at = |(x, y): (f64, f64)| ((f64::from(col) + x) * cell, (f64::from(row) + y) * cell);
    let flag = [(0.28, 0.84), (0.28, 0.16), (0.8, 0.34), (0.37, 0.53), (0.37, 0.84)].map(at);
    let ink = ink_on(viridis(panel.steps[grid.goal()]));
    map + &format!("<path class=\"goal\" fill=\"{ink}\" d=\"{}z\"/>", path(&flag))
}

/// The arrows of a cell with its centre at (x, y), from there outwards; short ones go without a head.
fn arrows(x: f64, y: f64, cell: f64, row: &[f64; ACTIONS], stroke: f64) -> String {
    // A tenth of a pixel is fine enough here.
    let short = |length: f64| libm::round(10.0 * length) / 10.0;
    let mut arrows = String::new();
    for (action, &p) in Action::ALL.into_iter().zip(row).filter(|(_, p)| **p >= 0.04) {
        if action == Action::Stay {
            // A circle that is open by a tenth; its outline adds half its width.
            let r = short(0.2 * cell * p - stroke / 2.0).max(0.1);
            arrows += &format!("M{}a{} 0 1 0 .1 0z", list(&[x, y - r]), list(&[r, r]));
            continue;
        }
        let (down, right) = action.direction();
        let head = if p < 0.25 { 0.0 } else { short(cell * (0.18 * p).min(0.12)) };
        let shaft = short(0.45 * cell * p - head);
        let (line, sign) = if down == 0 { ('h', f64::from(right)) } else { ('v', f64::from(down)) };
        arrows += &format!("M{}{line}{}", list(&[x, y]), n(sign * shaft));
        if head > 0.0 {
            let (wing, tip) = (short(0.7 * head), sign * head);
            let turn = |along: f64, across: f64| if down == 0 { [along, across] } else { [across, along] };
            let tip = [turn(tip, wing), turn(-tip, wing)].concat();
            arrows += &format!("m{}l{}z", list(&turn(0.0, -wing)), list(&tip));
        }
    }
    arrows
}

/// Yellow at the goal, purple from 100 steps on.
fn viridis(steps: f64) -> [u8; 3] {
    let color = colorous::VIRIDIS.eval_continuous(1.0 - (steps / CAP).clamp(0.0, 1.0));
    [color.r, color.g, color.b]
}

/// Ink that can be read on a colour.
fn ink_on([r, g, b]: [u8; 3]) -> &'static str {
    let intensity = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
    if intensity > 0.45 * 255.0 { "#101216" } else { "#fafafa" }
}

#[cfg(test)]
mod tests {
    use super::super::assert_well_formed;
    use super::*;
    use crate::mdp::{GridSpec, HORIZON, Solver, optimal_policy};

    #[test]
    fn heatmaps_have_a_flag_each_and_escaped_titles() {
        let grid = Grid::new(GridSpec { walls: vec![(1, 1), (2, 1)], slip: 0.1, ..GridSpec::default() }).unwrap();
        let policy = optimal_policy(&grid);
        let steps = Solver::new(&grid).evaluate(&policy, HORIZON).hitting_time;
        let panel = || Panel { title: "a < b & c > d".into(), subtitle: "".into(), policy: &policy, steps: &steps };
        let svg = heatmaps(&grid, &[panel(), panel(), panel(), panel(), panel()]);
        assert_well_formed(&svg);
        assert_eq!(svg.matches("class=\"goal\"").count(), 5);
        assert_eq!(svg.matches(">a &lt; b &amp; c &gt; d<").count(), 5);
        assert!(svg.len() < 60_000, "{}", svg.len());
    }
}
