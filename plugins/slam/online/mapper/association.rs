//! Online data association, with corrections of earlier frames.
use super::Mapper;
use super::frame::FrameReport;
use super::object::{ObjectState, ViewingDirections};
use super::revision::MapSnapshot;
use manifactor_association::{Corrections, DetectionMove, MapEstimate, ObjectIdChanges, ObjectMerge};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{Graph, Key, Values};
use manifactor_mapping::mapping::measurements::{Measurements, ObjectBox};
use manifactor_mapping::mapping::{object_key, pose_key};
use manifactor_mapping::settings::RunSettings;
use manifactor_quadric::DualQuadric;
use manifactor_recording::sequence::ObjectId;
use manifactor_smoother::{FactorId, Smoother};
use std::collections::{BTreeMap, BTreeSet};

/// Share of the boxes of an object that may change at once. Beyond it, the object is removed and initialized
/// again.
const MAX_MOVED_SHARE: f64 = 0.25;

/// The current estimate for data association. Poses outside of the window are those at the time of their
/// frames.
pub(super) struct AssociationContext<'a> {
    /// Index and pose of the last frame.
    pub newest: (usize, Se3),
    pub live_poses: &'a [StampedPose],
    pub smoother: &'a Smoother,
    pub measurements: &'a Measurements,
}

impl MapEstimate for AssociationContext<'_> {
    fn pose(&self, frame: usize) -> Option<Se3> {
        let (newest, pose) = self.newest;
        if frame == newest {
            return Some(pose);
        }
        let now = self.smoother.get(pose_key(frame).as_str()).ok();
        now.or_else(|| self.live_poses.get(frame).map(|live| live.pose))
    }

    fn object(&self, id: ObjectId) -> Option<DualQuadric> {
        let now = self.smoother.get(object_key(id).as_str()).ok();
        // the first frame is assigned before the smoother has the objects of the prior map
        now.or_else(|| Some(self.measurements.object(id)?.prior.as_ref()?.quadric))
    }
}

/// A correction, with the state before it.
pub(super) struct AppliedCorrections {
    /// Object ids after the correction.
    pub id_changes: ObjectIdChanges,
    corrections: Vec<Corrections>,
    before: MapSnapshot,
    measurements: Measurements,
}

impl Mapper {
    /// Returns the current estimate, with the newest frame and its pose.
    pub(super) fn association_context(&self, newest: (usize, Se3)) -> AssociationContext<'_> {
        AssociationContext {
            newest,
            live_poses: &self.live_poses,
            smoother: &self.smoother,
            measurements: &self.measurements,
        }
    }

    /// Pushes pending corrections of earlier frames to the smoother, for the next update. If the update
    /// fails, the returned correction has to be [undone](Self::undo_corrections).
    pub(super) fn apply_pending_corrections(
        &mut self,
        report: &mut FrameReport,
    ) -> Option<AppliedCorrections> {
        let pending = std::mem::take(&mut self.pending);
        if pending.is_empty() {
            return None;
        }
        let before = self.take_snapshot();
        let measurements = self.measurements.clone();
        let (mut id_changes, mut owners) = (self.id_changes.clone(), vec![]);
        for corrections in &pending {
            for moved in &corrections.moved {
                self.move_detection(moved);
                id_changes.record_move(moved);
            }
            report.moved.extend_from_slice(&corrections.moved);
            owners.extend(self.update_moved_boxes(&corrections.moved, report));
            for merge in &corrections.merged {
                owners.extend(self.merge_objects(*merge, report));
                id_changes.record_merge(*merge);
            }
            corrections.forgotten.iter().for_each(|id| self.forget_tentative_object(*id));
        }
        let owners: BTreeSet<ObjectId> = owners.into_iter().map(|id| id_changes.current_id(id)).collect();
        self.apply_rules(&owners.into_iter().collect::<Vec<_>>(), report);
        Some(AppliedCorrections { id_changes, corrections: pending, before, measurements })
    }

    /// Restores the state before a failed correction. The correction is tried again with the next frame.
    pub(super) fn undo_corrections(
        &mut self,
        corrected: AppliedCorrections,
        why: &str,
        report: &mut FrameReport,
    ) {
        let moved = report.moved.drain(..).map(|moved| moved.from);
        let gone = moved.chain(report.merged.drain(..).map(|merge| merge.from)).map(object_key);
        let keys: BTreeSet<Key> = gone.chain(report.removed.drain(..)).collect();
        let keys: Vec<&str> = keys.iter().map(Key::as_str).collect();
        report.refused.push(format!("changes of {}: {why}", keys.join(", ")));
        self.restore_snapshot(corrected.before);
        self.measurements = corrected.measurements;
        self.pending = corrected.corrections;
    }

    /// Moves a detection to a different object in the measurements.
    fn move_detection(&mut self, DetectionMove { from, detection, .. }: &DetectionMove) {
        let RunSettings { detections, aliases, .. } = &*self.settings;
        self.measurements.remove_detection(detection, *from, detections, aliases);
        self.measurements.add_detection(detection, detections, aliases);
        if let Some(object @ ObjectState::Removed) = self.objects.get_mut(from) {
            // without this detection it may be one object
            *object = ObjectState::default();
        }
    }

    /// Updates the factors of objects whose boxes have moved. If a large share of the boxes of an object
    /// changed at once, its estimate belongs to a different object: it is removed from the map until its next
    /// detection. Returns the objects that semantic rules connected with removed ones.
    fn update_moved_boxes(&mut self, all: &[DetectionMove], report: &mut FrameReport) -> Vec<ObjectId> {
        let mut changed: BTreeMap<ObjectId, BTreeSet<usize>> = BTreeMap::new();
        for (id, frame) in all.iter().flat_map(|moved| [(moved.from, moved.frame), (moved.into, moved.frame)])
        {
            changed.entry(id).or_default().insert(frame);
        }
        let mut owners = vec![];
        for (id, frames) in changed {
            let others = self.measured(id).filter(|measured| measured.prior.is_none());
            let is_other =
                others.is_some_and(|own| frames.len() as f64 > MAX_MOVED_SHARE * own.views.len() as f64);
            let is_begun_again = is_other && self.is_removable(id);
            match self.objects.entry(id).or_default() {
                ObjectState::Mapped(_) if is_begun_again => {
                    owners.extend(self.remove_object(id, report));
                    self.objects.insert(id, ObjectState::Tentative(self.viewing_directions(id)));
                    report.removed.push(object_key(id));
                }
                ObjectState::Mapped(mapped) => {
                    let gone = mapped.boxes.extract_if(.., |(of, _)| frames.contains(of));
                    let gone: Vec<FactorId> = gone.map(|(_, factor)| factor).collect();
                    self.remove_factors(&gone, report);
                    let views_in =
                        |frame: &usize| self.measured(id).map_or(&[][..], |own| own.views_in(*frame));
                    let views: Vec<ObjectBox> = frames.iter().flat_map(views_in).cloned().collect();
                    self.push_boxes(id, &views, report);
                }
                ObjectState::Tentative(_) => {
                    self.objects.insert(id, ObjectState::Tentative(self.viewing_directions(id)));
                }
                ObjectState::Removed => {}
            }
        }
        owners
    }

    /// Returns whether an object can be removed without a trace, so that it can come back: none of the poses
    /// with its boxes has left the window.
    pub(super) fn is_removable(&self, id: ObjectId) -> bool {
        let Some(ObjectState::Mapped(mapped)) = self.objects.get(&id) else { return true };
        mapped.boxes.iter().all(|(_, factor)| self.smoother.entry(*factor).is_some())
    }

    /// Returns the viewing directions of an object outside of the map.
    pub(super) fn viewing_directions(&self, id: ObjectId) -> ViewingDirections {
        let mut sights = ViewingDirections::new();
        for view in self.measured(id).map_or(&[][..], |measured| &measured.views) {
            if let Some(pose) = self.pose(view.frame) {
                sights.add(view, &pose);
            }
        }
        sights
    }

    /// Removes an object that is not in the map. Its boxes become unassociated.
    pub(super) fn forget_tentative_object(&mut self, id: ObjectId) {
        if !self.objects.get(&id).is_some_and(ObjectState::is_mapped) {
            self.objects.remove(&id);
            self.measurements.remove_object(id);
        }
    }

    /// Merges an object into a second one: adds its boxes to the map if the second one is there, else to its
    /// tentative track. Returns the objects that semantic rules connected with the removed one.
    fn merge_objects(&mut self, merge: ObjectMerge, report: &mut FrameReport) -> Vec<ObjectId> {
        let ObjectMerge { from, into } = merge;
        let is_mapped = self.objects.get(&from).is_some_and(ObjectState::is_mapped);
        let owners = if is_mapped { self.remove_object(from, report) } else { vec![] };
        self.objects.remove(&from);
        let mut new = self.measurements.merge_objects(from, into);
        if matches!(self.objects.get(&into), Some(ObjectState::Removed)) {
            // with these boxes the object may be valid
            self.objects.remove(&into);
            new = self.measured(into).map_or(new, |measured| measured.views.clone());
        }
        match self.objects.entry(into).or_default() {
            ObjectState::Mapped(_) => self.push_boxes(into, &new, report),
            ObjectState::Tentative(sights) => {
                for view in &new {
                    if let Ok(pose) = self.smoother.get(pose_key(view.frame).as_str()) {
                        sights.add(view, &pose);
                    }
                }
            }
            ObjectState::Removed => {}
        }
        tracing::info!(object = %from, "is object {into}");
        report.merged.push(merge);
        owners
    }

    /// Pushes boxes of a mapped object, as far as their poses are in the smoother.
    fn push_boxes(&mut self, id: ObjectId, views: &[ObjectBox], report: &mut FrameReport) {
        let (frames, entries) = self.entries_of(&object_key(id), views);
        let mut graph = Graph::new();
        graph.factors_mut().extend(entries);
        match (self.smoother.push(&graph, &Values::new()), self.objects.get_mut(&id)) {
            (Ok(ids), Some(ObjectState::Mapped(mapped))) => mapped.boxes.extend(frames.into_iter().zip(ids)),
            (Ok(_), _) => {}
            (Err(error), _) => report.refused.push(error.to_string()),
        }
    }
}
