//! Bootstrap confidence intervals (Efron and Tibshirani, An Introduction to the Bootstrap, chapter 13).
use super::PosePair;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;
use std::collections::BTreeMap;

/// A mean with its 95 % confidence interval. The bounds are `None`, and not serialized, if there is nothing
/// to resample: a single cluster or a single resample.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Interval {
    /// Mean of the sample.
    pub mean: f64,
    /// 2.5 % quantile of the resampled means.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub low: Option<f64>,
    /// 97.5 % quantile of the resampled means.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub high: Option<f64>,
}

/// Returns the mean of all values and its percentile interval. Resamples whole clusters with replacement, as
/// many as there are. `None` without values. The result depends only on the values, the number of resamples
/// and the seed.
pub fn bootstrap(clusters: &[Vec<f64>], resamples: usize, seed: u64) -> Option<Interval> {
    // the mean needs only the sums of the clusters
    let sums = clusters.iter().filter(|c| !c.is_empty()).map(|c| [c.iter().sum(), c.len() as f64]);
    let sums: Vec<[f64; 2]> = sums.collect();
    (!sums.is_empty()).then(|| resample(&sums, |[sum, count]| sum / count, resamples, seed))
}

/// Returns `of` the sum over all clusters, and its percentile interval.
fn resample(sums: &[[f64; 2]], of: fn([f64; 2]) -> f64, resamples: usize, seed: u64) -> Interval {
    let add = |a: [f64; 2], b: &[f64; 2]| [a[0] + b[0], a[1] + b[1]];
    let mean = of(sums.iter().fold([0.0; 2], add));
    if sums.len() < 2 || resamples < 2 {
        return Interval { mean, low: None, high: None };
    }
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut draw =
        || of((0..sums.len()).fold([0.0; 2], |a, _| add(a, &sums[rng.random_range(0..sums.len())])));
    let mut all: Vec<f64> = (0..resamples).map(|_| draw()).collect();
    all.sort_by(f64::total_cmp);
    let quantile = |q: f64| all.get(((all.len() - 1) as f64 * q).round() as usize).copied();
    Interval { mean, low: quantile(0.025), high: quantile(0.975) }
}

/// Length of the blocks, in seconds. Errors of a trajectory are correlated in time, so whole blocks are
/// resampled.
const BLOCK_S: f64 = 10.0;
/// Number of resamples, and the seed of the draws.
const RESAMPLES: usize = 2000;
const SEED: u64 = 1;

/// Returns the relative change of the absolute trajectory error (RMSE of positions) from `before` to `after`.
/// The interval resamples blocks of ten seconds, with the alignment of the whole trajectory. `None` without
/// pairs, or if the error before is zero.
pub fn change_of_error(before: &[PosePair], after: &[PosePair]) -> Option<Interval> {
    let began = before.first()?.timestamp;
    let mut blocks: BTreeMap<u64, [f64; 2]> = BTreeMap::new();
    for (pairs, side) in [(after, 0), (before, 1)] {
        for pair in pairs {
            let block = ((pair.timestamp - began).max(0.0) / BLOCK_S) as u64;
            let off = (pair.truth.translation - pair.estimate.translation).norm_squared();
            blocks.entry(block).or_default()[side] += off;
        }
    }
    let sums: Vec<[f64; 2]> = blocks.into_values().collect();
    let change = resample(&sums, |[after, before]| (after / before).sqrt() - 1.0, RESAMPLES, SEED);
    Some(change).filter(|change| change.mean.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::{Se3, So3};

    fn as_clusters(values: impl IntoIterator<Item = f64>) -> Vec<Vec<f64>> {
        values.into_iter().map(|x| vec![x]).collect()
    }

    #[test]
    fn an_interval_is_that_of_the_normal_law_for_many_values() {
        // 1 to 400: the standard error of the mean is 400 / √12 / √400
        let interval = bootstrap(&as_clusters((1..=400).map(f64::from)), 4000, 1).unwrap();
        let expected = 1.96 * 400.0 / 12f64.sqrt() / 20.0;
        assert_eq!(interval.mean, 200.5);
        let (low, high) = (interval.low.unwrap(), interval.high.unwrap());
        assert!((high - 200.5 - expected).abs() < 0.1 * expected, "{interval:?}");
        assert!((200.5 - low - expected).abs() < 0.1 * expected, "{interval:?}");
    }

    #[test]
    fn what_is_alike_within_a_cluster_counts_once() {
        let apart = bootstrap(&as_clusters([1.0, 2.0, 3.0, 4.0]), 2000, 7).unwrap();
        let tenfold: Vec<Vec<f64>> = [1.0, 2.0, 3.0, 4.0].map(|x| vec![x; 10]).into();
        assert_eq!(bootstrap(&tenfold, 2000, 7).unwrap(), apart);
    }

    #[test]
    fn the_same_seed_gives_the_same_bits() {
        let values = as_clusters((0..50).map(|i| f64::from(i * i)));
        assert_eq!(bootstrap(&values, 500, 3), bootstrap(&values, 500, 3));
        assert_ne!(bootstrap(&values, 500, 3), bootstrap(&values, 500, 4));
        assert_eq!(bootstrap(&[], 500, 3), None);
    }

    #[test]
    fn one_value_or_one_cluster_or_one_sample_has_no_interval() {
        for (clusters, resamples) in
            [(as_clusters([2.0]), 100), (vec![vec![1.0, 3.0]], 100), (as_clusters([1.0, 3.0]), 1)]
        {
            let interval = bootstrap(&clusters, resamples, 1).unwrap();
            assert_eq!(interval, Interval { mean: 2.0, low: None, high: None });
            assert!(!excludes_zero(&interval));
            assert_eq!(serde_json::to_string(&interval).unwrap(), r#"{"mean":2.0}"#);
        }
    }

    /// Returns whether zero lies outside of the interval; false without an interval.
    fn excludes_zero(interval: &Interval) -> bool {
        interval.low.is_some_and(|low| low > 0.0) || interval.high.is_some_and(|high| high < 0.0)
    }

    /// Poses at intervals of one second, with the given position errors.
    fn poses_with_errors(by: impl Fn(usize) -> f64) -> Vec<PosePair> {
        let pair = |i: usize| PosePair {
            timestamp: i as f64,
            truth: Se3::identity(),
            estimate: Se3::new(So3::identity(), nalgebra::Vector3::new(by(i), 0.0, 0.0)),
        };
        (0..100).map(pair).collect()
    }

    #[test]
    fn a_change_that_is_everywhere_is_certain_and_one_in_a_single_block_is_not() {
        let before = poses_with_errors(|_| 0.1);
        let certain = change_of_error(&before, &poses_with_errors(|_| 0.08)).unwrap();
        assert!((certain.mean + 0.2).abs() < 1e-12 && excludes_zero(&certain), "{certain:?}");
        let uncertain =
            change_of_error(&before, &poses_with_errors(|i| if i < 10 { 0.0 } else { 0.1 })).unwrap();
        assert!(uncertain.mean < 0.0 && !excludes_zero(&uncertain), "{uncertain:?}");
        assert_eq!(change_of_error(&poses_with_errors(|_| 0.0), &before), None);
        assert_eq!(change_of_error(&[], &[]), None);
    }
}
