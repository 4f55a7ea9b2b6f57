use manifactor_graph::checked::NotNegative;
use manifactor_quadric::initialise::{Initialiser, SvdInitialiser};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

manifactor_graph::number! {
    /// An angle in degrees.
    pub Degrees: "a number from 0 to 180", |x| x >= 0.0 && x <= 180.0, { "minimum": 0, "maximum": 180 };
}

/// `[objects]`: selection and initialization of the mapped objects.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct ObjectSettings {
    /// Smallest number of boxes of a mapped object.
    pub min_views: usize,
    /// Objects are not mapped if the width or height of their boxes has this standard deviation or more. Such
    /// boxes usually show several objects under one number. Unit: pixels.
    pub max_box_deviation_px: NotNegative,
    /// Objects are not mapped if the largest angle between two views is smaller, because their depth is not
    /// observed. Unit: degrees.
    pub min_parallax_deg: Degrees,
    /// In a stream, an object is initialized as soon as the angle between two views reaches this value, but
    /// never below `min_parallax_deg`. Objects that never reach it are tried once more at the end, with all
    /// boxes. Unit: degrees.
    pub birth_parallax_deg: Degrees,
    /// Method that computes the initial value of an object from its boxes.
    pub initialiser: Arc<dyn Initialiser>,
    /// Largest number of times that each object is fitted alone to its own factors, from several initial
    /// values, before the joint solve. 0 for the joint solve only.
    pub refinements: usize,
}

impl Default for ObjectSettings {
    fn default() -> Self {
        Self {
            min_views: 3,
            max_box_deviation_px: NotNegative::literal(50.0),
            min_parallax_deg: Degrees::literal(0.0),
            birth_parallax_deg: Degrees::literal(10.0),
            initialiser: Arc::new(SvdInitialiser::default()),
            refinements: 5,
        }
    }
}
