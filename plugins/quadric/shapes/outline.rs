//! Outline of an ellipsoid in an image.
use crate::shapes::DualConic;
use crate::shapes::Ellipse;
use crate::shapes::Ellipsoid;
use manifactor_geometry::Camera;
use manifactor_graph::Scalar;
use nalgebra::{RowVector3, Vector2};

impl Ellipsoid {
    /// Returns C* = P Q* Pᵀ for an ellipsoid anywhere: in front of the camera, behind or around it.
    pub fn dual_conic(&self, camera: &Camera) -> DualConic {
        let (b, p) = (camera.matrix() * self.axes, camera.matrix() * self.centroid);
        DualConic(b * b.transpose() - p * p.transpose())
    }
}

impl<T: Scalar> Ellipsoid<T> {
    /// Returns the outline of an ellipsoid that [is in front](Ellipsoid::is_in_front).
    ///
    /// With A = BBᵀ the ellipsoid's shape, d = z² - A₃₃, and for each image axis k the row a of KB, the
    /// coordinate x of Kp (both relative to the principal point), and w = z a - x b: centre = (x z - a·b)/d,
    /// shape = (d wᵢ·wⱼ + (wᵢ·b)(wⱼ·b)) / (z d)². The usual C*₁₃² - C*₁₁C*₃₃ is a difference of nearly equal
    /// numbers for a distant object; here all terms on the diagonal are positive and are added.
    #[inline]
    pub fn outline(&self, camera: &Camera) -> Ellipse<T> {
        let (p, b): (_, RowVector3<T>) = (&self.centroid, self.axes.row(2).into_owned());
        let d = p.z * p.z - b.dot(&b);
        let row = |i: usize| self.axes.row(i).into_owned();
        let a1 = row(0) * T::from(camera.fx) + row(1) * T::from(camera.skew);
        let a2 = row(1) * T::from(camera.fy);
        let (x, y) = (p.x * camera.fx + p.y * camera.skew, p.y * camera.fy);
        let (w1, w2) = (a1 * p.z - b * x, a2 * p.z - b * y);
        let (g1, g2) = (w1.dot(&b), w2.dot(&b));
        let scale = (p.z * d).recip();
        let scale = scale * scale;
        let across = w1.cross(&w2).norm_squared() * d + (w2 * g1 - w1 * g2).norm_squared();
        Ellipse {
            centre: Vector2::new(
                (x * p.z - a1.dot(&b)) / d + T::from(camera.cx),
                (y * p.z - a2.dot(&b)) / d + T::from(camera.cy),
            ),
            xx: (w1.norm_squared() * d + g1 * g1) * scale,
            xy: (w1.dot(&w2) * d + g1 * g2) * scale,
            yy: (w2.norm_squared() * d + g2 * g2) * scale,
            determinant: across * d * scale * scale,
        }
    }
}
