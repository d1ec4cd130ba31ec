//! How numbers are written: with a true minus, in steps, in per cent.

use egui::DragValue;

use crate::ape::written;
use crate::mdp::ReturnKind;

/// A number with so many decimals and a true minus sign.
pub fn decimal(value: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$}", value.abs());
    let is_zero = text.bytes().all(|byte| byte == b'0' || byte == b'.');
    if value < 0.0 && !is_zero { format!("−{text}") } else { text }
}

/// How many times as large one number is as another; a dash where that is no number.
pub fn times(number: f64, other: f64) -> String {
    let ratio = number / other;
    if ratio.is_finite() { steps(ratio) + "×" } else { "–".to_owned() }
}

/// A field for a number, written in full: who only passes through it with the keyboard has egui read the text again, and
/// it must be the same number.
pub fn exact(value: &mut f64) -> DragValue<'_> {
    DragValue::new(value).custom_formatter(|value, _| written(value)).update_while_editing(false)
}

/// Steps or a return, short: one decimal, and powers of ten where it is huge.
pub fn steps(value: f64) -> String {
    if value.abs() >= f64::from(f32::MAX) {
        return if value < 0.0 { "< −10³⁸" } else { "> 10³⁸" }.to_owned();
    }
    if value.abs() < 9999.5 {
        return decimal(value, 1);
    }
    let exponent = libm::floor(libm::log10(value.abs()));
    let mantissa = value / libm::pow(10.0, exponent);
    format!("{}×10{}", decimal(mantissa, 1), superscript(exponent as u32))
}

/// Steps in a table: two decimals, powers of ten where they are huge.
pub fn short(value: f64) -> String {
    if value.abs() < 9999.5 { decimal(value, 2) } else { steps(value) }
}

/// A count with its thousands apart.
pub fn grouped(count: u32) -> String {
    let digits = count.to_string();
    let groups: Vec<&str> = digits.as_bytes().rchunks(3).rev().filter_map(|g| std::str::from_utf8(g).ok()).collect();
    groups.join(",")
}

fn superscript(number: u32) -> String {
    let digits = ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'];
    number.to_string().bytes().map(|byte| digits[usize::from(byte - b'0')]).collect()
}

/// A probability in per cent; never 100 % for less than certainty, nor 0 % for what can happen.
pub fn percent(p: f64) -> String {
    match p {
        p if p <= 0.0 => "0 %".to_owned(),
        p if p >= 1.0 - 1e-12 => "100 %".to_owned(),
        p if p < 0.01 => "< 1 %".to_owned(),
        p if p > 0.99 => "> 99 %".to_owned(),
        p => format!("{:.0} %", 100.0 * p),
    }
}

/// A number as somebody has set it, as β or α: no more decimals than it has, four at most.
pub fn as_set(value: f64) -> String {
    format!("{}", libm::round(value * 1e4) / 1e4).replace('-', "−")
}

/// A probability to a tenth of a per cent; the same at the ends.
pub fn fine_percent(p: f64) -> String {
    match p {
        p if p <= 0.0 => "0 %".to_owned(),
        p if p >= 1.0 - 1e-12 => "100 %".to_owned(),
        p if p < 0.0005 => "< 0.1 %".to_owned(),
        p if p >= 0.9995 => "> 99.9 %".to_owned(),
        p => format!("{:.1} %", 100.0 * p),
    }
}

/// A return of some kind.
pub fn of_kind(kind: &ReturnKind, value: f64) -> String {
    if kind.is_steps { steps(value) } else { percent(value) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_for_readers() {
        assert_eq!(steps(-16.94), "−16.9");
        assert_eq!((times(-52.0, -10.0).as_str(), times(-52.0, -1e-320).as_str()), ("5.2×", "–"));
        assert_eq!((times(-52.0, 0.0).as_str(), times(0.0, 0.0).as_str()), ("–", "–"));
        assert_eq!(steps(-0.01), "0.0");
        assert_eq!([0.6, 0.0625, -20.125].map(as_set), ["0.6", "0.0625", "−20.125"]);
        assert_eq!(steps(-1.67e9), "−1.7×10⁹");
        assert_eq!([7, 100, 1000, 1_234_567].map(grouped), ["7", "100", "1,000", "1,234,567"]);
        assert_eq!(steps(12345.0), "1.2×10⁴");
        assert_eq!((steps(-1e300).as_str(), steps(f64::INFINITY).as_str()), ("< −10³⁸", "> 10³⁸"));
        assert_eq!([0.0, 1.0, 0.999_99, 0.001, 0.136].map(percent), ["0 %", "100 %", "> 99 %", "< 1 %", "14 %"]);
        let fine = [0.0, 1.0, 0.999_99, 0.0001, 0.1364, 0.9994].map(fine_percent);
        assert_eq!(fine, ["0 %", "100 %", "> 99.9 %", "< 0.1 %", "13.6 %", "99.9 %"]);
    }
}
