//! Objects that are named as they come, and what turns out to be otherwise.
use super::Mapper;
use super::frame::FrameReport;
use super::object::{Sights, Tracked};
use super::revision::Before;
use manifactor_association::{Learned, Map, Merge, Move, Names};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::{Graph, Key, Values};
use manifactor_mapping::mapping::measurements::{Measurements, ObjectBox};
use manifactor_mapping::mapping::{object_key, pose_key};
use manifactor_mapping::settings::Settings;
use manifactor_quadric::DualQuadric;
use manifactor_recording::sequence::ObjectId;
use manifactor_smoother::{FactorId, Session};
use std::collections::{BTreeMap, BTreeSet};

/// An object begins again when more of its boxes than this part are others at once.
const OTHERS: f64 = 0.25;

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

/// What was corrected, and how all was before.
pub(super) struct Corrected {
    /// What boxes are called then.
    pub names: Names,
    learned: Vec<Learned>,
    before: Before,
    measurements: Measurements,
}

impl Mapper {
    /// What has been estimated so far, with a newest frame and its pose.
    pub(super) fn known(&self, newest: (usize, Se3)) -> Known<'_> {
        Known { newest, live: &self.live, session: &self.session, measurements: &self.measurements }
    }

    /// Corrects what earlier frames were thought to show, where they have taught anything: pushes it, for the next update. What
    /// comes back is to be [undone](Self::undo) where that fails.
    pub(super) fn correct(&mut self, report: &mut FrameReport) -> Option<Corrected> {
        let learned = std::mem::take(&mut self.pending);
        if learned.is_empty() {
            return None;
        }
        let before = self.before();
        let measurements = self.measurements.clone();
        let (mut names, mut owners) = (self.names.clone(), vec![]);
        for learned in &learned {
            for moved in &learned.moved {
                self.put(moved);
                names.put(moved);
            }
            report.moved.extend_from_slice(&learned.moved);
            owners.extend(self.put_right(&learned.moved, report));
            for merge in &learned.merged {
                owners.extend(self.unite(*merge, report));
                names.merge(*merge);
            }
            learned.forgotten.iter().for_each(|id| self.forget(*id));
        }
        let owners: BTreeSet<ObjectId> = owners.into_iter().map(|id| names.now(id)).collect();
        self.ask(&owners.into_iter().collect::<Vec<_>>(), report);
        Some(Corrected { names, learned, before, measurements })
    }

    /// All is again as it was before a correction that could not be taken, and it is tried again with the next frame.
    pub(super) fn undo(&mut self, corrected: Corrected, why: &str, report: &mut FrameReport) {
        let moved = report.moved.drain(..).map(|moved| moved.from);
        let gone = moved.chain(report.merged.drain(..).map(|merge| merge.from)).map(object_key);
        let keys: BTreeSet<Key> = gone.chain(report.withdrawn.drain(..)).collect();
        let keys: Vec<&str> = keys.iter().map(Key::as_str).collect();
        report.refused.push(format!("changes of {}: {why}", keys.join(", ")));
        self.restore(corrected.before);
        self.measurements = corrected.measurements;
        self.pending = corrected.learned;
    }

    /// Counts a box for the object that it shows.
    fn put(&mut self, Move { from, detection, .. }: &Move) {
        let Settings { detections, aliases, .. } = &*self.settings;
        self.measurements.take_back(detection, *from, &self.camera, detections, aliases);
        self.measurements.add(detection, &self.camera, detections, aliases);
        if let Some(object @ Tracked::Withdrawn) = self.objects.get_mut(from) {
            // it may be one thing without it
            *object = Tracked::default();
        }
    }

    /// Updates the factors of objects whose boxes have moved. An object begins again if a large share of its boxes changed at once, because its
    /// place is then that of another: it leaves the map until its next detection. Returns objects that rules had connected with those.
    fn put_right(&mut self, all: &[Move], report: &mut FrameReport) -> Vec<ObjectId> {
        let mut changed: BTreeMap<ObjectId, BTreeSet<usize>> = BTreeMap::new();
        for (id, frame) in all.iter().flat_map(|moved| [(moved.from, moved.frame), (moved.into, moved.frame)])
        {
            changed.entry(id).or_default().insert(frame);
        }
        let mut owners = vec![];
        for (id, frames) in changed {
            let others = self.measured(id).filter(|measured| measured.prior.is_none());
            let is_other = others.is_some_and(|own| frames.len() as f64 > OTHERS * own.views.len() as f64);
            let is_begun_again = is_other && self.leaves_nothing(id);
            match self.objects.entry(id).or_default() {
                Tracked::Mapped(_) if is_begun_again => {
                    owners.extend(self.take_out(id, report));
                    self.objects.insert(id, Tracked::Waiting(self.sights(id)));
                    report.withdrawn.push(object_key(id));
                }
                Tracked::Mapped(mapped) => {
                    let gone = mapped.boxes.extract_if(.., |(of, _)| frames.contains(of));
                    let gone: Vec<FactorId> = gone.map(|(_, factor)| factor).collect();
                    self.remove(&gone, report);
                    let view = |frame: &usize| self.measured(id)?.view(*frame).cloned();
                    let views: Vec<ObjectBox> = frames.iter().filter_map(view).collect();
                    self.push_boxes(id, &views, report);
                }
                Tracked::Waiting(_) => {
                    self.objects.insert(id, Tracked::Waiting(self.sights(id)));
                }
                Tracked::Withdrawn => {}
            }
        }
        owners
    }

    /// Returns whether nothing of an object stays when it is taken out of the map, so that it can come back: no pose that it was seen from has left the window.
    pub(super) fn leaves_nothing(&self, id: ObjectId) -> bool {
        let Some(Tracked::Mapped(mapped)) = self.objects.get(&id) else { return true };
        mapped.boxes.iter().all(|(_, factor)| self.session.entry(*factor).is_some())
    }

    /// From where an object is seen that is not in the map.
    pub(super) fn sights(&self, id: ObjectId) -> Sights {
        let mut sights = Sights::new();
        for view in self.measured(id).map_or(&[][..], |measured| &measured.views) {
            if let Some(pose) = self.pose(view.frame) {
                sights.add(view, &pose, &self.camera);
            }
        }
        sights
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
        let (frames, entries) = self.entries_of(&object_key(id), views);
        let mut graph = Graph::new();
        graph.factors_mut().extend(entries);
        match (self.session.push(&graph, &Values::new()), self.objects.get_mut(&id)) {
            (Ok(ids), Some(Tracked::Mapped(mapped))) => mapped.boxes.extend(frames.into_iter().zip(ids)),
            (Ok(_), _) => {}
            (Err(error), _) => report.refused.push(error.to_string()),
        }
    }
}
