//! Absolute and relative errors of paired poses.
use super::{MetricsError, PosePair, Statistics};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Returns the absolute trajectory error: distances between positions, in metres. Align the pairs first.
///
/// # Errors
/// If there is no pair.
pub fn absolute_error(pairs: &[PosePair]) -> Result<Statistics, MetricsError> {
    let errors: Vec<f64> =
        pairs.iter().map(|p| (p.truth.translation - p.estimate.translation).norm()).collect();
    let what = "the absolute trajectory error";
    Statistics::of(&errors).ok_or(MetricsError::TooFew { what, needed: 1, found: 0 })
}

/// Pairs of poses that a relative error covers.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pairing {
    /// (0, Δ), (Δ, 2Δ), …
    #[default]
    Consecutive,
    /// (0, Δ), (1, 1 + Δ), …
    All,
}

/// Relative pose error: the error of the motion over Δ frames.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct RelativeError {
    /// Unit: metres.
    pub translation: Statistics,
    /// Unit: radians.
    pub rotation: Statistics,
}

/// Returns the relative pose error over `delta` matched poses: E = (Qᵢ⁻¹Qⱼ)⁻¹ (Pᵢ⁻¹Pⱼ), with Q true and P
/// estimated. It does not depend on the frame of the map, but on the scale.
///
/// # Errors
/// If there are not more pairs than `delta`, or `delta` is 0.
pub fn relative_error(
    pairs: &[PosePair],
    delta: usize,
    pairing: Pairing,
) -> Result<RelativeError, MetricsError> {
    let too_few = MetricsError::TooFew {
        what: "the relative pose error (over at least one frame)",
        needed: delta.max(1).saturating_add(1),
        found: pairs.len(),
    };
    let errors = relative_errors(pairs, delta, pairing);
    let (translation, rotation): (Vec<f64>, Vec<f64>) = errors.into_iter().unzip();
    let both = Statistics::of(&translation).zip(Statistics::of(&rotation));
    both.map(|(translation, rotation)| RelativeError { translation, rotation }).ok_or(too_few)
}

/// Returns the individual errors behind [`relative_error`], in order: metres, radians.
pub fn relative_errors(pairs: &[PosePair], delta: usize, pairing: Pairing) -> Vec<(f64, f64)> {
    if delta == 0 {
        return vec![];
    }
    let step = if pairing == Pairing::All { 1 } else { delta };
    let ends = pairs.iter().zip(pairs.iter().skip(delta)).step_by(step);
    let errors = ends.map(|(i, j)| {
        let (truth, estimate) = (i.truth.between(&j.truth), i.estimate.between(&j.estimate));
        let error = truth.between(&estimate);
        (error.translation.norm(), error.rotation.log().norm())
    });
    errors.collect()
}
