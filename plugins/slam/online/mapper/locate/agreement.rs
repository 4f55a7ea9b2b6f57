//! Agreement of the boxes of a stream with a place in a map.
//!
//! A place predicts boxes. Boxes of matched objects should lie on the outlines of the map's ellipsoids. Other objects of the map should be
//! detected too if they are in view: in another room, a few objects may stand as in the map, but the others are missing.
use super::layout::{Aligned, Layout};
use crate::mapper::Mapper;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::looks::{Expected, Sight, sights};
use manifactor_mapping::mapping::measurements::ObjectBox;
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, DualQuadric};
use manifactor_recording::prior_map::{PriorMap, PriorObject};
use manifactor_recording::sequence::ObjectId;
use std::collections::BTreeSet;

/// How well boxes agree with a place.
#[derive(Debug, Clone, Copy)]
pub(super) struct Agreement {
    /// Mean intersection over union of the boxes of matched objects with the outlines of the map's.
    pub overlap: f64,
    /// Of what should have been seen of the map, the share that was, from 0 to 1.
    pub seen: f64,
}

/// A place is believed where boxes agree with it by this,
const BELIEVED: f64 = 0.45;
/// and it has to be ahead of all other places with which they agree by this.
const POSSIBLE: f64 = 0.3;

impl Agreement {
    /// The overlap, where what should have been seen and was not counts as none.
    fn whole(self) -> f64 {
        self.overlap * self.seen
    }

    /// Returns whether a place is good enough.
    pub(super) fn is_believed(self) -> bool {
        self.whole() >= BELIEVED
    }
}

/// Boxes of an object that are compared with its outline.
const BOXES: usize = 20;
/// The last frames of a stream, which are searched for what should be in them.
const FRAMES: usize = 300;
/// A box of an object that may be one of the map shows it if it overlaps its outline by this.
const SHOWN: f64 = 0.3;

impl Mapper {
    /// How well boxes agree with a place; `None` where it is too little for any place.
    pub(super) fn agreement(&self, aligned: &Aligned, layout: &Layout, map: &PriorMap) -> Option<Agreement> {
        let overlap = Some(self.overlap(aligned, map)).filter(|overlap| *overlap >= POSSIBLE)?;
        let seen = self.seen(&aligned.known_from_local, layout, map);
        Some(Agreement { overlap, seen }).filter(|agreement| agreement.whole() >= POSSIBLE)
    }

    fn overlap(&self, aligned: &Aligned, map: &PriorMap) -> f64 {
        let of_pair = |(local, known): &(ObjectId, ObjectId)| {
            let (measured, object) = (self.measured(*local)?, map.object(*known)?);
            let every = measured.views.len().div_ceil(BOXES).max(1);
            let overlaps = measured.views.iter().step_by(every).filter_map(|view| {
                let pose = aligned.known_from_local.compose(&self.pose(view.frame)?);
                let outline = self.outline(&pose, &object.quadric, view);
                Some(outline.map_or(0.0, |outline| outline.iou(&view.bounding_box)))
            });
            mean(overlaps)
        };
        mean(aligned.matches.iter().filter_map(of_pair)).unwrap_or_default()
    }

    /// Looks at objects of the map from a place: how many are expected to show them, by how often looks did before, and how many do.
    fn seen(&self, place: &Se3, layout: &Layout, map: &PriorMap) -> f64 {
        let expected = |object: &PriorObject| Expected::new(object.id, object.quadric, object.least_px);
        let objects: Vec<Expected> = map.objects.iter().map(|object| expected(object)).collect();
        let frames = self.live.iter().enumerate().skip(self.live.len().saturating_sub(FRAMES));
        let poses = frames
            .filter_map(|(frame, live)| Some((frame, live.timestamp, place.compose(&self.pose_of(frame)?))));
        let (mut expected, mut seen) = (0.0, 0.0);
        // in the look that goes on
        let mut is_seen = BTreeSet::new();
        let border = self.settings.detections.border_px;
        sights(&objects, poses, &self.camera, *border, |sight| {
            let Some(object) = map.object(sight.id) else { return };
            if sight.begins {
                expected += object.looks.rate();
                is_seen.remove(&sight.id);
            }
            if !is_seen.contains(&sight.id) && self.is_shown(&sight, object, layout) {
                seen += 1.0;
                is_seen.insert(sight.id);
            }
        });
        // less than one is no evidence
        f64::min(seen / f64::max(expected, 1.0), 1.0)
    }

    /// Returns whether an object of the map has a box where it is there to be seen.
    fn is_shown(&self, sight: &Sight, object: &PriorObject, layout: &Layout) -> bool {
        layout.may_be(object.id).any(|local| {
            let view = self.measured(local).and_then(|measured| measured.view(sight.frame));
            view.is_some_and(|view| {
                let outline = self.outline(&sight.pose, &object.quadric, view);
                outline.is_some_and(|outline| outline.iou(&view.bounding_box) >= SHOWN)
            })
        })
    }

    fn outline(&self, pose: &Se3, quadric: &DualQuadric, view: &ObjectBox) -> Option<BoundingBox> {
        let (bounding_box, camera) = (view.bounding_box, self.camera);
        BoundingBoxFactor { bounding_box, camera, model: BoxModel::Truncated }.predict(pose, quadric)
    }
}

fn mean(of: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = of.fold((0.0, 0), |(sum, n), x| (sum + x, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}
