//! A measured ellipse of an object's outline, compared by the Wasserstein distance between conics.
use manifactor_geometry::{Camera, Se3};
use manifactor_graph::prelude::*;
use manifactor_quadric::{DualQuadric, Ellipsoid};
use nalgebra::SVector;

/// A detector measures the outline of an object as an ellipse: r = (μ - μ₀, A^½ U - A₀^½), in pixels.
///
/// Variables: the pose of the camera and the object. μ and A are centre and shape of the outline (x is inside
/// if (x - μ)ᵀA⁻¹(x - μ) ≤ 1), U the rotation that brings A^½ closest to A₀^½. Then |r|² = |μ - μ₀|² + tr(A +
/// A₀ - 2(A^½A₀A^½)^½), the squared 2-Wasserstein distance between the normal distributions with these 1-σ
/// ellipses (Gelbrich 1990). It changes smoothly as ellipses move, scale and rotate, even if they are round
/// or do not overlap. Rows: μ, then the four entries of the difference by columns.
///
/// Like `bounding_box`, it is defined if the whole object is in front of the camera; there it is smooth.
///
/// ```toml
/// [[factors]]
/// keys   = ["x0", "q0"]
/// factor = { type = "conic_distance", centre = [190.0, 195.0], semi_axes = [110.0, 70.0], angle = 1.2, camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
/// noise  = { sigma = 10.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ConicDistance {
    /// Centre of the measured ellipse, x right and y down, in pixels.
    pub centre: [f64; 2],
    /// Semi-axes of the measured ellipse, in pixels.
    pub semi_axes: [Positive; 2],
    /// Angle from the image's x axis (right) to the first semi-axis, towards y (down), in radians. Default:
    /// 0.
    #[serde(default)]
    pub angle: f64,
    /// The calibrated camera.
    pub camera: Camera,
}

impl ConicDistance {
    /// Returns A₀^½.
    fn root(&self) -> Matrix2<f64> {
        let (sin, cos) = self.angle.sin_cos();
        let axes = Matrix2::new(cos, -sin, sin, cos);
        axes * Matrix2::from_diagonal(&Vector2::from(self.semi_axes.map(Positive::get))) * axes.transpose()
    }
}

impl Residual for ConicDistance {
    type Variables = (Se3, DualQuadric);
    type Dim = U6;

    fn residual<T: Scalar>(&self, (pose, quadric): Lifted<Self::Variables, T>) -> SVector<T, 6> {
        let seen = Ellipsoid::in_camera_frame(&pose, &quadric);
        if !seen.is_in_front() {
            return SVector::zeros();
        }
        let outline = seen.outline(&self.camera);
        // Square root of a positive definite 2 × 2 matrix.
        let d = outline.determinant.sqrt();
        let scale = (outline.xx + outline.yy + d * 2.0).sqrt().recip();
        let a = Matrix2::new(outline.xx + d, outline.xy, outline.xy, outline.yy + d) * scale;
        let b: Matrix2<T> = self.root().map(T::from);
        // The closest A^½ U: U comes from the polar decomposition of the product, whose determinant is
        // positive.
        let m = a * b;
        let (cos, sin) = (m.m11 + m.m22, m.m21 - m.m12);
        let length = (cos * cos + sin * sin).sqrt();
        let (cos, sin) = (cos / length, sin / length);
        let shape = a * Matrix2::new(cos, -sin, sin, cos) - b;
        let centre = outline.centre - Vector2::from(self.centre).map(T::from);
        SVector::<T, 6>::from_column_slice(&[centre.x, centre.y, shape.m11, shape.m21, shape.m12, shape.m22])
    }
    fn is_defined(&self, (pose, quadric): Refs<'_, Self::Variables>) -> bool {
        quadric.is_in_front_of(pose)
    }
}
register_factor!("conic_distance", ConicDistance);

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_quadric::testing::any_view;
    use manifactor_testing::{check, factor_laws};
    use nalgebra::SymmetricEigen;

    factor_laws! { conic_distance }

    fn root(m: Matrix2<f64>) -> Matrix2<f64> {
        let e = SymmetricEigen::new(m);
        e.eigenvectors * Matrix2::from_diagonal(&e.eigenvalues.map(f64::sqrt)) * e.eigenvectors.transpose()
    }

    #[test]
    fn its_length_is_the_distance_of_wasserstein() {
        check(
            (any_view(), 5.0..200.0f64, 0.1..1.0f64, -3.0..3.0f64),
            |((camera, pose, quadric), a, ratio, angle)| {
                let semi_axes = [a, a * ratio].map(|s| Positive::new(s).unwrap());
                let factor = ConicDistance { centre: [300.0, 200.0], semi_axes, angle, camera };
                let outline = Ellipsoid::in_camera_frame(&pose, &quadric).outline(&camera);
                let (shape, measured) = (
                    Matrix2::new(outline.xx, outline.xy, outline.xy, outline.yy),
                    factor.root() * factor.root(),
                );
                let (s, centre) = (root(shape), outline.centre - Vector2::new(300.0, 200.0));
                let bures = (shape + measured - root(s * measured * s) * 2.0).trace();
                let expected = centre.norm_squared() + bures;
                let found = factor.residual::<f64>((pose, quadric)).norm_squared();
                let size = centre.norm_squared() + shape.trace() + measured.trace();
                assert!((found - expected).abs() < 1e-9 * size, "{found} {expected}");
                Ok(())
            },
        );
    }
}
