//! Revision of the map after a frame: adds and removes objects, and applies semantic rules again.
use super::Mapper;
use super::frame::{FrameBoxes, FrameReport};
use super::object::{MappedState, ObjectState};
use manifactor_association::Corrections;
use manifactor_graph::{FactorEntry, Graph, Key, Values};
use manifactor_mapping::estimate::refine::refine_object;
use manifactor_mapping::mapping::measurements::ObjectBox;
use manifactor_mapping::mapping::rules::SemanticFactors;
use manifactor_mapping::mapping::{Rejection, as_candidate, object_key, rejection, view_entries};
use manifactor_mapping::semantics::RuleCandidate;
use manifactor_quadric::DualQuadric;
use manifactor_recording::sequence::ObjectId;
use manifactor_smoother::FactorId;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Number of last boxes of an object that are tested for motion with each new box.
const MOTION_CHECK_BOXES: usize = 256;

/// Due change of an object.
enum DueChange {
    /// Removal from the map.
    Removal(Rejection),
    /// Change of its class.
    Revision(Option<String>),
    /// Initialization.
    Initialization,
}

/// The state before a change.
pub(super) struct MapSnapshot {
    objects: BTreeMap<ObjectId, ObjectState>,
    semantic_factors: SemanticFactors,
}

impl Mapper {
    /// Applies the changes that follow from the boxes of a frame: removes objects, changes classes, and adds
    /// objects.
    pub(super) fn update_objects(&mut self, seen: FrameBoxes, report: &mut FrameReport) {
        let Some(pose) = self.pose(report.frame) else { return };
        for ((id, _), view) in &seen.boxes {
            if let ObjectState::Tentative(sights) = self.objects.entry(*id).or_default() {
                sights.add(view, &pose);
            }
        }
        let moved = report.moved.iter().flat_map(|moved| [moved.from, moved.into]);
        let changed = moved.chain(report.merged.iter().map(|merge| merge.into));
        let mut ids: BTreeSet<ObjectId> = seen
            .boxes
            .keys()
            .map(|(id, _)| *id)
            .chain(changed.map(|id| self.id_changes.current_id(id)))
            .collect();
        // objects removed in this frame can only come back with their next detection
        ids.retain(|id| !report.removed.contains(&object_key(*id)));
        let due: Vec<(ObjectId, DueChange)> =
            ids.iter().filter_map(|id| Some((*id, self.due_change(*id)?))).collect();
        let is_changed = seen.up_moved || !due.is_empty();
        if is_changed {
            self.apply_changes(due, seen.up_moved, report);
        }
        for id in report.moved.iter().map(|moved| moved.from) {
            if self.measured(id).is_some_and(|measured| measured.detections == 0 && measured.prior.is_none())
            {
                self.forget_tentative_object(id);
            }
        }
        self.queue_corrections(seen.corrections, report);
    }

    /// Stores corrections to earlier frames, which are applied with the next frame.
    pub(super) fn queue_corrections(&mut self, corrections: Corrections, report: &mut FrameReport) {
        report.forgotten.clone_from(&corrections.forgotten);
        if self.pending.is_empty() && corrections.changes_no_object() {
            corrections.forgotten.iter().for_each(|id| self.forget_tentative_object(*id));
        } else {
            // forgotten objects may have boxes that move
            self.pending.push(corrections);
        }
    }

    /// Changes the map; restores the previous state if the update fails.
    fn apply_changes(&mut self, due: Vec<(ObjectId, DueChange)>, up_moved: bool, report: &mut FrameReport) {
        let (before, gone) = (self.take_snapshot(), report.removed.len());
        if up_moved {
            self.reapply_all_rules(report);
        }
        for (id, due) in due {
            match due {
                DueChange::Removal(rejection) => self.reject_object(id, &rejection, report),
                DueChange::Revision(class) => self.reapply_rules(id, class, report),
                DueChange::Initialization => self.initialize_object(id, report),
            }
        }
        if report.initialized.is_empty() && report.removed.len() == gone && report.revised.is_empty() {
            return;
        }
        match self.smoother.update() {
            Ok(update) => report.updates.push(update),
            Err(error) => {
                let removed = report.removed.drain(gone..);
                let keys = report.initialized.drain(..).chain(removed).chain(report.revised.drain(..));
                let keys: Vec<Key> = keys.collect();
                let keys: Vec<&str> = keys.iter().map(Key::as_str).collect();
                report.refused.push(format!("changes of {}: {error}", keys.join(", ")));
                self.restore_snapshot(before);
            }
        }
    }

    pub(super) fn take_snapshot(&self) -> MapSnapshot {
        MapSnapshot { objects: self.objects.clone(), semantic_factors: self.semantic_factors.clone() }
    }

    pub(super) fn restore_snapshot(
        &mut self,
        MapSnapshot { objects, semantic_factors: ledger }: MapSnapshot,
    ) {
        (self.objects, self.semantic_factors) = (objects, ledger);
    }

    /// Returns the due change of an object after a new box.
    fn due_change(&self, id: ObjectId) -> Option<DueChange> {
        let (measured, settings) = (self.measured(id)?, &self.settings.objects);
        match self.objects.get(&id)? {
            ObjectState::Tentative(sights) => {
                let degrees = settings.birth_parallax_deg.max(*settings.min_parallax_deg);
                let is_due = sights.suffice_for_initialization(measured, degrees)
                    && rejection::check_boxes(measured, settings).is_ok();
                is_due.then_some(DueChange::Initialization)
            }
            ObjectState::Mapped(mapped) => match rejection::check_boxes(measured, settings).and_then(|()| {
                let last = &measured.views[measured.views.len().saturating_sub(MOTION_CHECK_BOXES)..];
                let depth_error = self.settings.detections.depth_error;
                rejection::check_still(measured, last, |frame| self.stamped_pose(frame), *depth_error)
            }) {
                Err(rejection) => Some(DueChange::Removal(rejection)),
                Ok(()) if measured.class_name() != mapped.class.as_deref() => {
                    Some(DueChange::Revision(measured.class_name().map(str::to_owned)))
                }
                Ok(()) => None,
            },
            ObjectState::Removed => None,
        }
    }

    /// Removes an object from the map.
    fn reject_object(&mut self, id: ObjectId, rejection: &Rejection, report: &mut FrameReport) {
        let comes_back = matches!(rejection, Rejection::Views { .. }) && self.is_removable(id);
        let owners = self.remove_object(id, report);
        if comes_back {
            // its boxes moved to different objects, and it may get new ones
            self.objects.insert(id, ObjectState::Tentative(self.viewing_directions(id)));
        }
        self.apply_rules(&owners, report);
        tracing::info!(object = %id, "taken out of the map: {rejection}");
        report.removed.push(object_key(id));
    }

    /// Removes an object from the map, with all its factors. Returns the objects that semantic rules
    /// connected with it.
    pub(super) fn remove_object(&mut self, id: ObjectId, report: &mut FrameReport) -> Vec<ObjectId> {
        let key = object_key(id);
        let (mut factors, owners) = self.semantic_factors.remove_factors(|other| *other == key);
        self.semantic_factors.forget_object(id);
        if let Some(ObjectState::Mapped(mapped)) = self.objects.insert(id, ObjectState::Removed) {
            factors.extend(mapped.boxes.into_iter().map(|(_, factor)| factor));
        }
        self.remove_factors(&factors, report);
        let left = self.smoother.marginalize(&[&key]);
        report.refused.extend(left.err().map(|error| error.to_string()));
        owners
    }

    /// Applies the semantic rules again to an object whose class changed, and to the objects connected with
    /// it.
    fn reapply_rules(&mut self, id: ObjectId, class: Option<String>, report: &mut FrameReport) {
        if let Some(ObjectState::Mapped(mapped)) = self.objects.get_mut(&id) {
            mapped.class = class;
        }
        let key = object_key(id);
        let (ids, mut owners) = self.semantic_factors.remove_factors(|other| *other == key);
        owners.push(id);
        self.remove_factors(&ids, report);
        self.apply_rules(&owners, report);
        report.revised.push(key);
    }

    /// Creates all semantic factors again.
    fn reapply_all_rules(&mut self, report: &mut FrameReport) {
        let (ids, owners) = self.semantic_factors.remove_factors(|_| true);
        self.remove_factors(&ids, report);
        self.apply_rules(&owners, report);
        report.revised.extend(owners.into_iter().map(object_key));
    }

    /// Initializes an object and adds it to the map.
    fn initialize_object(&mut self, id: ObjectId, report: &mut FrameReport) {
        let Some(measured) = self.measured(id) else { return };
        let started = rejection::initial_quadric(measured, |i| self.stamped_pose(i), &self.settings);
        let (views, class) = (measured.views.clone(), measured.class_name().map(str::to_owned));
        let pushed = started.map_err(|rejection| rejection.to_string());
        let pushed = pushed.and_then(|start| self.push_object(id, start, &views));
        let (start, boxes) = match pushed {
            Ok(pushed) => pushed,
            Err(why) => {
                tracing::info!(object = %id, "not placed yet: {why}");
                if let Some(ObjectState::Tentative(sights)) = self.objects.get_mut(&id) {
                    sights.record_failed_attempt(views.len());
                }
                return;
            }
        };
        self.objects.insert(id, ObjectState::Mapped(MappedState { start, boxes, class }));
        report.initialized.push(object_key(id));
        // it may be the neighbour that a rule requires
        if self.settings.semantics.iter().any(|rule| rule.near.is_some()) {
            let mapped = self.objects.iter().filter(|(_, object)| object.is_mapped());
            let mapped: Vec<ObjectId> = mapped.map(|(id, _)| *id).collect();
            self.apply_rules(&mapped, report);
        }
    }

    /// Pushes an object with its boxes and its semantic factors, after a fit of the object alone. Returns the
    /// fitted value, and the factors of the boxes.
    fn push_object(
        &mut self,
        id: ObjectId,
        start: DualQuadric,
        views: &[ObjectBox],
    ) -> Result<(DualQuadric, Vec<(usize, FactorId)>), String> {
        let key = object_key(id);
        let settings = Arc::clone(&self.settings);
        let (frames, boxes) = self.entries_of(&key, views);
        let before = self.semantic_factors.clone();
        let mut all = self.candidates();
        if let Some(measured) = self.measured(id) {
            all.push(as_candidate(measured, start));
        }
        let up = self.up.map_frame().and_then(|frame| frame.up);
        let ruled = self
            .semantic_factors
            .apply_rules(&[id], &all, &settings, up)
            .map_err(|error| error.to_string())?;
        let entries: Vec<FactorEntry> = ruled.iter().map(|ruled| ruled.entry.clone()).collect();
        let all: Vec<&FactorEntry> = boxes.iter().chain(&entries).collect();
        let start = match settings.objects.refinements {
            0 => start,
            _ => refine_object(&key, start, &all, &self.estimates_around(&all, &key), up),
        };
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for entry in all {
            graph.push(entry.clone());
        }
        values.insert(key, start);
        match self.smoother.push(&graph, &values) {
            Ok(mut ids) => {
                let of_rules = ids.split_off(boxes.len());
                self.semantic_factors.assign_ids(of_rules);
                Ok((start, frames.into_iter().zip(ids).collect()))
            }
            Err(error) => {
                self.semantic_factors = before;
                Err(error.to_string())
            }
        }
    }

    /// Returns the factors of the boxes whose poses are in the smoother, with their frames.
    pub(super) fn entries_of(&self, key: &Key, views: &[ObjectBox]) -> (Vec<usize>, Vec<FactorEntry>) {
        let there = views.iter().filter(|view| self.pose(view.frame).is_some());
        let entries = there.flat_map(|view| {
            let entries = view_entries(view, key, &self.settings.detections);
            entries.map(|entry| (view.frame, entry))
        });
        entries.unzip()
    }

    /// Returns the estimates of all variables of some factors, except `but`.
    fn estimates_around(&self, entries: &[&FactorEntry], but: &Key) -> Values {
        let mut values = Values::new();
        for key in entries.iter().flat_map(|entry| &entry.keys).filter(|key| *key != but) {
            if let (false, Some(value)) =
                (values.contains(key.as_str()), self.smoother.estimate(key.as_str()))
            {
                values.insert_boxed(key.clone(), value);
            }
        }
        values
    }

    /// Returns the mapped objects as candidates for semantic rules.
    fn candidates(&self) -> Vec<RuleCandidate> {
        let mapped = self.objects.iter().filter(|(_, object)| object.is_mapped());
        mapped
            .filter_map(|(id, object)| {
                let now = self.quadric(*id).or(object.initial_value())?;
                Some(as_candidate(self.measured(*id)?, now))
            })
            .collect()
    }

    /// Applies the semantic rules to some objects, and pushes the new factors.
    pub(super) fn apply_rules(&mut self, about: &[ObjectId], report: &mut FrameReport) {
        let (all, before) = (self.candidates(), self.semantic_factors.clone());
        let up = self.up.map_frame().and_then(|frame| frame.up);
        let pushed = match self.semantic_factors.apply_rules(about, &all, &self.settings, up) {
            Ok([]) => return,
            Ok(ruled) => {
                let mut graph = Graph::new();
                for ruled in ruled {
                    graph.push(ruled.entry.clone());
                }
                self.smoother.push(&graph, &Values::new()).map_err(|error| error.to_string())
            }
            Err(error) => Err(error.to_string()),
        };
        match pushed {
            Ok(ids) => self.semantic_factors.assign_ids(ids),
            Err(why) => {
                self.semantic_factors = before;
                report.refused.push(why);
            }
        }
    }

    /// Removes the factors that are still in the smoother.
    pub(super) fn remove_factors(&mut self, factors: &[FactorId], report: &mut FrameReport) {
        let there = factors.iter().copied().filter(|id| self.smoother.entry(*id).is_some());
        let removed = self.smoother.remove(&there.collect::<Vec<_>>());
        report.refused.extend(removed.err().map(|error| error.to_string()));
    }
}
