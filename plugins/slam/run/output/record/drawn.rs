//! Frame of the drawings: the ground-truth frame, if there is ground truth.
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::Estimate;
use manifactor_metrics::{Alignment, Sim3, align, associate};

/// Transformations from the map frame to the frame of the record.
pub(super) struct RecordFrames {
    pub(super) odometry: Sim3,
    pub(super) estimate: Sim3,
}

impl RecordFrames {
    /// Returns the transformations. Simulated trajectories are not aligned, because the errors of their
    /// objects are measured without alignment. Odometry and estimate of recorded data are aligned separately
    /// to the ground truth with SE(3), using poses within `max_time_difference` seconds. Without ground truth
    /// the frame is the map frame.
    pub(super) fn of(estimate: &Estimate, max_time_difference: f64) -> Self {
        let truth = estimate.sequence.ground_truth.as_ref();
        let to_truth = |poses: &[StampedPose]| match truth {
            None => Sim3::rigid(Se3::identity()),
            Some(truth) if !truth.objects.is_empty() => {
                Sim3::rigid(estimate.mapping.frame.map_from_odometry.inverse())
            }
            Some(truth) => associate(&truth.trajectory, poses, max_time_difference)
                .and_then(|pairs| align(&pairs, Alignment::Se3))
                .map_or_else(|_| Sim3::rigid(Se3::identity()), |(similarity, _)| similarity),
        };
        Self { odometry: to_truth(&estimate.odometry()), estimate: to_truth(&estimate.trajectory()) }
    }
}
