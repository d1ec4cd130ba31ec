//! Charts: lines and points over axes with legible ticks; and the chart of a training run.

use egui::{Color32, Label, Rangef, RichText, Role, Sense, TextStyle, Ui, Vec2, WidgetInfo, vec2};
use egui_plot::{
    AxisHints, Bar, BarChart, GridInput, HoverPosition, Line, LineStyle, Plot, PlotPoint, PlotPoints, Points, Text,
    VLine, uniform_grid_spacer,
};

use super::app::View;
use super::board::Shown;
use super::compare::Kept;
use super::numbers;
use super::theme::Palette;
use crate::experiment::CurvePoint;
use crate::lab::RunState;
use crate::mdp::RETURN_KINDS;

/// A line or a cloud of points.
pub struct Curve {
    pub name: String,
    pub color: Color32,
    pub points: Vec<[f64; 2]>,
    pub style: Style,
}

#[derive(Clone, Copy, PartialEq)]
pub enum Style {
    Solid,
    Thin,
    Dashed,
    /// A line with its points marked.
    Marked,
    Points,
    /// Bars from zero, each as wide as they are apart.
    Bars,
}

/// What the axes say, and what they must hold besides the curves.
pub struct Axes {
    pub id: &'static str,
    pub size: Vec2,
    pub include: Vec<[f64; 2]>,
    /// A number on an axis, and in the words beside the pointer.
    pub x: fn(f64) -> String,
    pub y: fn(f64) -> String,
    /// Words at points.
    pub labels: Vec<([f64; 2], String)>,
    /// Where a vertical line stands that can be dragged.
    pub cursor: Option<f64>,
}

/// Draws curves over axes; returns where the cursor was dragged to.
pub fn plot(ui: &mut Ui, axes: Axes, curves: Vec<Curve>) -> Option<f64> {
    let palette = Palette::of(ui);
    let hints = |hints: AxisHints<'static>| {
        hints.tick_label_color(palette.muted).tick_label_font(TextStyle::Small.resolve(ui.style()))
    };
    let Axes { x, y, .. } = axes;
    // A line for every so many points, so that each has room for its label.
    let (across, up) = ((axes.size.x / 60.0).clamp(2.0, 8.0), (axes.size.y / 26.0).clamp(2.0, 8.0));
    let mut plot = Plot::new(axes.id)
        .width(axes.size.x)
        .height(axes.size.y)
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        // Nothing to be done with it: Tab need not stop here.
        // Never a stop for Tab: the timeline's slider is.
        .sense(if axes.cursor.is_some() { Sense::DRAG } else { Sense::hover() })
        .show_background(false)
        .grid_color(palette.line)
        .x_grid_spacer(uniform_grid_spacer(move |input| ticks(input, across)))
        .y_grid_spacer(uniform_grid_spacer(move |input| ticks(input, up)))
        .custom_x_axes(vec![
            hints(AxisHints::new_x()).label_spacing(Rangef::new(20.0, 36.0)).formatter(move |mark, _| x(mark.value)),
        ])
        .custom_y_axes(vec![
            // As wide for short labels as for long ones, so that charts below one another agree.
            hints(AxisHints::new_y())
                .min_thickness(48.0)
                .label_spacing(Rangef::new(14.0, 24.0))
                .formatter(move |mark, _| y(mark.value)),
        ])
        .label_formatter(move |position| match position {
            HoverPosition::NearDataPoint { plot_name, position, .. } => {
                Some(format!("{plot_name}\n{}: {}", x(position.x), y(position.y)))
            }
            HoverPosition::Elsewhere { .. } => None,
        });
    for [x, y] in axes.include {
        plot = plot.include_x(x).include_y(y);
    }
    let words = describe(&curves, y);
    let cursor = axes.cursor;
    let shown = plot.show(ui, |plot| {
        for Curve { name, color, points, style } in curves {
            if style == Style::Bars {
                let width = points.windows(2).next().map_or(1.0, |pair| pair[1][0] - pair[0][0]);
                let fill = color.gamma_multiply(0.4);
                let bars = points.iter().map(|&[x, y]| Bar::new(x, y).width(width).fill(fill)).collect();
                plot.bar_chart(BarChart::new(name, bars).allow_hover(false));
                continue;
            }
            if style != Style::Points {
                let line = Line::new(name.clone(), PlotPoints::from(points.clone()))
                    .color(color)
                    .width(if style == Style::Thin { 1.0 } else { 2.0 });
                plot.line(if style == Style::Dashed { line.style(LineStyle::dashed_loose()) } else { line });
            }
            if matches!(style, Style::Marked | Style::Points) {
                plot.points(Points::new(name, PlotPoints::from(points)).color(color).radius(3.5));
            }
        }
        for ([x, y], label) in axes.labels {
            let text = RichText::new(label).small().color(palette.muted);
            plot.text(Text::new("", PlotPoint::new(x, y), text).anchor(egui::Align2::LEFT_BOTTOM));
        }
        if let Some(x) = cursor {
            plot.vline(VLine::new("", x).color(palette.ink).width(1.5));
        }
    });
    shown.response.widget_info(|| WidgetInfo::labeled(Role::Figure, true, &words));
    let at = shown.response.interact_pointer_pos().filter(|_| cursor.is_some())?;
    Some(shown.transform.value_from_position(at).x)
}

/// A chart in words: where each curve begins and ends.
fn describe(curves: &[Curve], y: fn(f64) -> String) -> String {
    let curves = curves.iter().filter_map(|Curve { name, points, .. }| {
        let [first, last] = [points.first()?, points.last()?].map(|point| y(point[1]));
        Some(format!("{name} from {first} to {last}"))
    });
    format!("Chart: {}.", curves.collect::<Vec<_>>().join("; "))
}

/// The names of curves in their colours, on one line where there is room.
pub fn legend<'a>(ui: &mut Ui, title: &str, curves: impl Iterator<Item = (&'a str, Color32)>) {
    ui.spacing_mut().interact_size.y = 14.0;
    ui.spacing_mut().item_spacing.y = 2.0;
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(title).small().color(Palette::of(ui).muted));
        for (name, color) in curves {
            ui.add(Label::new(RichText::new(format!("• {name}")).small().color(color)).extend());
        }
    });
}

/// Draws the curve of a run into all the space there is: returns of ensemble and clone and what is climbed; and
/// β below, where it moves by itself.
///
/// Kept runs stand behind it. Returns the update that was dragged to.
pub fn show(ui: &mut Ui, size: Vec2, shown: &Shown, kept: &[Kept], view: &View) -> Option<u32> {
    let Shown { curve, snapshot, .. } = shown;
    let config = &shown.started.setup.config;
    let palette = Palette::of(ui);
    let top = ui.cursor().top();
    let kind = &RETURN_KINDS[view.kind];
    if snapshot.state == RunState::Given {
        ui.label(RichText::new("Over training: nothing, as this ensemble was given.").small().color(palette.muted));
        return None;
    }
    // A clone with a memory is not known by every kind of return: within T there is always one.
    let is_known = curve.iter().all(|point| point.clone.get(view.kind).is_some());
    let of_clone = |point: &CurvePoint| point.clone.get(view.kind).unwrap_or(point.clone.horizon_return);
    let curve_of = |name: &str, color: Color32, style: Style, value: &dyn Fn(&CurvePoint) -> f64| Curve {
        name: name.to_owned(),
        color,
        points: curve.iter().map(|point| [f64::from(point.update), value(point)]).collect(),
        style,
    };
    let clone = format!("clone ({}{})", config.observer, if is_known { "" } else { ", within T" });
    // Behind the run shown, those that are kept: both lines of each in its colour.
    let mut behind = Vec::new();
    for (index, kept) in kept.iter().enumerate() {
        let line = |name: &str, style: Style, value: &dyn Fn(&CurvePoint) -> f64| Curve {
            name: format!("{name}, {}", kept.name),
            color: palette.kept(index),
            points: kept.shown.curve.iter().map(|point| [f64::from(point.update), value(point)]).collect(),
            style,
        };
        behind.push(line("ensemble", Style::Thin, &|point| (kind.get)(&point.ensemble)));
        // The chart's own clone says by its name where it is within T; these have one name for both lines.
        if kept.shown.curve.iter().all(|point| point.clone.get(view.kind).is_some()) {
            behind.push(line("clone", Style::Thin, &of_clone));
        }
    }
    let mut curves = vec![
        curve_of("ensemble", palette.accent, Style::Solid, &|point| (kind.get)(&point.ensemble)),
        curve_of(&clone, palette.clone, Style::Solid, &of_clone),
    ];
    let is_denied = curve.iter().any(|point| point.denied.is_some());
    if is_denied {
        let collected = |point: &CurvePoint| point.denied.map_or(0.0, |denied| denied.clone);
        curves.push(curve_of("r̃ of the clone", palette.warning, Style::Solid, &collected));
    } else if kind.is_steps && is_known {
        // Eq. 3, of this kind of return.
        curves.push(curve_of("J = ensemble − β·clone", palette.muted, Style::Dashed, &|point| {
            (kind.get)(&point.ensemble) - point.beta * of_clone(point)
        }));
    }
    let unit = if kind.is_steps { "steps" } else { "probability" };
    let title = format!("Over training, {} ({unit}):", kind.label);
    let names = curves.iter().map(|curve| (&*curve.name, curve.color));
    // Of a kept run the upper line is the ensemble's, the lower the clone's.
    let kept_names = kept.iter().enumerate().map(|(index, kept)| (&*kept.name, palette.kept(index)));
    legend(ui, &title, names.chain(kept_names));
    let moves = config.alpha.is_some();
    let size = vec2(size.x, size.y - (ui.cursor().top() - top));
    let below = if moves { (0.3 * size.y).max(60.0) } else { 0.0 };
    let last = f64::from(snapshot.last_update);
    let x = |update: f64| numbers::decimal(update, 0);
    let axes = Axes {
        id: "curve",
        size: vec2(size.x, (size.y - below).max(70.0)),
        include: vec![[0.0, 0.0], [last, if kind.is_steps { 0.0 } else { 1.0 }]],
        x,
        y: if kind.is_steps { in_steps } else { |value| numbers::decimal(value, 2) },
        labels: Vec::new(),
        cursor: Some(f64::from(view.sought.unwrap_or(snapshot.update))),
    };
    let curves = behind.into_iter().chain(curves).collect();
    let sought = plot(ui, axes, curves);
    if moves {
        let beta = curve_of("β", palette.ink, Style::Solid, &|point| point.beta);
        legend(ui, "Dual ascent:", [("β", palette.ink)].into_iter());
        let axes = Axes {
            id: "beta",
            size: vec2(size.x, (below - 18.0).max(50.0)),
            include: vec![[0.0, 0.0], [last, 0.1]],
            x,
            y: |value| numbers::decimal(value, 2),
            labels: Vec::new(),
            cursor: None,
        };
        plot(ui, axes, vec![beta]);
    }
    sought.map(|x| x.clamp(0.0, f64::from(snapshot.recorded))).map(|x| libm::round(x) as u32)
}

/// Steps on an axis: whole as a rule, powers of ten where they are huge.
pub fn in_steps(value: f64) -> String {
    if value.abs() >= 9999.5 {
        return numbers::steps(value);
    }
    numbers::decimal(value, usize::from(value.fract().abs() > 1e-9))
}

/// Distances of grid lines: 1, 2 or 5 times a power of ten, at most about `lines` of them over an axis.
fn ticks(input: GridInput, lines: f32) -> [f64; 3] {
    let least = (input.bounds.1 - input.bounds.0).max(f64::MIN_POSITIVE) / f64::from(lines);
    let power = libm::pow(10.0, libm::floor(libm::log10(least)));
    let step = [1.0, 2.0, 5.0, 10.0].map(|times| times * power).into_iter().find(|&step| step >= least);
    let step = step.unwrap_or(10.0 * power);
    [step, 10.0 * step, 100.0 * step]
}
