//! Camera with one focal length and radial distortion.
use crate::bundle::radial_tangential::smallest_root;
use crate::{
    Camera, CameraError, CameraModel, Coordinates, RadialTangential, UncalibratedModel, register_camera,
};
use manifactor_graph::Scalar;
use nalgebra::{Matrix2x3, Matrix2x5, U5, Vector2, Vector3, Vector5};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A camera with one focal length and two coefficients of radial distortion.
///
/// A point at p = (x/z, y/z) projects to f (1 + k₁ ‖p‖² + k₂ ‖p‖⁴) p + (cx, cy). It is `RADIAL` of COLMAP, with k₂ = 0
/// `SIMPLE_RADIAL`, and the lens of BAL's cameras. The model can fold back beyond some radius; points beyond that
/// radius are not seen.
///
/// ```toml
/// [source]
/// type = "recorded"
/// folder = "my_recording"
/// camera = { type = "radial", f = 1487.0, cx = 640.0, cy = 480.0, width = 1280, height = 960, distortion = [-0.18, 0.17] }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct Radial {
    /// Both focal lengths are equal.
    pinhole: Camera,
    /// k₁ and k₂.
    distortion: [f64; 2],
    /// Largest squared radius x²/z² + y²/z² at which the model does not fold back.
    limit: f64,
}

#[derive(Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Radial")]
struct Document {
    /// Focal length, in pixels.
    f: f64,
    /// Principal point, in pixels.
    cx: f64,
    /// Principal point, in pixels.
    cy: f64,
    /// Size of the image, in pixels.
    width: u32,
    /// Size of the image, in pixels.
    height: u32,
    /// Coefficients k₁ and k₂.
    distortion: Coordinates<2>,
}

impl Radial {
    /// Creates a camera. `numbers` are the focal length, the principal point, k₁ and k₂.
    ///
    /// # Errors
    /// If the focal length or a size is not positive, or a number not finite.
    pub fn new([f, cx, cy, k1, k2]: [f64; 5], width: u32, height: u32) -> Result<Self, CameraError> {
        for (field, found) in [("k1", k1), ("k2", k2)] {
            if !found.is_finite() {
                return Err(CameraError { field, expected: "a finite number", found });
            }
        }
        Ok(Self::unchecked(Camera::new([f, f, cx, cy], width, height)?, [k1, k2]))
    }

    fn unchecked(pinhole: Camera, distortion: [f64; 2]) -> Self {
        let [k1, k2] = distortion;
        Self { pinhole, distortion, limit: smallest_root(3.0 * k1, 5.0 * k2) }
    }
}

impl CameraModel for Radial {
    const EXAMPLE: &'static str =
        "{ f = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480, distortion = [0.1, 0.02] }";

    #[inline(always)]
    fn project<T: Scalar>(&self, point: &Vector3<T>) -> Vector2<T> {
        self.project_with(&self.lifted(), point)
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        let [k1, k2] = self.distortion;
        RadialTangential::new(self.pinhole, [k1, k2, 0.0, 0.0, 0.0]).unproject(pixel)
    }

    #[inline(always)]
    fn sees(&self, point: &Vector3<f64>) -> bool {
        let square = point.xy().norm_squared();
        self.pinhole.sees(point) && square < self.limit * point.z * point.z
    }

    fn pinhole(&self) -> Camera {
        self.pinhole
    }

    #[inline]
    fn derivative(&self, point: &Vector3<f64>) -> Matrix2x3<f64> {
        let (f, p, [k1, k2]) = (self.pinhole.fx, point.xy() / point.z, self.distortion);
        let rho = p.norm_squared();
        // ∂u/∂p = f (radial I + 2 (k1 + 2 k2 ρ) p pᵀ), ∂p/∂P = [I -p] / z
        let (radial, slope) = (1.0 + rho * (k1 + rho * k2), 2.0 * (k1 + 2.0 * k2 * rho));
        let scale = f / point.z;
        let (xx, yy) = (scale * (radial + slope * p.x * p.x), scale * (radial + slope * p.y * p.y));
        let xy = scale * slope * p.x * p.y;
        Matrix2x3::new(xx, xy, -(xx * p.x + xy * p.y), xy, yy, -(xy * p.x + yy * p.y))
    }
}

impl UncalibratedModel for Radial {
    type Dim = U5;
    const INTRINSICS: &'static [&'static str] = &["f", "cx", "cy", "k1", "k2"];

    #[inline(always)]
    fn intrinsics(&self) -> Vector5<f64> {
        let (Camera { fx, cx, cy, .. }, [k1, k2]) = (self.pinhole, self.distortion);
        Vector5::new(fx, cx, cy, k1, k2)
    }

    fn with_intrinsics(&self, intrinsics: &Vector5<f64>) -> Self {
        let [f, cx, cy, k1, k2] = (*intrinsics).into();
        Self::unchecked(Camera { fx: f, fy: f, cx, cy, ..self.pinhole }, [k1, k2])
    }

    #[inline(always)]
    fn is_valid(&self) -> bool {
        self.pinhole.is_valid()
    }

    #[inline(always)]
    fn project_with<T: Scalar>(&self, intrinsics: &Vector5<T>, point: &Vector3<T>) -> Vector2<T> {
        let [f, cx, cy, k1, k2] = (*intrinsics).into();
        let p = point.xy() / point.z;
        let rho = p.norm_squared();
        let scale = f * (T::from(1.0) + rho * (k1 + rho * k2));
        Vector2::new(p.x * scale + cx, p.y * scale + cy)
    }

    #[inline]
    fn derivative_by_intrinsics(&self, point: &Vector3<f64>) -> Matrix2x5<f64> {
        let (f, p, [k1, k2]) = (self.pinhole.fx, point.xy() / point.z, self.distortion);
        let rho = p.norm_squared();
        let (radial, by_k1, by_k2) = (1.0 + rho * (k1 + rho * k2), f * rho, f * rho * rho);
        Matrix2x5::new(
            p.x * radial,
            1.0,
            0.0,
            p.x * by_k1,
            p.x * by_k2, //
            p.y * radial,
            0.0,
            1.0,
            p.y * by_k1,
            p.y * by_k2,
        )
    }
}

register_camera!("radial", "projection_radial", "uncalibrated_radial", Radial);

impl TryFrom<Document> for Radial {
    type Error = CameraError;
    fn try_from(d: Document) -> Result<Self, CameraError> {
        let [k1, k2] = d.distortion.vector().into();
        Self::new([d.f, d.cx, d.cy, k1, k2], d.width, d.height)
    }
}

impl From<Radial> for Document {
    fn from(camera: Radial) -> Self {
        let Camera { fx, cx, cy, width, height, .. } = camera.pinhole;
        Self { f: fx, cx, cy, width, height, distortion: Coordinates::unchecked(camera.distortion.into()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::camera_law;
    use crate::{BalCamera, Se3};
    use proptest::prelude::*;

    fn camera() -> Radial {
        Radial::new([800.0, 320.0, 240.0, -0.2, 0.05], 640, 480).unwrap()
    }

    #[test]
    fn a_pixel_is_that_of_its_direction() {
        proptest!(|([x, y] in [-0.5..0.5f64, -0.5..0.5], z in 0.5..10.0f64)| {
            prop_assert_eq!(camera_law(&camera(), &(Vector3::new(x, y, 1.0) * z)), Ok(()));
        });
    }

    /// BAL's image has its origin at the centre and y up, and its camera looks along -z.
    #[test]
    fn the_lens_is_that_of_bal() {
        let bal = BalCamera {
            world_from_camera: Se3::identity(),
            focal_length: 800.0,
            distortion: Vector2::new(-0.2, 0.05),
        };
        let there = bal.project(&Vector3::new(0.3, -0.4, -2.0));
        let here = camera().project(&Vector3::new(0.3, 0.4, 2.0));
        assert!((here - Vector2::new(320.0 + there.x, 240.0 - there.y)).norm() < 1e-12);
    }

    #[test]
    fn a_point_beyond_the_fold_is_not_seen() {
        let folds = Radial::new([800.0, 320.0, 240.0, -1.0, 0.0], 640, 480).unwrap();
        // 1 - 3 ρ = 0
        assert!(folds.sees(&Vector3::new(0.57, 0.0, 1.0)) && !folds.sees(&Vector3::new(0.58, 0.0, 1.0)));
        let never = Radial::new([800.0, 320.0, 240.0, 0.1, 0.0], 640, 480).unwrap();
        assert!(never.sees(&Vector3::new(50.0, 0.0, 1.0)) && !never.sees(&Vector3::new(0.0, 0.0, -1.0)));
    }

    #[test]
    fn a_document_reads_back() {
        let text = serde_json::to_string(&camera()).unwrap();
        assert_eq!(serde_json::from_str::<Radial>(&text).unwrap(), camera());
        let bad = serde_json::from_str::<Radial>(&text.replace("800.0", "-1.0")).unwrap_err();
        assert!(bad.to_string().starts_with("camera: expected fx to be a finite number above zero"), "{bad}");
    }
}
