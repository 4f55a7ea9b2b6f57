//! Data association by the joint likelihood of box and class.
mod fit;
mod merge;
mod posed_detections;
mod reassociation;
mod track;
mod tracker;

use super::{Association, Associator};
use fit::BoxNoise;
use manifactor_graph::checked::{Positive, Share};
use manifactor_graph::register;
use manifactor_quadric::Camera;
use manifactor_recording::class::ClassAliases;
use manifactor_recording::measurement::{MeasurementSigmas, Quantities, UsualDepth};
use manifactor_recording::prior_map::PriorObject;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use tracker::Tracker;

/// Assigns detections by the likelihood of box and class, given the predicted box of each object.
///
/// From its first box on, each object has an ellipsoid with a covariance, fitted to boxes from all sides. One
/// box determines all but the depth. The innovation covariance of the next box is S = J Σ Jᵀ + D + R: Σ is
/// the covariance of the ellipsoid, D the drift of the camera since the object was last seen, R the noise of
/// the detector. A box costs d² + ln det 2πS - 2 ln p(class), with the Mahalanobis distance d under S. A new
/// object costs as much as a box of any size anywhere in the image. The cheapest assignment of all boxes of a
/// frame wins (Hungarian method). A box that nearly coincides with an assigned box gets its object, because
/// detectors draw one box per class.
///
/// An object that was lost starts again under a new id. Two objects are merged if one ellipsoid explains the
/// boxes of both and they are not visible side by side. After a delay, all boxes of a frame are assigned a second time with the knowledge of that time, and
/// boxes that show a different object move to it.
///
/// The defaults were chosen on fr1/desk, fr1/desk2 and simulated desks: see the page on association in
/// `docs/decisions`.
///
/// ```toml
/// association = { type = "likelihood", box_sigma = 4.0, box_sigma_of_size = 0.06 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
#[schemars(rename = "Likelihood")]
pub struct LikelihoodAssociation {
    /// Standard deviation of the sides of a box. Unit: pixels.
    pub box_sigma: Positive,
    /// Standard deviation of the sides of a box, relative to its width and height. The variances of
    /// `box_sigma` and `box_sigma_of_size` add up.
    pub box_sigma_of_size: Positive,
    /// Factor on the standard deviation of a single box compared with a prediction, because the errors of a
    /// detector persist over many frames. A fit, which averages many boxes, does not use it.
    pub lasting: Positive,
    /// Assumed distance of a new object until the distances of other objects are known. Unit: metres.
    pub depth: Positive,
    /// Standard deviation of the logarithm of `depth`.
    pub depth_spread: Positive,
    /// Rotational drift of the camera: standard deviation of a random walk after one second. Unit: radians.
    pub drift_rad: Positive,
    /// Translational drift of the camera: standard deviation of a random walk after one second. Unit: metres.
    pub drift_m: Positive,
    /// Standard deviation of measured depths, relative to the depth. Only for sources with depths.
    pub depth_error: Positive,
    /// Share of boxes with a class that is not the class of their object.
    pub class_error: Share,
    /// Expected number of new objects per frame.
    pub new_objects: Positive,
    /// Intersection over union at which two boxes of a frame show one object.
    pub twin_iou: Share,
    /// Largest misfit at which two objects are merged: root mean square of the residuals of their box sides
    /// to one ellipsoid, in standard deviations. The limit is divided by 1.4 if the classes differ, and
    /// doubled for two objects of one class in one place.
    pub merge_error: Positive,
    /// Delay after which the boxes of a frame are assigned a second time. Unit: seconds.
    pub second_look_s: Positive,
}

impl Default for LikelihoodAssociation {
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
impl Association for LikelihoodAssociation {
    fn create_associator(&self, aliases: &ClassAliases, known: &[Arc<PriorObject>]) -> Box<dyn Associator> {
        let (settings, aliases) = (self.clone(), aliases.clone());
        Box::new(Tracker::new(settings, aliases, known))
    }
}
register!(dyn Association, "likelihood", LikelihoodAssociation);

impl LikelihoodAssociation {
    fn noise(&self) -> BoxNoise {
        let others = MeasurementSigmas { depth: *self.depth_error };
        BoxNoise { px: *self.box_sigma, of_size: *self.box_sigma_of_size, others }
    }

    /// Returns the likelihood of a class, given its share of the votes of an object.
    fn class_likelihood(&self, share: f64) -> f64 {
        (1.0 - *self.class_error) * share + *self.class_error / CLASS_COUNT
    }

    /// Returns the cost of a box that shows a new object: the box lies anywhere in the image, with any size
    /// and class, and the distance is the usual one with its spread.
    fn cost_of_new(&self, camera: &Camera, quantities: &Quantities, usual: f64) -> f64 {
        let area = camera.size().product();
        let usual = UsualDepth { depth: usual, spread: *self.depth_spread };
        let of_others: f64 = quantities.iter().map(|measurement| measurement.cost_of_new(&usual)).sum();
        of_others - 2.0 * (*self.new_objects / (area * area / 4.0) / CLASS_COUNT).ln()
    }
}

/// Number of classes that a wrong box may have. The result hardly depends on it.
const CLASS_COUNT: f64 = 20.0;
