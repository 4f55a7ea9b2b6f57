//! Summaries of errors.
use serde::Serialize;

/// A summary of errors, in their unit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Statistics {
    /// Number of errors.
    pub count: usize,
    /// Square root of the mean square.
    pub rmse: f64,
    /// Mean.
    pub mean: f64,
    /// The middle error; the mean of the middle two if their number is even.
    pub median: f64,
    /// Standard deviation, normalized by the number of errors.
    pub std: f64,
    /// Smallest.
    pub min: f64,
    /// Largest.
    pub max: f64,
}

impl Statistics {
    /// Returns the summary of errors; `None` if there are none.
    pub fn of(errors: &[f64]) -> Option<Self> {
        let mut sorted = errors.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (&min, &max) = (sorted.first()?, sorted.last()?);
        let (count, half) = (sorted.len(), sorted.len() / 2);
        let average = |f: &dyn Fn(f64) -> f64| sorted.iter().map(|x| f(*x)).sum::<f64>() / count as f64;
        let mean = average(&|x| x);
        let median = if count % 2 == 1 { sorted[half] } else { (sorted[half - 1] + sorted[half]) / 2.0 };
        let rmse = average(&|x| x * x).sqrt();
        let std = average(&|x| (x - mean) * (x - mean)).sqrt();
        Some(Self { count, rmse, mean, median, std, min, max })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_of_an_even_number_is_between_the_middle_two() {
        let s = Statistics::of(&[4.0, 1.0, 2.0, 9.0]).unwrap();
        assert_eq!((s.median, s.mean, s.min, s.max), (3.0, 4.0, 1.0, 9.0));
        assert!((s.rmse - 25.5_f64.sqrt()).abs() < 1e-15 && (s.std - 9.5_f64.sqrt()).abs() < 1e-15);
        assert_eq!(Statistics::of(&[3.0]).unwrap().median, 3.0);
        assert_eq!(Statistics::of(&[]), None);
    }
}
