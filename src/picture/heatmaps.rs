//! Policies as heat maps, as on the page.

use std::collections::BTreeMap;

use super::{BOLD, ColorMap, QUIET, document, hex, list, n, path, text, wrap};
use crate::mdp::{ACTIONS, Action, CAP, Grid, Policy};

const MARGIN: f64 = 16.0;

/// Height of a line of the caption.
const LINE: f64 = 17.0;

/// One heat map.
pub struct Panel {
    pub title: String,
    pub subtitle: String,
    pub policy: Policy,
    /// Expected steps to the goal, `[S]`.
    pub steps: Vec<f64>,
    /// Cells with a reward of their own, r̃, which is not 0: they are framed, white for a loss, black for a gain.
    pub rewards: Vec<(usize, f64)>,
}

/// Heat maps side by side, three a row, or fewer where the grid is large or much wider than high. The colour of a cell is its steps to the goal, cut at 100; the length
/// of an arrow is the probability of its move, the radius of a dot that of Stay. Below them the colours' scale, and
/// the paragraphs of `caption`, each in as many lines as it takes.
pub fn heatmaps(grid: &Grid, panels: &[Panel], colors: &ColorMap, caption: &[String]) -> String {
    const ROOM: f64 = 768.0;
    const GAP: f64 = 24.0;
    let (rows, cols) = (grid.rows(), grid.cols());
    let per_row = match () {
        () if cols >= 4 * rows => 1,
        () if cols >= 2 * rows || rows.max(cols) > 20 => 2,
        () => 3,
    };
    let side = (ROOM + GAP) / per_row as f64 - GAP;
    let cell = side / grid.rows().max(grid.cols()) as f64;
    let head = if panels.iter().all(|panel| panel.subtitle.is_empty()) { 18.0 } else { 34.0 };
    let pitch = head + grid.rows() as f64 * cell + GAP;
    let mut body = String::new();
    for (i, panel) in panels.iter().enumerate() {
        let x = MARGIN + (i % per_row) as f64 * (side + GAP);
        let y = MARGIN + (i / per_row) as f64 * pitch;
        body += &text(x, y + 10.0, BOLD, &panel.title, side);
        body += &text(x, y + 26.0, QUIET, &panel.subtitle, side);
        body += &format!(
            "<g transform=\"translate({})\">{}</g>\n",
            list(&[x, y + head]),
            heatmap(grid, panel, colors, cell)
        );
    }
    let bar = MARGIN + panels.len().div_ceil(per_row) as f64 * pitch;
    let tenth =
        |i| format!("<stop offset=\".{i}\" stop-color=\"{}\"/>", hex(colors.of_steps(f64::from(i) * CAP / 9.0)));
    let stops: String = (0..10).map(tenth).collect();
    body += &format!("<linearGradient id=\"steps\" x2=\"1.11\">{stops}</linearGradient>");
    body += &format!("<path fill=\"url(#steps)\" d=\"M30 {}h120v12h-120z\"/>", n(bar - 10.0));
    if let Some(color) = colors.lines {
        body += &format!("<path fill=\"none\" stroke=\"{}\" d=\"M30 {}h120v12h-120z\"/>", hex(color), n(bar - 10.0));
    }
    body += &text(MARGIN, bar, QUIET, "0", side);
    body += &text(156.0, bar, QUIET, &format!("{CAP} or more steps to the goal"), side);
    let width = 2.0 * MARGIN + panels.len().clamp(1, per_row) as f64 * (side + GAP) - GAP;
    let width = width.max(380.0);
    let mut bottom = bar;
    for paragraph in caption {
        bottom += 0.4 * LINE;
        for line in wrap(paragraph, width - 2.0 * MARGIN) {
            bottom += LINE;
            body += &text(MARGIN, bottom, "", &line, width - 2.0 * MARGIN);
        }
    }
    document(width, bottom + MARGIN, &body)
}

/// Cells of one colour are one path, as are the arrows of one ink: that keeps the file small.
fn heatmap(grid: &Grid, panel: &Panel, colors: &ColorMap, cell: f64) -> String {
    const WALL: [u8; 3] = [0x9a, 0x9f, 0xa8];
    let mut fills = BTreeMap::<[u8; 3], String>::new();
    let mut inks = BTreeMap::<[u8; 3], String>::new();
    let stroke = (0.05 * cell).max(0.7);
    for state in 0..grid.cells() {
        let (row, col) = grid.cell(state);
        let (x, y) = (f64::from(col) * cell, (f64::from(row) + 0.5) * cell);
        let color = if grid.is_wall(state) { WALL } else { colors.of_steps(panel.steps[state]) };
        *fills.entry(color).or_default() += &format!("M{}h{}", list(&[x, y]), n(cell));
        if !grid.is_wall(state) && state != grid.goal() {
            let arrows = arrows(x + cell / 2.0, y, cell, panel.policy.row(state), stroke);
            *inks.entry(colors.ink_on(color)).or_default() += &arrows;
        }
    }
    let mut map = format!("<g stroke-width=\"{}\" shape-rendering=\"crispEdges\">", n(cell));
    for (color, cells) in fills {
        map += &format!("<path stroke=\"{}\" d=\"{cells}\"/>", hex(color));
    }
    map += "</g>";
    // A thin line, white if nothing else is asked for, shows between cells where there is room for one.
    let (width, height) = (n(grid.cols() as f64 * cell), n(grid.rows() as f64 * cell));
    let mut lines = String::new();
    if cell >= 12.0 {
        lines.extend((1..grid.rows()).map(|row| format!("M0 {}h{width}", n(row as f64 * cell))));
        lines.extend((1..grid.cols()).map(|col| format!("M{} 0v{height}", n(col as f64 * cell))));
    }
    if colors.lines.is_some() {
        lines += &format!("M0 0h{width}v{height}h-{width}z");
    }
    if !lines.is_empty() {
        let style =
            colors.lines.map_or("stroke=\"#fff\"".to_owned(), |c| format!("fill=\"none\" stroke=\"{}\"", hex(c)));
        map += &format!("<path {style} d=\"{lines}\"/>");
    }
    // Walls are struck through: no colour map may take them for cells.
    let walls = (0..grid.cells()).filter(|&state| grid.is_wall(state)).map(|wall| {
        let (row, col) = grid.cell(wall);
        let corner = [f64::from(col) * cell, f64::from(row + 1) * cell];
        format!("M{}l{}", list(&corner), list(&[cell, -cell]))
    });
    let walls: String = walls.collect();
    if !walls.is_empty() {
        let width = n(stroke);
        map += &format!("<path class=\"walls\" stroke=\"#5f656f\" stroke-width=\"{width}\" d=\"{walls}\"/>");
    }
    for (ink, arrows) in inks {
        let ink = hex(ink);
        let style = format!("fill=\"{ink}\" stroke=\"{ink}\" stroke-width=\"{}\"", n(stroke));
        map += &format!("<path {style} stroke-linejoin=\"round\" d=\"{arrows}\"/>");
    }
    for &(state, reward) in &panel.rewards {
        let (row, col) = grid.cell(state);
        let corner = [f64::from(col) * cell + stroke, f64::from(row) * cell + stroke];
        let (side, width) = (n(cell - 2.0 * stroke), n(1.5 * stroke));
        let style = format!("stroke=\"{}\" stroke-width=\"{width}\"", if reward < 0.0 { "#fff" } else { "#000" });
        let frame = format!("M{}h{side}v{side}h-{side}z", list(&corner));
        map += &format!("<path class=\"reward\" fill=\"none\" {style} d=\"{frame}\"/>");
    }
    let (row, col) = grid.cell(grid.goal());
    let at = |(x, y): (f64, f64)| ((f64::from(col) + x) * cell, (f64::from(row) + y) * cell);
    let flag = [(0.28, 0.84), (0.28, 0.16), (0.8, 0.34), (0.37, 0.53), (0.37, 0.84)].map(at);
    let ink = hex(colors.ink_on(colors.of_steps(panel.steps[grid.goal()])));
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

#[cfg(test)]
mod tests {
    use super::super::{COLOR_MAPS, assert_well_formed};
    use super::*;
    use crate::mdp::{GridSpec, HORIZON, Solver, optimal_policy};

    fn panel(grid: &Grid) -> Panel {
        let policy = optimal_policy(grid);
        let steps = Solver::new(grid).evaluate(&policy, HORIZON).hitting_time;
        Panel { title: "a < b & c > d".into(), subtitle: "".into(), policy, steps, rewards: Vec::new() }
    }

    #[test]
    fn heatmaps_have_a_flag_each_and_escaped_titles() {
        let grid = Grid::new(GridSpec { walls: vec![(1, 1), (2, 1)], slip: 0.1, ..GridSpec::default() }).unwrap();
        let panels: Vec<Panel> = (0..5).map(|_| panel(&grid)).collect();
        let svg = heatmaps(&grid, &panels, &COLOR_MAPS[0], &[]);
        assert_well_formed(&svg);
        assert_eq!(svg.matches("class=\"goal\"").count(), 5);
        assert_eq!(svg.matches("class=\"walls\"").count(), 5);
        assert_eq!(svg.matches(">a &lt; b &amp; c &gt; d<").count(), 5);
        assert!(svg.len() < 60_000, "{}", svg.len());
    }

    /// The caption stands below everything else and inside the picture, every word of it, in lines that fit.
    #[test]
    fn a_caption_is_wrapped_below_the_scale() {
        let grid = Grid::new(GridSpec { rows: 3, cols: 20, ..GridSpec::default() }).unwrap();
        let words: Vec<String> = (0..80).map(|i| format!("word{i}")).collect();
        let caption = [words.join(" "), "last".to_owned()];
        let with = |colors| heatmaps(&grid, &[Panel { rewards: vec![(5, -1.0)], ..panel(&grid) }], colors, &caption);
        let [svg, contrast] = [with(&COLOR_MAPS[0]), with(&COLOR_MAPS[2])];
        for svg in [&svg, &contrast] {
            assert_well_formed(svg);
            assert!(!svg.contains("textLength") && svg.contains("class=\"reward\""));
        }
        let number = |tag: &str, name: &str| -> f64 {
            tag.split_once(&format!("{name}=\"")).unwrap().1.split('"').next().unwrap().parse().unwrap()
        };
        let lines: Vec<(f64, &str)> = svg.split("<text ").skip(1).map(|tag| (number(tag, " y"), tag)).collect();
        let scale = lines.iter().position(|(_, tag)| tag.contains("or more steps")).unwrap();
        let (above, below) = lines.split_at(scale + 1);
        assert!(below.len() > 5 && below[0].0 > above[scale].0);
        assert!(below.windows(2).all(|pair| pair[1].0 - pair[0].0 >= LINE));
        assert!(below.last().unwrap().0 < number(&svg, " height") && below.last().unwrap().1.contains(">last<"));
        assert!(words.iter().all(|word| svg.contains(word)));
        // Greys only: red, green and blue are equal.
        let is_grey = |hex: &str| hex[0..2] == hex[2..4] && hex[2..4] == hex[4..6];
        assert!(contrast.split("stop-color=\"#").skip(1).all(|rest| is_grey(&rest[..6])));
    }
}
