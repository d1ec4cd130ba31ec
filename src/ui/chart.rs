//! The chart: returns of ensemble and clone over training, and what PG-APE climbs.

use egui::{Color32, Label, Rangef, RichText, TextStyle, Ui};
use egui_plot::{AxisHints, GridInput, Line, LineStyle, Plot, PlotPoints, uniform_grid_spacer};

use super::app::View;
use super::numbers;
use super::theme::Palette;
use crate::experiment::CurvePoint;
use crate::lab::{RunState, Snapshot};
use crate::mdp::RETURN_KINDS;

/// Draws the curve of a run into all the space there is.
pub fn show(ui: &mut Ui, curve: &[CurvePoint], snapshot: &Snapshot, observer: &str, view: &View) {
    let palette = Palette::of(ui);
    let kind = &RETURN_KINDS[view.kind];
    let unit = if kind.is_steps { "steps" } else { "probability" };
    let title = format!("Over training, {} ({unit}):", kind.label);
    let j = "J = ensemble − β·clone";
    let clone = format!("clone ({observer})");
    if snapshot.state == RunState::Given {
        ui.label(RichText::new("Over training: nothing, as this ensemble was given.").small().color(palette.muted));
        return;
    }
    ui.spacing_mut().interact_size.y = 14.0;
    ui.spacing_mut().item_spacing.y = 2.0;
    ui.horizontal_wrapped(|ui| {
        ui.label(RichText::new(title).small().color(palette.muted));
        for (name, color) in [("ensemble", palette.accent), (&clone, palette.clone), (j, palette.muted)] {
            if name != j || kind.is_steps {
                ui.add(Label::new(RichText::new(format!("• {name}")).small().color(color)).extend());
            }
        }
    });
    let line = |name: &str, color: Color32, value: &dyn Fn(&CurvePoint) -> f64| {
        let points: Vec<[f64; 2]> = curve.iter().map(|point| [f64::from(point.update), value(point)]).collect();
        Line::new(name.to_owned(), PlotPoints::from(points)).color(color).width(2.0)
    };
    let lines = [
        Some(line("ensemble", palette.accent, &|point| (kind.get)(&point.ensemble))),
        Some(line(&clone, palette.clone, &|point| (kind.get)(&point.clone))),
        // Eq. 3, of this kind of return.
        kind.is_steps.then(|| {
            line(j, palette.muted, &|point| (kind.get)(&point.ensemble) - point.beta * (kind.get)(&point.clone))
                .style(LineStyle::dashed_loose())
        }),
    ];
    let axis = |hints: AxisHints<'static>| {
        hints.tick_label_color(palette.muted).tick_label_font(TextStyle::Small.resolve(ui.style()))
    };
    let size = ui.available_size();
    Plot::new("curve")
        .width(size.x)
        .height(size.y.max(70.0))
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .show_background(false)
        .include_x(0.0)
        .include_x(f64::from(snapshot.last_update))
        .include_y(0.0)
        .include_y(if kind.is_steps { 0.0 } else { 1.0 })
        .grid_color(palette.line)
        .x_grid_spacer(uniform_grid_spacer(ticks))
        .y_grid_spacer(uniform_grid_spacer(ticks))
        .custom_x_axes(vec![
            axis(AxisHints::new_x())
                .label_spacing(Rangef::new(20.0, 36.0))
                .formatter(|mark, _| numbers::decimal(mark.value, 0)),
        ])
        .custom_y_axes(vec![
            axis(AxisHints::new_y())
                .label_spacing(Rangef::new(14.0, 24.0))
                .formatter(|mark, _| axis_label(mark.value, kind.is_steps)),
        ])
        .label_formatter(move |position| match position {
            egui_plot::HoverPosition::NearDataPoint { plot_name, position, .. } => {
                Some(format!("{plot_name}\nupdate {:.0}: {}", position.x, numbers::of_kind(kind, position.y)))
            }
            egui_plot::HoverPosition::Elsewhere { .. } => None,
        })
        .show(ui, |plot| lines.into_iter().flatten().for_each(|line| plot.line(line)));
}

/// Distances of grid lines: 1, 2 or 5 times a power of ten, some eight of them over an axis.
fn ticks(input: GridInput) -> [f64; 3] {
    let least = (input.bounds.1 - input.bounds.0).max(f64::MIN_POSITIVE) / 8.0;
    let power = libm::pow(10.0, libm::floor(libm::log10(least)));
    let step = [1.0, 2.0, 5.0, 10.0].map(|times| times * power).into_iter().find(|&step| step >= least);
    let step = step.unwrap_or(10.0 * power);
    [step, 10.0 * step, 100.0 * step]
}

fn axis_label(value: f64, is_steps: bool) -> String {
    if !is_steps {
        return numbers::decimal(value, 1);
    }
    if value.abs() < 9999.5 { numbers::decimal(value, 0) } else { numbers::steps(value) }
}
