//! What is said and drawn of each racer: its counter, its figures, and how many steps it takes to the goal.

use egui::{RichText, Sense, Ui, vec2};

use super::board;
use crate::experiment::{Raced, Racer, Run};
use crate::ui::chart::{self, Axes, Curve, Style};
use crate::ui::numbers;
use crate::ui::theme::{self, Palette};

/// A racer's token, its name and where it stands after `step` steps.
pub fn counter(ui: &mut Ui, racer: Racer, name: &str, run: Option<&Run>, step: f64) {
    let palette = Palette::of(ui);
    ui.spacing_mut().interact_size.y = 18.0;
    ui.horizontal(|ui| {
        let (rect, _) = ui.allocate_exact_size(vec2(16.0, 18.0), Sense::hover());
        ui.painter().add(board::token(racer, rect.center(), 6.0, palette));
        let text = run.map_or(name.to_owned(), |run| format!("{name}: {}", standing(run, step)));
        ui.label(RichText::new(text).text_style(theme::strong()).color(board::color(racer, palette)));
    });
}

/// Steps so far, and whether it is there or lost.
fn standing(run: &Run, step: f64) -> String {
    let steps = |steps: usize| if steps == 1 { "1 step".to_owned() } else { format!("{steps} steps") };
    let last = run.path.len() - 1;
    match step as usize {
        now if now < last => steps(now),
        _ if run.has_arrived => format!("{}, arrived", steps(last)),
        _ => format!("lost: not there after {}", steps(last)),
    }
}

/// The figures of a racer in words: those of the sample, where there is one, next to the exact ones. Lost is who is
/// not there by T.
pub fn sentence(raced: &Raced, racer: Racer) -> String {
    let exact = raced.exact(racer);
    let (arrive, steps) = (numbers::fine_percent(exact.success), numbers::decimal(exact.steps, 1));
    let lost = numbers::fine_percent(1.0 - exact.success);
    if raced.episodes == 1 {
        return format!("exactly {arrive} arrive, {lost} are lost; {steps} steps in the mean");
    }
    let sample = raced.sample(racer);
    format!(
        "{} arrive (exact {arrive}), {} are lost; {} steps (exact {steps})",
        numbers::fine_percent(sample.success),
        numbers::fine_percent(1.0 - sample.success),
        numbers::decimal(sample.steps, 1),
    )
}

/// Most bars that a histogram has.
const BARS: u32 = 60;

/// The last number of steps that a picture of all racers must hold: beyond it less than one episode in ten thousand
/// arrives at each, and none did.
pub fn last_step(raced: &Raced) -> u32 {
    let holds = |run: &Run| {
        let seen = run.arrivals.iter().rposition(|&count| count > 0).unwrap_or(0);
        run.exact.iter().rposition(|&p| p > 1e-4).unwrap_or(0).max(seen)
    };
    let horizon = raced.runs[0].exact.len() as u32 - 1;
    let last = raced.runs.iter().map(holds).max().unwrap_or(0) as u32;
    last.max(1).next_multiple_of(10).min(horizon)
}

/// Numbers of steps that share a bar, so that there are at most [`BARS`] and, where it can be, all are alike.
fn bar_width(last: u32) -> u32 {
    let least = last.div_ceil(BARS);
    (least..=2 * least).find(|&width| last.is_multiple_of(width)).unwrap_or(least)
}

/// Sums of neighbours, from one step on: the middle of each `width` numbers of steps, and how many per cent are there.
fn binned(share: impl Iterator<Item = f64>, width: usize) -> Vec<[f64; 2]> {
    let share: Vec<f64> = share.skip(1).collect();
    let middle = |bin: usize| 1.0 + (bin * width) as f64 + (width as f64 - 1.0) / 2.0;
    share.chunks(width).enumerate().map(|(bin, share)| [middle(bin), 100.0 * share.iter().sum::<f64>()]).collect()
}

/// The histogram of a racer's steps, where there are many episodes, and the exact distribution over it as a line.
pub fn histogram(ui: &mut Ui, raced: &Raced, racer: Racer, height: f32) {
    let last = last_step(raced);
    let width = bar_width(last) as usize;
    let run = raced.run(racer);
    let shown = last as usize + 1;
    let color = board::color(racer, Palette::of(ui));
    let of = |&count: &u32| f64::from(count) / f64::from(raced.episodes);
    let mut curves = Vec::new();
    if raced.episodes > 1 {
        let points = binned(run.arrivals.iter().take(shown).map(of), width);
        curves.push(Curve { name: "episodes".to_owned(), color, points, style: Style::Bars });
    }
    let points = binned(run.exact.iter().take(shown).copied(), width);
    curves.push(Curve { name: "exact".to_owned(), color, points, style: Style::Solid });
    let axes = Axes {
        id: ["race expert", "race clone", "race optimal"][racer as usize],
        size: vec2(ui.available_width(), height),
        include: vec![[0.0, 0.0], [f64::from(last), 0.1]],
        x: chart::in_steps,
        y: |percent| {
            let decimals =
                usize::from(percent.fract().abs() > 1e-9) + usize::from(percent.abs() < 0.1 && percent != 0.0);
            format!("{} %", numbers::decimal(percent, decimals))
        },
        labels: Vec::new(),
        cursor: None,
    };
    chart::plot(ui, axes, curves);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(steps: usize, has_arrived: bool) -> Run {
        let mut arrivals = vec![0; 101];
        arrivals[steps] = u32::from(has_arrived);
        let exact = arrivals.iter().map(|&count| f64::from(count)).collect();
        Run { path: vec![1; steps + 1], has_arrived, arrivals, exact }
    }

    #[test]
    fn counters_say_where_a_racer_stands() {
        let of = |steps, has_arrived, step| standing(&run(steps, has_arrived), step);
        assert_eq!(of(12, true, 1.9), "1 step");
        assert_eq!((of(12, true, 12.0), of(12, true, 50.0)), ("12 steps, arrived".into(), "12 steps, arrived".into()));
        assert_eq!(
            (of(100, false, 99.0), of(100, false, 100.0)),
            ("99 steps".into(), "lost: not there after 100 steps".into())
        );
    }

    #[test]
    fn bins_hold_everything() {
        let raced = Raced { expert: 0, episodes: 1, runs: [run(12, true), run(100, false), run(18, true)] };
        assert_eq!(last_step(&raced), 20);
        let bins = binned((0..8).map(f64::from), 3);
        assert_eq!(bins, [[2.0, 600.0], [5.0, 1500.0], [8.0, 700.0]]);
        assert_eq!([1, 60, 70, 100, 97, 10_000].map(bar_width), [1, 1, 2, 2, 2, 200]);
        assert_eq!(sentence(&raced, Racer::Clone), "exactly 0 % arrive, 100 % are lost; 100.0 steps in the mean");
    }
}
