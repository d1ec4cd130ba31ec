//! A policy's arrows: two triangles for each shaft, head and dot. A page shows thousands of arrows, anew in every frame of
//! a training run. Heads and dots are stamped from one small texture that holds both in many sizes, their edges smooth.

use egui::emath::GuiRounding as _;
use egui::epaint::{Mesh, Vertex};
use egui::{Color32, ColorImage, Context, Pos2, Rect, TextureHandle, TextureId, TextureOptions, Vec2, pos2, vec2};

use crate::mdp::{ACTIONS, Action};

/// Half a head's width, of its length.
const WING: f32 = 0.7;
/// Sizes of the texture, each √2 of the one before: dots by their radius, heads by their length, from 1 pixel.
const SIZES: i32 = 11;
/// Samples of a pixel along each side.
const SAMPLES: usize = 4;

/// What draws arrows.
pub struct Pen {
    texture: TextureHandle,
    dots: Vec<Stamp>,
    heads: Vec<Stamp>,
}

/// A dot, or a head that points right, in the middle of a square of the texture.
struct Stamp {
    /// In pixels.
    size: f32,
    /// Of the square, in pixels.
    side: f32,
    uv: Rect,
}

impl Pen {
    pub fn new(ctx: &Context) -> Pen {
        let is_dot = |x: f32, y: f32| x * x + y * y <= 1.0;
        let is_head = |x: f32, y: f32| (-0.5..=0.5).contains(&x) && y.abs() <= WING * (0.5 - x);
        let sizes = || (0..SIZES).map(|i| libm::powf(2.0, i as f32 / 2.0));
        let dots: Vec<(f32, usize)> = sizes().map(|size| (size, 2 * libm::ceilf(size) as usize + 3)).collect();
        let heads: Vec<(f32, usize)> = sizes().map(|size| (size, 2 * libm::ceilf(WING * size) as usize + 3)).collect();
        // Dots beside one another, heads below; in the corner a white pixel for all that is filled.
        let width = 1 + dots.iter().map(|(_, side)| side).sum::<usize>();
        let height = [&dots, &heads].map(|row| row[row.len() - 1].1).iter().sum();
        let mut image = ColorImage::filled([width, height], Color32::TRANSPARENT);
        image[(0, 0)] = Color32::WHITE;
        let mut row = |stamps: &[(f32, usize)], top: usize, covers: &dyn Fn(f32, f32) -> bool| -> Vec<Stamp> {
            let mut left = 1;
            let stamps = stamps.iter().map(|&(size, side)| {
                for (y, x) in (0..side).flat_map(|y| (0..side).map(move |x| (y, x))) {
                    let at = |pixel: usize, i: usize| {
                        (pixel as f32 + (i as f32 + 0.5) / SAMPLES as f32 - side as f32 / 2.0) / size
                    };
                    let samples = (0..SAMPLES * SAMPLES).map(|i| covers(at(x, i % SAMPLES), at(y, i / SAMPLES)));
                    let covered = samples.filter(|is_covered| *is_covered).count();
                    let alpha = (255 * covered / (SAMPLES * SAMPLES)) as u8;
                    image[(left + x, top + y)] = Color32::from_rgba_premultiplied(alpha, alpha, alpha, alpha);
                }
                let place = Rect::from_min_size(pos2(left as f32, top as f32), Vec2::splat(side as f32));
                left += side;
                let in_texture = |at: Pos2| pos2(at.x / width as f32, at.y / height as f32);
                let uv = Rect::from_min_max(in_texture(place.min), in_texture(place.max));
                Stamp { size, side: side as f32, uv }
            });
            stamps.collect()
        };
        let (dots, heads) = (row(&dots, 0, &is_dot), row(&heads, dots[dots.len() - 1].1, &is_head));
        Pen { texture: ctx.load_texture("arrows", image, TextureOptions::LINEAR), dots, heads }
    }

    /// What a mesh with arrows is to be drawn with. Its first pixel is white, as epaint expects.
    pub fn texture(&self) -> TextureId {
        self.texture.id()
    }

    /// An arrow for every move, its length the move's probability; a dot for Stay.
    pub fn arrows(&self, mesh: &mut Mesh, cell: Rect, policy: &[f32; ACTIONS], ink: Color32, pixels_per_point: f32) {
        let size = cell.width().min(cell.height());
        // Shafts are upright or level: where their sides lie between pixels, nothing has to be smoothed.
        let pixels = (size * 0.06).max(1.0) * pixels_per_point;
        let half = Vec2::splat(libm::roundf(pixels) / pixels_per_point / 2.0);
        let center = (cell.center() - half).round_to_pixels(pixels_per_point) + half;
        let mut stamp = |stamps: &[Stamp], size: f32, center: Pos2, along: Vec2| {
            // Rather from a larger one: that stays sharp.
            let wanted = 1.19 * size * pixels_per_point;
            let from = stamps.iter().find(|stamp| stamp.size >= wanted).unwrap_or(&stamps[stamps.len() - 1]);
            let reach = along * (from.side * size / from.size / 2.0);
            let across = reach.rot90();
            let first = mesh.vertices.len() as u32;
            for (offset, uv) in [
                (-reach - across, from.uv.left_top()),
                (reach - across, from.uv.right_top()),
                (across - reach, from.uv.left_bottom()),
                (reach + across, from.uv.right_bottom()),
            ] {
                mesh.vertices.push(Vertex { pos: center + offset, uv, color: ink });
            }
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first + 1, first + 2, first + 3);
        };
        // Two opposite arrows have one shaft.
        let (mut upright, mut level) = (Rect::NOTHING, Rect::NOTHING);
        for (action, &p) in Action::ALL.into_iter().zip(policy) {
            // What is rarer than one time in thirty would be a speck.
            if p < 0.03 {
                continue;
            }
            if action == Action::Stay {
                stamp(&self.dots, size * 0.17 * p.sqrt(), center, vec2(1.0, 0.0));
                continue;
            }
            let (down, right) = action.direction();
            let along = vec2(right as f32, down as f32);
            let head = size * 0.16 * p.sqrt().min(2.0 * p);
            let neck = center + along * (size * 0.46 * p - head);
            let side = along.rot90().abs() * half;
            let shaft = Rect::from_two_pos(center - side, neck + side);
            let shafts = if down == 0 { &mut level } else { &mut upright };
            *shafts = shafts.union(shaft);
            stamp(&self.heads, head, neck + along * head / 2.0, along);
        }
        for shaft in [upright, level].into_iter().filter(Rect::is_positive) {
            mesh.add_colored_rect(shaft, ink);
        }
    }
}
