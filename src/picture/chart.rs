//! Charts: lines, bands, and points with their intervals and names.

use super::{BOLD, MIDDLE, QUIET, document, hex, is_finite, n, path, text, wide};

/// How the points of a series are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Mark {
    #[default]
    Line,
    DashedLine,
    Points,
    LineAndPoints,
}

/// One curve or cloud of a chart. Points that are not finite leave a gap.
#[derive(Clone, Debug, Default)]
pub struct Series {
    pub name: String,
    pub color: [u8; 3],
    pub points: Vec<(f64, f64)>,
    pub mark: Mark,
    /// Low and high in y, one for each point: bars through points, a band around a bare line.
    pub intervals: Option<Vec<(f64, f64)>>,
    /// The same in x: always bars.
    pub x_intervals: Option<Vec<(f64, f64)>>,
    /// Words next to the points, one for each.
    pub labels: Option<Vec<String>>,
}

impl Series {
    fn is_dotted(&self) -> bool {
        matches!(self.mark, Mark::Points | Mark::LineAndPoints)
    }

    /// Its line, if it has one.
    fn line(&self, points: &[(f64, f64)]) -> String {
        let dashes = if self.mark == Mark::DashedLine { " stroke-dasharray=\"6 4\"" } else { "" };
        let style = format!("fill=\"none\" stroke=\"{}\" stroke-width=\"2\"{dashes}", hex(self.color));
        let line = format!("<path {style} stroke-linejoin=\"round\" d=\"{}\"/>", path(points));
        if self.mark == Mark::Points { String::new() } else { line }
    }

    /// One of its dots, if it has any.
    fn dot(&self, (x, y): (f64, f64)) -> String {
        let place = format!("cx=\"{}\" cy=\"{}\"", n(x), n(y));
        let dot = format!("<circle {place} r=\"4\" fill=\"{}\" stroke=\"#fff\"/>", hex(self.color));
        if self.is_dotted() { dot } else { String::new() }
    }
}

/// What a chart measures; a range that is not given is taken from the series and their intervals.
#[derive(Clone, Debug, Default)]
pub struct Axes {
    pub title: String,
    pub x: String,
    pub y: String,
    pub is_x_log: bool,
    pub x_range: Option<(f64, f64)>,
    pub y_range: Option<(f64, f64)>,
}

/// A chart of 800 × 420 px; its legend stands above the data, never on them.
pub fn chart(axes: &Axes, series: &[Series]) -> String {
    let (left, right, bottom) = (84.0, 768.0, 368.0);
    let mut body = text(400.0, 22.0, &[BOLD, MIDDLE].concat(), &axes.title, 768.0);
    let (mut x, mut y) = (left, 44.0);
    for one in series {
        let width = 46.0 + wide(&one.name);
        if x + width > right && x > left {
            (x, y) = (left, y + 18.0);
        }
        body += &one.line(&[(x, y - 4.0), (x + 24.0, y - 4.0)]);
        body += &one.dot((x + 12.0, y - 4.0));
        body += &text(x + 30.0, y, "", &one.name, right - left - 30.0);
        x += width;
    }
    let top = y + 14.0;
    let ends = |spans: &Option<Vec<(f64, f64)>>| spans.iter().flatten().flat_map(|s| [s.0, s.1]).collect::<Vec<_>>();
    let xs: Vec<f64> = series.iter().flat_map(|s| s.points.iter().map(|p| p.0).chain(ends(&s.x_intervals))).collect();
    let ys: Vec<f64> = series.iter().flat_map(|s| s.points.iter().map(|p| p.1).chain(ends(&s.intervals))).collect();
    let x_axis = Scale::new(axes.x_range, axes.is_x_log, &xs, (left, right));
    let y_axis = Scale::new(axes.y_range, false, &ys, (bottom, top));

    let mut grid = String::new();
    for (at, label) in y_axis.ticks(45.0) {
        grid += &path(&[(left, at), (right, at)]);
        body += &text(left - 8.0, at + 4.0, &[QUIET, " text-anchor=\"end\""].concat(), &label, 48.0);
    }
    for (at, label) in x_axis.ticks(80.0) {
        grid += &path(&[(at, top), (at, bottom)]);
        body += &text(at, bottom + 18.0, &[QUIET, MIDDLE].concat(), &label, 64.0);
    }
    let corner = path(&[(left, top), (left, bottom), (right, bottom)]);
    body += &format!("<path stroke=\"#e3e5e9\" d=\"{grid}\"/><path fill=\"none\" stroke=\"#8a909b\" d=\"{corner}\"/>");
    body += &text((left + right) / 2.0, 406.0, MIDDLE, &axes.x, right - left);
    let middle = (top + bottom) / 2.0;
    body += &text(24.0, middle, &format!("{MIDDLE} transform=\"rotate(-90 24 {})\"", n(middle)), &axes.y, bottom - top);

    // An inner svg cuts off what leaves the plotting area.
    let [a, b, c, d] = [left, top, right - left, bottom - top].map(n);
    body += &format!("<svg x=\"{a}\" y=\"{b}\" width=\"{c}\" height=\"{d}\" viewBox=\"{a} {b} {c} {d}\">");
    let at = |x: f64, y: f64| (x_axis.at(x), y_axis.at(y));
    let mut over = String::new();
    let mut words = Vec::new();
    // Boxes (centre, half of width and height) that words should keep clear of.
    let mut taken = Vec::new();
    for one in series {
        let color = hex(one.color);
        let points: Vec<_> = one.points.iter().map(|p| at(p.0, p.1)).collect();
        let up = one.points.iter().zip(one.intervals.iter().flatten()).map(|(p, i)| [at(p.0, i.0), at(p.0, i.1)]);
        let up: Vec<_> = up.collect();
        let along = one.points.iter().zip(one.x_intervals.iter().flatten()).map(|(p, i)| [at(i.0, p.1), at(i.1, p.1)]);
        let mut bars: Vec<_> = along.collect();
        if one.is_dotted() {
            bars.extend(up);
        } else {
            let around = up.iter().map(|bar| bar[0]).chain(up.iter().rev().map(|bar| bar[1]));
            let band: Vec<_> = around.filter(is_finite).collect();
            body += &format!("<path fill=\"{color}\" fill-opacity=\".18\" d=\"{}\"/>", path(&band));
        }
        let mut whiskers = String::new();
        for [p, q] in bars.into_iter().filter(|bar| bar.iter().all(is_finite)) {
            let (dx, dy) = if p.0 == q.0 { (3.0, 0.0) } else { (0.0, 3.0) };
            let cap = |(x, y): (f64, f64)| [(x - dx, y - dy), (x + dx, y + dy)];
            whiskers += &path(&[&cap(p), [p, q].as_slice(), &cap(q)].concat());
            taken.push((
                (p.0 + q.0) / 2.0,
                (p.1 + q.1) / 2.0,
                (p.0 - q.0).abs() / 2.0 + dx,
                (p.1 - q.1).abs() / 2.0 + dy,
            ));
        }
        body += &format!("<path fill=\"none\" stroke=\"{color}\" stroke-opacity=\".6\" d=\"{whiskers}\"/>");
        body += &one.line(&points);
        for (pair, t) in points.windows(2).flat_map(|pair| (1..16).map(move |i| (pair, f64::from(i) / 16.0))) {
            let [(x0, y0), (x1, y1)] = [pair[0], pair[1]];
            taken.push((x0 + t * (x1 - x0), y0 + t * (y1 - y0), 1.0, 1.0));
        }
        for (i, &(x, y)) in points.iter().enumerate() {
            if (left..=right).contains(&x) && (top..=bottom).contains(&y) {
                over += &one.dot((x, y));
                // A dot weighs as much as three lines.
                taken.extend([(x, y, 5.0, 5.0); 3]);
                words.extend(one.labels.iter().flatten().nth(i).map(|label| (x, y, label, one.color)));
            }
        }
    }
    for (x, y, label, color) in words {
        let half = wide(label) / 2.0;
        let sides = [half + 7.0, -half - 7.0, 0.0, half + 12.0, -half - 12.0];
        let places = sides.into_iter().flat_map(|dx| [-11.0, 12.0, 0.0, -19.0, 20.0].map(|dy| (x + dx, y + dy)));
        let crowd = |&(x, y): &(f64, f64)| {
            let is_outside = x - half < left || x + half > right || y - 6.0 < top || y + 6.0 > bottom;
            let hits = taken.iter().filter(|t| (x - t.0).abs() < half + t.2 && (y - t.1).abs() < 6.0 + t.3).count();
            hits + if is_outside { 1000 } else { 0 }
        };
        if let Some((x, y)) = places.min_by_key(crowd) {
            let style =
                format!("{MIDDLE} paint-order=\"stroke\" stroke=\"#fff\" stroke-width=\"3\" fill=\"{}\"", hex(color));
            over += &text(x, y + 4.0, &style, label, 2.0 * half);
            taken.push((x, y, half, 6.0));
        }
    }
    document(800.0, 420.0, &(body + "</svg>" + &over))
}

/// One axis: where a value stands between its two ends.
struct Scale {
    is_log: bool,
    /// Least and largest value, as powers of ten if logarithmic.
    low: f64,
    high: f64,
    ends: (f64, f64),
}

impl Scale {
    fn new(range: Option<(f64, f64)>, is_log: bool, values: &[f64], ends: (f64, f64)) -> Scale {
        let map = |value: f64| if is_log { libm::log10(value) } else { value };
        let there = values.iter().map(|v| map(*v)).filter(|v| v.is_finite());
        let (least, most) = there.fold((f64::MAX, f64::MIN), |(low, high), v| (low.min(v), high.max(v)));
        let pad = 0.04 * (most - least);
        let (low, high) = match range.map_or((least - pad, most + pad), |(low, high)| (map(low), map(high))) {
            (low, high) if low == high => (low - low.abs().max(1.0), low + low.abs().max(1.0)),
            (low, high) if low < high && (high - low).is_finite() => (low, high),
            _ => (0.0, 1.0),
        };
        Scale { is_log, low, high, ends }
    }

    fn place(&self, mapped: f64) -> f64 {
        self.ends.0 + (mapped - self.low) / (self.high - self.low) * (self.ends.1 - self.ends.0)
    }

    fn at(&self, value: f64) -> f64 {
        self.place(if self.is_log { libm::log10(value) } else { value })
    }

    /// Places and labels of multiples of 1, 2 or 5 times a power of ten, at least `room` px apart. On a logarithmic
    /// axis it is the exponents that are so spaced.
    fn ticks(&self, room: f64) -> Vec<(f64, String)> {
        let rough = (self.high - self.low) * room / (self.ends.1 - self.ends.0).abs();
        let power = libm::pow(10.0, libm::floor(libm::log10(rough)));
        let round = [1.0, 2.0, 5.0].map(|m| m * power).into_iter().find(|step| *step >= rough);
        let step = round.unwrap_or(10.0 * power).max(if self.is_log { 1.0 } else { 0.0 });
        let decimals = -libm::floor(libm::log10(step) + 1e-9).min(0.0) as usize;
        let raise = |c: char| c.to_digit(10).and_then(|digit| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit as usize)).unwrap_or('⁻');
        let label = |number: String| match self.is_log {
            true => format!("10{}", number.chars().map(raise).collect::<String>()),
            false => number.replace('-', "−"),
        };
        let within = libm::ceil(self.low / step - 1e-9) as i64..=libm::floor(self.high / step + 1e-9) as i64;
        let values = within.map(|i| i as f64 * step);
        values.map(|value| (self.place(value), label(format!("{value:.decimals$}")))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::assert_well_formed;
    use super::*;

    #[test]
    fn points_land_in_the_plotting_area() {
        let points = vec![(100.0, -80.0), (1e4, f64::NAN), (1e5, -1e300), (1e6, -20.0)];
        let intervals = Some(points.iter().map(|p| (p.1 - 5.0, p.1 + 5.0)).collect());
        let one =
            Series { name: "history <4>".into(), points, intervals, mark: Mark::LineAndPoints, ..Series::default() };
        let svg = chart(&Axes { is_x_log: true, y_range: Some((-100.0, 0.0)), ..Axes::default() }, &[one]);
        assert_well_formed(&svg);
        for words in ["history &lt;4&gt;", "10²", "10⁶", "−100", "0"] {
            assert!(svg.contains(&format!(">{words}<")), "{words}");
        }
        let read = |tag: &str, name: &str| -> f64 {
            let (_, value) = tag.split_once(&format!("{name}=\"")).unwrap();
            value.split('"').next().unwrap().parse().unwrap()
        };
        let area = &svg[svg.find("<svg x=").unwrap()..];
        let [left, top, width, height] = [" x", " y", " width", " height"].map(|name| read(area, name));
        let dots: Vec<_> = area.split("<circle").skip(1).map(|tag| (read(tag, " cx"), read(tag, " cy"))).collect();
        // What is not finite or out of range is left out; what is in range stands to scale.
        assert_eq!(dots.len(), 2);
        assert!((dots[0].0 - left - 0.04 / 1.08 * width).abs() < 0.02 && (dots[0].1 - top - 0.8 * height).abs() < 0.02);
        assert!((dots[1].0 - left - 1.04 / 1.08 * width).abs() < 0.02 && (dots[1].1 - top - 0.2 * height).abs() < 0.02);
    }
}
