//! Where a stream is in a map that was made before.
use super::Mapper;
use manifactor_geometry::Se3;
use manifactor_graph::Noise;
use manifactor_mapping::mapping::measurements::Measured;
use manifactor_mapping::mapping::object_key;
use manifactor_quadric::DualQuadric;
use manifactor_recording::prior_map::PriorMap;
use manifactor_recording::sequence::ObjectId;
use serde::Serialize;

mod agreement;
mod layout;

use agreement::Agreement;
use layout::{Layout, Mark};

/// Where a run begins in a map that was made before.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Located {
    /// The pose of the first camera in the map's frame.
    pub start: Se3,
    /// How well that is known: rad, then m.
    #[serde(skip)]
    pub noise: Noise,
    /// Objects that are the same: of the run until then, of the map.
    pub matches: Vec<(ObjectId, ObjectId)>,
    /// What speaks for it and not for the next best place, in nats.
    pub lead: f64,
    /// Mean intersection over union of the boxes of these objects with the outlines of the map's.
    pub overlap: f64,
    /// Of what should have been seen of the map until then, the share that was, from 0 to 1.
    pub seen: f64,
}

/// Variance of the centre of an object of which it is not known, as a part of its distance squared.
const UNKNOWN: f64 = 0.04;

impl Mapper {
    /// Where the stream begins in `map`, by the objects that it has mapped, if objects there are known as well as their covariances say; `None`
    /// as long as that is not clear.
    pub fn locate(&self, map: &PriorMap) -> Option<Located> {
        let first = self.pose_of(0)?;
        let marks = self.objects().filter_map(|(measured, quadric)| self.mark(measured, &quadric));
        let layout = Layout::new(marks.collect(), self.up(), map, self.settings.association.uses_names());
        let (aligned, agreement) = layout.align(|aligned| self.agreement(aligned, &layout, map))?;
        let start = aligned.known_from_local.compose(&first);
        let noise = aligned.noise(&first).ok()?;
        let (Agreement { overlap, seen }, lead) = (agreement, aligned.lead);
        Some(Located { start, noise, lead, overlap, seen, matches: aligned.matches })
    }

    fn mark(&self, measured: &Measured, quadric: &DualQuadric) -> Option<Mark> {
        let key = object_key(measured.id);
        let distance = (quadric.centroid() - self.live.last()?.pose.translation).norm();
        let variance = self.session.covariance(&[key.as_str()]);
        let variance = variance
            .map_or(UNKNOWN * distance * distance, |of| (3..6).map(|i| of[(i, i)]).sum::<f64>() / 3.0);
        Some(Mark::new(measured.id, quadric, variance, measured.classes()))
    }
}
