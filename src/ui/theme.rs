//! Every colour, font and distance of the page.

use std::sync::Arc;

use egui::{
    Color32, Context, CornerRadius, FontData, FontDefinitions, FontFamily, FontId, Margin, Shadow, Stroke, TextStyle,
    Theme, Ui, Vec2, Visuals, vec2,
};

use super::math;

/// The colours of a theme.
pub struct Palette {
    pub ground: Color32,
    pub card: Color32,
    /// Rails, unselected buttons.
    pub raised: Color32,
    pub line: Color32,
    /// Edges of what can be pressed.
    pub edge: Color32,
    pub ink: Color32,
    pub muted: Color32,
    /// What can be acted on, and the ensemble.
    pub accent: Color32,
    pub on_accent: Color32,
    /// The clone, on the chart and in its figures.
    pub clone: Color32,
    pub warning: Color32,
    pub wall: Color32,
    /// Runs kept to compare with.
    kept: [Color32; 5],
}

const LIGHT: Palette = Palette {
    ground: Color32::from_rgb(0xf5, 0xf5, 0xf2),
    card: Color32::from_rgb(0xff, 0xff, 0xff),
    raised: Color32::from_rgb(0xe9, 0xea, 0xe6),
    line: Color32::from_rgb(0xdd, 0xde, 0xd9),
    edge: Color32::from_rgb(0xb4, 0xb9, 0xb3),
    ink: Color32::from_rgb(0x1f, 0x23, 0x28),
    muted: Color32::from_rgb(0x5a, 0x61, 0x6c),
    accent: Color32::from_rgb(0x0b, 0x74, 0x70),
    on_accent: Color32::WHITE,
    clone: Color32::from_rgb(0x8a, 0x2d, 0x8f),
    warning: Color32::from_rgb(0xa3, 0x40, 0x0b),
    wall: Color32::from_rgb(0xb4, 0xb8, 0xbe),
    kept: [
        Color32::from_rgb(0x2f, 0x5f, 0xb3),
        Color32::from_rgb(0xa3, 0x5a, 0x00),
        Color32::from_rgb(0x4f, 0x6f, 0x1c),
        Color32::from_rgb(0xa8, 0x2a, 0x4f),
        Color32::from_rgb(0x5a, 0x61, 0x6c),
    ],
};

const DARK: Palette = Palette {
    ground: Color32::from_rgb(0x13, 0x15, 0x19),
    card: Color32::from_rgb(0x1c, 0x1f, 0x25),
    raised: Color32::from_rgb(0x2a, 0x2e, 0x36),
    line: Color32::from_rgb(0x33, 0x38, 0x41),
    edge: Color32::from_rgb(0x55, 0x5c, 0x68),
    ink: Color32::from_rgb(0xe8, 0xea, 0xee),
    muted: Color32::from_rgb(0xa2, 0xa9, 0xb5),
    accent: Color32::from_rgb(0x45, 0xc4, 0xb4),
    on_accent: Color32::from_rgb(0x06, 0x22, 0x20),
    clone: Color32::from_rgb(0xd9, 0x8f, 0xe3),
    warning: Color32::from_rgb(0xf2, 0xa0, 0x6a),
    wall: Color32::from_rgb(0x47, 0x4d, 0x57),
    kept: [
        Color32::from_rgb(0x8a, 0xb4, 0xf8),
        Color32::from_rgb(0xf0, 0xb3, 0x5e),
        Color32::from_rgb(0xa9, 0xcf, 0x6a),
        Color32::from_rgb(0xf2, 0x93, 0xac),
        Color32::from_rgb(0xa2, 0xa9, 0xb5),
    ],
};

impl Palette {
    pub fn of(ui: &Ui) -> &'static Palette {
        Palette::of_theme(if ui.visuals().dark_mode { Theme::Dark } else { Theme::Light })
    }

    /// The colour of the kept run of this number: two lines of one colour belong together.
    pub fn kept(&self, index: usize) -> Color32 {
        self.kept[index % self.kept.len()]
    }

    fn of_theme(theme: Theme) -> &'static Palette {
        match theme {
            Theme::Light => &LIGHT,
            Theme::Dark => &DARK,
        }
    }
}

/// Distance between things that belong together, and between parts of the page.
pub const GAP: f32 = 8.0;
pub const SPACE: f32 = 16.0;

/// Greatest height of a menu: all its lines, where the page is not tiny.
pub const MENU: f32 = 480.0;

/// Width of the page under which parts stack and touch targets grow.
pub const NARROW: f32 = 720.0;
/// Width from which the controls stand beside the panels.
pub const WIDE: f32 = 1000.0;

/// Text styles of our own.
pub fn strong() -> TextStyle {
    TextStyle::Name("strong".into())
}

pub fn figure() -> TextStyle {
    TextStyle::Name("figure".into())
}

/// The family of headings, figures and what is selected.
pub fn semibold() -> FontFamily {
    FontFamily::Name("semibold".into())
}

/// Gives a context our fonts and styles, light and dark.
pub fn install(ctx: &Context) {
    let mut fonts = FontDefinitions::empty();
    for (name, family, bytes) in [
        ("Inter", FontFamily::Proportional, &include_bytes!("../../web/fonts/Inter-Regular.otf")[..]),
        ("Inter SemiBold", semibold(), &include_bytes!("../../web/fonts/Inter-SemiBold.otf")[..]),
    ] {
        fonts.font_data.insert(name.to_owned(), Arc::new(FontData::from_static(bytes)));
        fonts.families.insert(family, vec![name.to_owned()]);
    }
    fonts.families.insert(FontFamily::Monospace, vec!["Inter".to_owned()]);
    for (name, bytes) in math::FONTS {
        fonts.font_data.insert(name.to_owned(), Arc::new(FontData::from_static(bytes)));
        fonts.families.insert(FontFamily::Name(name.into()), vec![name.to_owned()]);
    }
    ctx.set_fonts(fonts);
    for theme in [Theme::Light, Theme::Dark] {
        ctx.style_mut_of(theme, |style| {
            style.text_styles = [
                (TextStyle::Small, FontId::new(12.0, FontFamily::Proportional)),
                (TextStyle::Body, FontId::new(14.0, FontFamily::Proportional)),
                (TextStyle::Button, FontId::new(14.0, FontFamily::Proportional)),
                (TextStyle::Monospace, FontId::new(13.0, FontFamily::Monospace)),
                (TextStyle::Heading, FontId::new(18.0, semibold())),
                (strong(), FontId::new(14.0, semibold())),
                (figure(), FontId::new(26.0, semibold())),
            ]
            .into();
            style.visuals = visuals(theme);
            let spacing = &mut style.spacing;
            spacing.item_spacing = vec2(GAP, 6.0);
            spacing.button_padding = vec2(10.0, 4.0);
            spacing.interact_size = vec2(36.0, 28.0);
            spacing.slider_rail_height = 6.0;
            spacing.menu_margin = Margin::same(6);
            spacing.window_margin = Margin::same(SPACE as i8);
            spacing.icon_width = 16.0;
            spacing.tooltip_width = 320.0;
            style.interaction.selectable_labels = false;
            style.interaction.tooltip_delay = 0.3;
            // The page says with its own words what a control does; nothing moves for ornament.
            style.animation_time = 0.08;
        });
    }
}

/// Whether the page may move by itself.
pub fn set_motion(ctx: &Context, moves: bool) {
    ctx.all_styles_mut(|style| style.animation_time = if moves { 0.08 } else { 0.0 });
}

/// Larger targets for fingers.
pub fn enlarge_targets(ui: &mut Ui) {
    let spacing = ui.spacing_mut();
    spacing.interact_size = vec2(44.0, 40.0);
    spacing.button_padding = vec2(12.0, 8.0);
    spacing.icon_width = 20.0;
}

fn visuals(theme: Theme) -> Visuals {
    let palette = Palette::of_theme(theme);
    let mut visuals = match theme {
        Theme::Light => Visuals::light(),
        Theme::Dark => Visuals::dark(),
    };
    visuals.panel_fill = palette.ground;
    visuals.window_fill = palette.card;
    visuals.window_stroke = Stroke::new(1.0, palette.line);
    visuals.window_shadow = Shadow { offset: [0, 4], blur: 16, spread: 0, color: Color32::from_black_alpha(40) };
    visuals.popup_shadow = visuals.window_shadow;
    visuals.extreme_bg_color = palette.card;
    visuals.faint_bg_color = palette.raised;
    visuals.hyperlink_color = palette.accent;
    visuals.weak_text_color = Some(palette.muted);
    visuals.warn_fg_color = palette.warning;
    visuals.error_fg_color = palette.warning;
    visuals.slider_trailing_fill = true;
    visuals.selection.bg_fill = palette.accent;
    visuals.selection.stroke = Stroke::new(1.5, palette.on_accent);
    // From 5 on egui draws a corner with twice as many triangles.
    let radius = CornerRadius::same(4);
    visuals.window_corner_radius = CornerRadius::same(10);
    visuals.menu_corner_radius = CornerRadius::same(8);
    let widgets = &mut visuals.widgets;
    for (state, fill, stroke, ink) in [
        (&mut widgets.noninteractive, palette.card, palette.line, palette.ink),
        (&mut widgets.inactive, palette.raised, palette.edge, palette.ink),
        (&mut widgets.hovered, palette.raised, palette.accent, palette.ink),
        (&mut widgets.active, palette.raised, palette.accent, palette.ink),
        (&mut widgets.open, palette.raised, palette.accent, palette.ink),
    ] {
        state.bg_fill = fill;
        state.weak_bg_fill = fill;
        state.bg_stroke = Stroke::new(1.0, stroke);
        state.fg_stroke = Stroke::new(1.0, ink);
        state.corner_radius = radius;
        state.expansion = 0.0;
    }
    // Focus must be seen: it is drawn with the colours of `active`.
    widgets.active.bg_stroke = Stroke::new(2.0, palette.accent);
    visuals
}

/// A white (or dark) sheet that holds things which belong together.
pub fn card(ui: &Ui) -> egui::Frame {
    let palette = Palette::of(ui);
    egui::Frame::new()
        .fill(palette.card)
        .stroke(Stroke::new(1.0, palette.line))
        .corner_radius(CornerRadius::same(8))
        .inner_margin(Margin::same(10))
}

/// Size of a square button with an icon.
pub fn icon_size(ui: &Ui) -> Vec2 {
    Vec2::splat(ui.spacing().interact_size.y)
}
