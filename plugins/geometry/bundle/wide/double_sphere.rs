//! Fisheye camera with two spheres.
use crate::bundle::camera_model::camera_document;
use crate::{Camera, CameraError, CameraModel, register_camera};
use manifactor_graph::Scalar;
use manifactor_graph::checked::Share;
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// A fisheye camera with two parameters.
///
/// A point is projected onto a unit sphere, then onto a second one that is ξ ahead, then through a pinhole that is
/// α/(1-α) ahead of that; Usenko, Demmel and Cremers, *The double sphere camera model*, 2018. It is `ds` of Kalibr.
///
/// ```toml
/// [source]
/// type = "recorded"
/// folder = "my_recording"
/// camera = { type = "double_sphere", fx = 364.8, fy = 364.7, cx = 512.2, cy = 514.1, width = 1024, height = 1024, xi = -0.27, alpha = 0.57 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct DoubleSphere {
    pinhole: Camera,
    xi: f64,
    alpha: f64,
}

camera_document! {
    "DoubleSphere",
    /// Distance ξ of the spheres' centres, above -1 and up to 1.
    xi: f64,
    /// Place α of the pinhole, from 0 to 1.
    alpha: Share
}

impl DoubleSphere {
    /// Creates a camera with the focal lengths, principal point and size of `pinhole`.
    ///
    /// # Errors
    /// If ξ is not above -1 and up to 1.
    pub fn new(pinhole: Camera, xi: f64, alpha: Share) -> Result<Self, CameraError> {
        if xi > -1.0 && xi <= 1.0 {
            Ok(Self { pinhole, xi, alpha: alpha.get() })
        } else {
            Err(CameraError { field: "xi", expected: "a number above -1 and up to 1", found: xi })
        }
    }
}

impl CameraModel for DoubleSphere {
    const EXAMPLE: &'static str = "{ fx = 364.0, fy = 364.0, cx = 512.0, cy = 512.0, width = 1024, height = 1024, \
                                   xi = -0.25, alpha = 0.5 }";

    #[inline(always)]
    fn project<T: Scalar>(&self, point: &Vector3<T>) -> Vector2<T> {
        let [xi, alpha] = [self.xi, self.alpha].map(T::from);
        let side = point.x * point.x + point.y * point.y;
        let ahead = xi * (side + point.z * point.z).sqrt() + point.z;
        let depth = alpha * (side + ahead * ahead).sqrt() + (T::from(1.0) - alpha) * ahead;
        self.pinhole.project(&Vector3::new(point.x, point.y, depth))
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let Self { xi, alpha, .. } = *self;
        let m = self.pinhole.ray(*pixel).xy();
        let square = m.norm_squared();
        let root = 1.0 - (2.0 * alpha - 1.0) * square;
        if root < 0.0 {
            return None;
        }
        let z = (1.0 - alpha * alpha * square) / (alpha * root.sqrt() + 1.0 - alpha);
        let root = z * z + (1.0 - xi * xi) * square;
        let scale = (z * xi + root.max(0.0).sqrt()) / (z * z + square);
        let direction = Vector3::new(scale * m.x, scale * m.y, scale * z - xi);
        (root >= 0.0 && self.sees(&direction)).then_some(direction)
    }

    #[inline(always)]
    fn sees(&self, point: &Vector3<f64>) -> bool {
        let Self { xi, alpha, .. } = *self;
        let w = if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha };
        let (side, distance) = (point.x * point.x + point.y * point.y, point.norm());
        // beyond this direction in the second sphere, the distance of the pixel from the centre falls again
        let ahead = xi * distance + point.z;
        distance > 0.0 && ahead > -w * (side + ahead * ahead).sqrt()
    }

    fn pinhole(&self) -> Camera {
        self.pinhole
    }
}

register_camera!("double_sphere", "projection_double_sphere", DoubleSphere);

impl TryFrom<Document> for DoubleSphere {
    type Error = CameraError;
    fn try_from(document: Document) -> Result<Self, CameraError> {
        Self::new(document.pinhole()?, document.xi, document.alpha)
    }
}

impl From<DoubleSphere> for Document {
    fn from(camera: DoubleSphere) -> Self {
        Self::of(camera.pinhole, camera.xi, Share::literal(camera.alpha))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se3, camera_law, ray};
    use crate::{Coordinates, Point3, Projection};
    use manifactor_testing::jacobian_laws;
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;
    use std::f64::consts::PI;

    fn camera(xi: f64, alpha: f64) -> DoubleSphere {
        let pinhole = Camera::new([364.8, 364.7, 512.2, 514.1], 1024, 1024).unwrap();
        DoubleSphere::new(pinhole, xi, Share::new(alpha).unwrap()).unwrap()
    }

    fn any_visible_point() -> impl Strategy<Value = Vector3<f64>> {
        (0.0..1.7f64, -PI..PI, 0.5..10.0f64).prop_map(|(angle, turn, distance)| ray(angle, turn) * distance)
    }

    jacobian_laws! {
        jacobians_agree: (any_visible_point(), vector::<2>(500.0), any_se3()).prop_map(|(point, pixel, pose)| {
            let factor = Projection::new(Coordinates::new(pixel).unwrap(), camera(-0.27, 0.57));
            (factor, pose, Point3::new(pose.act(&point)))
        })
    }

    #[test]
    fn a_pixel_is_that_of_its_direction() {
        proptest!(|(point in any_visible_point())| {
            prop_assert_eq!(camera_law(&camera(-0.27, 0.57), &point), Ok(()));
        });
        proptest!(|(xi in -0.9..1.0f64, alpha in 0.0..1.0f64, point in any_visible_point())| {
            let camera = camera(xi, alpha);
            if camera.sees(&point) && !camera.sees(&(point - Vector3::z() * 0.1)) {
                prop_assert_eq!(camera_law(&camera, &point), Ok(()));
            }
        });
    }

    #[test]
    fn without_spheres_it_is_the_pinhole() {
        let plain = camera(0.0, 0.0);
        let point = Vector3::new(0.3, -0.2, 1.5);
        assert!((plain.project(&point) - plain.pinhole.project(&point)).norm() < 1e-12);
        assert!(!plain.sees(&Vector3::new(1.0, 0.0, -0.1)));
        let text = serde_json::to_string(&camera(-0.27, 0.57)).unwrap();
        assert_eq!(serde_json::from_str::<DoubleSphere>(&text).unwrap(), camera(-0.27, 0.57));
        let bad =
            serde_json::from_str::<DoubleSphere>(&text.replace("-0.27", "-1.5")).unwrap_err().to_string();
        assert!(bad.contains("expected xi to be a number above -1"), "{bad}");
    }
}
