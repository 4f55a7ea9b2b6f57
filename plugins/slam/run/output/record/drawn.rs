//! Where an estimate is drawn: in the frame of the truth, where there is one.
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::Estimate;
use manifactor_metrics::{Alignment, Similarity, align, associate};

/// From the map's frame to that of the record.
pub(super) struct Frames {
    pub(super) odometry: Similarity,
    pub(super) estimate: Similarity,
}

impl Frames {
    /// Simulated trajectories as they stand, as their objects are measured; recorded ones each aligned to the truth by
    /// SE(3), poses within `max_time_difference` seconds. Without a truth, the frame of the map.
    pub(super) fn of(estimate: &Estimate, max_time_difference: f64) -> Self {
        let truth = estimate.sequence.ground_truth.as_ref();
        let to_truth = |poses: &[StampedPose]| match truth {
            None => Similarity::rigid(Se3::identity()),
            Some(truth) if !truth.objects.is_empty() => {
                Similarity::rigid(estimate.mapping.frame.map_from_odometry.inverse())
            }
            Some(truth) => associate(&truth.trajectory, poses, max_time_difference)
                .and_then(|pairs| align(&pairs, Alignment::Se3))
                .map_or_else(|_| Similarity::rigid(Se3::identity()), |(similarity, _)| similarity),
        };
        Self { odometry: to_truth(&estimate.odometry()), estimate: to_truth(&estimate.trajectory()) }
    }
}
