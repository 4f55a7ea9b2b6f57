//! Ellipsoids whose shape is not limited by boxes: plates, and ellipsoids that reach beyond the farthest
//! camera.
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::Warning;

/// Largest ratio of the longest to the shortest semi-axis. A sheet of paper on a desk has about 100.
const MAX_AXIS_RATIO: f64 = 200.0;

/// Returns a warning with these objects, if there are any.
pub(super) fn run_away_warning(estimate: &Estimate) -> Option<Warning> {
    let poses = estimate.trajectory();
    let mut objects = vec![];
    for landmark in estimate.landmarks() {
        let (axes, centre) = (landmark.quadric.semi_axes, landmark.quadric.pose.translation);
        let distances = poses.iter().map(|stamped| (stamped.pose.translation - centre).norm());
        let farthest = distances.fold(0.0, f64::max);
        if axes.max() > MAX_AXIS_RATIO * axes.min() || axes.max() > farthest {
            objects
                .push(format!("{} ({:.3} × {:.3} × {:.3} m)", landmark.object.key, axes.x, axes.y, axes.z));
        }
    }
    (!objects.is_empty()).then_some(Warning::RunAway { objects })
}
