use manifactor_graph::checked::NotNegative;
use manifactor_quadric::initialise::{Initialiser, Svd};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

manifactor_graph::number! {
    /// An angle in degrees.
    pub Degrees: "a number from 0 to 180", |x| x >= 0.0 && x <= 180.0, { "minimum": 0, "maximum": 180 };
}

/// `[objects]`: which objects are mapped, and where they begin.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObjectSettings {
    /// Objects with fewer boxes are left out.
    pub min_views: usize,
    /// Objects whose boxes have a standard deviation of width or height of this or more are left out, in pixels:
    /// as a rule, detections of several things under one number.
    pub max_box_deviation_px: NotNegative,
    /// Objects that are seen under a smaller angle between two views are left out, in degrees: their depth is not
    /// observed.
    pub min_parallax_deg: Degrees,
    /// In a stream: an object is placed as soon as it is seen under this angle between two views, in degrees, though not under less
    /// than `min_parallax_deg`. What is never seen so is tried once more at the end, with all boxes.
    pub birth_parallax_deg: Degrees,
    /// How an object's first estimate is made of its boxes.
    pub initialiser: Arc<dyn Initialiser>,
    /// How many times, at most, each object is fitted alone to its own factors, from several places, before all is
    /// solved jointly; 0 for one joint solve and nothing else.
    pub refinements: usize,
}

impl Default for ObjectSettings {
    fn default() -> Self {
        Self {
            min_views: 3,
            max_box_deviation_px: NotNegative::literal(50.0),
            min_parallax_deg: Degrees::literal(0.0),
            birth_parallax_deg: Degrees::literal(10.0),
            initialiser: Arc::new(Svd::default()),
            refinements: 5,
        }
    }
}
