//! The chart: returns of ensemble and clone over training, and what PG-APE climbs.

use egui::{Color32, RichText, Ui};
use egui_plot::{Corner, Legend, Line, LineStyle, Plot, PlotPoints};

use super::app::View;
use super::numbers;
use super::theme::Palette;
use crate::lab::{CurvePoint, Snapshot};
use crate::mdp::RETURN_KINDS;

/// Draws the curve of a run into all the space there is.
pub fn show(ui: &mut Ui, curve: &[CurvePoint], snapshot: &Snapshot, observer: &str, view: &View) {
    let palette = Palette::of(ui);
    let kind = &RETURN_KINDS[view.kind];
    let unit = if kind.is_steps { "steps" } else { "probability" };
    let title = format!("Over training: {} return ({unit})", kind.label);
    let title = if kind.is_steps { title } else { "Over training: success".to_owned() };
    ui.label(RichText::new(title).small().color(palette.muted));
    let line = |name: &str, color: Color32, value: &dyn Fn(&CurvePoint) -> f64| {
        let points: Vec<[f64; 2]> = curve.iter().map(|point| [f64::from(point.update), value(point)]).collect();
        Line::new(name.to_owned(), PlotPoints::from(points)).color(color).width(2.0)
    };
    let lines = [
        Some(line("ensemble", palette.accent, &|point| (kind.get)(&point.ensemble))),
        Some(line(&format!("clone ({observer})"), palette.clone, &|point| (kind.get)(&point.clone))),
        // J = ensemble − β clone (Eq. 3), of this kind of return.
        kind.is_steps.then(|| {
            line("J = ensemble − β·clone", palette.muted, &|point| {
                (kind.get)(&point.ensemble) - point.beta * (kind.get)(&point.clone)
            })
            .style(LineStyle::dashed_loose())
        }),
    ];
    let size = ui.available_size();
    Plot::new("curve")
        .width(size.x)
        .height(size.y.max(120.0))
        .allow_zoom(false)
        .allow_drag(false)
        .allow_scroll(false)
        .allow_boxed_zoom(false)
        .show_background(false)
        .include_x(0.0)
        .include_x(f64::from(snapshot.last_update))
        .include_y(0.0)
        .include_y(if kind.is_steps { 0.0 } else { 1.0 })
        .legend(Legend::default().position(Corner::RightBottom).background_alpha(0.8).follow_insertion_order(true))
        .x_axis_formatter(|mark, _| if mark.value >= 0.0 { format!("{:.0}", mark.value) } else { String::new() })
        .y_axis_formatter(|mark, _| axis_label(mark.value, kind.is_steps))
        .label_formatter(move |position| match position {
            egui_plot::HoverPosition::NearDataPoint { plot_name, position, .. } => {
                Some(format!("{plot_name}\nupdate {:.0}: {}", position.x, numbers::of_kind(kind, position.y)))
            }
            egui_plot::HoverPosition::Elsewhere { .. } => None,
        })
        .show(ui, |plot| lines.into_iter().flatten().for_each(|line| plot.line(line)));
}

fn axis_label(value: f64, is_steps: bool) -> String {
    if !is_steps {
        return numbers::decimal(value, 1);
    }
    if value.abs() < 9999.5 { numbers::decimal(value, 0) } else { numbers::steps(value) }
}
