//! Short equations, set as TeX sets them: text is parsed to a tree ([`parse`]), the tree laid out ([`layout`]) and
//! painted here. Nothing in this module knows what an equation says.
//!
//! Understood are letters, digits, signs, `_`, `^`, `'`, groups in braces, `\frac`, `\sum`, `\prod`, `\tilde`,
//! `\mathbb`, `\text`, and the signs, words and spaces listed in parse.rs. The fonts are KaTeX's and hold no more than
//! that: web/fonts/README.md tells how to add a glyph.

mod glyphs;
mod layout;
mod parse;

use egui::text::{LayoutJob, TextFormat};
use egui::{Color32, FontFamily, FontId, Rect, Response, Role, Sense, TextStyle, Ui, WidgetInfo, pos2, vec2};

use layout::{Ink, Layout, RULE, Style};

use super::theme::Palette;

pub use glyphs::FONTS;

/// Shows one equation at the left, shrunk where it would not fit. `spoken` is what it says, in plain words.
/// Text that is no equation is shown as it is.
pub fn math(ui: &mut Ui, tex: &str, spoken: &str) -> Response {
    let Ok(nodes) = parse::parse(tex) else { return ui.label(tex) };
    let layout = layout::row(&nodes, Style::Display);
    // Its letters are as tall as those of the text around it.
    let size = fitted(layout.width, 1.28 * TextStyle::Body.resolve(ui.style()).size, ui.available_width());
    let extent = vec2(layout.width * size, ((layout.ascent + layout.descent) * size).ceil());
    let (rect, response) = ui.allocate_exact_size(extent, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, spoken));
    if ui.is_rect_visible(rect) {
        layout.paint(ui, rect, size);
    }
    response
}

/// Whether an equation can be shown.
///
/// # Errors
/// What is wrong with it.
#[cfg(test)]
pub fn check(tex: &str) -> Result<(), String> {
    parse::parse(tex).map(drop)
}

/// The size of an equation that is `width` ems wide, where there is room for `available` points. In steps: each size
/// takes room in the atlas of glyphs.
fn fitted(width: f32, size: f32, available: f32) -> f32 {
    if width * size <= available { size } else { (available / width * 4.0).floor().max(1.0) / 4.0 }
}

impl Layout {
    /// Every baseline is at a whole pixel, every glyph at a quarter of one: as sharp, and as even, as can be.
    fn paint(&self, ui: &Ui, rect: Rect, size: f32) {
        let color = Palette::of(ui).ink;
        let painter = ui.painter();
        let scale = painter.pixels_per_point();
        let pixel = |points: f32| (points * scale).round() / scale;
        let origin = pos2(pixel(rect.left()), pixel(rect.top() + self.ascent * size));
        for piece in &self.pieces {
            let (x, y) = (origin.x + piece.x * size, origin.y + pixel(piece.y * size));
            match piece.ink {
                Ink::Rule(width) => {
                    // Rounded up, as KaTeX has it: else it is fainter than the letters.
                    let height = (RULE * size * scale).ceil() / scale;
                    let top = pixel(y - height / 2.0);
                    let rule = Rect::from_min_max(pos2(pixel(x), top), pos2(pixel(x + width * size), top + height));
                    painter.rect_filled(rule, 0.0, color);
                }
                Ink::Glyph(glyph, relative) => {
                    let whole = (x * scale).floor() / scale;
                    let quarter = ((x - whole) * scale * 4.0).round() / 4.0 / scale;
                    let font = FontId::new(size * relative, FontFamily::Name(glyph.font.name().into()));
                    let format = TextFormat::simple(font, Color32::PLACEHOLDER);
                    let mut job = LayoutJob::single_section(glyph.char.into(), format);
                    job.sections[0].leading_space = quarter;
                    let galley = painter.layout_job(job);
                    let baseline = galley.rows.first().and_then(|row| Some(row.pos.y + row.glyphs.first()?.pos.y));
                    painter.galley(pos2(whole, y - baseline.unwrap_or(0.0)), galley, color);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::theme;
    use super::*;

    const EQUATIONS: [&str; 8] = [
        r"J(\theta) = \mathbb{E}_{c,\,\tau\sim\pi_c}[R(\tau)] - \beta\,\mathbb{E}_{\tau\sim\pi_o}[R(\tau)]",
        r"\pi_o(a \mid s) = \sum_{c=1}^{n} p(c \mid s)\,\pi_c(a \mid s)",
        r"p(c \mid s) = \frac{d_c(s)}{\sum_{c'} d_{c'}(s)}",
        r"\mathbb{E}[T_o] = D + \sum_s m(s)\,h_o(s)",
        r"p(c \mid \tau) \propto \prod_t \pi_c(a_t \mid s_t)",
        r"\tilde{\pi}_o = \max_{\phi} \log \tilde\pi(a), \quad x^2_i \in \text{all cells}",
        r"\mathbb{E}[-\min(h(s), 100)] \ne \mathbb{E}[-\min(\tau_s, T)]",
        r"\gamma \le 1 \ge \epsilon \cdot \alpha \times 2 \approx x' \to \infty",
    ];

    #[test]
    fn equations_are_understood() {
        for tex in EQUATIONS {
            assert_eq!(check(tex), Ok(()), "{tex}");
        }
    }

    #[test]
    fn an_equation_keeps_to_its_room_and_its_ink_to_its_box() {
        let ctx = egui::Context::default();
        theme::install(&ctx);
        for (tex, width) in EQUATIONS.into_iter().flat_map(|tex| [600.0, 150.0].map(|width| (tex, width))) {
            let mut rect = Rect::NOTHING;
            let output = ctx.run_ui(egui::RawInput::default(), |ui| {
                ui.set_max_width(width);
                rect = math(ui, tex, "words").rect;
            });
            assert!(rect.width() <= width && rect.width() > 100.0, "{tex}: {rect}");
            let ink = output.shapes.iter().fold(Rect::NOTHING, |ink, shape| ink | shape.shape.visual_bounding_rect());
            assert!(rect.expand(2.0).contains_rect(ink), "{tex}: {ink} in {rect}");
            output.drop_without_applying_deltas();
        }
    }

    #[test]
    fn what_is_no_equation_is_shown_as_text() {
        egui::__run_test_ui(|ui| {
            math(ui, r"\frac{", "words");
        });
    }
}
