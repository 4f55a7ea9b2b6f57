//! Camera with radial and tangential lens distortion.
use crate::{Camera, CameraError, CameraModel, Coordinates, register_camera};
use manifactor_graph::Scalar;
use nalgebra::{Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A camera with radial and tangential lens distortion, with five coefficients.
///
/// A point at (x/z, y/z), with radius r, projects through the pinhole at (x/z, y/z) · (1 + k₁ r² + k₂ r⁴ + k₃
/// r⁶) plus the tangential part (2 p₁ xy/z² + p₂ (r² + 2 x²/z²), p₁ (r² + 2 y²/z²) + 2 p₂ xy/z²); Brown,
/// *Close-range camera calibration*, 1971. The model folds back beyond some radius; points beyond that radius
/// are not seen.
///
/// ```toml
/// [source]
/// type = "recorded"
/// folder = "my_recording"
/// camera = { type = "radial_tangential", fx = 517.3, fy = 516.5, cx = 318.6, cy = 255.3, width = 640, height = 480, distortion = [0.2624, -0.9531, -0.0054, 0.0026, 1.1633] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct RadialTangential {
    pinhole: Camera,
    /// k₁, k₂, p₁, p₂, k₃, in OpenCV's order.
    distortion: [f64; 5],
    /// Largest squared radius x²/z² + y²/z² at which the model does not fold back.
    limit: f64,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "RadialTangential")]
struct Document {
    /// Focal length along x, in pixels.
    fx: f64,
    /// Focal length along y, in pixels.
    fy: f64,
    /// Principal point, in pixels.
    cx: f64,
    /// Principal point, in pixels.
    cy: f64,
    /// Size of the image, in pixels.
    width: u32,
    /// Size of the image, in pixels.
    height: u32,
    /// Coefficients k₁, k₂, p₁, p₂, k₃, in OpenCV's order.
    distortion: Coordinates<5>,
}

/// Maximum number of fixed-point iterations of `unproject`, and its tolerance in units of the focal length.
const MAX_ITERATIONS: usize = 100;
const UNPROJECT_TOLERANCE: f64 = 1e-9;

impl RadialTangential {
    /// Creates a camera with the coefficients k₁, k₂, p₁, p₂, k₃ in OpenCV's order.
    pub fn new(pinhole: Camera, distortion: [f64; 5]) -> Self {
        Self { pinhole, distortion, limit: fold_limit(distortion) }
    }

    /// Applies the distortion to the point (x/z, y/z), in units of the focal length from the principal point.
    fn distort<T: Scalar>(&self, [x, y]: [T; 2]) -> [T; 2] {
        let [k1, k2, p1, p2, k3] = self.distortion.map(T::from);
        let [one, two] = [T::from(1.0), T::from(2.0)];
        let r2 = x * x + y * y;
        let radial = one + r2 * (k1 + r2 * (k2 + r2 * k3));
        let sideways = two * p1 * x * y + p2 * (r2 + two * x * x);
        let upward = p1 * (r2 + two * y * y) + two * p2 * x * y;
        [x * radial + sideways, y * radial + upward]
    }
}

/// Number of samples of the search for the fold, and bisections of the interval that contains it.
const FOLD_SAMPLES: u32 = 10_000;
const FOLD_BISECTIONS: usize = 60;

/// Returns the smallest s = r² > 0 at which r (1 + k₁ r² + k₂ r⁴ + k₃ r⁶) stops growing with r; infinite if
/// it never does.
fn fold_limit([k1, k2, _, _, k3]: [f64; 5]) -> f64 {
    // With t = 1/s the derivative is t³ + 3 k₁ t² + 5 k₂ t + 7 k₃, and positive at `bound`, above its largest
    // root.
    let grows = |t: f64| t * (t * (t + 3.0 * k1) + 5.0 * k2) + 7.0 * k3 > 0.0;
    let bound = 1.0 + (3.0 * k1).abs().max((5.0 * k2).abs()).max((7.0 * k3).abs());
    let at = |i: u32| bound * f64::from(i) / f64::from(FOLD_SAMPLES);
    let Some(first) = (0..FOLD_SAMPLES).rev().find(|i| !grows(at(*i))).filter(|i| *i > 0) else {
        return f64::INFINITY;
    };
    let [mut low, mut high] = [at(first), at(first + 1)];
    for _ in 0..FOLD_BISECTIONS {
        let middle = 0.5 * (low + high);
        *(if grows(middle) { &mut high } else { &mut low }) = middle;
    }
    1.0 / high
}

impl CameraModel for RadialTangential {
    const EXAMPLE: &'static str = "{ fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480, \
                                   distortion = [0.1, 0.02, 0.0, 0.0, 0.0] }";

    #[inline(always)]
    fn project<T: Scalar>(&self, point: &Vector3<T>) -> Vector2<T> {
        let [x, y] = self.distort([point.x / point.z, point.y / point.z]);
        self.pinhole.project(&Vector3::new(x, y, T::from(1.0)))
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let seen = self.pinhole.ray(*pixel);
        let mut point = [seen.x, seen.y];
        for _ in 0..MAX_ITERATIONS {
            let [x, y] = self.distort(point);
            let off = [seen.x - x, seen.y - y];
            point = [point[0] + off[0], point[1] + off[1]];
            if off[0].hypot(off[1]) < UNPROJECT_TOLERANCE {
                let direction = Vector3::new(point[0], point[1], 1.0);
                return self.sees(&direction).then_some(direction);
            }
        }
        None
    }

    #[inline(always)]
    fn sees(&self, point: &Vector3<f64>) -> bool {
        let square = point.xy().norm_squared();
        point.z > 0.0 && square < self.limit * point.z * point.z
    }

    fn pinhole(&self) -> Camera {
        self.pinhole
    }
}

register_camera!("radial_tangential", "projection_radial_tangential", RadialTangential);

impl TryFrom<Document> for RadialTangential {
    type Error = CameraError;
    fn try_from(document: Document) -> Result<Self, CameraError> {
        let Document { fx, fy, cx, cy, width, height, distortion } = document;
        Ok(Self::new(Camera::new([fx, fy, cx, cy], width, height)?, distortion.vector().into()))
    }
}

impl From<RadialTangential> for Document {
    fn from(camera: RadialTangential) -> Self {
        let Camera { fx, fy, cx, cy, width, height, .. } = camera.pinhole;
        Self { fx, fy, cx, cy, width, height, distortion: Coordinates::unchecked(camera.distortion.into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se3, camera_law};
    use crate::{Point3, Projection};
    use manifactor_testing::jacobian_laws;
    use manifactor_testing::strategies::vector;
    use proptest::prelude::*;

    /// Calibration of freiburg1, as published by the benchmark.
    fn freiburg1() -> RadialTangential {
        let pinhole = Camera::new([517.3, 516.5, 318.6, 255.3], 640, 480).unwrap();
        RadialTangential::new(pinhole, [0.2624, -0.9531, -0.0054, 0.0026, 1.1633])
    }

    /// Points that the camera sees inside its image or slightly outside.
    fn any_visible_point() -> impl Strategy<Value = Vector3<f64>> {
        ([-0.65..0.65f64, -0.5..0.5], 0.5..10.0f64).prop_map(|([x, y], z)| Vector3::new(x, y, 1.0) * z)
    }

    jacobian_laws! {
        jacobians_agree: (any_visible_point(), vector::<2>(500.0), any_se3()).prop_map(|(point, pixel, pose)| {
            let factor = Projection { pixel: Coordinates::new(pixel).unwrap(), camera: freiburg1() };
            (factor, pose, Point3::new(pose.act(&point)))
        })
    }

    #[test]
    fn a_pixel_is_that_of_its_direction() {
        proptest!(|(point in any_visible_point())| prop_assert_eq!(camera_law(&freiburg1(), &point), Ok(())));
    }

    #[test]
    fn without_distortion_it_is_the_pinhole() {
        let plain = RadialTangential::new(freiburg1().pinhole, [0.0; 5]);
        let point = Vector3::new(0.3, -0.2, 1.5);
        assert_eq!(plain.project(&point), plain.pinhole.project(&point));
        assert_eq!(plain.limit, f64::INFINITY);
    }

    #[test]
    fn a_point_beyond_the_fold_is_not_seen() {
        let folds = RadialTangential::new(freiburg1().pinhole, [-1.0, 0.0, 0.0, 0.0, 0.0]);
        // 1 - 3 s = 0
        assert!((folds.limit - 1.0 / 3.0).abs() < 1e-12);
        assert!(folds.sees(&Vector3::new(0.5, 0.0, 1.0)) && !folds.sees(&Vector3::new(0.6, 0.0, 1.0)));
        assert!(folds.unproject(&Vector2::new(10.0, 10.0)).is_none());
    }

    #[test]
    fn a_document_reads_back() {
        let text = serde_json::to_string(&freiburg1()).unwrap();
        assert_eq!(serde_json::from_str::<RadialTangential>(&text).unwrap(), freiburg1());
        let bad = serde_json::from_str::<RadialTangential>(&text.replace("517.3", "-1.0")).unwrap_err();
        assert!(bad.to_string().starts_with("camera: expected fx to be a finite number above zero"), "{bad}");
    }
}
