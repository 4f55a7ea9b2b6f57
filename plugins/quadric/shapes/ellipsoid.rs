//! An ellipsoid as a camera sees it: in the camera's frame, before its projection.
use crate::shapes::DualQuadric;
use manifactor_geometry::Se3;
use manifactor_graph::Scalar;
use nalgebra::{Matrix3, Vector3};

/// How far the nearest point of an ellipsoid has to be in front of the camera: z² - A₃₃ > 1e-6 z².
///
/// Bounds grow without limit as the surface comes up to the camera's plane.
const MARGIN: f64 = 1e-6;

/// The points centroid + axes·u, |u| ≤ 1, in the frame of a camera that looks along +z.
#[derive(Debug, Clone, Copy)]
pub struct Ellipsoid<T: Scalar = f64> {
    /// The centre.
    pub centroid: Vector3<T>,
    /// By columns, the three semi-axes with their lengths.
    pub axes: Matrix3<T>,
}

impl<T: Scalar> Ellipsoid<T> {
    /// A quadric, seen from a camera.
    #[inline]
    pub fn seen(world_from_camera: &Se3<T>, quadric: &DualQuadric<T>) -> Self {
        let mut axes = world_from_camera.rotation.between(&quadric.pose.rotation).matrix();
        for (mut axis, s) in axes.column_iter_mut().zip(&quadric.semi_axes) {
            axis *= *s;
        }
        Self { centroid: world_from_camera.inverse_act(&quadric.centroid()), axes }
    }
    /// Returns whether all of it is in front of the camera, which then is outside of it; its outline is an
    /// ellipse.
    #[inline]
    pub fn is_in_front(&self) -> bool {
        is_in_front(self.centroid.z, self.axes.row(2).norm_squared())
    }
}

/// z > 0 and z² - A₃₃ > 1e-6 z².
#[inline]
pub(crate) fn is_in_front<T: Scalar>(z: T, a33: T) -> bool {
    z > T::zero() && z * z * (1.0 - MARGIN) > a33
}
