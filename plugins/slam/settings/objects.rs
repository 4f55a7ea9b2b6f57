use crate::number::{table, within};
use manifactor_config::Section;
use manifactor_quadric::initialise::{Initialiser, Svd};
use serde::Serialize;
use std::sync::Arc;

/// `[objects]`: which objects are mapped, and where they begin.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectSettings {
    /// Objects with fewer boxes are left out.
    pub min_views: usize,
    /// Objects whose boxes have a standard deviation of width or height of this or more are left out, in pixels:
    /// as a rule, detections of several things under one number.
    pub max_box_deviation_px: f64,
    /// Objects that are seen under a smaller angle between two views are left out, in degrees: their depth is not
    /// observed.
    pub min_parallax_deg: f64,
    /// How an object's first estimate is made of its boxes.
    pub initialiser: Arc<dyn Initialiser>,
    /// How many times, at most, each object is fitted alone to its own factors, from several places, before all is
    /// solved jointly; 0 for one joint solve and nothing else.
    pub refinements: usize,
}

impl ObjectSettings {
    pub(super) fn take(parent: &mut Section<'_>) -> Option<Self> {
        table(parent, "objects", |section| {
            let min_views = section.optional::<usize>("min_views").unwrap_or(3);
            let initialiser = section.optional::<Box<dyn Initialiser>>("initialiser");
            Self {
                min_views,
                max_box_deviation_px: within(section, "max_box_deviation_px", 50.0, 0.0..=f64::INFINITY),
                min_parallax_deg: within(section, "min_parallax_deg", 0.0, 0.0..=180.0),
                initialiser: initialiser.map_or_else(|| Arc::new(Svd::default()) as Arc<_>, Arc::from),
                refinements: section.optional("refinements").unwrap_or(5),
            }
        })
    }
}
