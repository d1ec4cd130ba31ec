//! A figure over several seeds: mean, standard deviation, and an interval that resampling gives.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

/// A figure over several seeds.
#[derive(Clone, Debug, PartialEq)]
pub struct Summary {
    pub mean: f64,
    /// Standard deviation over seeds (n − 1); 0 for a single one.
    pub sd: f64,
    /// The figure of each seed; at least one.
    pub values: Vec<f64>,
}

impl Summary {
    /// Nothing for no values.
    pub fn of(values: &[f64]) -> Option<Summary> {
        if values.is_empty() {
            return None;
        }
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        // In a unit in which no square overflows: hitting times go up to 1e300.
        let largest = values.iter().fold(0.0, |largest: f64, value| largest.max(value.abs()));
        let unit = if largest > 1e100 { largest } else { 1.0 };
        let squares: f64 = values.iter().map(|value| ((value - mean) / unit) * ((value - mean) / unit)).sum();
        let sd = if values.len() > 1 { (squares / (n - 1.0)).sqrt() * unit } else { 0.0 };
        Some(Summary { mean, sd, values: values.to_vec() })
    }

    /// Ends of the 95 % interval of the mean: that of the percentile bootstrap (Efron 1979), always with the same
    /// resamples.
    pub fn interval(&self) -> (f64, f64) {
        const RESAMPLES: usize = 4000;
        let count = self.values.len();
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        let mut draw = || self.values[rng.random_range(0..count as u32) as usize];
        let mut means: Vec<f64> =
            (0..RESAMPLES).map(|_| (0..count).map(|_| draw()).sum::<f64>() / count as f64).collect();
        let mut at = |share: f64| {
            let place = ((RESAMPLES - 1) as f64 * share) as usize;
            *means.select_nth_unstable_by(place, f64::total_cmp).1
        };
        (at(0.025), at(0.975))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_of_known_numbers() {
        assert_eq!(Summary::of(&[]), None);
        let one = Summary::of(&[2.5]).unwrap();
        assert_eq!((one.mean, one.sd, one.interval()), (2.5, 0.0, (2.5, 2.5)));
        let far = Summary::of(&[-1e300, 0.0]).unwrap();
        assert!((far.sd / 5e299 - f64::sqrt(2.0)).abs() < 1e-12 && far.interval().0.is_finite(), "{far:?}");
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        let many = Summary::of(&values).unwrap();
        assert!((many.mean - 50.5).abs() < 1e-12 && (many.sd - 29.011_491_975_882_016).abs() < 1e-9);
        // Of so many the bootstrap is nearly the normal interval, mean ± 1.96 sd / √n.
        let half = 1.96 * many.sd / 10.0;
        let (low, high) = many.interval();
        assert!((low - (50.5 - half)).abs() < 0.4 && (high - (50.5 + half)).abs() < 0.4, "{low} to {high}");
    }
}
