//! The glyphs of equations: in which font they are, and their measures. What they mean is none of this file's business.

use std::collections::BTreeMap;
use std::sync::LazyLock;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Font {
    Roman,
    Italic,
    Double,
    Sum,
    BigSum,
}

/// The fonts' files, for [`crate::ui::theme::install`].
pub const FONTS: [(&str, &[u8]); 5] = [
    (Font::Roman.name(), include_bytes!("../../../web/fonts/MathRoman.ttf")),
    (Font::Italic.name(), include_bytes!("../../../web/fonts/MathItalic.ttf")),
    (Font::Double.name(), include_bytes!("../../../web/fonts/MathDouble.ttf")),
    (Font::Sum.name(), include_bytes!("../../../web/fonts/MathSum.ttf")),
    (Font::BigSum.name(), include_bytes!("../../../web/fonts/MathBigSum.ttf")),
];

impl Font {
    /// Name of the family.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Font::Roman => "math roman",
            Font::Italic => "math italic",
            Font::Double => "math double",
            Font::Sum => "math sum",
            Font::BigSum => "math big sum",
        }
    }
}

/// A glyph with its measures in ems.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Glyph {
    pub font: Font,
    pub char: char,
    pub width: f32,
    pub height: f32,
    pub depth: f32,
    /// How far it leans out at the upper right.
    pub italic: f32,
    /// How far right of its middle an accent belongs.
    pub skew: f32,
}

impl Glyph {
    pub(super) fn find(font: Font, char: char) -> Result<Glyph, String> {
        GLYPHS.get(&(font, char)).copied().ok_or_else(|| format!("There is no “{char}” in the {} font.", font.name()))
    }
}

pub(super) static GLYPHS: LazyLock<BTreeMap<(Font, char), Glyph>> = LazyLock::new(|| {
    include_str!("../../../web/fonts/math.txt").lines().filter_map(read_glyph).map(|g| ((g.font, g.char), g)).collect()
});

/// A line of math.txt; the first, which is a heading, is none.
fn read_glyph(line: &str) -> Option<Glyph> {
    let (font, rest) = line.split_once(' ')?;
    let font = match font {
        "Roman" => Font::Roman,
        "Italic" => Font::Italic,
        "Double" => Font::Double,
        "Sum" => Font::Sum,
        "BigSum" => Font::BigSum,
        _ => return None,
    };
    let (char, rest) = rest.split_once(' ')?;
    let mut measures = rest.split(' ').map_while(|number| number.parse::<f32>().ok()).map(|number| number / 1000.0);
    let mut next = || measures.next();
    let (width, height, depth, italic, skew) = (next()?, next()?, next()?, next()?, next()?);
    Some(Glyph { font, char: char.parse().ok()?, width, height, depth, italic, skew })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_of_the_measures_is_read() {
        assert_eq!(GLYPHS.len(), include_str!("../../../web/fonts/math.txt").lines().count() - 1);
    }
}
