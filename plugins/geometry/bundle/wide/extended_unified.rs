//! Fisheye camera with an ellipsoid.
use crate::bundle::camera_model::camera_document;
use crate::{Camera, CameraError, CameraModel, register_camera};
use manifactor_graph::Scalar;
use manifactor_graph::checked::{Positive, Share};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// A fisheye camera with two parameters.
///
/// A point projects through a pinhole with the depth α √(β (x² + y²) + z²) + (1-α) z; Khomutenko, Garcia and Martinet,
/// *An enhanced unified camera model*, 2016. It is `eucm` of Kalibr. With β = 1 it is the unified model, `omni`, with
/// ξ = α/(1-α).
///
/// ```toml
/// [source]
/// type = "recorded"
/// folder = "my_recording"
/// camera = { type = "extended_unified", fx = 366.1, fy = 366.0, cx = 512.1, cy = 514.0, width = 1024, height = 1024, alpha = 0.65, beta = 1.06 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct ExtendedUnified {
    pinhole: Camera,
    alpha: f64,
    beta: f64,
}

camera_document! {
    "ExtendedUnified",
    /// Share α of the distance in the depth, from 0 to 1.
    alpha: Share,
    /// Weight β of the distance from the optical axis.
    beta: Positive
}

impl ExtendedUnified {
    /// Creates a camera with the focal lengths, principal point and size of `pinhole`.
    pub fn new(pinhole: Camera, alpha: Share, beta: Positive) -> Self {
        Self { pinhole, alpha: alpha.get(), beta: beta.get() }
    }

    fn distance(&self, point: &Vector3<f64>) -> f64 {
        (self.beta * point.xy().norm_squared() + point.z * point.z).sqrt()
    }
}

impl CameraModel for ExtendedUnified {
    const EXAMPLE: &'static str = "{ fx = 366.0, fy = 366.0, cx = 512.0, cy = 512.0, width = 1024, height = 1024, \
                                   alpha = 0.5, beta = 1.0 }";

    #[inline(always)]
    fn project<T: Scalar>(&self, point: &Vector3<T>) -> Vector2<T> {
        let [alpha, beta] = [self.alpha, self.beta].map(T::from);
        let distance = (beta * (point.x * point.x + point.y * point.y) + point.z * point.z).sqrt();
        let depth = alpha * distance + (T::from(1.0) - alpha) * point.z;
        self.pinhole.project(&Vector3::new(point.x, point.y, depth))
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let Self { alpha, beta, .. } = *self;
        let m = self.pinhole.ray(*pixel).xy();
        let square = beta * m.norm_squared();
        let root = 1.0 - (2.0 * alpha - 1.0) * square;
        if root < 0.0 {
            return None;
        }
        let z = (1.0 - alpha * alpha * square) / (alpha * root.sqrt() + 1.0 - alpha);
        let direction = Vector3::new(m.x, m.y, z);
        self.sees(&direction).then_some(direction)
    }

    #[inline(always)]
    fn sees(&self, point: &Vector3<f64>) -> bool {
        let alpha = self.alpha;
        let w = if alpha <= 0.5 { alpha / (1.0 - alpha) } else { (1.0 - alpha) / alpha };
        let distance = self.distance(point);
        distance > 0.0 && point.z > -w * distance
    }

    fn pinhole(&self) -> Camera {
        self.pinhole
    }
}

register_camera!("extended_unified", "projection_extended_unified", ExtendedUnified);

impl TryFrom<Document> for ExtendedUnified {
    type Error = CameraError;
    fn try_from(document: Document) -> Result<Self, CameraError> {
        Ok(Self::new(document.pinhole()?, document.alpha, document.beta))
    }
}

impl From<ExtendedUnified> for Document {
    fn from(camera: ExtendedUnified) -> Self {
        Self::of(camera.pinhole, Share::literal(camera.alpha), Positive::literal(camera.beta))
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

    fn camera(alpha: f64, beta: f64) -> ExtendedUnified {
        let pinhole = Camera::new([366.1, 366.0, 512.1, 514.0], 1024, 1024).unwrap();
        ExtendedUnified::new(pinhole, Share::new(alpha).unwrap(), Positive::new(beta).unwrap())
    }

    fn any_visible_point() -> impl Strategy<Value = Vector3<f64>> {
        (0.0..1.7f64, -PI..PI, 0.5..10.0f64).prop_map(|(angle, turn, distance)| ray(angle, turn) * distance)
    }

    jacobian_laws! {
        jacobians_agree: (any_visible_point(), vector::<2>(500.0), any_se3()).prop_map(|(point, pixel, pose)| {
            let factor = Projection::new(Coordinates::new(pixel).unwrap(), camera(0.65, 1.06));
            (factor, pose, Point3::new(pose.act(&point)))
        })
    }

    #[test]
    fn a_pixel_is_that_of_its_direction() {
        proptest!(|(point in any_visible_point())| {
            prop_assert_eq!(camera_law(&camera(0.65, 1.06), &point), Ok(()));
        });
    }

    #[test]
    fn without_a_share_of_the_distance_it_is_the_pinhole() {
        let plain = camera(0.0, 1.0);
        let point = Vector3::new(0.3, -0.2, 1.5);
        assert!((plain.project(&point) - plain.pinhole.project(&point)).norm() < 1e-12);
        let text = serde_json::to_string(&camera(0.65, 1.06)).unwrap();
        assert_eq!(serde_json::from_str::<ExtendedUnified>(&text).unwrap(), camera(0.65, 1.06));
        assert!(serde_json::from_str::<ExtendedUnified>(&text.replace("1.06", "-1.0")).is_err());
    }

    /// With β = 1 and α = ξ/(1+ξ) it is the unified model (Mei and Rives 2007).
    #[test]
    fn it_contains_the_unified_model() {
        let xi = 1.4;
        let unified = camera(xi / (1.0 + xi), 1.0);
        proptest!(|(point in any_visible_point())| {
            let on_sphere = point.normalize();
            let scaled = Vector3::new(on_sphere.x, on_sphere.y, (on_sphere.z + xi) / (1.0 + xi));
            let expected = unified.pinhole.project(&scaled);
            prop_assert!((unified.project(&point) - expected).norm() < 1e-9);
        });
    }
}
