//! Pictures for papers and READMEs, as SVG text: heat maps of policies, and charts; and the colours of heat maps,
//! which the page shares.
//!
//! White ground, vectors only, 12 px text; the same input gives the same bytes. Lengths are in px. Here is what
//! the pictures share: how numbers, paths, words and the whole document are written.

mod chart;
mod colors;
mod heatmaps;

pub use chart::{Axes, Mark, Series, chart};
pub use colors::{COLOR_MAPS, ColorMap};
pub use heatmaps::{Panel, heatmaps};

const BOLD: &str = " font-weight=\"600\"";
const QUIET: &str = " fill=\"#555b66\"";
const MIDDLE: &str = " text-anchor=\"middle\"";

fn is_finite(point: &(f64, f64)) -> bool {
    point.0.is_finite() && point.1.is_finite()
}

/// A line through points; it breaks at those that are not finite.
fn path(points: &[(f64, f64)]) -> String {
    let breaks = points.split(|point| !is_finite(point)).filter(|part| !part.is_empty());
    breaks.map(|part| format!("M{}", list(&part.iter().flat_map(|p| [p.0, p.1]).collect::<Vec<_>>()))).collect()
}

/// About how wide words are, rather too much.
fn wide(words: &str) -> f64 {
    6.8 * words.chars().count() as f64
}

/// Words; squeezed if they would be wider than `room`.
fn text(x: f64, y: f64, style: &str, words: &str, room: f64) -> String {
    let squeezed = format!(" textLength=\"{}\" lengthAdjust=\"spacingAndGlyphs\"", n(room));
    let fit = if wide(words) > room { &squeezed } else { "" };
    let words = words.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    format!("<text x=\"{}\" y=\"{}\"{style}{fit}>{words}</text>\n", n(x), n(y))
}

/// Words in lines no wider than `room`, broken at plain spaces only; a word that is wider has a line of its own.
fn wrap(words: &str, room: f64) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in words.split(' ') {
        match lines.last_mut() {
            Some(line) if wide(line) + wide(" ") + wide(word) <= room => *line += &format!(" {word}"),
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn document(width: f64, height: f64, body: &str) -> String {
    // Whole pixels, so that nothing is stretched where the document becomes an image.
    let (width, height) = (n(libm::ceil(width)), n(libm::ceil(height)));
    let size = format!("width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\"");
    let font = "font-family=\"Inter, Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#101216\"";
    let ground = "<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>";
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" {size} {font}>{ground}\n{body}</svg>\n")
}

fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// A number with at most two decimals, as short as it goes; what is far outside any picture is brought nearer.
fn n(value: f64) -> String {
    let rounded = libm::round(100.0 * value.clamp(-1e5, 1e5)) / 100.0;
    // 0 is added for −0.
    let text = (rounded + 0.0).to_string();
    if rounded.abs() < 1.0 { text.replacen("0.", ".", 1) } else { text }
}

/// Numbers with no more between them than SVG needs.
fn list(numbers: &[f64]) -> String {
    numbers.iter().map(|v| n(*v)).collect::<Vec<_>>().join(" ").replace(" -", "-")
}

/// Every tag that opens closes, and every number is one.
#[cfg(test)]
fn assert_well_formed(svg: &str) {
    let [tags, closing, empty] = ["<", "</", "/>"].map(|part| svg.matches(part).count());
    assert_eq!(tags, 2 * closing + empty);
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}
