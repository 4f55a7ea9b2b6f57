//! By the joint likelihood of box and class.
mod division;
mod fit;
#[cfg(test)]
mod rail;
mod second_look;
mod sightings;
mod track;
mod tracker;
mod union;

use super::{Association, Associator};
use fit::BoxNoise;
use manifactor_graph::checked::{Positive, Share};
use manifactor_graph::register;
use manifactor_quadric::Camera;
use manifactor_recording::class::Aliases;
use manifactor_recording::measurement::{Errors, Quantities, UsualDepth};
use manifactor_recording::prior_map::PriorObject;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tracker::Tracker;

/// By the likelihood of box and class, under what each object is expected to look like.
///
/// Each object has an ellipsoid of its own from its first box on, fitted to its boxes from all sides, with a covariance: one box says
/// where it is but for its depth. The next box is expected with S = J Σ Jᵀ + D + R: Σ of the ellipsoid, D of the camera's drift since
/// the object was seen, R of the detector. A box costs d² + ln det 2πS - 2 ln p(class), d its distance by S; to be a new object
/// costs what a box anywhere in the image does. The cheapest assignment of all boxes of a frame wins (Hungarian method). A box that
/// is nearly another's twin shows the same object: detectors draw a box for each class.
///
/// An object that was lost begins again under another name. Where one ellipsoid explains the boxes of two objects that
/// are not seen side by side, they become one; where only two explain those of one, it becomes two. All boxes of a frame are put to objects once
/// more a while later, by what is known then: those that turn out to show another object are moved to it.
///
/// Chosen on fr1/desk, fr1/desk2 and simulated desks: see the page on association in `docs/decisions`.
///
/// ```toml
/// association = { type = "likelihood", box_sigma = 4.0, box_sigma_of_size = 0.06 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Likelihood {
    /// Standard deviation of a box's sides, in pixels.
    pub box_sigma: Positive,
    /// The same as a part of its width and height; the two add up as squares.
    pub box_sigma_of_size: Positive,
    /// How many times as far off a box may be as one of many that are averaged: a detector's errors last for many frames.
    pub lasting: Positive,
    /// How far away a new object is believed to be, in metres, until there are others to go by.
    pub depth: Positive,
    /// Standard deviation of the logarithm of that.
    pub depth_spread: Positive,
    /// How far the camera drifts in a second, as standard deviations of a random walk: radians.
    pub drift_rad: Positive,
    /// The same in metres.
    pub drift_m: Positive,
    /// Standard deviation of measured depths, where the source has any, as a part of the depth.
    pub depth_error: Positive,
    /// The share of boxes that have a class which is not their object's.
    pub class_error: Share,
    /// New objects in a frame, on average.
    pub new_objects: Positive,
    /// Boxes in a frame with this intersection over union show one object.
    pub twin_iou: Share,
    /// Two objects are one where the sides of their boxes are off by this many standard deviations at most from one ellipsoid, as a root of
    /// the mean square: 1.4 times less for two of different classes, twice as many for two of one class in one place.
    pub merge_error: Positive,
    /// The boxes of a frame are put to objects once more after so many seconds, by what is known then.
    pub second_look_s: Positive,
}

impl Default for Likelihood {
    fn default() -> Self {
        Self {
            box_sigma: Positive::literal(4.0),
            box_sigma_of_size: Positive::literal(0.06),
            lasting: Positive::literal(2.5),
            depth: Positive::literal(1.5),
            depth_spread: Positive::literal(0.6),
            depth_error: Positive::literal(0.03),
            drift_rad: Positive::literal(0.016),
            drift_m: Positive::literal(0.016),
            class_error: Share::literal(0.1),
            new_objects: Positive::literal(0.05),
            twin_iou: Share::literal(0.7),
            merge_error: Positive::literal(1.2),
            second_look_s: Positive::literal(10.0),
        }
    }
}

#[typetag::serialize(name = "likelihood")]
impl Association for Likelihood {
    fn begin(&self, camera: Camera, aliases: &Aliases, known: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        let (settings, aliases) = (self.clone(), aliases.clone());
        Box::new(Tracker::new(settings, camera, aliases, known))
    }
}
register!(dyn Association, "likelihood", Likelihood);

impl Likelihood {
    fn noise(&self) -> BoxNoise {
        let others = Errors { depth: *self.depth_error };
        BoxNoise { px: *self.box_sigma, of_size: *self.box_sigma_of_size, others }
    }

    /// The likelihood of a class for an object that has this share of it.
    fn likelihood(&self, share: f64) -> f64 {
        (1.0 - *self.class_error) * share + *self.class_error / CLASSES
    }

    /// What a box costs that shows a new object: it is anywhere in the image, of any size and class, and as far away as objects usually are,
    /// give or take the spread.
    fn cost_of_new(&self, camera: &Camera, quantities: &Quantities, usual: f64) -> f64 {
        let area = camera.size().product();
        let usual = UsualDepth { depth: usual, spread: *self.depth_spread };
        let of_others: f64 = quantities.iter().map(|measurement| measurement.cost_of_new(&usual)).sum();
        of_others - 2.0 * (*self.new_objects / (area * area / 4.0) / CLASSES).ln()
    }
}

/// Classes that a box may have by mistake: it makes next to no difference.
const CLASSES: f64 = 20.0;
