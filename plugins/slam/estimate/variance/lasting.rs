//! What lasts of the errors of boxes, and for how long.
//!
//! The error of a side is x + o: x is new in each box, o changes slowly, as a first-order Gauss-Markov process, whose covariance at a distance
//! of t seconds is σ² exp(-t/T). The object follows its boxes, and takes up most of what lasts: residuals alone have a T that is too short.
//! So the likelihood is that of what an object cannot take up (restricted likelihood; Patterson and Thompson, *Recovery of inter-block
//! information when block sizes are unequal*, 1971), with poses as they are estimated.
use super::offsets::kept_by_mean;
use nalgebra::{SMatrix, SVector};
use rayon::prelude::*;
use serde::Serialize;

/// What lasts of the errors of boxes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LastingComponent {
    /// The standard deviation of what is new in each box, as a multiple of that of residuals.
    pub white: f64,
    /// The standard deviation of what lasts, as a multiple of that of residuals.
    pub lasting: f64,
    /// After so many seconds 1/e of it is left.
    pub seconds: f64,
}

/// An error of a side, in standard deviations of residuals.
#[derive(Debug, Clone, Copy)]
pub(super) struct TimedError {
    /// In seconds.
    pub(super) time: f64,
    pub(super) error: f64,
    /// Its derivative by the object.
    pub(super) by_object: SVector<f64, 9>,
}

impl TimedError {
    pub(super) fn divided_by(self, sigma: f64) -> Self {
        Self { error: self.error / sigma, by_object: self.by_object / sigma, ..self }
    }
}

/// Times that are tried, each longer than the one before by a factor of √2, from the mean interval between boxes on.
const TIMES: i32 = 17;
/// Shares of the variance that are tried, in steps of one by this: less than 5 % of it that is new in each box counts as none.
const SHARES: i32 = 20;
/// Twice the logarithm of the likelihood is larger by so much than that of errors that do not last: three standard errors.
const CLEAR: f64 = 9.0;
/// Of a prior that holds what boxes do not: σ of 1 rad, 1 m and a factor of e.
const HELD: f64 = 1.0;

impl LastingComponent {
    /// What the noise of a box is given: what is new in each, and what an offset that is the same over an interval does not take up.
    pub(super) fn in_boxes(&self) -> f64 {
        self.white.hypot(self.lasting * (1.0 - kept_by_mean()).sqrt())
    }

    /// What offsets are given.
    pub(super) fn in_offsets(&self) -> f64 {
        self.lasting * kept_by_mean().sqrt()
    }
}

/// Errors of the sides of an object, each in the order of time.
pub(super) type Sides = [Vec<TimedError>; 4];

/// The most likely of a grid of shares and times. `None` where nothing lasts, or there is too little to say so.
pub(super) fn lasting(objects: &[Sides]) -> Option<LastingComponent> {
    let series = || objects.iter().flatten();
    let errors = series().map(Vec::len).sum::<usize>() as f64;
    let freedom = errors - (9 * objects.len()) as f64;
    let steps = series().flat_map(|series| series.windows(2));
    let (count, sum) = steps.fold((0.0, 0.0), |(n, sum), pair| (n + 1.0, sum + pair[1].time - pair[0].time));
    let interval: f64 = sum / count;
    if !(freedom > 0.0 && interval > 0.0) {
        return None;
    }
    let likelihood = |(share, seconds): (f64, f64)| {
        let of_object = |sides: &Sides| restricted(sides, share, seconds);
        let (logs, squares) = objects.iter().map(of_object).fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
        let variance = squares / freedom;
        (logs + freedom * f64::ln(variance), variance)
    };
    let times = (0..TIMES).map(|step| interval * 2f64.powf(0.5 * f64::from(step)));
    let shares = || (1..=SHARES).map(|step| f64::from(step) / f64::from(SHARES));
    let grid: Vec<(f64, f64)> =
        times.flat_map(|seconds| shares().map(move |share| (share, seconds))).collect();
    let found: Vec<(f64, f64)> = grid.par_iter().map(|of| likelihood(*of)).collect();
    let tried = grid.into_iter().zip(found).filter(|(_, (minus, _))| minus.is_finite());
    let ((share, seconds), (minus, variance)) = tried.min_by(|a, b| a.1.0.total_cmp(&b.1.0))?;
    let is_clear = likelihood((0.0, interval)).0 - minus > CLEAR;
    let [white, lasting] = [1.0 - share, share].map(|share| (share * variance).sqrt());
    is_clear.then_some(LastingComponent { white, lasting, seconds })
}

/// The logarithms of determinants, and the squares, of what an object cannot take up, for errors of variance 1.
fn restricted(sides: &Sides, share: f64, seconds: f64) -> (f64, f64) {
    let mut logs = 0.0;
    // of errors and derivatives, each side made white: the information that they are worth
    let mut information = SMatrix::<f64, 10, 10>::zeros();
    for side in sides {
        // a filter for the part that lasts: its mean for each column, and its variance
        let (mut mean, mut variance) = (SVector::<f64, 10>::zeros(), share);
        let mut before = side.first().map_or(0.0, |first| first.time);
        for error in side {
            let left = ((before - error.time) / seconds).exp();
            before = error.time;
            mean *= left;
            variance = left * left * variance + share * (1.0 - left * left);
            let innovation = error.by_object.push(error.error) - mean;
            let total = variance + 1.0 - share;
            logs += total.ln();
            information.ger(1.0 / total, &innovation, &innovation, 1.0);
            mean += innovation * (variance / total);
            variance *= (1.0 - share) / total;
        }
    }
    let by_object = information.fixed_view::<9, 9>(0, 0) + SMatrix::<f64, 9, 9>::identity() * HELD;
    let gradient = information.fixed_view::<9, 1>(0, 9).into_owned();
    let Some(cholesky) = by_object.cholesky() else { return (f64::NAN, f64::NAN) };
    let taken_up = gradient.dot(&cholesky.solve(&gradient));
    let determinant: f64 = cholesky.l_dirty().diagonal().iter().map(|d| d.ln()).sum();
    (logs + 2.0 * determinant, information[(9, 9)] - taken_up)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    /// Errors of 40 objects in 100 boxes each, at intervals of 0.1 s, less what an object takes up that follows them by two parameters: a
    /// constant, and a line.
    fn errors(white: f64, lasting: f64, seconds: f64, seed: u64) -> Vec<Sides> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut normal = move || -> f64 { StandardNormal.sample(&mut rng) };
        let left = (-0.1 / seconds).exp();
        let mut side = |s: usize| -> Vec<TimedError> {
            let mut slow = lasting * normal();
            let box_at = |i: usize| {
                slow = left * slow + lasting * (1.0 - left * left).sqrt() * normal();
                let mut by_object = SVector::<f64, 9>::zeros();
                (by_object[2 * s], by_object[2 * s + 1]) = (10.0, 0.2 * (i as f64 - 50.0));
                TimedError { time: 0.1 * i as f64, error: slow + white * normal(), by_object }
            };
            let mut all: Vec<TimedError> = (0..100).map(box_at).collect();
            let mean = all.iter().map(|e| e.error).sum::<f64>() / 100.0;
            all.iter_mut().for_each(|e| e.error -= mean);
            all
        };
        (0..40).map(|_| [0, 1, 2, 3].map(&mut side)).collect()
    }

    #[test]
    fn share_and_time_are_found_although_the_object_takes_up_what_lasts() {
        for (white, slow, seconds) in [(1.0, 2.0, 1.0), (2.0, 1.0, 0.5)] {
            let found = lasting(&errors(white, slow, seconds, 1)).unwrap();
            assert!((found.white / white).ln().abs() < 0.3, "{found:?}, not {white}");
            assert!((found.lasting / slow).ln().abs() < 0.3, "{found:?}, not {slow}");
            assert!((found.seconds / seconds).ln().abs() < 0.5, "{found:?}, not {seconds}");
        }
    }

    #[test]
    fn nothing_lasts_of_white_errors() {
        assert_eq!(lasting(&errors(1.0, 0.0, 1.0, 2)), None);
        assert_eq!(lasting(&[]), None);
    }
}
