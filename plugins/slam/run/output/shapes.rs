//! Ellipsoids whose shape is not limited by boxes: plates, and ellipsoids that reach beyond the farthest
//! camera.
use manifactor_mapping::estimate::{Estimate, LandmarkEstimate};
use manifactor_mapping::mapping::Warning;

/// Returns a warning for each kind of such objects, if there are any.
pub(super) fn shape_warnings(estimate: &Estimate) -> impl Iterator<Item = Warning> {
    let poses = estimate.trajectory();
    let (mut flat, mut run_away) = (vec![], vec![]);
    for landmark in estimate.landmarks() {
        let (axes, centre) = (landmark.quadric.semi_axes, landmark.quadric.pose.translation);
        let distances = poses.iter().map(|stamped| (stamped.pose.translation - centre).norm());
        if axes.max() > distances.fold(0.0, f64::max) {
            run_away.push(with_size(&landmark));
        } else if landmark.quadric.is_flat() {
            flat.push(with_size(&landmark));
        }
    }
    let run_away = (!run_away.is_empty()).then_some(Warning::RunAway { objects: run_away });
    let flat = (!flat.is_empty()).then_some(Warning::Flat { objects: flat });
    run_away.into_iter().chain(flat)
}

fn with_size(landmark: &LandmarkEstimate<'_>) -> String {
    let axes = landmark.quadric.semi_axes;
    format!("{} ({:.3} × {:.3} × {:.3} m)", landmark.object.key, axes.x, axes.y, axes.z)
}
