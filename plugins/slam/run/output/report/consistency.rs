//! Consistency of errors with the estimated covariances.
use super::trajectory::by_first_pose;
use crate::output::truth_frame::truth_from_map;
use manifactor_geometry::Se3;
use manifactor_graph::{Key, Manifold};
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::pose_key;
use manifactor_mapping::settings::EvaluationSettings;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::collections::HashMap;

/// Normalized estimation errors squared, eᵀ Σ⁻¹ e per degree of freedom, with the marginal covariance Σ
/// (Bar-Shalom, Li and Kirubarajan, *Estimation with Applications to Tracking and Navigation*, 2001, section
/// 5.4). Their mean is near 1 if Σ is right, and larger if the estimate is overconfident.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ConsistencyReport {
    /// Mean over poses with six degrees of freedom, each compared with the true pose nearest in time. The
    /// first pose aligns the trajectory with the ground truth, so its error is 0. `None` if the poses of the
    /// odometry were kept, since their noise is unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poses: Option<f64>,
    /// Mean over the centres of objects with three degrees of freedom, in the odometry frame, if the ground
    /// truth has objects.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub objects: Option<f64>,
}

impl ConsistencyReport {
    /// Returns the report; `None` without ground truth or covariances.
    pub(super) fn new(estimate: &Estimate, settings: &EvaluationSettings) -> Option<Self> {
        let truth = estimate.sequence.ground_truth.as_ref()?;
        let marginals = estimate.solution.marginals(&estimate.mapping.graph, &[]).ok()?;
        let covariances: HashMap<Key, DMatrix<f64>> =
            marginals.into_iter().map(|marginal| (marginal.key, marginal.covariance)).collect();
        let poses = by_first_pose(truth, &estimate.trajectory(), settings).unwrap_or_default();
        let poses = if estimate.keeps_odometry() { vec![] } else { poses };
        let frames = estimate.sequence.frames.iter().enumerate();
        let keys: HashMap<u64, Key> = frames.map(|(i, f)| (f.timestamp.to_bits(), pose_key(i))).collect();
        let poses = poses.iter().filter_map(|pair| {
            let covariance = covariances.get(keys.get(&pair.timestamp.to_bits())?)?;
            let error = pair.estimate.local(&pair.truth);
            normalized(&DVector::from_column_slice(error.as_slice()), covariance.clone())
        });
        let within = *settings.max_time_difference;
        let truth_from_map = truth_from_map(estimate, &estimate.trajectory(), within);
        let landmarks = estimate.landmarks();
        let objects = landmarks.iter().filter_map(|landmark| {
            let pose: Se3 = truth_from_map?.compose(&landmark.quadric.pose);
            let off = landmark.truth?.bounding_box.centroid() - pose.translation;
            // the tangent of a pose rotates with the pose, so the translation is in the object's frame
            let off = pose.rotation.inverse().act(&off);
            let covariance = covariances.get(&landmark.object.key)?.view((3, 3), (3, 3)).into_owned();
            normalized(&DVector::from_column_slice(off.as_slice()), covariance)
        });
        let report = Self { poses: mean(poses), objects: mean(objects) };
        (report.poses.is_some() || report.objects.is_some()).then_some(report)
    }
}

/// Returns eᵀ Σ⁻¹ e / n; `None` if Σ has no inverse.
fn normalized(error: &DVector<f64>, covariance: DMatrix<f64>) -> Option<f64> {
    let n = error.len() as f64;
    Some(error.dot(&covariance.cholesky()?.solve(error)) / n)
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    (count > 0).then(|| sum / f64::from(count)).filter(|mean| mean.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_of_one_sigma_in_each_direction_counts_one() {
        let covariance = DMatrix::from_row_slice(2, 2, &[4.0, 0.0, 0.0, 9.0]);
        let error = DVector::from_column_slice(&[2.0, -3.0]);
        assert_eq!(normalized(&error, covariance), Some(1.0));
        assert_eq!(normalized(&error, DMatrix::zeros(2, 2)), None);
        assert_eq!(mean(std::iter::empty()), None);
    }
}
