//! Agreement of the boxes of a stream with a pose in a prior map.
//!
//! A pose predicts boxes. Boxes of matched objects should lie on the projections of the prior ellipsoids.
//! Other prior objects in view should be detected too: in a different room, a few objects may stand as in the
//! map, but the rest is missing.
use super::layout::{AlignedLayout, Layout};
use crate::mapper::Mapper;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::visibility::{ExpectedObject, VisibleObject, visit_visible_objects};
use manifactor_mapping::mapping::measurements::ObjectBox;
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, DualQuadric};
use manifactor_recording::prior_map::{PriorMap, PriorObject};
use manifactor_recording::sequence::ObjectId;
use std::collections::BTreeSet;

/// Agreement of boxes with a pose in the prior map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Agreement {
    /// Mean intersection over union of the boxes of matched objects with the projections of the prior
    /// ellipsoids.
    pub overlap: f64,
    /// Detected share of the prior objects that should be visible, from 0 to 1.
    pub seen: f64,
}

/// Agreement at which a pose is accepted. Chosen on the streams listed in `docs/decisions/prior-maps.md`.
const MIN_AGREEMENT: f64 = 0.45;
/// Agreement at which a pose counts as a rival of the best one.
const MIN_RIVAL_AGREEMENT: f64 = 0.3;

impl Agreement {
    /// Returns the overlap times the detected share: an undetected object counts as no overlap.
    fn score(self) -> f64 {
        self.overlap * self.seen
    }

    /// Returns whether the agreement is good enough to accept a pose.
    pub(super) fn is_accepted(self) -> bool {
        self.score() >= MIN_AGREEMENT
    }
}

/// Number of boxes per object that are compared with projections, at most.
const MAX_COMPARED_BOXES: usize = 20;
/// Number of last frames that are searched for prior objects.
const SEARCHED_FRAMES: usize = 300;
/// Intersection over union at which a box shows a prior object.
const MIN_SHOWN_IOU: f64 = 0.3;

impl Mapper {
    /// Returns the agreement of boxes with a pose; `None` if it is too low for any pose.
    pub(super) fn agreement(
        &self,
        aligned: &AlignedLayout,
        layout: &Layout,
        map: &PriorMap,
    ) -> Option<Agreement> {
        let overlap = Some(self.overlap(aligned, map)).filter(|overlap| *overlap >= MIN_RIVAL_AGREEMENT)?;
        let seen = self.detected_share(&aligned.known_from_local, layout, map);
        Some(Agreement { overlap, seen }).filter(|agreement| agreement.score() >= MIN_RIVAL_AGREEMENT)
    }

    fn overlap(&self, aligned: &AlignedLayout, map: &PriorMap) -> f64 {
        let of_pair = |(local, known): &(ObjectId, ObjectId)| {
            let (measured, object) = (self.measured(*local)?, map.object(*known)?);
            let every = measured.views.len().div_ceil(MAX_COMPARED_BOXES).max(1);
            let overlaps = measured.views.iter().step_by(every).filter_map(|view| {
                let pose = aligned.known_from_local.compose(&self.pose(view.frame)?);
                let outline = self.outline(&pose, &object.quadric, view);
                Some(outline.map_or(0.0, |outline| outline.iou(&view.bounding_box)))
            });
            mean(overlaps)
        };
        mean(aligned.matches.iter().filter_map(of_pair)).unwrap_or_default()
    }

    /// Returns the detected share of the prior objects at a pose. The expected number is the sum of the
    /// detection rates over all opportunities.
    fn detected_share(&self, place: &Se3, layout: &Layout, map: &PriorMap) -> f64 {
        let expected = |object: &PriorObject| ExpectedObject::new(object.id, object.quadric, object.least_px);
        let objects: Vec<ExpectedObject> = map.objects.iter().map(|object| expected(object)).collect();
        let frames =
            self.live_poses.iter().enumerate().skip(self.live_poses.len().saturating_sub(SEARCHED_FRAMES));
        let poses = frames
            .filter_map(|(frame, live)| Some((frame, live.timestamp, place.compose(&self.pose_of(frame)?))));
        let (mut expected, mut seen) = (0.0, 0.0);
        // objects detected in the current opportunity
        let mut is_seen = BTreeSet::new();
        let border = self.settings.detections.border_px;
        visit_visible_objects(&objects, poses, &self.camera, *border, |sight| {
            let Some(object) = map.object(sight.id) else { return };
            if sight.begins {
                expected += object.detection_counts.detection_rate();
                is_seen.remove(&sight.id);
            }
            if !is_seen.contains(&sight.id) && self.is_shown(&sight, object, layout) {
                seen += 1.0;
                is_seen.insert(sight.id);
            }
        });
        // less than one expected detection is no evidence
        f64::min(seen / f64::max(expected, 1.0), 1.0)
    }

    /// Returns whether a visible prior object has a matching box.
    fn is_shown(&self, sight: &VisibleObject, object: &PriorObject, layout: &Layout) -> bool {
        layout.possible_matches(object.id).any(|local| {
            let view = self.measured(local).and_then(|measured| measured.view(sight.frame));
            view.is_some_and(|view| {
                let outline = self.outline(&sight.pose, &object.quadric, view);
                outline.is_some_and(|outline| outline.iou(&view.bounding_box) >= MIN_SHOWN_IOU)
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
