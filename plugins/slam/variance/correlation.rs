//! How long errors last.

/// The longest lag that is looked at.
const LONGEST: usize = 300;
/// A window of this many times τ (Sokal, Monte Carlo Methods in Statistical Mechanics, 1996).
const WINDOW: f64 = 5.0;

/// The integrated autocorrelation time τ = 1 + 2 Σ ρₖ of series of errors around zero, at least 1: as many consecutive
/// errors say as much as one alone. Series are pooled; `None` in a series is a gap.
pub(super) fn autocorrelation_time(series: &[Vec<Option<f64>>]) -> f64 {
    let all = || series.iter().flatten().flatten();
    let variance = all().map(|x| x * x).sum::<f64>() / all().count().max(1) as f64;
    if variance.is_nan() || variance <= 0.0 {
        return 1.0;
    }
    let mut tau = 1.0;
    for lag in 1..=LONGEST {
        let (mut sum, mut count) = (0.0, 0usize);
        for series in series {
            for (now, later) in series.iter().zip(series.iter().skip(lag)) {
                if let (Some(now), Some(later)) = (now, later) {
                    sum += now * later;
                    count += 1;
                }
            }
        }
        // past this, it is noise that is summed
        if count == 0 || sum <= 0.0 || lag as f64 > WINDOW * tau {
            break;
        }
        tau += 2.0 * sum / count as f64 / variance;
    }
    f64::max(tau, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    /// xₜ = a xₜ₋₁ + noise, of unit variance.
    fn autoregressive(a: f64, n: usize) -> Vec<Option<f64>> {
        let mut rng = Pcg64::seed_from_u64(1);
        let mut x = 0.0;
        let step = |_| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            x = a * x + (1.0 - a * a).sqrt() * noise;
            Some(x)
        };
        (0..n).map(step).collect()
    }

    #[test]
    fn an_autoregression_has_its_time() {
        for a in [0.0, 0.5, 0.9] {
            let tau = autocorrelation_time(&[autoregressive(a, 40_000)]);
            let expected = (1.0 + a) / (1.0 - a);
            assert!((tau / expected - 1.0).abs() < 0.15, "{a}: {tau}, not {expected}");
        }
    }

    #[test]
    fn errors_that_take_turns_are_no_better_than_independent_ones() {
        let series: Vec<_> = (0..100).map(|i| Some(if i % 2 == 0 { 1.0 } else { -1.0 })).collect();
        assert_eq!(autocorrelation_time(&[series]), 1.0);
        assert_eq!(autocorrelation_time(&[]), 1.0);
        assert_eq!(autocorrelation_time(&[vec![Some(0.0), None]]), 1.0);
    }
}
