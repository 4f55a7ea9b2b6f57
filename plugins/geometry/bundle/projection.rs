//! Projection of a point into a calibrated camera.
use crate::bundle::camera_model::CameraNames;
use crate::{Camera, CameraModel, Coordinates, Point3, Se3};
use manifactor_graph::prelude::*;
use nalgebra::SMatrix;

/// A camera measures a point at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.
///
/// With `body_from_camera`, the variable is the pose of a body on which the camera is mounted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "M: CameraModel")]
#[schemars(bound = "M: CameraModel + CameraNames", description = description::<M>())]
pub struct Projection<M = Camera> {
    /// Measured pixel, x right and y down.
    pub pixel: Coordinates<2>,
    /// The calibrated camera.
    pub camera: M,
    /// Pose of the camera in the frame of the variable. Default: the variable is the pose of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<Se3>,
}

fn description<M: CameraModel + CameraNames>() -> String {
    format!(
        "The point is seen at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.\n\nVariables: the pose of the camera, from its own frame (z \
         forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera is \
         mounted. π is the projection of `camera`. Rows: x to the right and y down. Not defined if \
         the camera cannot see the point, for example behind it; the factor is inactive there.\n\n```toml\n[[factors]]\nkeys = \
         [\"x0\", \"l0\"]\nfactor = {{ type = \"{}\", pixel = [310.0, 262.5], camera = {} }}\nnoise = {{ sigma = 1.0 }}\n```",
        M::PROJECTION,
        M::EXAMPLE
    )
}

impl<M: CameraModel> Projection<M> {
    /// Creates the measurement of a camera whose pose is the variable.
    pub fn new(pixel: Coordinates<2>, camera: M) -> Self {
        Self { pixel, camera, body_from_camera: None }
    }
}

/// Returns a point in the frame of a camera whose pose is `pose`, or `pose` times the mounting.
#[inline]
pub(super) fn seen<T: Scalar>(pose: &Se3<T>, point: &Vector3<T>, mounting: Option<&Se3>) -> Vector3<T> {
    let point = pose.inverse_act(point);
    match mounting {
        Some(mounting) => mounting.lift::<T>().inverse_act(&point),
        None => point,
    }
}

impl<M: CameraModel> Residual for Projection<M> {
    type Variables = (Se3, Point3);
    type Dim = U2;
    const ROWS: &'static [&'static str] = &["u", "v"];

    #[inline]
    fn residual<T: Scalar>(&self, (pose, point): Lifted<Self::Variables, T>) -> Vector2<T> {
        self.camera.project(&seen(&pose, &point, self.body_from_camera.as_ref())) - self.pixel.lift::<T>()
    }

    #[inline]
    fn is_defined(&self, (pose, point): Refs<'_, Self::Variables>) -> bool {
        self.camera.sees(&seen(pose, point, self.body_from_camera.as_ref()))
    }

    #[inline]
    fn linearize(
        &self,
        (pose, point): Refs<'_, Self::Variables>,
        _free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> Vector2<f64> {
        let mounting = self.body_from_camera.as_ref();
        let seen = seen(pose, point, mounting);
        let (by_pose, by_point) = jacobians;
        derive(self.camera.derivative(&seen), (pose, point), mounting, by_pose, by_point);
        self.camera.project(&seen) - *self.pixel
    }
}

/// Writes the derivatives with respect to the pose and the point, from the one with respect to the point in the frame
/// of the camera.
#[inline]
pub(super) fn derive<const ROWS: usize>(
    mut by_local: SMatrix<f64, ROWS, 3>,
    (pose, point): (&Se3, &Vector3<f64>),
    mounting: Option<&Se3>,
    by_pose: &mut SMatrix<f64, ROWS, 6>,
    by_point: &mut SMatrix<f64, ROWS, 3>,
) {
    let local = pose.inverse_act(point);
    if let Some(mounting) = mounting {
        by_local *= mounting.rotation.matrix().transpose();
    }
    // P = Exp(-δ)∘P: ∂P/∂(ω, v) = [P]×, -I
    by_pose.fixed_columns_mut::<3>(0).copy_from(&(by_local * local.cross_matrix()));
    by_pose.fixed_columns_mut::<3>(3).copy_from(&-by_local);
    *by_point = by_local * pose.rotation.matrix().transpose();
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
        Projection::new(Coordinates::new(pixel).unwrap(), camera())
    }
    fn any_projection() -> impl Strategy<Value = (Projection, Se3, Point3)> {
        (vector(500.0), any_se3(), in_front())
            .prop_map(|(pixel, pose, p)| (at(pixel), pose, Point3::new(pose.act(&p))))
    }

    fn any_mounted() -> impl Strategy<Value = (Projection, Se3, Point3)> {
        (any_projection(), any_se3()).prop_map(|((factor, pose, point), mounting)| {
            let body = pose.compose(&mounting.inverse());
            (Projection { body_from_camera: Some(mounting), ..factor }, body, point)
        })
    }

    jacobian_laws! {
        jacobians_agree: any_projection();
        jacobians_of_a_mounted_camera_agree: any_mounted();
    }

    proptest! {
        #[test]
        fn a_mounted_camera_sees_what_a_camera_there_sees((factor, body, point) in any_mounted()) {
            let camera = body.compose(&factor.body_from_camera.unwrap());
            let r = factor.residual::<f64>((body, point.0));
            let there = Projection { body_from_camera: None, ..factor }.residual::<f64>((camera, point.0));
            prop_assert!((r - there).norm() < 1e-6);
        }
    }

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
