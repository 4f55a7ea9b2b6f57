//! Agreement of the detections of a stream with a pose in a prior map.
//!
//! A pose predicts boxes. Boxes of matched objects should lie on the projections of the prior ellipsoids.
//! Other prior objects in view should be detected too: in a different room, a few objects may stand as in the
//! map, but the rest is missing.
use super::layout::{AlignedLayout, is_reliable, mixed_with_change};
use crate::mapper::Mapper;
use manifactor_geometry::Se3;
use manifactor_mapping::estimate::visibility::{ExpectedObject, VisibleObject, visit_visible_objects};
use manifactor_mapping::mapping::measurements::ObjectBox;
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, DualQuadric};
use manifactor_recording::prior_map::{DetectionCounts, PriorMap, PriorObject};
use manifactor_recording::sequence::ObjectId;
use std::collections::{BTreeMap, BTreeSet};

/// Agreement of detections with a pose in the prior map.
#[derive(Debug, Clone, Copy)]
pub(super) struct Agreement {
    /// Mean intersection over union of the boxes of matched objects with the projections of the prior
    /// ellipsoids.
    pub overlap: f64,
    /// Detected share of the prior objects that should be visible, from 0 to 1.
    pub seen: f64,
    /// Log-likelihood ratio of the prior objects that should be visible and were never detected, in nats.
    pub missed: f64,
}

/// Number of boxes per object that are compared with projections, at most.
const MAX_COMPARED_BOXES: usize = 20;
/// Number of last frames that are searched for prior objects.
const SEARCHED_FRAMES: usize = 300;
/// Intersection over union at which a box shows a prior object.
const MIN_SHOWN_IOU: f64 = 0.3;

impl Mapper {
    /// Returns the agreement of detections with a pose.
    pub(super) fn agreement(&self, aligned: &AlignedLayout, by_name: bool, map: &PriorMap) -> Agreement {
        let counts = self.detections_of_map(&aligned.known_from_local, by_name, map);
        let (mut expected, mut seen, mut missed) = (0.0, 0.0, 0.0);
        for (id, now) in counts {
            let Some(object) = map.object(id).filter(|object| is_reliable(&object.classes)) else { continue };
            expected += now.expected as f64 * object.detection_counts.detection_rate();
            seen += now.seen as f64;
            if now.seen == 0 && aligned.matches.iter().all(|(_, known)| *known != id) {
                missed += mixed_with_change(object.detection_counts.log_likelihood(now));
            }
        }
        // less than one expected detection is no evidence
        let seen = f64::min(seen / f64::max(expected, 1.0), 1.0);
        Agreement { overlap: self.overlap(aligned, map), seen, missed }
    }

    fn overlap(&self, aligned: &AlignedLayout, map: &PriorMap) -> f64 {
        let of_pair = |(local, known): &(ObjectId, ObjectId)| {
            let (measured, object) = (self.measured(*local)?, map.object(*known)?);
            let every = measured.views.len().div_ceil(MAX_COMPARED_BOXES).max(1);
            let overlaps = measured.views.iter().step_by(every).filter_map(|view| {
                let pose = aligned.known_from_local.compose(&self.pose(view.frame)?);
                let outline = outline(&view.camera_pose(&pose), &object.quadric, view);
                Some(outline.map_or(0.0, |outline| outline.iou(&view.bounding_box)))
            });
            mean(overlaps)
        };
        mean(aligned.matches.iter().filter_map(of_pair)).unwrap_or_default()
    }

    /// Returns the opportunities to detect the prior objects from a pose, and the detections among them.
    fn detections_of_map(
        &self,
        place: &Se3,
        by_name: bool,
        map: &PriorMap,
    ) -> BTreeMap<ObjectId, DetectionCounts> {
        let expected = |object: &PriorObject| ExpectedObject::new(object.id, object.quadric, object.least_px);
        let objects: Vec<ExpectedObject> = map.objects.iter().map(|object| expected(object)).collect();
        let frames =
            self.live_poses.iter().enumerate().skip(self.live_poses.len().saturating_sub(SEARCHED_FRAMES));
        let poses = frames
            .filter_map(|(frame, live)| Some((frame, live.timestamp, place.compose(&self.pose_of(frame)?))));
        let mut counts: BTreeMap<ObjectId, DetectionCounts> = BTreeMap::new();
        // objects detected in the current opportunity
        let mut is_seen = BTreeSet::new();
        let border = self.settings.detections.border_px;
        visit_visible_objects(&objects, poses, &self.cameras, *border, |sight| {
            let Some(object) = map.object(sight.id) else { return };
            let counts = counts.entry(sight.id).or_default();
            if sight.begins {
                counts.expected += 1;
                is_seen.remove(&sight.id);
            }
            if !is_seen.contains(&sight.id) && self.is_shown(&sight, object, by_name) {
                counts.seen += 1;
                is_seen.insert(sight.id);
            }
        });
        counts
    }

    /// Returns whether a visible prior object has a matching box, of any object of the run.
    fn is_shown(&self, sight: &VisibleObject, object: &PriorObject, by_name: bool) -> bool {
        self.measurements.objects.iter().any(|measured| {
            let shows = |view: &ObjectBox| {
                let outline = outline(&view.camera.view_pose(&sight.pose), &object.quadric, view);
                outline.is_some_and(|outline| outline.iou(&view.bounding_box) >= MIN_SHOWN_IOU)
            };
            let may_be = || match by_name {
                true => measured.id == object.id,
                false => measured.classes().is_compatible(&object.classes),
            };
            let views = measured.views_in(sight.frame).iter();
            let own = views.filter(|view| view.camera.index == sight.camera).any(shows);
            own && may_be()
        })
    }
}

/// Returns the projection of a prior object in the image of a box, from the pose of its camera.
fn outline(pose: &Se3, quadric: &DualQuadric, view: &ObjectBox) -> Option<BoundingBox> {
    let (bounding_box, camera) = (view.bounding_box, view.camera.model);
    BoundingBoxFactor { bounding_box, camera, model: BoxModel::Truncated }.predict(pose, quadric)
}

fn mean(of: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, n) = of.fold((0.0, 0), |(sum, n), x| (sum + x, n + 1));
    (n > 0).then(|| sum / f64::from(n))
}
