//! Relocalization of a stream in a prior map.
use super::Mapper;
use manifactor_geometry::Se3;
use manifactor_graph::Noise;
use manifactor_mapping::mapping::measurements::ObjectMeasurements;
use manifactor_mapping::mapping::object_key;
use manifactor_quadric::DualQuadric;
use manifactor_recording::prior_map::{DetectionCounts, PriorMap, PriorObject};
use manifactor_recording::sequence::ObjectId;
use serde::Serialize;
use std::sync::Arc;

mod agreement;
mod layout;

use agreement::Agreement;
use layout::{Layout, LayoutObject, is_reliable};

/// Start pose of a run in a prior map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Relocalization {
    /// Pose of the first camera in the frame of the prior map.
    pub start: Se3,
    /// Noise of the start pose: rad, then m.
    #[serde(skip)]
    pub noise: Noise,
    /// Matched objects: ids in the run, ids in the prior map.
    pub matches: Vec<(ObjectId, ObjectId)>,
    /// Log-likelihood lead over the second best explanation, another pose or a different room, in nats.
    pub lead: f64,
    /// Mean intersection over union of the boxes of matched objects with the projections of the prior
    /// ellipsoids.
    pub overlap: f64,
    /// Detected share of the prior objects that should be visible so far, from 0 to 1.
    pub seen: f64,
}

/// Variance of the centre of an object without a marginal covariance, relative to its squared distance.
const UNKNOWN_CENTRE_VARIANCE: f64 = 0.04;

impl Mapper {
    /// Finds the start pose in `map` from the mapped objects with enough detections. `None` as long as the
    /// result is ambiguous.
    pub fn locate(&self, map: &PriorMap) -> Option<Relocalization> {
        let first = self.pose_of(0)?;
        let by_name = self.settings.association.uses_source_ids();
        let reliable = self.objects().filter(|(measured, _)| is_reliable(measured.classes()));
        let marks = reliable.filter_map(|(measured, quadric)| self.layout_object(measured, &quadric));
        let layout = Layout::new(marks.collect(), self.up(), map, by_name);
        let (aligned, agreement) = layout.align(|aligned| self.agreement(aligned, by_name, map))?;
        let start = aligned.known_from_local.compose(&first);
        let noise = aligned.noise(&first).ok()?;
        let Agreement { overlap, seen, .. } = agreement;
        Some(Relocalization { start, noise, lead: aligned.lead, overlap, seen, matches: aligned.matches })
    }

    /// Returns the mapped objects so far as a prior map. Objects whose covariance is not known are left out. Their
    /// detection rates are unknown.
    pub fn prior_map(&self) -> PriorMap {
        let object = |(measured, quadric): (&ObjectMeasurements, DualQuadric)| {
            let covariance = self.smoother.covariance(&[object_key(measured.id).as_str()]).ok()?;
            let row = |r: usize| std::array::from_fn(|c| covariance[(r, c)]);
            Some(Arc::new(PriorObject {
                id: measured.id,
                classes: measured.classes().clone(),
                quadric,
                covariance: std::array::from_fn(row),
                detection_counts: DetectionCounts::default(),
                least_px: measured.least_px(),
                flat: quadric.is_flat(),
            }))
        };
        PriorMap::new(self.up(), self.objects().filter_map(object).collect())
    }

    fn layout_object(&self, measured: &ObjectMeasurements, quadric: &DualQuadric) -> Option<LayoutObject> {
        let key = object_key(measured.id);
        let distance = (quadric.centroid() - self.live_poses.last()?.pose.translation).norm();
        let variance = self.smoother.covariance(&[key.as_str()]);
        let variance = variance.map_or(UNKNOWN_CENTRE_VARIANCE * distance * distance, |of| {
            (3..6).map(|i| of[(i, i)]).sum::<f64>() / 3.0
        });
        Some(LayoutObject::new(measured.id, quadric, variance, measured.classes()))
    }
}
