//! From logits to policies, once for every row of an update.

use super::Ensemble;
use crate::mdp::{ACTIONS, Policy};

/// The experts of a table of logits, `[n][S][5]`: π(a) = exp θ_a / Σ exp θ, the same bits on every machine.
pub fn softmax(logits: &[f64], cells: usize) -> Ensemble {
    let expert = |logits: &[f64]| {
        let logits = logits.as_chunks::<ACTIONS>().0;
        let mut rows: Vec<[f64; ACTIONS]> = Vec::with_capacity(logits.len());
        rows.extend(logits.iter().map(|row| {
            let top = row[1..].iter().fold(row[0], |top, &logit| if logit > top { logit } else { top });
            row.map(|logit| logit - top)
        }));
        // All in one go, without a branch: a compiler makes two at a time of it.
        rows.as_flattened_mut().iter_mut().for_each(|x| *x = exp(*x));
        for row in &mut rows {
            let scale = 1.0 / row.iter().sum::<f64>();
            *row = row.map(|weight| weight * scale);
        }
        Policy::from_rows(rows)
    };
    Ensemble::new(logits.chunks(cells * ACTIONS).map(expert).collect())
}

/// eˣ of x ≤ 0, to 3 units in the last place; what is below 1e-300 is about that. A library's is exact to the last bit
/// but one, and takes twice as long.
#[inline(always)]
fn exp(x: f64) -> f64 {
    // Adding it rounds to a whole number, which then stands in the lowest bits.
    const ROUND: f64 = 6_755_399_441_055_744.0;
    /// ln 2 in two parts, the first with zeros at its end, so that its multiples are exact.
    const LN_2: (f64, f64) = (6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10);
    const LEAST: f64 = -690.0;
    /// 1 / k!.
    const TAYLOR: [f64; 14] = {
        let mut terms = [1.0; 14];
        let mut k = 1;
        while k < terms.len() {
            terms[k] = terms[k - 1] / k as f64;
            k += 1;
        }
        terms
    };
    // x = k ln 2 + r with |r| ≤ ln 2 / 2.
    let x = if x < LEAST { LEAST } else { x };
    let rounded = x * std::f64::consts::LOG2_E + ROUND;
    let k = rounded - ROUND;
    let r = (x - k * LN_2.0) - k * LN_2.1;
    // Terms in pairs, pairs in pairs: they need not wait for each other.
    let pair = |k: usize| TAYLOR[k] + TAYLOR[k + 1] * r;
    let r2 = r * r;
    let four = |k: usize| pair(k) + pair(k + 2) * r2;
    let r4 = r2 * r2;
    let power = (four(0) + four(4) * r4) + (four(8) + pair(12) * r4) * (r4 * r4);
    power * f64::from_bits(rounded.to_bits().wrapping_add(1023) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_is_that_of_a_library() {
        assert_eq!(exp(0.0), 1.0);
        for i in 0..200_000 {
            let x = -690.0 * (f64::from(i) / 200_000.0) * (f64::from(i) / 200_000.0);
            let library = libm::exp(x);
            assert!((exp(x) / library - 1.0).abs() < 3.0 * f64::EPSILON, "{x}: {} {library}", exp(x));
        }
        assert!(exp(-1e9) > 0.0 && exp(-1e9) < 1e-299 && exp(f64::NEG_INFINITY) > 0.0);
    }

    #[test]
    fn rows_sum_to_one_and_have_the_logits_ratios() {
        let ensemble = softmax(&[1.0, 2.0, -300.0, 0.5, 2.0, 0.0, 0.0, 0.0, 0.0, 1e6], 1);
        assert_eq!(ensemble.experts(), 2);
        let row = ensemble.policies()[0].row(0);
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        assert!((row[1] / row[0] - std::f64::consts::E).abs() < 1e-14 && row[1] == row[4]);
        assert!(row[2] > 0.0 && row[2] < 1e-120);
        assert_eq!(ensemble.policies()[1].row(0)[4], 1.0);
    }
}
