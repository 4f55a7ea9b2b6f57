//! Projection of a point that is given by its inverse depth in another image.
use crate::{Camera, CameraModel, Coordinates, Point1, Se3};
use manifactor_graph::prelude::*;

/// A point at `anchor` in one image, with inverse depth λ there, is seen at `pixel` in another image.
///
/// Variables: the pose of the first camera (Rₐ, tₐ), that of the second (R, t), and λ in 1/m, a `point1`. With u the ray of
/// `anchor`, whose z is 1: r = π(Rᵀ(Rₐ u + λ(tₐ - t))) - z, in pixels. A short baseline gives only a lower bound of the
/// distance. λ then goes to 0, a point at infinity, while a point in space would go away without end. With
/// `body_from_camera`, both poses are those of a body on which the camera is mounted. Rows: x to the right and y down. Not
/// defined for λ < 0, and if the second camera cannot see the point; the factor is inactive there. Source: Civera,
/// Davison and Montiel, *Inverse Depth Parametrization for Monocular SLAM*, T-RO 2008, with the ray of the first image
/// as a constant.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "x1", "d0"]
/// noise = { sigma = 1.0 }
///
/// [factors.factor]
/// type = "projection_inverse_depth"
/// anchor = [350.0, 240.0]
/// pixel = [310.0, 262.5]
/// camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct InverseDepthProjection {
    /// Pixel in the first image, x right and y down.
    pub anchor: Coordinates<2>,
    /// Measured pixel in the second image.
    pub pixel: Coordinates<2>,
    /// The calibrated camera of both images.
    pub camera: Camera,
    /// Pose of the camera in the frame of the poses. Default: the poses are those of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<Se3>,
}

impl InverseDepthProjection {
    /// Returns λ times the point, in the frame of the second camera.
    #[inline]
    fn scaled<T: Scalar>(&self, first: &Se3<T>, second: &Se3<T>, inverse_depth: T) -> Vector3<T> {
        let ray = self.camera.ray(*self.anchor);
        let mounting = self.body_from_camera.as_ref();
        let in_body = mounting.map_or(ray, |m| m.rotation.act(&ray));
        // the point in the frame of the second body, times λ: its translation is scaled, its rotation is not
        let lever = mounting.map_or_else(Vector3::zeros, |m| m.translation).lift::<T>();
        let origin = first.act(&lever) - second.translation;
        let turned = first.rotation.act(&in_body.lift());
        let local = second.rotation.inverse().act(&(turned + origin * inverse_depth));
        match mounting {
            Some(m) => m.rotation.lift::<T>().inverse().act(&(local - lever * inverse_depth)),
            None => local,
        }
    }
}

impl Residual for InverseDepthProjection {
    type Variables = (Se3, Se3, Point1);
    type Dim = U2;
    const ROWS: &'static [&'static str] = &["u", "v"];

    #[inline]
    fn residual<T: Scalar>(&self, (first, second, depth): Lifted<Self::Variables, T>) -> Vector2<T> {
        self.camera.project(&self.scaled(&first, &second, depth.x)) - self.pixel.lift::<T>()
    }

    #[inline]
    fn is_defined(&self, (first, second, depth): Refs<'_, Self::Variables>) -> bool {
        depth.x >= 0.0 && self.camera.sees(&self.scaled(first, second, depth.x))
    }
}
register_factor!("projection_inverse_depth", InverseDepthProjection);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se3, in_front};
    use crate::{Point3, Projection};
    use manifactor_testing::strategies::vector;
    use manifactor_testing::{check, invariance_law, jacobian_laws};
    use proptest::prelude::*;

    fn camera() -> Camera {
        Camera { skew: 3.0, ..Camera::new([500.0, 510.0, 320.0, 240.0], 640, 480).unwrap() }
    }

    /// A point in front of the second camera and of the first, with its factor.
    fn any_measurement() -> impl Strategy<Value = (InverseDepthProjection, Se3, Se3, Point1, Vector3<f64>)> {
        let shift = (vector::<3>(0.3), vector::<3>(0.3));
        (vector(500.0), any_se3(), shift, in_front(), prop::option::of(any_se3())).prop_map(
            |(pixel, first, (turn, step), p, mounting)| {
                let second = first.compose(&Se3::new(crate::So3::exp(&turn), step * 0.1 * p.z));
                let factor = InverseDepthProjection {
                    anchor: Coordinates::new(camera().project(&p)).unwrap(),
                    pixel: Coordinates::new(pixel).unwrap(),
                    camera: camera(),
                    body_from_camera: mounting,
                };
                let point = first.act(&p);
                let bodies =
                    [first, second].map(|x| x.compose(&mounting.unwrap_or(Se3::identity()).inverse()));
                (factor, bodies[0], bodies[1], Point1::new([1.0 / p.z]), point)
            },
        )
    }

    jacobian_laws! {
        jacobians_agree: any_measurement().prop_map(|(factor, first, second, depth, _)| (factor, first, second, depth))
            .prop_filter("seen", |(f, a, b, d)| f.is_defined((a, b, d)));
        jacobians_agree_at_infinity: any_measurement().prop_map(|(factor, first, second, ..)| (factor, first, second, Point1::new([0.0])))
            .prop_filter("seen", |(f, a, b, d)| f.is_defined((a, b, d)));
    }

    proptest! {
        #[test]
        fn it_is_the_projection_of_the_point((factor, first, second, depth, point) in any_measurement()) {
            let InverseDepthProjection { pixel, camera, body_from_camera, .. } = factor;
            let plain = Projection { pixel, camera, body_from_camera };
            prop_assume!(plain.is_defined((&second, &Point3::new(point))));
            let (a, b) = (factor.residual::<f64>((first, second, depth.0)), plain.residual::<f64>((second, point)));
            prop_assert!((a - b).norm() < 1e-6 * b.norm().max(1.0), "{a} {b}");
        }
    }

    #[test]
    fn moving_both_poses_changes_nothing() {
        check((any_measurement(), any_se3()), |((factor, first, second, depth, _), m)| {
            if !factor.is_defined((&first, &second, &depth)) {
                return Ok(());
            }
            invariance_law(
                &factor,
                &[&first, &second, &depth],
                &[&m.compose(&first), &m.compose(&second), &depth],
            )
        });
    }

    #[test]
    fn a_negative_inverse_depth_is_not_defined() {
        let origin = Se3::identity();
        let pixel = Coordinates::new(Vector2::new(320.0, 240.0)).unwrap();
        let factor =
            InverseDepthProjection { anchor: pixel, pixel, camera: camera(), body_from_camera: None };
        let defined = |depth: f64| factor.is_defined((&origin, &origin, &Point1::new([depth])));
        assert!(defined(0.0) && defined(2.0) && !defined(-1e-9));
    }
}
