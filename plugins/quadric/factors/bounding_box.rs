//! A detected bounding box of an object in an image.
use crate::shapes::BoundingBox;
use crate::shapes::DualQuadric;
use crate::shapes::Ellipsoid;
use crate::shapes::tangent_line::TangentLine;
use crate::shapes::{Ellipse, Side};
use manifactor_geometry::{Camera, Se3};
use manifactor_graph::prelude::*;
use nalgebra::{Matrix4x6, SMatrix};

/// Minimum visible extent of a cut object, in pixels: no detector draws a smaller box.
const MIN_VISIBLE_PX: f64 = 1.0;

/// A detector measures the box around an object's outline: r = β(x, q) - b, in pixels.
///
/// Variables: the pose of the camera (from the camera's frame, z forward, to the world frame) and the object.
/// Rows: xmin, ymin, xmax, ymax. The sign is estimate minus measurement, as in all factors of this library;
/// Jablonsky et al. use b - β, which gives an equal cost.
///
/// `model` selects β. *standard*: the bounds of the whole ellipse C* = P Q* Pᵀ. *truncated*: the bounds of
/// the part inside the image (Nicholson et al., QuadricSLAM), so that a box cut by the border does not pull
/// the object. With the standard model, mask such sides: `noise = { sigma = 20.0, observed = [false, true,
/// true, true] }`.
///
/// Defined only if the whole object is in front of the camera, by a millionth of its distance. If it is
/// behind the camera, around it or across its plane, the outline is no box and the factor is inactive. With
/// the truncated model the factor is also inactive if less than a pixel of the outline is left in the image.
/// An inactive factor has residual zero.
///
/// Kinks: the bounds are smooth while the object is in front. With the truncated model a side stops at the
/// border. From there on, including the border, its derivative is zero, so an object that fills the image is
/// not constrained. If the border cuts off the end of the ellipse, the side moves to the intersection of the
/// two. Its derivative does not jump there, but grows without limit as the last pixel leaves the image.
///
/// ```toml
/// [[factors]]
/// keys   = ["x0", "q0"]
/// factor = { type = "bounding_box", box = [120.0, 80.0, 260.0, 310.0], camera = { fx = 525.0, fy = 525.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }, model = "truncated" }
/// noise  = { sigma = 20.0 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BoundingBoxFactor {
    /// Measured box: xmin, ymin, xmax, ymax, in pixels.
    #[serde(rename = "box")]
    pub bounding_box: BoundingBox,
    /// The calibrated camera.
    pub camera: Camera,
    /// Part of the object that the box encloses.
    #[serde(default)]
    pub model: BoxModel,
}

/// Part of an object that a box encloses.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BoxModel {
    /// The whole object, including parts outside the image.
    #[default]
    Standard,
    /// The part inside the image.
    Truncated,
}

impl BoundingBoxFactor {
    /// Returns the sides of β; `None` if the factor is not defined.
    #[inline(always)]
    pub(super) fn sides<T: Scalar>(&self, ellipsoid: &Ellipsoid<T>) -> Option<[Side<T>; 4]> {
        if !ellipsoid.is_in_front() {
            return None;
        }
        let outline = ellipsoid.outline(&self.camera);
        match self.model {
            BoxModel::Standard => Some(outline.sides()),
            BoxModel::Truncated => self.inside(&outline),
        }
    }

    #[inline(always)]
    fn inside<T: Scalar>(&self, outline: &Ellipse<T>) -> Option<[Side<T>; 4]> {
        let sides = outline.truncated_sides(self.camera.size())?;
        let [xmin, ymin, xmax, ymax] = sides.map(|s| s.bound());
        let [width, height] = [outline.xx, outline.yy].map(|s| s.sqrt() * 2.0);
        let left = |extent: T, all: T| extent >= T::from(MIN_VISIBLE_PX) || extent >= all * 0.5;
        (left(xmax - xmin, width) && left(ymax - ymin, height)).then_some(sides)
    }

    /// Returns the predicted box of the object in the camera's image; `None` if the factor is not defined.
    pub fn predict(&self, world_from_camera: &Se3, quadric: &DualQuadric) -> Option<BoundingBox> {
        let sides = self.sides(&Ellipsoid::in_camera_frame(world_from_camera, quadric))?;
        Some(BoundingBox::from_bounds(sides.map(|s| s.bound())))
    }

    pub(super) fn error<T: Scalar>(&self, sides: &[Side<T>; 4]) -> Vector4<T> {
        let measured = self.bounding_box.bounds();
        Vector4::from_fn(|i, _| sides[i].bound() - T::from(measured[i]))
    }
}

impl BoundingBoxFactor {
    /// Returns the residual and writes its derivatives. Zeros and `None` if the factor is not defined.
    pub(super) fn derive(
        &self,
        (camera, quadric): (&Se3, &DualQuadric),
        by_pose: &mut Matrix4x6<f64>,
        by_quadric: &mut SMatrix<f64, 4, 9>,
    ) -> Option<Vector4<f64>> {
        by_pose.fill(0.0);
        by_quadric.fill(0.0);
        let seen = Ellipsoid::in_camera_frame(camera, quadric);
        let sides = self.sides(&seen)?;
        for (i, side) in sides.iter().enumerate() {
            if let Some(line) = TangentLine::of(&self.camera, side, i % 2) {
                let (pose, object) = line.derivatives(&seen, &quadric.semi_axes);
                by_pose.row_mut(i).copy_from(&pose);
                by_quadric.row_mut(i).copy_from(&object);
            }
        }
        Some(self.error(&sides))
    }
}

impl Residual for BoundingBoxFactor {
    type Variables = (Se3, DualQuadric);
    type Dim = U4;
    const ROWS: &'static [&'static str] = &["left", "top", "right", "bottom"];

    #[inline]
    fn residual<T: Scalar>(&self, (camera, quadric): Lifted<Self::Variables, T>) -> Vector4<T> {
        let sides = self.sides(&Ellipsoid::in_camera_frame(&camera, &quadric));
        sides.map_or_else(Vector4::zeros, |sides| self.error(&sides))
    }

    #[inline]
    fn is_defined(&self, (camera, quadric): Refs<'_, Self::Variables>) -> bool {
        match self.model {
            BoxModel::Standard => quadric.is_in_front_of(camera),
            BoxModel::Truncated => self.sides(&Ellipsoid::in_camera_frame(camera, quadric)).is_some(),
        }
    }

    fn linearize(
        &self,
        variables: Refs<'_, Self::Variables>,
        _free: &[bool],
        (by_pose, by_quadric): &mut Jacobians<Self>,
    ) -> Vector4<f64> {
        self.derive(variables, by_pose, by_quadric).unwrap_or_default()
    }
}

register_factor!("bounding_box", BoundingBoxFactor);

#[cfg(test)]
mod tests;
