//! The ring around what has the keyboard's attention, the same for every widget.

use egui::{Id, Key, LayerId, Order, Stroke, StrokeKind, Ui};

use super::theme::Palette;

/// Keys by which people move about a page.
const MOVES: [Key; 5] = [Key::Tab, Key::ArrowUp, Key::ArrowDown, Key::ArrowLeft, Key::ArrowRight];

/// Draws the ring while the page is used by keyboard; a click or a touch takes it away.
pub fn show(ui: &Ui, is_by_keyboard: &mut bool) {
    ui.input(|input| {
        if input.pointer.any_pressed() {
            *is_by_keyboard = false;
        } else if MOVES.iter().any(|&key| input.key_pressed(key)) {
            *is_by_keyboard = true;
        }
    });
    let focused = ui.ctx().memory(|memory| memory.focused()).and_then(|id| ui.ctx().read_response(id));
    if let Some(response) = focused.filter(|_| *is_by_keyboard) {
        let painter = ui.ctx().layer_painter(LayerId::new(Order::Foreground, Id::unique("focus")));
        let ring = response.rect.expand(3.0);
        painter.rect_stroke(ring, 8.0, Stroke::new(2.0, Palette::of(ui).ink), StrokeKind::Outside);
    }
}
