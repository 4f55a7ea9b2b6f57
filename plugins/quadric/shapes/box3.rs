//! Axis-aligned boxes in space.
use manifactor_geometry::Coordinates;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An axis-aligned box in space, in metres; in documents `{ min = [..], max = [..] }`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct Box3 {
    /// The corner with the smallest coordinates.
    pub min: Vector3<f64>,
    /// The corner with the largest coordinates.
    pub max: Vector3<f64>,
}

#[derive(Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Box3")]
struct Document {
    /// The corner with the smallest coordinates, in metres.
    min: [f64; 3],
    /// The corner with the largest coordinates, in metres.
    max: [f64; 3],
}

/// Corners that do not form a box.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("expected two corners of finite numbers with min ≤ max, got min = {min:?}, max = {max:?}")]
pub struct Box3Error {
    /// The corner given as minimum.
    pub min: [f64; 3],
    /// The corner given as maximum.
    pub max: [f64; 3],
}

impl Box3 {
    /// Creates the box between two corners.
    ///
    /// # Errors
    /// If a coordinate of `min` is above the corresponding one of `max`, or not finite.
    pub fn new(min: Vector3<f64>, max: Vector3<f64>) -> Result<Self, Box3Error> {
        let finite = Coordinates::new(min).is_ok() && Coordinates::new(max).is_ok();
        if finite && min <= max {
            Ok(Self { min, max })
        } else {
            Err(Box3Error { min: min.into(), max: max.into() })
        }
    }
    /// Creates the box with these dimensions around a point.
    pub fn around(centroid: Vector3<f64>, dimensions: Vector3<f64>) -> Self {
        Self { min: centroid - dimensions / 2.0, max: centroid + dimensions / 2.0 }
    }
    /// Returns the smallest box around points; `None` if there are no points.
    pub fn enclosing(points: impl IntoIterator<Item = Vector3<f64>>) -> Option<Self> {
        let grow = |b: Self, p: Self| Self { min: b.min.inf(&p.min), max: b.max.sup(&p.max) };
        points.into_iter().map(|p| Self { min: p, max: p }).reduce(grow)
    }
    /// Returns the extents along x, y and z.
    pub fn dimensions(&self) -> Vector3<f64> {
        self.max - self.min
    }
    /// Returns the centre.
    pub fn centroid(&self) -> Vector3<f64> {
        (self.min + self.max) / 2.0
    }
    /// Returns the volume, in cubic metres.
    pub fn volume(&self) -> f64 {
        self.dimensions().product()
    }
    /// Returns the box moved to the origin.
    #[must_use]
    pub fn centred(&self) -> Self {
        Self::around(Vector3::zeros(), self.dimensions())
    }
    /// Returns the intersection of two boxes.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        Self::new(self.min.sup(&other.min), self.max.inf(&other.max)).ok()
    }
    /// Returns the volume of the intersection divided by the volume of the union, 0 to 1; 0 for two boxes
    /// without volume.
    pub fn iou(&self, other: &Self) -> f64 {
        let common = self.intersection(other).map_or(0.0, |b| b.volume());
        let union = self.volume() + other.volume() - common;
        if union > 0.0 { common / union } else { 0.0 }
    }
}

impl TryFrom<Document> for Box3 {
    type Error = Box3Error;
    fn try_from(d: Document) -> Result<Self, Box3Error> {
        Self::new(d.min.into(), d.max.into())
    }
}
impl From<Box3> for Document {
    fn from(b: Box3) -> Self {
        Self { min: b.min.into(), max: b.max.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cube(at: f64, size: f64) -> Box3 {
        Box3::around(Vector3::repeat(at), Vector3::repeat(size))
    }

    #[test]
    fn overlap_is_measured_by_volumes() {
        assert_eq!(cube(0.0, 2.0).iou(&cube(0.0, 2.0)), 1.0);
        assert_eq!(cube(0.0, 2.0).iou(&cube(1.0, 2.0)), 1.0 / 15.0);
        assert_eq!(cube(0.0, 2.0).iou(&cube(3.0, 2.0)), 0.0);
        assert_eq!(cube(5.0, 2.0).centred().iou(&cube(0.0, 2.0)), 1.0);
        assert_eq!(cube(0.0, 0.0).iou(&cube(0.0, 0.0)), 0.0);
    }

    #[test]
    fn corners_are_in_order() {
        let text = r#"{"min":[0.0,0.0,0.0],"max":[1.0,2.0,0.5]}"#;
        let read = serde_json::from_str::<Box3>(text).unwrap();
        assert_eq!(serde_json::to_string(&read).unwrap(), text);
        assert!(serde_json::from_str::<Box3>(&text.replace("0.5", "-0.5")).is_err());
        assert!(Box3::new(Vector3::zeros(), Vector3::new(1.0, f64::NAN, 1.0)).is_err());
    }

    #[test]
    fn points_are_enclosed() {
        let points = [Vector3::new(1.0, -1.0, 0.0), Vector3::new(0.0, 2.0, 5.0)];
        let b = Box3::enclosing(points).unwrap();
        assert_eq!((b.min, b.max), (Vector3::new(0.0, -1.0, 0.0), Vector3::new(1.0, 2.0, 5.0)));
        assert!(Box3::enclosing([]).is_none());
    }
}
