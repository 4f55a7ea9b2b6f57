//! Frame of the drawings: the ground-truth frame, if there is ground truth.
use crate::output::truth_frame::truth_from_map;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::Estimate;
use manifactor_metrics::Sim3;

/// Transformations from the map frame to the frame of the record.
pub(super) struct RecordFrames {
    pub(super) odometry: Sim3,
    pub(super) estimate: Sim3,
}

impl RecordFrames {
    /// Returns the transformations. Simulated trajectories are not aligned, because the errors of their
    /// objects are measured without alignment. Odometry and estimate of other data are aligned separately
    /// to the ground truth with SE(3), using poses within `max_time_difference` seconds. Without ground truth
    /// the frame is the map frame.
    pub(super) fn of(estimate: &Estimate, max_time_difference: f64) -> Self {
        let to_truth = |poses: &[StampedPose]| {
            let moved = truth_from_map(estimate, poses, max_time_difference);
            Sim3::rigid(moved.unwrap_or(Se3::identity()))
        };
        Self { odometry: to_truth(&estimate.odometry()), estimate: to_truth(&estimate.trajectory()) }
    }
}
