//! Fisheye camera by Kannala and Brandt.
use crate::bundle::camera_model::camera_document;
use crate::{Camera, CameraModel, Coordinates, UncalibratedModel, register_camera};
use manifactor_graph::Scalar;
use nalgebra::{SVector, U8, Vector2, Vector3, Vector4};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;

/// A fisheye camera with four coefficients.
///
/// A ray at the angle θ to the optical axis projects at the radius θ (1 + k₁ θ² + k₂ θ⁴ + k₃ θ⁶ + k₄ θ⁸) focal
/// lengths from the principal point; Kannala and Brandt, *A generic camera model and calibration method*, 2006. It is
/// `cv::fisheye` of OpenCV, `equidistant` of ROS and Kalibr, and `OPENCV_FISHEYE` of COLMAP. Rays behind the camera
/// are seen up to the angle at which the radius stops growing.
///
/// ```toml
/// [source]
/// type = "recorded"
/// folder = "my_recording"
/// camera = { type = "kannala_brandt", fx = 285.7, fy = 286.9, cx = 425.5, cy = 384.2, width = 848, height = 800, distortion = [-0.0046, 0.0395, -0.0369, 0.0061] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct KannalaBrandt {
    pinhole: Camera,
    /// k₁, k₂, k₃, k₄.
    distortion: [f64; 4],
    /// Largest angle θ of a ray that is seen, in radians.
    max_angle: f64,
}

camera_document! {
    "KannalaBrandt",
    /// Coefficients k₁, k₂, k₃, k₄.
    distortion: Coordinates<4>
}

/// Number of samples of the search for the angle at which the radius stops growing.
const SAMPLES: u32 = 2000;
/// Rays this close to the optical axis have a radius of θ = tan θ, to the last digit. Unit: tan² θ.
const SMALL: f64 = 1e-16;
/// Number of bisections that narrow an angle to the last digit.
const BISECTIONS: u32 = 60;

impl KannalaBrandt {
    /// Creates a camera with the focal lengths, principal point and size of `pinhole`, and the coefficients k₁ to k₄.
    pub fn new(pinhole: Camera, distortion: [f64; 4]) -> Self {
        let growth = |theta: f64| {
            let (s, [k1, k2, k3, k4]) = (theta * theta, distortion);
            1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * 9.0 * k4)))
        };
        let at = |i: u32| PI * f64::from(i) / f64::from(SAMPLES);
        let end = (1..=SAMPLES).find(|i| growth(at(*i)) <= 0.0);
        let max_angle = end.map_or(PI, |end| bisected([at(end - 1), at(end)], |theta| growth(theta) <= 0.0));
        Self { pinhole, distortion, max_angle }
    }

    /// Returns the radius of a ray at an angle, in focal lengths.
    fn radius(&self, theta: f64) -> f64 {
        radius(self.distortion, theta)
    }
}

/// Returns the radius of a ray at an angle with the coefficients k₁ to k₄, in focal lengths.
#[inline(always)]
fn radius<T: Scalar>([k1, k2, k3, k4]: [T; 4], theta: T) -> T {
    let s = theta * theta;
    theta * (T::from(1.0) + s * (k1 + s * (k2 + s * (k3 + s * k4))))
}

/// Returns the place in an interval at which a condition begins to hold.
fn bisected([mut low, mut high]: [f64; 2], holds: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        *(if holds(middle) { &mut high } else { &mut low }) = middle;
    }
    low
}

impl CameraModel for KannalaBrandt {
    const EXAMPLE: &'static str = "{ fx = 285.0, fy = 285.0, cx = 424.0, cy = 400.0, width = 848, height = 800, \
                                   distortion = [0.01, 0.02, 0.0, 0.0] }";

    #[inline(always)]
    fn project<T: Scalar>(&self, point: &Vector3<T>) -> Vector2<T> {
        self.project_with(&self.lifted(), point)
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let seen = self.pinhole.ray(*pixel).xy();
        let radius = seen.norm();
        if radius == 0.0 {
            return Some(Vector3::z());
        }
        if self.radius(self.max_angle) <= radius {
            return None;
        }
        let theta = bisected([0.0, self.max_angle], |theta| self.radius(theta) >= radius);
        let side = seen * (theta.sin() / radius);
        Some(Vector3::new(side.x, side.y, theta.cos()))
    }

    #[inline(always)]
    fn sees(&self, point: &Vector3<f64>) -> bool {
        let side = point.xy().norm();
        let is_ray = side > 0.0 || point.z > 0.0;
        is_ray && side.atan2(point.z) < self.max_angle
    }

    fn pinhole(&self) -> Camera {
        self.pinhole
    }
}

impl UncalibratedModel for KannalaBrandt {
    type Dim = U8;
    const INTRINSICS: &'static [&'static str] = &["fx", "fy", "cx", "cy", "k1", "k2", "k3", "k4"];

    #[inline(always)]
    fn intrinsics(&self) -> SVector<f64, 8> {
        let (Camera { fx, fy, cx, cy, .. }, [k1, k2, k3, k4]) = (self.pinhole, self.distortion);
        SVector::from([fx, fy, cx, cy, k1, k2, k3, k4])
    }

    fn with_intrinsics(&self, intrinsics: &SVector<f64, 8>) -> Self {
        let [fx, fy, cx, cy, k1, k2, k3, k4] = (*intrinsics).into();
        Self::new(Camera { fx, fy, cx, cy, ..self.pinhole }, [k1, k2, k3, k4])
    }

    #[inline(always)]
    fn is_valid(&self) -> bool {
        self.pinhole.is_valid()
    }

    #[inline(always)]
    fn project_with<T: Scalar>(&self, intrinsics: &SVector<T, 8>, point: &Vector3<T>) -> Vector2<T> {
        let [fx, fy, cx, cy, k1, k2, k3, k4] = (*intrinsics).into();
        let square = point.x * point.x + point.y * point.y;
        let ahead = point.z > T::zero();
        let scale = if ahead && square <= point.z * point.z * T::from(SMALL) {
            point.z.recip()
        } else {
            let side = square.sqrt();
            radius([k1, k2, k3, k4], side.atan2(point.z)) / side
        };
        let seen = Vector3::new(point.x * scale, point.y * scale, T::from(1.0));
        self.pinhole.project_with(&Vector4::new(fx, fy, cx, cy), &seen)
    }
}

register_camera!("kannala_brandt", "projection_kannala_brandt", "uncalibrated_kannala_brandt", KannalaBrandt);

impl TryFrom<Document> for KannalaBrandt {
    type Error = crate::CameraError;
    fn try_from(document: Document) -> Result<Self, Self::Error> {
        Ok(Self::new(document.pinhole()?, document.distortion.vector().into()))
    }
}

impl From<KannalaBrandt> for Document {
    fn from(camera: KannalaBrandt) -> Self {
        Self::of(camera.pinhole, Coordinates::unchecked(camera.distortion.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se3, camera_law, ray};
    use crate::{Point3, Projection};
    use manifactor_testing::jacobian_laws;
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;

    fn t265() -> KannalaBrandt {
        let pinhole = Camera::new([285.7, 286.9, 425.5, 384.2], 848, 800).unwrap();
        KannalaBrandt::new(pinhole, [-0.0046, 0.0395, -0.0369, 0.0061])
    }

    fn any_visible_point() -> impl Strategy<Value = Vector3<f64>> {
        (0.0..1.7f64, -PI..PI, 0.5..10.0f64).prop_map(|(angle, turn, distance)| ray(angle, turn) * distance)
    }

    jacobian_laws! {
        jacobians_agree: (any_visible_point(), vector::<2>(500.0), any_se3()).prop_map(|(point, pixel, pose)| {
            let factor = Projection::new(Coordinates::new(pixel).unwrap(), t265());
            (factor, pose, Point3::new(pose.act(&point)))
        })
    }

    #[test]
    fn a_pixel_is_that_of_its_direction() {
        proptest!(|(point in any_visible_point())| prop_assert_eq!(camera_law(&t265(), &point), Ok(())));
        let ends: Vec<Vector3<f64>> = vec![Vector3::z(), ray(1e-9, 1.0), ray(1e-7, 1.0), ray(1.7, 0.3)];
        ends.iter().for_each(|point| camera_law(&t265(), point).unwrap());
    }

    /// Pixels of points by `cv::fisheye::projectPoints` of OpenCV 5.0.0.
    const OPENCV: [([f64; 3], [f64; 2]); 5] = [
        (
            [0.1991647790018153, 0.014150446023882412, 1.9900083305560516],
            [453.99696247650087, 386.2331829952404],
        ),
        (
            [-0.8680073096497416, 0.40738028751811045, 1.7551651237807455],
            [296.0848810924799, 445.1932747572912],
        ),
        (
            [-0.9000017567225198, -1.4220726110120618, 1.0806046117362795],
            [272.08726110898635, 140.77782069307338],
        ),
        ([-1.7355211179934769, 0.837701591103041, 0.5349976572491747], [98.8119069190302, 542.5481710251934]),
        (
            [0.8529655489645619, -1.8034507937508233, 0.1414744033354058],
            [595.1035205284606, 24.09597344848879],
        ),
    ];

    #[test]
    fn pixels_are_those_of_opencv() {
        for (point, pixel) in OPENCV {
            let error = t265().project(&Vector3::from(point)) - Vector2::from(pixel);
            assert!(error.norm() < 1e-9, "{point:?} {error}");
        }
    }

    #[test]
    fn a_ray_beyond_the_fold_is_not_seen() {
        // 1 + 3 k₁ θ² = 0 at θ = 1
        let folds = KannalaBrandt::new(t265().pinhole, [-1.0 / 3.0, 0.0, 0.0, 0.0]);
        assert!((folds.max_angle - 1.0).abs() < 1e-9);
        assert!(folds.sees(&ray(0.99, 0.0)) && !folds.sees(&ray(1.01, 0.0)));
        let far = folds.pinhole.fx * 0.7 + folds.pinhole.cx;
        assert!(folds.unproject(&Vector2::new(far, folds.pinhole.cy)).is_none());
        let equidistant = KannalaBrandt::new(t265().pinhole, [0.0; 4]);
        assert!(equidistant.sees(&-Vector3::z().cross(&Vector3::x())) && !equidistant.sees(&-Vector3::z()));
    }
}
