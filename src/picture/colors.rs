//! Colour maps: which colour stands for how many steps to the goal. A map is one line in [`COLOR_MAPS`]; the page's
//! heat maps and menus read that table, and so do the pictures.

use crate::mdp::CAP;

/// Colours from 100 steps or more to none.
pub struct ColorMap {
    /// As in files and addresses.
    pub name: &'static str,
    /// As in a menu.
    pub title: &'static str,
    /// Whom it is for.
    pub summary: &'static str,
    /// Red, green and blue of a place on the map, 0..=1: 0 is the dark end, 1 the light one.
    pub color: fn(f64) -> [u8; 3],
    /// What is drawn on light colours, and what on dark ones.
    inks: [[u8; 3]; 2],
    /// Colour of the lines between and around cells, where the ground itself could be taken for a cell.
    pub lines: Option<[u8; 3]>,
}

const SOFT_INKS: [[u8; 3]; 2] = [[0x10, 0x12, 0x16], [0xfa; 3]];

/// Every colour map; the first is the paper's and what the page opens with.
pub static COLOR_MAPS: [ColorMap; 3] = [
    ColorMap {
        name: "viridis",
        title: "Viridis",
        summary: "Yellow at the goal, purple from 100 steps on: the paper's colours.",
        color: |t| {
            let color = colorous::VIRIDIS.eval_continuous(t);
            [color.r, color.g, color.b]
        },
        inks: SOFT_INKS,
        lines: None,
    },
    ColorMap {
        name: "cividis",
        title: "Cividis",
        summary: "Yellow at the goal, dark blue from 100 steps on: looks the same to colour-blind viewers.",
        color: |t| {
            let color = colorous::CIVIDIS.eval_continuous(t);
            [color.r, color.g, color.b]
        },
        inks: SOFT_INKS,
        lines: None,
    },
    ColorMap {
        name: "contrast",
        title: "High contrast",
        summary: "White at the goal, black from 100 steps on, arrows in the opposite: for projectors, print and weak eyes.",
        color: |t| [libm::round(255.0 * t) as u8; 3],
        inks: [[0; 3], [0xff; 3]],
        lines: Some([0x80; 3]),
    },
];

impl ColorMap {
    /// The colour of a number of steps to the goal, which is cut at 100.
    pub fn of_steps(&self, steps: f64) -> [u8; 3] {
        (self.color)(1.0 - (steps / CAP).clamp(0.0, 1.0))
    }

    /// Ink that can be read on a colour.
    pub fn ink_on(&self, [r, g, b]: [u8; 3]) -> [u8; 3] {
        let intensity = 0.299 * f64::from(r) + 0.587 * f64::from(g) + 0.114 * f64::from(b);
        self.inks[usize::from(intensity <= 0.45 * 255.0)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (WCAG 2).
    fn luminance(color: [u8; 3]) -> f64 {
        let linear = color.map(|part| {
            let part = f64::from(part) / 255.0;
            if part <= 0.040_45 { part / 12.92 } else { libm::pow((part + 0.055) / 1.055, 2.4) }
        });
        0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
    }

    #[test]
    fn more_steps_are_darker_and_arrows_stand_out() {
        for map in &COLOR_MAPS {
            let colors: Vec<[u8; 3]> = (0..=100).map(|steps| map.of_steps(f64::from(steps))).collect();
            // Cividis falls back by a thousandth at its dark end.
            assert!(colors.windows(2).all(|pair| luminance(pair[0]) >= luminance(pair[1]) - 2e-3), "{}", map.name);
            // What WCAG asks of graphics, and about what it asks of text.
            let least = if map.name == "contrast" { 4.4 } else { 3.0 };
            for color in colors {
                let (one, other) = (luminance(color) + 0.05, luminance(map.ink_on(color)) + 0.05);
                assert!(one.max(other) / one.min(other) >= least, "{} {color:?}", map.name);
            }
        }
        assert_eq!(COLOR_MAPS[0].of_steps(1e300), COLOR_MAPS[0].of_steps(CAP));
    }
}
