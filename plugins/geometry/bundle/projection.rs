//! Projection of a point into a calibrated camera.
use crate::bundle::camera_model::ProjectionName;
use crate::{Camera, CameraModel, Coordinates, Point3, Se3};
use manifactor_graph::prelude::*;

/// A camera measures a point at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "M: CameraModel")]
#[schemars(bound = "M: CameraModel + ProjectionName", description = description::<M>())]
pub struct Projection<M = Camera> {
    /// Measured pixel, x right and y down.
    pub pixel: Coordinates<2>,
    /// The calibrated camera.
    pub camera: M,
}

fn description<M: CameraModel + ProjectionName>() -> String {
    format!(
        "The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.\n\nVariables: the pose of the camera, from its own frame (z \
         forward) to the world's, and the point. π is the projection of `camera`. Rows: x to the right and y down. Not defined if \
         the camera cannot see the point, for example behind it; the factor is inactive there.\n\n```toml\n[[factors]]\nkeys = \
         [\"x0\", \"l0\"]\nfactor = {{ type = \"{}\", pixel = [310.0, 262.5], camera = {} }}\nnoise = {{ sigma = 1.0 }}\n```",
        M::PROJECTION,
        M::EXAMPLE
    )
}

impl<M: CameraModel> Residual for Projection<M> {
    type Variables = (Se3, Point3);
    type Dim = U2;
    const ROWS: &'static [&'static str] = &["u", "v"];

    #[inline]
    fn residual<T: Scalar>(&self, (pose, point): Lifted<Self::Variables, T>) -> Vector2<T> {
        self.camera.project(&pose.inverse_act(&point)) - self.pixel.lift::<T>()
    }

    #[inline]
    fn is_defined(&self, (pose, point): Refs<'_, Self::Variables>) -> bool {
        self.camera.sees(&pose.inverse_act(point))
    }

    #[inline]
    fn linearize(
        &self,
        (pose, point): Refs<'_, Self::Variables>,
        _free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Vector2<f64> {
        let seen = pose.inverse_act(point);
        let by_seen = self.camera.derivative(&seen);
        // P = Exp(-δ)∘P: ∂P/∂(ω, v) = [P]×, -I
        jacobians.0.fixed_columns_mut::<3>(0).copy_from(&(by_seen * seen.cross_matrix()));
        jacobians.0.fixed_columns_mut::<3>(3).copy_from(&-by_seen);
        jacobians.1 = by_seen * pose.rotation.matrix().transpose();
        self.camera.project(&seen) - *self.pixel
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se3, in_front};
    use manifactor_testing::strategies::vector;
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn camera() -> Camera {
        Camera { skew: 3.0, ..Camera::new([500.0, 510.0, 320.0, 240.0], 640, 480).unwrap() }
    }
    fn at(pixel: Vector2<f64>) -> Projection {
        Projection { pixel: Coordinates::new(pixel).unwrap(), camera: camera() }
    }
    fn any_projection() -> impl Strategy<Value = (Projection, Se3, Point3)> {
        (vector(500.0), any_se3(), in_front())
            .prop_map(|(pixel, pose, p)| (at(pixel), pose, Point3::new(pose.act(&p))))
    }

    jacobian_laws! { jacobians_agree: any_projection() }

    #[test]
    fn moving_pose_and_point_together_changes_nothing() {
        check((any_projection(), any_se3()), |((factor, pose, point), m)| {
            invariance_law(&factor, &[&pose, &point], &[&m.compose(&pose), &Point3::new(m.act(&point))])
        });
    }

    #[test]
    fn a_point_on_the_ray_of_its_pixel_is_no_error() {
        let pixel = Vector2::new(12.0, 345.0);
        let r = at(pixel).residual::<f64>((Se3::identity(), camera().ray(pixel) * 7.0));
        assert!(r.norm() < 1e-12);
    }

    #[test]
    fn a_point_behind_the_camera_is_not_seen() {
        let defined = |p: [f64; 3]| at(Vector2::zeros()).is_defined((&Se3::identity(), &Point3::new(p)));
        assert!(defined([0.0, 0.0, 1.0]) && !defined([0.0, 0.0, -1.0]) && !defined([1.0, 0.0, 1e-7]));
    }

    #[test]
    fn what_is_below_and_to_the_right_has_larger_coordinates() {
        let r = at(Vector2::zeros()).residual::<f64>((Se3::identity(), Vector3::new(1.0, 2.0, 2.0)));
        assert!((r - Vector2::new(320.0 + 250.0 + 3.0, 240.0 + 510.0)).norm() < 1e-12);
    }

    #[test]
    fn a_document_reads_back() {
        let factor = at(Vector2::new(1.5, -2.0));
        let text = serde_json::to_string(&factor).unwrap();
        assert_eq!(serde_json::from_str::<Projection>(&text).unwrap(), factor);
    }
}
