//! A figure over several seeds: mean, standard deviation, and an interval that resampling gives.

use rand::{RngExt, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use serde::{Deserialize, Serialize};

/// A figure over several seeds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    pub mean: f64,
    /// Standard deviation over seeds (n − 1); 0 for a single one.
    pub sd: f64,
    /// Ends of the 95 % bootstrap interval of the mean.
    pub low: f64,
    pub high: f64,
    /// Number of seeds.
    pub seeds: u32,
}

impl Summary {
    /// Nothing for no values. The interval is that of the percentile bootstrap (Efron 1979), always with the
    /// same resamples.
    pub fn of(values: &[f64]) -> Option<Summary> {
        const RESAMPLES: usize = 4000;
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
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
        let mut draw = || values[rng.random_range(0..values.len() as u32) as usize];
        let mut means: Vec<f64> = (0..RESAMPLES).map(|_| (0..values.len()).map(|_| draw()).sum::<f64>() / n).collect();
        means.sort_by(f64::total_cmp);
        let at = |share: f64| means[((RESAMPLES - 1) as f64 * share) as usize];
        Some(Summary { mean, sd, low: at(0.025), high: at(0.975), seeds: values.len() as u32 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_of_known_numbers() {
        assert_eq!(Summary::of(&[]), None);
        let one = Summary::of(&[2.5]).unwrap();
        assert_eq!((one.mean, one.sd, one.low, one.high, one.seeds), (2.5, 0.0, 2.5, 2.5, 1));
        let far = Summary::of(&[-1e300, 0.0]).unwrap();
        assert!((far.sd / 5e299 - f64::sqrt(2.0)).abs() < 1e-12 && far.low.is_finite(), "{far:?}");
        let values: Vec<f64> = (1..=100).map(f64::from).collect();
        let many = Summary::of(&values).unwrap();
        assert!((many.mean - 50.5).abs() < 1e-12 && (many.sd - 29.011_491_975_882_016).abs() < 1e-9);
        // Of so many the bootstrap is nearly the normal interval, mean ± 1.96 sd / √n.
        let half = 1.96 * many.sd / 10.0;
        assert!((many.low - (50.5 - half)).abs() < 0.4 && (many.high - (50.5 + half)).abs() < 0.4, "{many:?}");
    }
}
