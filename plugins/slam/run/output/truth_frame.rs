//! The frame of the ground truth, in which errors of objects are measured and pictures are drawn.
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::Estimate;
use manifactor_metrics::{Alignment, align, associate};
use manifactor_recording::sequence::{GroundTruth, Sequence};

/// Largest difference between two equal poses. Unit: rad and m.
const SAME_POSE: f64 = 1e-6;

/// Returns whether the odometry begins at a true pose, so that it is in the frame of the ground truth: simulated data.
/// Errors of its objects are measured without alignment.
fn begins_at_truth(sequence: &Sequence, truth: &GroundTruth) -> bool {
    let Some(first) = sequence.frames.first() else { return false };
    let at = truth.trajectory.iter().find(|pose| (pose.timestamp - first.timestamp).abs() < SAME_POSE);
    at.is_some_and(|pose| pose.pose.between(&first.world_from_camera).log().norm() < SAME_POSE)
}

/// Returns the transformation of a trajectory in the map frame to the frame of the ground truth; `None` without ground
/// truth. Data whose odometry does not begin at a true pose are aligned with SE(3), by poses within `within` seconds.
pub(super) fn truth_from_map(estimate: &Estimate, poses: &[StampedPose], within: f64) -> Option<Se3> {
    let truth = estimate.sequence.ground_truth.as_ref()?;
    if !truth.objects.is_empty() && begins_at_truth(&estimate.sequence, truth) {
        return Some(estimate.mapping.frame.map_from_odometry.inverse());
    }
    let pairs = associate(&truth.trajectory, poses, within).ok()?;
    let (similarity, _) = align(&pairs, Alignment::Se3).ok()?;
    Some(Se3::new(similarity.rotation, similarity.translation))
}
