//! Trajectory errors by the standard measures, with the same numbers as `evo`.
//!
//! [`associate`] poses by time, [`align`] them, then compute the [`absolute_error`] (ATE) or the
//! [`relative_error`] (RPE). Sturm et al., A Benchmark for the Evaluation of RGB-D SLAM Systems, 2012.
mod align;
mod associate;
mod bootstrap;
mod error;
mod identity;
mod matching;
mod pairing;
mod statistics;
#[cfg(test)]
mod tests;

pub use align::{Alignment, align};
pub use associate::{PosePair, associate};
pub use bootstrap::{Interval, bootstrap, change_of_error};
pub use error::relative_errors;
pub use error::{Pairing, RelativeError, absolute_error, relative_error};
pub use identity::{IdentityScores, identity, matched_objects};
pub use manifactor_geometry::Sim3;
pub use pairing::pair_boxes;
pub use statistics::Statistics;

/// Reason why an error could not be computed.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MetricsError {
    /// No pose has a counterpart within the tolerance.
    #[error(
        "no pose of the estimate is within {within} s of a true pose; do the two share a clock?{}",
        spans(*estimate, *truth)
    )]
    NothingMatches {
        /// Tolerance, in seconds.
        within: f64,
        /// First and last timestamp of the estimate.
        estimate: Option<(f64, f64)>,
        /// First and last timestamp of the truth.
        truth: Option<(f64, f64)>,
    },
    /// Fewer poses than the measure needs.
    #[error("{what} needs at least {needed} matched poses, got {found}")]
    TooFew {
        /// The measure.
        what: &'static str,
        /// Required number of poses.
        needed: usize,
        /// Available number of poses.
        found: usize,
    },
    /// Positions on a line, or in one place: no rotation aligns them best.
    #[error("the positions lie on one line, so that no alignment is best; align by the first pose instead")]
    Degenerate,
}

fn spans(estimate: Option<(f64, f64)>, truth: Option<(f64, f64)>) -> String {
    let span = |s: Option<(f64, f64)>| s.map_or("empty".to_owned(), |(a, b)| format!("{a} to {b} s"));
    format!(" (estimate: {}; truth: {})", span(estimate), span(truth))
}
