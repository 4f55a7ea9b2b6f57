//! Pinhole cameras without distortion.
use crate::{CameraModel, Se3, UncalibratedModel, register_camera};
use manifactor_graph::Scalar;
use nalgebra::{Matrix2x3, Matrix2x4, Matrix3, Matrix3x4, U4, Vector2, Vector3, Vector4};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pinhole camera: u = fx x/z + skew y/z + cx, v = fy y/z + cy. x is right, y down, z forward.
///
/// Pixel coordinates count from the corner of the image, which covers 0 to `width` and 0 to `height`.
///
/// ```toml
/// [source]
/// type = "recorded"
/// folder = "my_recording"
/// camera = { type = "pinhole", fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct Camera {
    /// Focal length along x, in pixels.
    pub fx: f64,
    /// Focal length along y, in pixels.
    pub fy: f64,
    /// Principal point, in pixels.
    pub cx: f64,
    /// Principal point, in pixels.
    pub cy: f64,
    /// Contribution of y/z to u, in pixels; 0 for nearly all cameras.
    pub skew: f64,
    /// Size of the image, in pixels.
    pub width: u32,
    /// Size of the image, in pixels.
    pub height: u32,
}

#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Camera")]
struct Document {
    /// Focal length along x, in pixels.
    fx: f64,
    /// Focal length along y, in pixels.
    fy: f64,
    /// Principal point, in pixels.
    cx: f64,
    /// Principal point, in pixels.
    cy: f64,
    /// Contribution of y/z to u, in pixels.
    #[serde(default, skip_serializing_if = "is_zero")]
    skew: f64,
    /// Size of the image, in pixels.
    width: u32,
    /// Size of the image, in pixels.
    height: u32,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde passes a reference
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// An invalid camera parameter.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("camera: expected {field} to be {expected}, got {found}")]
pub struct CameraError {
    /// The parameter.
    pub field: &'static str,
    /// The allowed values.
    pub expected: &'static str,
    /// The value given.
    pub found: f64,
}

impl Camera {
    /// Creates a camera without skew.
    ///
    /// # Errors
    /// If a focal length or a size is not positive, or a number not finite.
    pub fn new([fx, fy, cx, cy]: [f64; 4], width: u32, height: u32) -> Result<Self, CameraError> {
        Self { fx, fy, cx, cy, skew: 0.0, width, height }.checked()
    }

    fn checked(self) -> Result<Self, CameraError> {
        let size = [("width", f64::from(self.width)), ("height", f64::from(self.height))];
        for (field, found) in [("fx", self.fx), ("fy", self.fy)].into_iter().chain(size) {
            if !(found > 0.0 && found.is_finite()) {
                return Err(CameraError { field, expected: "a finite number above zero", found });
            }
        }
        for (field, found) in [("cx", self.cx), ("cy", self.cy), ("skew", self.skew)] {
            if !found.is_finite() {
                return Err(CameraError { field, expected: "a finite number", found });
            }
        }
        Ok(self)
    }

    /// Returns the calibration matrix K = [fx skew cx; 0 fy cy; 0 0 1].
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, self.skew, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }
    /// Returns the projection matrix P = K [Rᵀ | -Rᵀc] of a camera with the pose (R, c).
    pub fn projection(&self, world_from_camera: &Se3) -> Matrix3x4<f64> {
        let camera_from_world = world_from_camera.inverse().matrix();
        self.matrix() * camera_from_world.fixed_view::<3, 4>(0, 0)
    }
    /// Returns the viewing direction of a pixel in the camera's frame, with z = 1.
    pub fn ray(&self, pixel: Vector2<f64>) -> Vector3<f64> {
        let y = (pixel.y - self.cy) / self.fy;
        Vector3::new((pixel.x - self.cx - self.skew * y) / self.fx, y, 1.0)
    }
    /// Returns width and height of the image, in pixels.
    pub fn size(&self) -> Vector2<f64> {
        Vector2::new(f64::from(self.width), f64::from(self.height))
    }
}

/// Smallest depth of a point in front of the camera, as a share of its distance.
const MIN_RELATIVE_DEPTH: f64 = 1e-6;

impl CameraModel for Camera {
    const EXAMPLE: &'static str =
        "{ fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }";

    #[inline(always)]
    fn project<T: Scalar>(&self, point: &Vector3<T>) -> Vector2<T> {
        self.project_with(&self.lifted(), point)
    }

    fn unproject(&self, pixel: &Vector2<f64>) -> Option<Vector3<f64>> {
        Some(self.ray(*pixel))
    }

    #[inline(always)]
    fn sees(&self, point: &Vector3<f64>) -> bool {
        point.z > 0.0 && point.z * point.z > MIN_RELATIVE_DEPTH * MIN_RELATIVE_DEPTH * point.norm_squared()
    }

    fn pinhole(&self) -> Camera {
        *self
    }

    #[inline(always)]
    fn derivative(&self, point: &Vector3<f64>) -> Matrix2x3<f64> {
        let Self { fx, fy, skew, .. } = *self;
        let (x, y, w) = (point.x / point.z, point.y / point.z, point.z.recip());
        Matrix2x3::new(fx, skew, -(fx * x + skew * y), 0.0, fy, -fy * y) * w
    }
}

impl UncalibratedModel for Camera {
    type Dim = U4;
    const INTRINSICS: &'static [&'static str] = &["fx", "fy", "cx", "cy"];

    #[inline(always)]
    fn intrinsics(&self) -> Vector4<f64> {
        Vector4::new(self.fx, self.fy, self.cx, self.cy)
    }

    fn with_intrinsics(&self, intrinsics: &Vector4<f64>) -> Self {
        let [fx, fy, cx, cy] = (*intrinsics).into();
        Self { fx, fy, cx, cy, ..*self }
    }

    #[inline(always)]
    fn is_valid(&self) -> bool {
        self.fx > 0.0 && self.fy > 0.0
    }

    #[inline(always)]
    fn project_with<T: Scalar>(&self, intrinsics: &Vector4<T>, point: &Vector3<T>) -> Vector2<T> {
        let (x, y) = (point.x / point.z, point.y / point.z);
        let [fx, fy, cx, cy] = (*intrinsics).into();
        Vector2::new(x * fx + y * self.skew + cx, y * fy + cy)
    }

    #[inline(always)]
    fn derivative_by_intrinsics(&self, point: &Vector3<f64>) -> Matrix2x4<f64> {
        let (x, y) = (point.x / point.z, point.y / point.z);
        Matrix2x4::new(x, 0.0, 1.0, 0.0, 0.0, y, 0.0, 1.0)
    }
}

register_camera!("pinhole", "projection", "uncalibrated_pinhole", Camera);

impl TryFrom<Document> for Camera {
    type Error = CameraError;
    fn try_from(d: Document) -> Result<Self, CameraError> {
        let Document { fx, fy, cx, cy, skew, width, height } = d;
        Self { fx, fy, cx, cy, skew, width, height }.checked()
    }
}
impl From<Camera> for Document {
    fn from(c: Camera) -> Self {
        let Camera { fx, fy, cx, cy, skew, width, height } = c;
        Self { fx, fy, cx, cy, skew, width, height }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_is_what_projects_to_its_pixel() {
        let camera = Camera { skew: 3.0, ..Camera::new([500.0, 510.0, 320.0, 240.0], 640, 480).unwrap() };
        let pixel = camera.matrix() * camera.ray(Vector2::new(12.0, 345.0));
        assert!((pixel - Vector3::new(12.0, 345.0, 1.0)).norm() < 1e-12);
    }

    #[test]
    fn a_camera_needs_a_focal_length_and_an_image() {
        let read = |text: &str| serde_json::from_str::<Camera>(text).map_err(|e| e.to_string());
        let good = r#"{"fx":500.0,"fy":510.0,"cx":320.0,"cy":240.0,"width":640,"height":480}"#;
        assert_eq!(serde_json::to_string(&read(good).unwrap()).unwrap(), good);
        let bad = read(&good.replace("510.0", "-1.0")).unwrap_err();
        assert_eq!(bad, "camera: expected fy to be a finite number above zero, got -1");
        assert!(read(&good.replace("480", "0")).unwrap_err().contains("height"));
        assert!(read(&good.replace("\"cx\"", "\"cz\"")).unwrap_err().contains("unknown field"));
    }
}
