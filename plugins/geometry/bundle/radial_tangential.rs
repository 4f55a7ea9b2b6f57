//! Camera with radial and tangential lens distortion.
use crate::bundle::camera_model::camera_document;
use crate::{Camera, CameraError, CameraModel, Point2, UncalibratedModel, register_camera};
use manifactor_graph::{Jet, JetOf, Manifold, Scalar};
use nalgebra::{Matrix2, SVector, U2, U8, Vector2, Vector3, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A camera with radial and tangential lens distortion, with four, five or eight coefficients.
///
/// A point at (x/z, y/z), with radius r, projects through the pinhole at (x/z, y/z) · (1 + k₁ r² + k₂ r⁴ + k₃ r⁶) /
/// (1 + k₄ r² + k₅ r⁴ + k₆ r⁶) plus the tangential part (2 p₁ xy/z² + p₂ (r² + 2 x²/z²), p₁ (r² + 2 y²/z²) + 2 p₂
/// xy/z²); Brown, *Close-range camera calibration*, 1971, and OpenCV for the denominator. It is `plumb_bob` and
/// `rational_polynomial` of ROS, `radtan` of Kalibr, and `OPENCV` of COLMAP. The model folds back beyond some radius;
/// points beyond that radius are not seen. As a variable, k₃ to k₆ are constants.
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
    distortion: Distortion,
    /// Largest squared radius x²/z² + y²/z² at which the model does not fold back.
    limit: f64,
}

camera_document! {
    "RadialTangential",
    /// Coefficients k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆ in OpenCV's order: the first four, five or all.
    distortion: Distortion
}

/// Coefficients k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆ of a [`RadialTangential`] camera, in the order of OpenCV: the first
/// four, five or all eight.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Vec<f64>", into = "Vec<f64>")]
#[schemars(with = "Vec<f64>")]
pub struct Distortion {
    coefficients: [f64; 8],
    /// Number of coefficients that were given.
    given: usize,
}

/// Error of coefficients that are no distortion.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected 4, 5 or 8 finite coefficients k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆, got {0:?}")]
pub struct DistortionError(Vec<f64>);

impl TryFrom<Vec<f64>> for Distortion {
    type Error = DistortionError;
    fn try_from(given: Vec<f64>) -> Result<Self, DistortionError> {
        if !([4, 5, 8].contains(&given.len()) && given.iter().all(|k| k.is_finite())) {
            return Err(DistortionError(given));
        }
        let mut coefficients = [0.0; 8];
        coefficients.iter_mut().zip(&given).for_each(|(k, given)| *k = *given);
        Ok(Self { coefficients, given: given.len() })
    }
}

impl Distortion {
    /// Returns the coefficients k₃ to k₆; those that were not given are 0.
    pub fn further(&self) -> [f64; 4] {
        let [.., k3, k4, k5, k6] = self.coefficients;
        [k3, k4, k5, k6]
    }
}

impl From<Distortion> for Vec<f64> {
    fn from(distortion: Distortion) -> Self {
        distortion.coefficients[..distortion.given].to_vec()
    }
}

impl From<[f64; 5]> for Distortion {
    fn from([k1, k2, p1, p2, k3]: [f64; 5]) -> Self {
        Self { coefficients: [k1, k2, p1, p2, k3, 0.0, 0.0, 0.0], given: 5 }
    }
}

/// Maximum number of Newton steps of `unproject`, and its tolerance in units of the focal length.
const MAX_ITERATIONS: usize = 50;
const UNPROJECT_TOLERANCE: f64 = 1e-12;

impl RadialTangential {
    /// Creates a camera with the focal lengths, principal point and size of `pinhole`.
    pub fn new(pinhole: Camera, distortion: impl Into<Distortion>) -> Self {
        let distortion = distortion.into();
        Self { pinhole, distortion, limit: fold_limit(&distortion) }
    }

    /// Returns the coefficients.
    pub fn distortion(&self) -> Distortion {
        self.distortion
    }

    /// Applies the distortion to the point (x/z, y/z), in units of the focal length from the principal point.
    #[inline(always)]
    fn distort<T: Scalar>(&self, point: [T; 2]) -> [T; 2] {
        let [k1, k2, p1, p2, ..] = self.distortion.coefficients.map(T::from);
        self.distort_with([k1, k2, p1, p2], point)
    }

    /// Works like [`distort`](Self::distort), with other coefficients k₁, k₂, p₁, p₂.
    #[inline(always)]
    fn distort_with<T: Scalar>(&self, [k1, k2, p1, p2]: [T; 4], [x, y]: [T; 2]) -> [T; 2] {
        let two = T::from(2.0);
        let r2 = x * x + y * y;
        let radial = self.distortion.radial([k1, k2], r2);
        let sideways = two * p1 * x * y + p2 * (r2 + two * x * x);
        let upward = p1 * (r2 + two * y * y) + two * p2 * x * y;
        [x * radial + sideways, y * radial + upward]
    }
}

impl Distortion {
    /// Returns the radial factor at the squared radius, with other coefficients k₁ and k₂.
    #[inline(always)]
    fn radial<T: Scalar>(&self, [k1, k2]: [T; 2], r2: T) -> T {
        let [_, _, _, _, k3, k4, k5, k6] = self.coefficients.map(T::from);
        let one = T::from(1.0);
        let numerator = one + r2 * (k1 + r2 * (k2 + r2 * k3));
        if self.given <= 5 {
            return numerator;
        }
        numerator / (one + r2 * (k4 + r2 * (k5 + r2 * k6)))
    }
}

/// Number of samples of the search for the fold, and bisections of the interval that contains it.
const FOLD_SAMPLES: u32 = 10_000;
const FOLD_BISECTIONS: usize = 60;

/// Returns the smallest s = r² > 0 at which r times the radial factor stops growing with r, or has a pole; infinite
/// if there is none.
fn fold_limit(Distortion { coefficients: [k1, k2, _, _, k3, k4, k5, k6], .. }: &Distortion) -> f64 {
    if [k3, k4, k5, k6].into_iter().all(|k| *k == 0.0) {
        return smallest_root(3.0 * k1, 5.0 * k2);
    }
    // with t = 1/s: numerator t³ N = t³ + k₁ t² + k₂ t + k₃, denominator t³ D in the same way; r N/D grows with r if
    // N D + 2 s (N' D - N D') is positive, here times t⁶
    let polynomial = |t: f64, [a, b, c]: [f64; 3]| t * (t * (t + a) + b) + c;
    let slope = |t: f64, [a, b, c]: [f64; 3]| t * (t * a + 2.0 * b) + 3.0 * c;
    let (n, d) = ([*k1, *k2, *k3], [*k4, *k5, *k6]);
    let grows = |t: f64| {
        let [up, down] = [polynomial(t, n), polynomial(t, d)];
        down > 0.0 && up * down + 2.0 * (slope(t, n) * down - up * slope(t, d)) > 0.0
    };
    let size = n.iter().chain(&d).map(|k| k.abs()).sum::<f64>();
    // above it, t⁶ exceeds all other terms together
    let bound = 1.0 + 7.0 * size * (1.0 + size);
    let at = |i: u32| bound * (f64::from(i) / f64::from(FOLD_SAMPLES)).powi(2);
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

/// Returns the smallest s > 0 with 1 + a s + b s² = 0; infinite if there is none.
pub(super) fn smallest_root(a: f64, b: f64) -> f64 {
    let discriminant = a * a - 4.0 * b;
    // 1/s is the larger root of t² + a t + b; each branch adds numbers of one sign
    let largest = match () {
        () if discriminant < 0.0 => return f64::INFINITY,
        () if a <= 0.0 => 0.5 * (discriminant.sqrt() - a),
        () => -2.0 * b / (a + discriminant.sqrt()),
    };
    if largest > 0.0 { largest.recip() } else { f64::INFINITY }
}

impl CameraModel for RadialTangential {
    const EXAMPLE: &'static str = "{ fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480, \
                                   distortion = [0.1, 0.02, 0.0, 0.0, 0.0] }";

    #[inline(always)]
    fn project<T: Scalar>(&self, point: &Vector3<T>) -> Vector2<T> {
        self.project_with(&self.lifted(), point)
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let seen = self.pinhole.ray(*pixel).xy();
        let error = |point: &Vector2<f64>| Vector2::from(self.distort([point.x, point.y])) - seen;
        let mut point = seen;
        // the iteration begins inside the fold
        let reach = 0.9 * self.limit.sqrt() / point.norm();
        point *= reach.min(1.0);
        let mut off = error(&point);
        for _ in 0..MAX_ITERATIONS {
            if off.norm() < UNPROJECT_TOLERANCE {
                let direction = Vector3::new(point.x, point.y, 1.0);
                return self.sees(&direction).then_some(direction);
            }
            let seeded = Point2::new(point).seed();
            let mut jacobian = Matrix2::zeros();
            for (i, coordinate) in self.distort([seeded.x, seeded.y]).iter().enumerate() {
                jacobian.row_mut(i).copy_from_slice(JetOf::<U2>::gradient(coordinate)?);
            }
            let mut step = jacobian.try_inverse()? * off;
            // a shorter step if it leaves the fold or does not come closer
            let next = (0..MAX_ITERATIONS).find_map(|_| {
                let next = point - step;
                step *= 0.5;
                let closer = error(&next).norm() < off.norm();
                (closer && next.norm_squared() < self.limit).then_some(next)
            });
            let Some(next) = next else { break };
            (point, off) = (next, error(&next));
        }
        // the last digits of large numbers do not fit
        let direction = Vector3::new(point.x, point.y, 1.0);
        let is_close = off.norm() < 1e-9 * (1.0 + seen.norm());
        (is_close && self.sees(&direction)).then_some(direction)
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

impl UncalibratedModel for RadialTangential {
    type Dim = U8;
    const INTRINSICS: &'static [&'static str] = &["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"];

    #[inline(always)]
    fn intrinsics(&self) -> SVector<f64, 8> {
        let Camera { fx, fy, cx, cy, .. } = self.pinhole;
        let [k1, k2, p1, p2, ..] = self.distortion.coefficients;
        SVector::from([fx, fy, cx, cy, k1, k2, p1, p2])
    }

    fn with_intrinsics(&self, intrinsics: &SVector<f64, 8>) -> Self {
        let [fx, fy, cx, cy, lens @ ..]: [f64; 8] = (*intrinsics).into();
        let mut distortion = self.distortion;
        distortion.coefficients.iter_mut().zip(lens).for_each(|(k, new)| *k = new);
        Self::new(Camera { fx, fy, cx, cy, ..self.pinhole }, distortion)
    }

    #[inline(always)]
    fn is_valid(&self) -> bool {
        self.pinhole.is_valid()
    }

    #[inline(always)]
    fn project_with<T: Scalar>(&self, intrinsics: &SVector<T, 8>, point: &Vector3<T>) -> Vector2<T> {
        let [fx, fy, cx, cy, k1, k2, p1, p2] = (*intrinsics).into();
        let [x, y] = self.distort_with([k1, k2, p1, p2], [point.x / point.z, point.y / point.z]);
        self.pinhole.project_with(&Vector4::new(fx, fy, cx, cy), &Vector3::new(x, y, T::from(1.0)))
    }
}

register_camera!(
    "radial_tangential",
    "projection_radial_tangential",
    "uncalibrated_radial_tangential",
    RadialTangential
);

impl TryFrom<Document> for RadialTangential {
    type Error = CameraError;
    fn try_from(document: Document) -> Result<Self, CameraError> {
        Ok(Self::new(document.pinhole()?, document.distortion))
    }
}

impl From<RadialTangential> for Document {
    fn from(camera: RadialTangential) -> Self {
        Self::of(camera.pinhole, camera.distortion)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{any_se3, camera_law};
    use crate::{Coordinates, Point3, Projection};
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
            let factor = Projection::new(Coordinates::new(pixel).unwrap(), freiburg1());
            (factor, pose, Point3::new(pose.act(&point)))
        })
    }

    #[test]
    fn a_pixel_is_that_of_its_direction() {
        proptest!(|(point in any_visible_point())| prop_assert_eq!(camera_law(&freiburg1(), &point), Ok(())));
    }

    /// A camera with eight coefficients, and pixels of points by `cv::projectPoints` of OpenCV 5.0.0.
    fn rational() -> RadialTangential {
        let pinhole = Camera::new([608.3, 608.1, 637.4, 366.2], 1280, 720).unwrap();
        let all = vec![0.4821, -2.6133, 0.0003, -0.0004, 1.5231, 0.3630, -2.4392, 1.4513];
        RadialTangential::new(pinhole, Distortion::try_from(all).unwrap())
    }
    const OPENCV: [([f64; 3], [f64; 2]); 5] = [
        ([0.1, 0.2, 2.0], [667.856839872445, 427.10201360723346]),
        ([-0.9, 0.5, 2.0], [357.5165396126511, 521.6522218749701]),
        ([1.4, -0.8, 2.0], [1079.3331015388555, 113.77806149847058]),
        ([0.0, 1.2, 2.0], [637.3124048, 741.042577163885]),
        ([-1.9, -1.0, 2.0], [35.968892933961115, 50.11918144028607]),
    ];

    #[test]
    fn pixels_of_eight_coefficients_are_those_of_opencv() {
        for (point, pixel) in OPENCV {
            let error = rational().project(&Vector3::from(point)) - Vector2::from(pixel);
            assert!(error.norm() < 1e-9, "{point:?} {error}");
        }
        let size = || ([-0.95..0.95f64, -0.55..0.55], 0.5..10.0f64);
        proptest!(|(([x, y], z) in size())| {
            prop_assert_eq!(camera_law(&rational(), &(Vector3::new(x, y, 1.0) * z)), Ok(()));
        });
    }

    #[test]
    fn a_denominator_of_zero_ends_the_image() {
        let all = vec![0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0];
        let pole = RadialTangential::new(freiburg1().pinhole, Distortion::try_from(all).unwrap());
        assert!((pole.limit - 1.0).abs() < 1e-9, "{}", pole.limit);
        let error = Distortion::try_from(vec![0.1; 6]).unwrap_err().to_string();
        assert!(error.contains("expected 4, 5 or 8"), "{error}");
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
