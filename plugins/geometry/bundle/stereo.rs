//! Projection of a point into a rectified stereo camera.
use super::projection::{derive, seen};
use crate::{Camera, CameraModel, Coordinates, Point3, Se3};
use manifactor_graph::checked::Finite;
use manifactor_graph::prelude::*;

/// A stereo camera sees a point at `pixel` in its left image, and in the same row at `right` in its right one.
///
/// With q = (x, y, z) = Rᵀ(X - t) the point in the frame of the left camera, b the baseline and π the projection:
/// r = (π(q) - pixel, π(q - (b, 0, 0))ᵤ - right), in pixels. Variables: the pose of the left camera, from its own frame
/// (z forward) to the world's, and the point. With `body_from_camera`, the pose is that of a body on which the camera
/// is mounted. Rows: u and v in the left image, u in the right one. Not defined if the point is behind the camera; the
/// factor is inactive there.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "l0"]
/// noise = { sigma = 1.0 }
///
/// [factors.factor]
/// type = "stereo"
/// pixel = [310.0, 262.5]
/// right = 295.0
/// baseline = 0.12
/// camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Stereo {
    /// Measured pixel in the left image, x right and y down.
    pub pixel: Coordinates<2>,
    /// Measured x in the right image, in pixels.
    pub right: Finite,
    /// Distance of the right camera to the right of the left one, in metres.
    pub baseline: Positive,
    /// Both cameras, after rectification.
    pub camera: Camera,
    /// Pose of the left camera in the frame of the variable. Default: the variable is the pose of the left camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<Se3>,
}

impl Residual for Stereo {
    type Variables = (Se3, Point3);
    type Dim = U3;
    const ROWS: &'static [&'static str] = &["u", "v", "u_right"];

    #[inline]
    fn residual<T: Scalar>(&self, (pose, point): Lifted<Self::Variables, T>) -> Vector3<T> {
        let q = seen(&pose, &point, self.body_from_camera.as_ref());
        let left = self.camera.project(&q);
        let disparity = q.z.recip() * (self.camera.fx * self.baseline.get());
        Vector3::new(left.x - self.pixel.x, left.y - self.pixel.y, left.x - disparity - self.right.get())
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
    ) -> Vector3<f64> {
        let mounting = self.body_from_camera.as_ref();
        let q = seen(pose, point, mounting);
        let left = self.camera.derivative(&q);
        let mut by_seen = left.fixed_resize::<3, 3>(0.0);
        by_seen.set_row(2, &left.row(0));
        by_seen[(2, 2)] += self.camera.fx * self.baseline.get() / (q.z * q.z);
        let (by_pose, by_point) = jacobians;
        derive(by_seen, (pose, point), mounting, by_pose, by_point);
        self.residual::<f64>((*pose, **point))
    }
}
register_factor!("stereo", Stereo);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Projection;
    use crate::testing::{any_se3, in_front};
    use manifactor_testing::strategies::vector;
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    fn any_stereo() -> impl Strategy<Value = (Stereo, Se3, Point3)> {
        let camera = Camera { skew: 3.0, ..Camera::new([500.0, 510.0, 320.0, 240.0], 640, 480).unwrap() };
        (vector(500.0), 0.0..500.0, 0.01..1.0, any_se3(), in_front()).prop_map(
            move |(pixel, right, baseline, pose, p)| {
                let factor = Stereo {
                    pixel: Coordinates::new(pixel).unwrap(),
                    right: Finite::literal(right),
                    baseline: Positive::literal(baseline),
                    camera,
                    body_from_camera: None,
                };
                (factor, pose, Point3::new(pose.act(&p)))
            },
        )
    }

    fn any_mounted() -> impl Strategy<Value = (Stereo, Se3, Point3)> {
        (any_stereo(), any_se3()).prop_map(|((factor, pose, point), mounting)| {
            let body = pose.compose(&mounting.inverse());
            (Stereo { body_from_camera: Some(mounting), ..factor }, body, point)
        })
    }

    jacobian_laws! {
        jacobians_agree: any_stereo();
        jacobians_of_a_mounted_camera_agree: any_mounted();
    }

    proptest! {
        #[test]
        fn each_image_is_that_of_a_camera((factor, pose, point) in any_stereo()) {
            let r = factor.residual::<f64>((pose, point.0));
            let left = Projection::new(factor.pixel, factor.camera);
            let mut right = left.clone();
            right.body_from_camera = Some(Se3::new(crate::So3::identity(), Vector3::x() * factor.baseline.get()));
            prop_assert!((r.xy() - left.residual::<f64>((pose, point.0))).norm() < 1e-9);
            let u = right.residual::<f64>((pose, point.0)).x + factor.pixel.x - factor.right.get();
            prop_assert!((r.z - u).abs() < 1e-6 * u.abs().max(1.0));
        }
    }

    #[test]
    fn moving_pose_and_point_together_changes_nothing() {
        check((any_stereo(), any_se3()), |((factor, pose, point), m)| {
            invariance_law(&factor, &[&pose, &point], &[&m.compose(&pose), &Point3::new(m.act(&point))])
        });
    }
}
