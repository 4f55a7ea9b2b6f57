//! Axis-aligned boxes in an image.
use nalgebra::{Vector2, Vector3};
use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Names of the sides, in the order of documents and residuals.
pub const SIDES: [&str; 4] = ["xmin", "ymin", "xmax", "ymax"];

/// A box in an image, in pixels; in documents `[xmin, ymin, xmax, ymax]`. x is right, y down.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "[f64; 4]", into = "[f64; 4]")]
pub struct BoundingBox {
    /// Left.
    pub xmin: f64,
    /// Top.
    pub ymin: f64,
    /// Right.
    pub xmax: f64,
    /// Bottom.
    pub ymax: f64,
}

/// Numbers that do not form a box.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected [xmin, ymin, xmax, ymax], finite, with xmin ≤ xmax and ymin ≤ ymax; got {0:?}")]
pub struct BoundingBoxError(pub [f64; 4]);

impl BoundingBox {
    /// Creates the box from xmin, ymin, xmax, ymax.
    ///
    /// # Errors
    /// If a minimum is above its maximum, or a number is not finite.
    pub fn new(bounds: [f64; 4]) -> Result<Self, BoundingBoxError> {
        let [xmin, ymin, xmax, ymax] = bounds;
        let ordered = xmin <= xmax && ymin <= ymax && bounds.iter().all(|x| x.is_finite());
        if ordered { Ok(Self::from_bounds(bounds)) } else { Err(BoundingBoxError(bounds)) }
    }
    /// Creates a box from bounds known to be in order.
    pub(crate) fn from_bounds([xmin, ymin, xmax, ymax]: [f64; 4]) -> Self {
        Self { xmin, ymin, xmax, ymax }
    }
    /// Returns xmin, ymin, xmax, ymax.
    pub fn bounds(&self) -> [f64; 4] {
        [self.xmin, self.ymin, self.xmax, self.ymax]
    }
    /// Returns the width xmax - xmin.
    pub fn width(&self) -> f64 {
        self.xmax - self.xmin
    }
    /// Returns the height ymax - ymin.
    pub fn height(&self) -> f64 {
        self.ymax - self.ymin
    }
    /// Returns the area, in square pixels.
    pub fn area(&self) -> f64 {
        self.width() * self.height()
    }
    /// Returns whether width and height are at least a hundredth of a pixel, the resolution of detectors. A
    /// box without width shows nothing, and as a measurement it would make the object thin.
    pub fn has_area(&self) -> bool {
        const LEAST: f64 = 0.01;
        self.width() >= LEAST && self.height() >= LEAST
    }
    /// Returns the centre.
    pub fn centre(&self) -> Vector2<f64> {
        Vector2::new(self.xmin + self.xmax, self.ymin + self.ymax) / 2.0
    }
    /// Returns the lines of the sides as (a, b, c) with a x + b y + c = 0, in the order of [`SIDES`].
    pub fn lines(&self) -> [Vector3<f64>; 4] {
        [
            Vector3::new(1.0, 0.0, -self.xmin),
            Vector3::new(0.0, 1.0, -self.ymin),
            Vector3::new(1.0, 0.0, -self.xmax),
            Vector3::new(0.0, 1.0, -self.ymax),
        ]
    }
    /// Returns whether `other` is completely inside this box; sides may touch.
    pub fn contains(&self, other: &Self) -> bool {
        self.xmin <= other.xmin
            && self.ymin <= other.ymin
            && other.xmax <= self.xmax
            && other.ymax <= self.ymax
    }
    /// Returns whether the boxes have a point in common, including touching boxes and a box inside `other`.
    pub fn intersects(&self, other: &Self) -> bool {
        self.intersection(other).is_some()
    }
    /// Returns the intersection of two boxes.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        Self::new([
            self.xmin.max(other.xmin),
            self.ymin.max(other.ymin),
            self.xmax.min(other.xmax),
            self.ymax.min(other.ymax),
        ])
        .ok()
    }
    /// Returns the area of the intersection divided by the area of the union, 0 to 1; 0 for two boxes without
    /// area.
    pub fn iou(&self, other: &Self) -> f64 {
        let common = self.intersection(other).map_or(0.0, |b| b.area());
        let union = self.area() + other.area() - common;
        if union > 0.0 { common / union } else { 0.0 }
    }
    /// Returns which sides are more than `margin` pixels inside the border of an image of this size, in the
    /// order of [`SIDES`]. The remaining sides may belong to the border instead of the object: mask their
    /// rows with [`Noise::observing`](manifactor_graph::Noise::observing).
    pub fn sides_inside(&self, width: u32, height: u32, margin: f64) -> [bool; 4] {
        [
            self.xmin > margin,
            self.ymin > margin,
            self.xmax < f64::from(width) - margin,
            self.ymax < f64::from(height) - margin,
        ]
    }
}

impl TryFrom<[f64; 4]> for BoundingBox {
    type Error = BoundingBoxError;
    fn try_from(bounds: [f64; 4]) -> Result<Self, BoundingBoxError> {
        Self::new(bounds)
    }
}

impl From<BoundingBox> for [f64; 4] {
    fn from(b: BoundingBox) -> [f64; 4] {
        b.bounds()
    }
}

impl JsonSchema for BoundingBox {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> Cow<'static, str> {
        "BoundingBox".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "description": "[xmin, ymin, xmax, ymax], in pixels.",
            "type": "array", "items": { "type": "number" }, "minItems": 4, "maxItems": 4
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn b(bounds: [f64; 4]) -> BoundingBox {
        BoundingBox::new(bounds).unwrap()
    }

    #[test]
    fn overlap_is_measured_by_areas() {
        let (a, c) = (b([0.0, 0.0, 10.0, 10.0]), b([5.0, 0.0, 15.0, 10.0]));
        assert_eq!(a.iou(&c), 50.0 / 150.0);
        assert_eq!(a.iou(&a), 1.0);
        assert_eq!(a.iou(&b([20.0, 0.0, 21.0, 1.0])), 0.0);
        let point = b([3.0, 3.0, 3.0, 3.0]);
        assert_eq!(point.iou(&point), 0.0);
        assert!(a.contains(&point) && a.intersects(&point) && point.intersects(&a) && !point.contains(&a));
    }

    #[test]
    fn sides_at_the_border_are_not_inside() {
        let cut = b([0.0, 100.0, 639.0, 460.0]);
        assert_eq!(cut.sides_inside(640, 480, 10.0), [false, true, false, true]);
        assert_eq!(cut.sides_inside(640, 480, 20.0), [false, true, false, false]);
    }

    #[test]
    fn minimum_and_maximum_are_in_order() {
        let read = |text: &str| serde_json::from_str::<BoundingBox>(text).map_err(|e| e.to_string());
        assert_eq!(serde_json::to_string(&read("[1.0,2.0,3.5,4.0]").unwrap()).unwrap(), "[1.0,2.0,3.5,4.0]");
        assert!(read("[3.0,2.0,1.0,4.0]").unwrap_err().contains("xmin ≤ xmax"));
        assert!(BoundingBox::new([f64::NAN, 0.0, 1.0, 1.0]).is_err());
        assert!(BoundingBox::new([0.0, 0.0, f64::INFINITY, 1.0]).is_err());
    }
}
