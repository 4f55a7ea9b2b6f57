//! Projection of a point into a camera whose intrinsics are a variable.
use super::projection::{derive, seen};
use crate::bundle::camera_model::{CameraNames, UncalibratedName};
use crate::{Coordinates, Intrinsics, Point3, Se3, UncalibratedModel};
use manifactor_graph::prelude::*;
use std::marker::PhantomData;

/// A camera with unknown intrinsics measures a point at `pixel`: r = π(Rᵀ(X - t)) - z, in pixels.
///
/// Variables: the pose of the camera, the point, and the [`Intrinsics`], which many images can share. With
/// `body_from_camera`, the pose is that of a body on which the camera is mounted.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, bound = "M: UncalibratedModel")]
#[schemars(bound = "M: UncalibratedModel + CameraNames + UncalibratedName", description = description::<M>())]
pub struct UncalibratedProjection<M> {
    /// Measured pixel, x right and y down.
    pub pixel: Coordinates<2>,
    /// Pose of the camera in the frame of the variable. Default: the variable is the pose of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<Se3>,
    #[serde(skip)]
    model: PhantomData<M>,
}

fn description<M: UncalibratedModel + CameraNames + UncalibratedName>() -> String {
    format!(
        "The point is seen at `pixel` by a camera with unknown intrinsics: r = π(Rᵀ(X - t)) - z, in pixels.\n\nVariables: \
         the pose of the camera, from its own frame (z forward) to the world's, the point, and the intrinsics (`{}`), \
         which many images can share. With `body_from_camera`, the pose is that of a body on which the camera is mounted. \
         Rows: x to the right and y down. Not defined if the camera cannot see the point, for example behind it; the \
         factor is inactive there.\n\n```toml\n[[factors]]\nkeys = [\"x0\", \"l0\", \"camera\"]\nfactor = {{ type = \"{}\", \
         pixel = [310.0, 262.5] }}\nnoise = {{ sigma = 1.0 }}\n```",
        M::MODEL,
        M::UNCALIBRATED,
    )
}

impl<M: UncalibratedModel> UncalibratedProjection<M> {
    /// Creates the measurement of a camera whose pose is the variable.
    pub fn new(pixel: Coordinates<2>) -> Self {
        Self { pixel, body_from_camera: None, model: PhantomData }
    }
}

impl<M: UncalibratedModel> Residual for UncalibratedProjection<M> {
    type Variables = (Se3, Point3, Intrinsics<M>);
    type Dim = U2;
    const ROWS: &'static [&'static str] = &["u", "v"];

    #[inline]
    fn residual<T: Scalar>(&self, (pose, point, intrinsics): Lifted<Self::Variables, T>) -> Vector2<T> {
        intrinsics.project(&seen(&pose, &point, self.body_from_camera.as_ref())) - self.pixel.lift::<T>()
    }

    #[inline]
    fn is_defined(&self, (pose, point, Intrinsics(camera)): Refs<'_, Self::Variables>) -> bool {
        camera.is_valid() && camera.sees(&seen(pose, point, self.body_from_camera.as_ref()))
    }

    #[inline]
    fn linearize(
        &self,
        (pose, point, intrinsics): Refs<'_, Self::Variables>,
        _free: &[bool],
        (by_pose, by_point, by_intrinsics): &mut Jacobians<Self>,
    ) -> Vector2<f64> {
        let mounting = self.body_from_camera.as_ref();
        let seen = seen(pose, point, mounting);
        derive(intrinsics.0.derivative(&seen), (pose, point), mounting, by_pose, by_point);
        *by_intrinsics = intrinsics.0.derivative_by_intrinsics(&seen);
        intrinsics.0.project(&seen) - *self.pixel
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::*;
    use crate::{Camera, KannalaBrandt, Projection, Radial, RadialTangential};
    use manifactor_testing::jacobian_laws;
    use manifactor_testing::strategies::vector;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    /// Points that all the cameras of the strategies see.
    fn visible() -> impl Strategy<Value = Vector3<f64>> {
        ([-0.4..0.4f64, -0.4..0.4], 0.5..10.0f64).prop_map(|([x, y], z)| Vector3::new(x, y, 1.0) * z)
    }

    fn any<M: UncalibratedModel>(
        intrinsics: impl Strategy<Value = Intrinsics<M>>,
    ) -> impl Strategy<Value = (UncalibratedProjection<M>, Se3, Point3, Intrinsics<M>)> {
        let mounting = prop_oneof![Just(None), any_se3().prop_map(Some)];
        (vector(500.0), mounting, any_se3(), visible(), intrinsics).prop_map(
            |(pixel, mounting, camera, p, intrinsics)| {
                let factor = UncalibratedProjection {
                    body_from_camera: mounting,
                    ..UncalibratedProjection::new(Coordinates::new(pixel).unwrap())
                };
                let point = Point3::new(camera.act(&p));
                let pose = mounting.map_or(camera, |mounting| camera.compose(&mounting.inverse()));
                (factor, pose, point, intrinsics)
            },
        )
    }

    jacobian_laws! {
        pinhole: any::<Camera>(any_pinhole());
        radial: any::<Radial>(any_radial());
        radial_tangential: any::<RadialTangential>(any_radial_tangential());
        kannala_brandt: any::<KannalaBrandt>(any_kannala_brandt());
    }

    proptest! {
        #[test]
        fn it_is_the_projection_of_the_calibrated_camera((factor, pose, point, intrinsics) in any(any_radial())) {
            let calibrated = Projection {
                body_from_camera: factor.body_from_camera,
                ..Projection::new(factor.pixel, intrinsics.0)
            };
            let here = factor.residual::<f64>((pose, point.0, intrinsics.lift()));
            let there = calibrated.residual::<f64>((pose, point.0));
            prop_assert!((here - there).norm() < 1e-9);
        }
    }

    #[test]
    fn a_camera_with_a_focal_length_below_zero_sees_nothing() {
        let camera = Intrinsics(Radial::new([500.0, 320.0, 240.0, 0.0, 0.0], 640, 480).unwrap());
        let factor = UncalibratedProjection::<Radial>::new(Coordinates::default());
        let defined = |camera: &Intrinsics<Radial>| {
            factor.is_defined((&Se3::identity(), &Point3::new([0.0, 0.0, 1.0]), camera))
        };
        let turned = camera.retract(&nalgebra::Vector5::new(-501.0, 0.0, 0.0, 0.0, 0.0));
        assert!(defined(&camera) && !defined(&turned));
    }
}
