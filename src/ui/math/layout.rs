//! From a tree to glyphs and rules at their places, by the rules and with the numbers of The TeXbook, appendix G, for
//! Computer Modern. Lengths are in ems of the whole equation; heights go down from its baseline. Nothing here paints.

use super::glyphs::Glyph;
use super::parse::{Class, Node, WORDS};

const X_HEIGHT: f32 = 0.431;
/// The height of fractions' rules and of the middle of signs.
const AXIS: f32 = 0.25;
/// The thickness of those rules.
pub(super) const RULE: f32 = 0.04;

/// TeX's four styles: what is within what decides on size and place.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Style {
    Display,
    Text,
    Script,
    ScriptScript,
}

impl Style {
    fn size(self) -> f32 {
        match self {
            Style::Display | Style::Text => 1.0,
            Style::Script => 0.7,
            Style::ScriptScript => 0.5,
        }
    }

    /// That of sub- and superscripts.
    fn script(self) -> Style {
        if matches!(self, Style::Display | Style::Text) { Style::Script } else { Style::ScriptScript }
    }

    /// That of what is above and below a fraction's rule.
    fn part(self) -> Style {
        if self == Style::Display { Style::Text } else { self.script() }
    }
}

/// A box: how far its ink goes right, up and down of the left end of its baseline, and what is in it.
#[derive(Debug, Default)]
pub(super) struct Layout {
    pub width: f32,
    pub ascent: f32,
    pub descent: f32,
    pub pieces: Vec<Piece>,
}

/// Ink whose left end and baseline are at a point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece {
    pub x: f32,
    pub y: f32,
    pub ink: Ink,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Ink {
    /// In a size, on its baseline.
    Glyph(Glyph, f32),
    /// Of a width, centred on its height.
    Rule(f32),
}

impl Layout {
    /// Puts another layout's left end of the baseline to a point of this; does not widen it.
    fn place(&mut self, other: Layout, x: f32, y: f32) {
        self.ascent = self.ascent.max(other.ascent - y);
        self.descent = self.descent.max(other.descent + y);
        self.pieces.extend(other.pieces.into_iter().map(|piece| Piece { x: piece.x + x, y: piece.y + y, ..piece }));
    }

    fn append(&mut self, other: Layout) {
        let (x, width) = (self.width, other.width);
        self.place(other, x, 0.0);
        self.width += width;
    }
}

/// Nodes beside each other, with the space that their classes ask for (TeXbook, chapter 18).
pub(super) fn row(nodes: &[Node], style: Style) -> Layout {
    let mut layout = Layout::default();
    let mut before = None;
    for (i, node) in nodes.iter().enumerate() {
        if let Some(class) = node.class() {
            let after = nodes[i + 1..].iter().find_map(Node::class);
            let class = if class == Class::Binary && is_sign_only(before, after) { Class::Ordinary } else { class };
            layout.width += before.map_or(0.0, |before| space(before, class, style)) * style.size();
            before = Some(class);
        }
        layout.append(node.layout(style));
    }
    layout
}

/// Whether a + or − between these belongs to one number only.
fn is_sign_only(before: Option<Class>, after: Option<Class>) -> bool {
    use Class::{Binary, Close, Open, Operator, Punctuation, Relation};
    matches!(before, None | Some(Binary | Operator | Relation | Open | Punctuation))
        || matches!(after, None | Some(Relation | Close | Punctuation))
}

/// In ems of the style.
fn space(before: Class, after: Class, style: Style) -> f32 {
    use Class::{Binary, Close, Open, Operator, Ordinary, Punctuation, Relation};
    let units = match (before, after) {
        (Ordinary | Close | Operator, Operator) | (Operator, Ordinary) => 3.0,
        _ if style.size() < 1.0 => 0.0,
        (Relation, Ordinary | Operator | Open) | (Ordinary | Operator | Close | Punctuation, Relation) => 5.0,
        (Binary, Ordinary | Operator | Open) | (Ordinary | Close, Binary) => 4.0,
        (Punctuation, Ordinary | Operator | Open | Close | Punctuation) => 3.0,
        _ => 0.0,
    };
    units / 18.0
}

impl Node {
    fn class(&self) -> Option<Class> {
        match self {
            Node::Space(_) => None,
            Node::Atom(class, _) => Some(*class),
            Node::Sum(..) => Some(Class::Operator),
            Node::Scripts(base, ..) => base.class(),
            Node::Accent(..) | Node::Fraction(..) | Node::Group(_) => Some(Class::Ordinary),
        }
    }

    /// The glyph that this is, or that bears an accent.
    fn glyph(&self) -> Option<&Glyph> {
        match self {
            Node::Atom(_, glyphs) if glyphs.len() == 1 => glyphs.first(),
            Node::Accent(_, inner) => inner.glyph(),
            _ => None,
        }
    }

    fn has_limits(&self) -> bool {
        match self {
            Node::Sum(..) => true,
            Node::Atom(Class::Operator, glyphs) => {
                let word: String = glyphs.iter().map(|glyph| glyph.char).collect();
                WORDS.contains(&(word.as_str(), true))
            }
            _ => false,
        }
    }

    fn layout(&self, style: Style) -> Layout {
        let size = style.size();
        match self {
            Node::Space(width) => Layout { width: width * size, ..Layout::default() },
            Node::Group(nodes) => row(nodes, style),
            Node::Atom(_, glyphs) => {
                let mut layout = Layout::default();
                glyphs.iter().for_each(|glyph| layout.append(single(*glyph, size)));
                layout
            }
            Node::Sum(small, big) => single(if style == Style::Display { *big } else { *small }, size),
            Node::Accent(accent, inner) => {
                let mut layout = inner.layout(style);
                let accent_layout = single(*accent, size);
                let skew = inner.glyph().map_or(0.0, |glyph| glyph.skew * size);
                let x = skew + (layout.width - accent_layout.width) / 2.0;
                let up = (layout.ascent - X_HEIGHT * size).max(0.0);
                layout.place(accent_layout, x, -up);
                layout
            }
            Node::Fraction(above, below) => fraction(row(above, style.part()), row(below, style.part()), style),
            Node::Scripts(base, sub, sup) => {
                let sub = (!sub.is_empty()).then(|| row(sub, style.script()));
                let sup = (!sup.is_empty()).then(|| row(sup, style.script()));
                if style == Style::Display && base.has_limits() {
                    limits(base.layout(style), sub, sup)
                } else {
                    scripts(base, sub, sup, style)
                }
            }
        }
    }
}

fn single(glyph: Glyph, size: f32) -> Layout {
    Layout {
        width: (glyph.width + glyph.italic) * size,
        ascent: glyph.height * size,
        descent: glyph.depth * size,
        pieces: vec![Piece { x: 0.0, y: 0.0, ink: Ink::Glyph(glyph, size) }],
    }
}

/// Appendix G, rule 15.
fn fraction(above: Layout, below: Layout, style: Style) -> Layout {
    const BESIDE: f32 = 0.12;
    let size = style.size();
    let (up, down, clear) = if style == Style::Display { (0.677, 0.686, 3.0) } else { (0.394, 0.345, 1.0) };
    let clear = (clear + 0.5) * RULE * size;
    let up = (up * size).max(above.descent + AXIS * size + clear);
    let down = (down * size).max(below.ascent - AXIS * size + clear);
    let width = above.width.max(below.width);
    let rule = Piece { x: BESIDE, y: -AXIS * size, ink: Ink::Rule(width) };
    let mut layout = Layout { width: width + 2.0 * BESIDE, pieces: vec![rule], ..Layout::default() };
    for (part, y) in [(above, -up), (below, down)] {
        let x = BESIDE + (width - part.width) / 2.0;
        layout.place(part, x, y);
    }
    layout
}

/// Appendix G, rule 13a: above and below a sum on display.
fn limits(base: Layout, sub: Option<Layout>, sup: Option<Layout>) -> Layout {
    const PADDING: f32 = 0.1;
    let width = [Some(&base), sub.as_ref(), sup.as_ref()].into_iter().flatten().map(|l| l.width).fold(0.0, f32::max);
    let centred = |layout: &Layout| (width - layout.width) / 2.0;
    let (x, ascent, descent) = (centred(&base), base.ascent, base.descent);
    let mut layout = Layout { width, ..Layout::default() };
    layout.place(base, x, 0.0);
    if let Some(sup) = sup {
        let (x, y) = (centred(&sup), -ascent - (0.2 - sup.descent).max(0.111) - sup.descent);
        layout.place(sup, x, y);
        layout.ascent += PADDING;
    }
    if let Some(sub) = sub {
        let (x, y) = (centred(&sub), descent + (0.6 - sub.ascent).max(0.166) + sub.ascent);
        layout.place(sub, x, y);
        layout.descent += PADDING;
    }
    layout
}

/// Appendix G, rule 18.
fn scripts(base: &Node, sub: Option<Layout>, sup: Option<Layout>, style: Style) -> Layout {
    const AFTER: f32 = 0.05;
    let (size, small) = (style.size(), style.script().size());
    let mut layout = base.layout(style);
    let glyph = base.glyph();
    let (mut up, mut down) =
        if glyph.is_some() { (0.0, 0.0) } else { (layout.ascent - 0.386 * small, layout.descent + 0.05 * small) };
    let least = match style {
        Style::Display => 0.413,
        Style::Text => 0.363,
        Style::Script | Style::ScriptScript => 0.289,
    };
    if let Some(sup) = &sup {
        up = up.max(least * size).max(sup.descent + 0.25 * X_HEIGHT * size);
    }
    match (&sub, &sup) {
        (Some(sub), None) => down = down.max(0.15 * size).max(sub.ascent - 0.8 * X_HEIGHT * size),
        (Some(sub), Some(sup)) => {
            down = down.max(0.247 * size).max(4.0 * RULE * size - (up - sup.descent) + sub.ascent);
            let lift = (0.8 * X_HEIGHT * size - (up - sup.descent)).max(0.0);
            (up, down) = (up + lift, down - lift);
        }
        _ => {}
    }
    let end = layout.width;
    // A subscript tucks in under a leaning base.
    let tucked = end - glyph.map_or(0.0, |glyph| glyph.italic * size);
    for (script, x, y) in [(sub, tucked, down), (sup, end, -up)] {
        if let Some(script) = script {
            layout.width = layout.width.max(x + script.width + AFTER);
            layout.place(script, x, y);
        }
    }
    layout
}

#[cfg(test)]
mod tests {
    use super::super::parse::parse;
    use super::*;

    fn layout(tex: &str) -> Layout {
        row(&parse(tex).unwrap(), Style::Display)
    }

    /// Where a character's first glyph is: x, baseline, size.
    fn at(layout: &Layout, wanted: char) -> (f32, f32, f32) {
        let glyph = |piece: &Piece| match piece.ink {
            Ink::Glyph(glyph, size) if glyph.char == wanted => Some((piece.x, piece.y, size)),
            _ => None,
        };
        layout.pieces.iter().find_map(glyph).unwrap()
    }

    #[test]
    fn scripts_are_small_and_off_the_baseline() {
        let scripts = layout("a_b^c");
        let ((_, sub, small), (_, sup, _)) = (at(&scripts, 'b'), at(&scripts, 'c'));
        assert!(sub > 0.0 && sup < 0.0 && small == 0.7);
        let limits = layout(r"\sum_b^c");
        let ((_, sub, _), (_, sup, _)) = (at(&limits, 'b'), at(&limits, 'c'));
        assert!(sub > 0.55 && sup < -1.05, "clear of the sign");
        let inline = layout(r"\frac{\sum_b a}{c}");
        assert!(at(&inline, 'b').0 > at(&inline, '∑').0 + 1.0, "beside the sign in a fraction");
    }

    #[test]
    fn a_fraction_has_its_rule_between_its_parts() {
        let fraction = layout(r"\frac{a_j}{b}");
        let rule = fraction.pieces.iter().find(|piece| matches!(piece.ink, Ink::Rule(_))).unwrap();
        assert!(at(&fraction, 'j').1 + 0.194 * 0.7 < rule.y && rule.y < at(&fraction, 'b').1 - 0.694);
    }

    #[test]
    fn space_tells_a_difference_from_a_negative_number() {
        let gap = |tex| at(&layout(tex), 'b').0 - at(&layout(tex), '−').0 - 0.778;
        assert!((gap("a-b") - 4.0 / 18.0).abs() < 1e-3);
        assert!(gap("-b").abs() < 1e-3 && gap("(-b").abs() < 1e-3);
        let relation = layout("a=b");
        assert!((at(&relation, 'b').0 - at(&relation, '=').0 - 0.778 - 5.0 / 18.0).abs() < 1e-3);
    }
}
