//! Projection of a point into a camera whose focal length and distortion are estimated too: bundle
//! adjustment.
use crate::{BalCamera, Coordinates, Point3};
use manifactor_graph::prelude::*;
use nalgebra::Matrix2x3;

/// A camera with radial distortion measures a point at `pixel`: r = f (1 + k1 ‖p‖² + k2 ‖p‖⁴) p - z, in
/// pixels.
///
/// Here p = -(Px, Py) / Pz, and P = Rᵀ(X - t) is the point in the camera's frame; the camera looks along -z.
/// Rows: x to the right and y up, from the image centre. Not defined unless the point is in front of the
/// camera, with a depth of more than a millionth of its distance; otherwise the factor is inactive.
///
/// ```toml
/// [[factors]]
/// keys = ["c0", "p0"]
/// factor = { type = "projection_bal", pixel = [120.0, -80.0] }
/// noise = { sigma = 1.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProjectionBal {
    /// Measured pixel, from the image centre, x right and y up.
    pub pixel: Coordinates<2>,
}

impl Residual for ProjectionBal {
    type Variables = (BalCamera, Point3);
    type Dim = U2;
    const ROWS: &'static [&'static str] = &["u", "v"];

    #[inline]
    fn residual<T: Scalar>(&self, (camera, point): Lifted<Self::Variables, T>) -> Vector2<T> {
        camera.project(&camera.world_from_camera.inverse_act(&point)) - self.pixel.lift::<T>()
    }

    #[inline]
    fn is_defined(&self, (camera, point): Refs<'_, Self::Variables>) -> bool {
        BalCamera::is_in_front(&camera.world_from_camera.inverse_act(point))
    }

    #[inline]
    fn linearize(
        &self,
        (camera, point): Refs<'_, Self::Variables>,
        _free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Vector2<f64> {
        let seen = camera.world_from_camera.inverse_act(point);
        let p = seen.xy() / -seen.z;
        let (f, rho, [k1, k2]) = (camera.focal_length, p.norm_squared(), camera.distortion.into());
        let radial = camera.radial(rho);
        // ∂r/∂p = f (radial I + 2 (k1 + 2 k2 ρ) p pᵀ), ∂p/∂P = -[I p] / Pz
        let slope = 2.0 * (k1 + 2.0 * k2 * rho);
        let scale = -f / seen.z;
        let (xx, yy) = (scale * (radial + slope * p.x * p.x), scale * (radial + slope * p.y * p.y));
        let xy = scale * slope * p.x * p.y;
        let by_seen = Matrix2x3::new(xx, xy, xx * p.x + xy * p.y, xy, yy, xy * p.x + yy * p.y);

        // P = Exp(-δ)∘P: ∂P/∂(ω, v) = [P]×, -I
        jacobians.0.fixed_columns_mut::<3>(0).copy_from(&(by_seen * seen.cross_matrix()));
        jacobians.0.fixed_columns_mut::<3>(3).copy_from(&-by_seen);
        jacobians.0.set_column(6, &(p * radial));
        jacobians.0.set_column(7, &(p * (f * rho)));
        jacobians.0.set_column(8, &(p * (f * rho * rho)));
        jacobians.1 = by_seen * camera.world_from_camera.rotation.matrix().transpose();
        p * (f * radial) - *self.pixel
    }
}
register_factor!("projection_bal", ProjectionBal);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_bal_camera, any_se3, in_front};
    use manifactor_testing::strategies::vector;
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn any_projection() -> impl Strategy<Value = (ProjectionBal, BalCamera, Point3)> {
        (vector(500.0), any_bal_camera(), in_front()).prop_map(|(pixel, camera, p)| {
            let point = camera.world_from_camera.act(&Vector3::new(p.x, p.y, -p.z));
            (ProjectionBal { pixel: Coordinates::new(pixel).unwrap() }, camera, Point3::new(point))
        })
    }

    jacobian_laws! { jacobians_agree: any_projection() }

    #[test]
    fn moving_camera_and_point_together_changes_nothing() {
        check((any_projection(), any_se3()), |((factor, camera, point), m)| {
            let moved = BalCamera { world_from_camera: m.compose(&camera.world_from_camera), ..camera };
            invariance_law(&factor, &[&camera, &point], &[&moved, &Point3::new(m.act(&point))])
        });
    }

    #[test]
    fn scaling_the_scene_about_the_camera_changes_nothing() {
        check((any_projection(), 0.5..2.0f64), |((factor, camera, point), scale)| {
            let centre = camera.world_from_camera.translation;
            let scaled = Point3::new(centre + (*point - centre) * scale);
            invariance_law(&factor, &[&camera, &point], &[&camera, &scaled])
        });
    }

    #[test]
    fn a_point_behind_the_camera_or_beside_it_is_not_seen() {
        let camera = BalCamera {
            world_from_camera: crate::Se3::identity(),
            focal_length: 100.0,
            distortion: Vector2::zeros(),
        };
        let factor = ProjectionBal { pixel: Coordinates::default() };
        let defined = |p: [f64; 3]| factor.is_defined((&camera, &Point3::new(p)));
        assert!(defined([0.0, 0.0, -1e-9]) && defined([1.0, 0.0, -1e-5]));
        assert!(!defined([0.0, 0.0, 1.0]) && !defined([0.0; 3]) && !defined([1.0, 0.0, -1e-7]));
    }
}
