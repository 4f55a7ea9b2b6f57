//! Landmark metrics of Jablonsky et al.: the error of a mapped object.
use crate::shapes::Box3;
use crate::shapes::DualQuadric;
use serde::{Deserialize, Serialize};

/// Error of an estimated object against the true one, both in one frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LandmarkError {
    /// Distance between the centroids of the quadric and of the true box, in metres.
    pub position: f64,
    /// Jaccard distance, 1 - IoU, between the quadric's axis-aligned box and the true box, both centred at
    /// the origin: 0 to 1.
    pub shape: f64,
    /// Jaccard distance between the two boxes at their actual positions: 0 to 1.
    pub quality: f64,
}

impl LandmarkError {
    /// Computes the error of an estimate against the axis-aligned box of the true object.
    pub fn of(estimate: &DualQuadric, truth: &Box3) -> Self {
        let estimated = estimate.axes_aligned_box();
        Self {
            position: (estimate.centroid() - truth.centroid()).norm(),
            shape: 1.0 - estimated.centred().iou(&truth.centred()),
            quality: 1.0 - estimated.iou(truth),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::{Se3, So3};
    use nalgebra::Vector3;

    #[test]
    fn position_shape_and_quality_are_apart() {
        let truth = Box3::around(Vector3::new(1.0, 2.0, 3.0), Vector3::repeat(2.0));
        let pose = Se3::new(So3::identity(), truth.centroid());
        let right = DualQuadric { pose, semi_axes: Vector3::repeat(1.0) };
        assert_eq!(
            LandmarkError::of(&right, &truth),
            LandmarkError { position: 0.0, shape: 0.0, quality: 0.0 }
        );

        let beside = DualQuadric { pose: Se3::new(So3::identity(), Vector3::new(2.0, 2.0, 3.0)), ..right };
        let error = LandmarkError::of(&beside, &truth);
        assert_eq!((error.position, error.shape), (1.0, 0.0));
        assert!((error.quality - 2.0 / 3.0).abs() < 1e-15);

        let large = DualQuadric { semi_axes: Vector3::new(2.0, 1.0, 1.0), ..right };
        let error = LandmarkError::of(&large, &truth);
        assert_eq!((error.position, error.shape, error.quality), (0.0, 0.5, 0.5));
    }

    #[test]
    fn objects_far_apart_have_nothing_in_common() {
        let truth = Box3::around(Vector3::zeros(), Vector3::repeat(2.0));
        let pose = Se3::new(So3::identity(), Vector3::new(9.0, 0.0, 0.0));
        let far = DualQuadric { pose, semi_axes: Vector3::repeat(1.0) };
        assert_eq!(
            LandmarkError::of(&far, &truth),
            LandmarkError { position: 9.0, shape: 0.0, quality: 1.0 }
        );
    }
}
