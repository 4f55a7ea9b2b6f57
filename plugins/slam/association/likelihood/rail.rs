//! Test scene: objects in a row, seen from a rail.
use super::fit::predict;
use crate::MapEstimate;
use manifactor_geometry::Se3;
use manifactor_quadric::{Camera, DualQuadric};
use manifactor_recording::sequence::{ClassScores, Detection, ObjectId};
use nalgebra::Vector3;

pub(super) const CAMERA: Camera =
    Camera { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0, skew: 0.0, width: 640, height: 480 };

/// A camera that moves to the right and looks ahead.
pub(super) struct RailCamera;

impl MapEstimate for RailCamera {
    fn pose(&self, frame: usize) -> Option<Se3> {
        Some(Se3 { translation: Vector3::x() * (0.02 * frame as f64 - 0.4), ..Se3::identity() })
    }
    fn object(&self, _: ObjectId) -> Option<DualQuadric> {
        None
    }
}

/// Returns the box of an object at `x`, 2 m away.
pub(super) fn detection_at(frame: usize, x: f64, class: &str) -> Detection {
    let pose = Se3 { translation: Vector3::new(x, 0.0, 2.0), ..Se3::identity() };
    let quadric = DualQuadric { pose, semi_axes: Vector3::new(0.1, 0.15, 0.1) };
    let bounding_box = predict(&RailCamera.pose(frame).unwrap(), &quadric, &CAMERA).unwrap().bounding_box;
    Detection {
        frame,
        object: None,
        scores: ClassScores::single(class, 0.8),
        bounding_box,
        quantities: manifactor_recording::measurement::Quantities::NONE,
    }
}
