use crate::output::truth_frame::truth_from_map;
use manifactor_formats::tum::StampedPose;
use manifactor_mapping::estimate::{Estimate, LandmarkEstimate};
use manifactor_quadric::{Cuboid, LandmarkError};
use serde::Serialize;

/// Errors of all landmarks with known truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LandmarkReport {
    /// Number of objects that are compared.
    pub objects: usize,
    /// Errors of the initial values.
    pub initial: LandmarkSummary,
    /// Errors of the estimate.
    pub estimate: LandmarkSummary,
}

/// Summary of the errors of several landmarks.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LandmarkSummary {
    /// Means, as in later code of the paper's authors.
    pub mean: LandmarkError,
    /// Root mean squares, as in the paper for positions.
    pub rmse: LandmarkError,
}

/// Returns the error of each landmark with known truth, in the [frame of the ground truth](truth_from_map) by the poses
/// that belong to the landmarks. None if that frame is unknown.
pub(super) fn in_truth_frame<'a>(
    estimate: &Estimate,
    landmarks: Vec<LandmarkEstimate<'a>>,
    poses: &[StampedPose],
    within: f64,
) -> Vec<(LandmarkEstimate<'a>, LandmarkError)> {
    let Some(truth_from_map) = truth_from_map(estimate, poses, within) else { return vec![] };
    let compare = |landmark: LandmarkEstimate<'a>| {
        let mut quadric = *landmark.quadric;
        quadric.pose = truth_from_map.compose(&quadric.pose);
        let truth = landmark.truth?;
        let cuboid = Cuboid { pose: truth.world_from_object, half_extents: truth.half_extents };
        let error = LandmarkError::of(&quadric, &truth.bounding_box, &cuboid);
        Some((landmark, error))
    };
    landmarks.into_iter().filter_map(compare).collect()
}

impl LandmarkReport {
    /// Creates the summaries before and after the solve; `None` without known truth.
    pub(super) fn new(
        before: &[(LandmarkEstimate<'_>, LandmarkError)],
        after: &[(LandmarkEstimate<'_>, LandmarkError)],
    ) -> Option<Self> {
        let (initial, estimate) = (LandmarkSummary::of(before)?, LandmarkSummary::of(after)?);
        Some(Self { objects: after.len(), initial, estimate })
    }
}

impl LandmarkSummary {
    fn of(errors: &[(LandmarkEstimate<'_>, LandmarkError)]) -> Option<Self> {
        let errors: Vec<LandmarkError> = errors.iter().map(|(_, error)| *error).collect();
        Self::over(&errors)
    }

    /// Creates the summary; `None` without landmarks.
    pub fn over(errors: &[LandmarkError]) -> Option<Self> {
        let average = |of: fn(&LandmarkError) -> f64, power: i32| {
            let sum: f64 = errors.iter().map(|error| of(error).powi(power)).sum();
            (sum / errors.len() as f64).powf(1.0 / f64::from(power))
        };
        let summary = |power| LandmarkError {
            position: average(|error| error.position, power),
            shape: average(|error| error.shape, power),
            quality: average(|error| error.quality, power),
            volume: average(|error| error.volume, power),
            tilt: average(|error| error.tilt, power),
            proportions: average(|error| error.proportions, power),
        };
        (!errors.is_empty()).then(|| Self { mean: summary(1), rmse: summary(2) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mean_and_rmse_are_apart() {
        let error = |position| LandmarkError {
            position,
            shape: 0.5,
            quality: 1.0,
            volume: 0.5,
            tilt: 0.1,
            proportions: 0.25,
        };
        let summary = LandmarkSummary::over(&[error(0.0), error(2.0)]).unwrap();
        assert_eq!(summary.mean, error(1.0));
        assert_eq!(summary.rmse.position, 2f64.sqrt());
        assert_eq!(LandmarkSummary::over(&[]), None);
    }
}
