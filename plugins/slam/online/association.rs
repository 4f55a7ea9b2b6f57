//! Objects that are named as they come, and that turn out to be one.
use super::Mapper;
use super::frame::FrameReport;
use super::object::Tracked;
use crate::association::{Map, Merge, Names};
use crate::input::sequence::ObjectId;
use crate::mapping::measurements::{Measurements, ObjectBox};
use crate::mapping::{object_key, pose_key, view_entries};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{Graph, Values};
use manifactor_online::Session;
use manifactor_quadric::DualQuadric;
use std::collections::BTreeSet;

/// What has been estimated so far; of frames that have left the window, as it was when they came.
pub(super) struct Known<'a> {
    /// The last frame, and its pose.
    pub newest: (usize, Se3),
    pub live: &'a [StampedPose],
    pub session: &'a Session,
    pub measurements: &'a Measurements,
}

impl Map for Known<'_> {
    fn pose(&self, frame: usize) -> Option<Se3> {
        let (newest, pose) = self.newest;
        if frame == newest {
            return Some(pose);
        }
        let now = self.session.get(pose_key(frame).as_str()).ok();
        now.or_else(|| self.live.get(frame).map(|live| live.pose))
    }

    fn object(&self, id: ObjectId) -> Option<DualQuadric> {
        let now = self.session.get(object_key(id).as_str()).ok();
        // the first frame is named before the objects of an earlier map are in the session
        now.or_else(|| Some(self.measurements.object(id)?.prior.as_ref()?.quadric))
    }
}

impl Mapper {
    /// What has been estimated so far, with a newest frame and its pose.
    pub(super) fn known(&self, newest: (usize, Se3)) -> Known<'_> {
        Known { newest, live: &self.live, session: &self.session, measurements: &self.measurements }
    }

    /// Makes one of objects that turn out to be one. Returns the names as they are then.
    pub(super) fn unite_all(&mut self, merges: &[Merge], report: &mut FrameReport) -> Names {
        let (mut names, mut owners) = (self.names.clone(), vec![]);
        for merge in merges {
            owners.extend(self.unite(*merge, report));
            names.merge(*merge);
        }
        let owners: BTreeSet<ObjectId> = owners.into_iter().map(|id| names.now(id)).collect();
        self.ask(&owners.into_iter().collect::<Vec<_>>(), report);
        names
    }

    /// Forgets an object that is not in the map: its boxes are nobody's.
    pub(super) fn forget(&mut self, id: ObjectId) {
        if !self.objects.get(&id).is_some_and(Tracked::is_mapped) {
            self.objects.remove(&id);
            self.measurements.disown(id);
        }
    }

    /// Gives the boxes of one object to another: in the map, if that is there, or to place it by. Returns objects that rules had connected
    /// with the one that is no more.
    fn unite(&mut self, merge: Merge, report: &mut FrameReport) -> Vec<ObjectId> {
        let Merge { from, into } = merge;
        let is_mapped = self.objects.get(&from).is_some_and(Tracked::is_mapped);
        let owners = if is_mapped { self.take_out(from, report) } else { vec![] };
        self.objects.remove(&from);
        let mut new = self.measurements.merge(from, into);
        if matches!(self.objects.get(&into), Some(Tracked::Withdrawn)) {
            // it is another one now
            self.objects.remove(&into);
            new = self.measured(into).map_or(new, |measured| measured.views.clone());
        }
        match self.objects.entry(into).or_default() {
            Tracked::Mapped(_) => self.push_boxes(into, &new, report),
            Tracked::Waiting(sights) => {
                for view in &new {
                    if let Ok(pose) = self.session.get(pose_key(view.frame).as_str()) {
                        sights.add(view, &pose, &self.camera);
                    }
                }
            }
            Tracked::Withdrawn => {}
        }
        tracing::info!(object = %from, "is object {into}");
        report.merged.push(merge);
        owners
    }

    /// Pushes boxes of an object that is in the map, as far as their poses are still there.
    fn push_boxes(&mut self, id: ObjectId, views: &[ObjectBox], report: &mut FrameReport) {
        let mut graph = Graph::new();
        for view in views.iter().filter(|view| self.pose(view.frame).is_some()) {
            let key = object_key(id);
            let entries = view_entries(view, &key, self.camera, &self.settings.detections);
            graph.factors_mut().extend(entries);
        }
        match (self.session.push(&graph, &Values::new()), self.objects.get_mut(&id)) {
            (Ok(ids), Some(Tracked::Mapped(mapped))) => mapped.boxes.extend(ids),
            (Ok(_), _) => {}
            (Err(error), _) => report.refused.push(error.to_string()),
        }
    }
}
