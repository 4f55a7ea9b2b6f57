//! Correlation time of errors.

/// Longest lag.
const MAX_LAG: usize = 300;
/// Window of the sum, in multiples of τ (Sokal, Monte Carlo Methods in Statistical Mechanics, 1996).
const WINDOW_TAUS: f64 = 5.0;

/// Returns the integrated autocorrelation time τ = 1 + 2 Σ ρₖ of series of errors around zero, at least 1.
/// The mean of n such errors has τ times the variance of the mean of independent errors. All series are
/// pooled.
///
/// The lag k counts entries of a series, not frames. So τ describes the errors that exist: a detector that
/// runs on every fifth image, or misses objects at random, has a smaller τ. ρₖ is Σᵢ xᵢ xᵢ₊ₖ / Σᵢ xᵢ²; short
/// series have few pairs at long lags, so n errors never count as less than one.
pub(super) fn autocorrelation_time(series: &[Vec<f64>]) -> f64 {
    let product = |lag: usize| -> f64 {
        let later = |series: &Vec<f64>| -> f64 {
            series.iter().zip(series.iter().skip(lag)).map(|(x, y)| x * y).sum()
        };
        series.iter().map(later).sum()
    };
    let power = product(0);
    let mut tau = 1.0;
    for lag in 1..=MAX_LAG {
        let share = product(lag) / power;
        // beyond the window, the sum would only add noise
        if !(share > 0.0 && lag as f64 <= WINDOW_TAUS * tau) {
            break;
        }
        tau += 2.0 * share;
    }
    tau
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    /// Returns xₜ = a xₜ₋₁ + noise with unit variance, at the selected times.
    fn autoregressive(a: f64, n: usize, seed: u64, mut kept: impl FnMut(usize) -> bool) -> Vec<f64> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut x: f64 = StandardNormal.sample(&mut rng);
        let mut step = || {
            let noise: f64 = StandardNormal.sample(&mut rng);
            x = a * x + (1.0 - a * a).sqrt() * noise;
            x
        };
        let all: Vec<f64> = (0..n).map(|_| step()).collect();
        (0..n).filter(|t| kept(*t)).map(|t| all[t]).collect()
    }

    #[track_caller]
    fn assert_near(tau: f64, expected: f64) {
        assert!((tau / expected - 1.0).abs() < 0.15, "{tau}, not {expected}");
    }

    #[test]
    fn an_autoregression_has_its_time() {
        for a in [0.0, 0.5, 0.9] {
            let tau = autocorrelation_time(&[autoregressive(a, 40_000, 1, |_| true)]);
            assert_near(tau, (1.0 + a) / (1.0 - a));
        }
    }

    #[test]
    fn an_autoregression_seen_at_every_kth_time_has_the_time_of_what_is_seen() {
        let a = 0.9f64;
        for k in [2, 5, 20] {
            let tau = autocorrelation_time(&[autoregressive(a, 20_000 * k, 2, |t| t % k == 0)]);
            let between = a.powi(k as i32);
            assert_near(tau, (1.0 + between) / (1.0 - between));
        }
    }

    #[test]
    fn an_autoregression_seen_at_random_has_the_time_of_what_is_seen() {
        let a = 0.9;
        for p in [0.1, 0.3, 0.7] {
            let mut rng = Pcg64::seed_from_u64(3);
            let tau = autocorrelation_time(&[autoregressive(a, 200_000, 4, |_| rng.random_bool(p))]);
            // 1 + 2 Σₖ p aᵏ: each earlier error is present with probability p
            assert_near(tau, 1.0 + 2.0 * p * a / (1.0 - a));
        }
    }

    #[test]
    fn an_autoregression_seen_in_visits_has_the_time_of_a_visit() {
        // 20 images with the object, then 500 without it
        let (a, n) = (0.9f64, 20);
        let tau = autocorrelation_time(&[autoregressive(a, 520 * 1000, 5, |t| t % 520 < n)]);
        let pairs = (1..n).map(|k| (1.0 - k as f64 / n as f64) * a.powi(k as i32));
        assert_near(tau, 1.0 + 2.0 * pairs.sum::<f64>());
    }

    #[test]
    fn a_few_errors_that_are_alike_say_as_much_as_one_and_no_less() {
        let alike: Vec<Vec<f64>> =
            (0..50).map(|i| vec![(-1f64).powi(i) * (1.0 + f64::from(i)); 10]).collect();
        assert_near(autocorrelation_time(&alike), 10.0);
    }

    #[test]
    fn errors_that_take_turns_are_no_better_than_independent_ones() {
        let series: Vec<_> = (0..100).map(|i| if i % 2 == 0 { 1.0 } else { -1.0 }).collect();
        assert_eq!(autocorrelation_time(&[series]), 1.0);
        assert_eq!(autocorrelation_time(&[]), 1.0);
        assert_eq!(autocorrelation_time(&[vec![0.0], vec![0.0, 0.0]]), 1.0);
    }
}
