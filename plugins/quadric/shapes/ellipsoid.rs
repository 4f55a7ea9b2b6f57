//! An ellipsoid in the camera's frame, before its projection.
use crate::shapes::DualQuadric;
use manifactor_geometry::Se3;
use manifactor_graph::Scalar;
use nalgebra::{Matrix3, Vector3};

/// Relative margin by which the nearest point of an ellipsoid must be in front of the camera: z² - A₃₃ > 1e-6
/// z².
///
/// Bounds grow without limit as the surface approaches the camera's plane.
const MIN_RELATIVE_DEPTH: f64 = 1e-6;

/// An ellipsoid in the frame of a camera that looks along +z: the points centroid + axes·u, |u| ≤ 1.
#[derive(Debug, Clone, Copy)]
pub struct Ellipsoid<T: Scalar = f64> {
    /// Centre.
    pub centroid: Vector3<T>,
    /// The three semi-axes with their lengths, as columns.
    pub axes: Matrix3<T>,
}

impl<T: Scalar> Ellipsoid<T> {
    /// Transforms a quadric to the frame of a camera.
    #[inline]
    pub fn in_camera_frame(world_from_camera: &Se3<T>, quadric: &DualQuadric<T>) -> Self {
        let mut axes = world_from_camera.rotation.between(&quadric.pose.rotation).matrix();
        for (mut axis, s) in axes.column_iter_mut().zip(&quadric.semi_axes) {
            axis *= *s;
        }
        Self { centroid: world_from_camera.inverse_act(&quadric.centroid()), axes }
    }
    /// Returns whether the whole ellipsoid is in front of the camera. The camera is then outside it, and its
    /// outline is an ellipse.
    #[inline]
    pub fn is_in_front(&self) -> bool {
        is_in_front(self.centroid.z, self.axes.row(2).norm_squared())
    }
}

/// Checks z > 0 and z² - A₃₃ > 1e-6 z².
#[inline]
pub(crate) fn is_in_front<T: Scalar>(z: T, a33: T) -> bool {
    z > T::zero() && z * z * (1.0 - MIN_RELATIVE_DEPTH) > a33
}
