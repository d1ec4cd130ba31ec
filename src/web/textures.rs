//! The texture of all letters and fills, unsmoothed.

use egui::{Context, FullOutput, TextureId, TextureOptions};

/// Has graphics take one pixel of egui's own texture for each pixel on the screen, not a mean of four: letters stand on whole
/// pixels, and what is filled has one colour. That is the same picture, and where a processor draws it, a quarter
/// less work.
pub struct Unsmoothed;

impl egui::Plugin for Unsmoothed {
    fn debug_name(&self) -> &'static str {
        "unsmoothed"
    }

    fn setup(&mut self, ctx: &Context) {
        // These would be stretched.
        ctx.tessellation_options_mut(|options| options.prerasterized_discs = false);
    }

    fn output_hook(&mut self, _ctx: &Context, output: &mut FullOutput) {
        let own = output.textures_delta.set.get_mut(&TextureId::default());
        own.into_iter().flatten().for_each(|delta| delta.options = TextureOptions::NEAREST);
    }
}
