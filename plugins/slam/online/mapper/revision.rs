//! Revision of the map after a frame: adds and removes objects, and applies semantic rules again.
use super::Mapper;
use super::frame::{FrameReport, Seen};
use super::object::{Mapped, Tracked};
use manifactor_association::Learned;
use manifactor_graph::{FactorEntry, Graph, Key, Values};
use manifactor_mapping::estimate::refine::refined;
use manifactor_mapping::mapping::measurements::ObjectBox;
use manifactor_mapping::mapping::rules::Ledger;
use manifactor_mapping::mapping::{Rejection, as_candidate, object_key, rejection, view_entries};
use manifactor_mapping::semantics::Candidate;
use manifactor_quadric::DualQuadric;
use manifactor_recording::sequence::ObjectId;
use manifactor_smoother::FactorId;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Number of last boxes of an object that are tested for motion with each new box.
const LAST: usize = 256;

/// Due change of an object.
enum Due {
    /// Removal from the map.
    Withdrawal(Rejection),
    /// Change of its class.
    Revision(Option<String>),
    /// Initialization.
    Birth,
}

/// The state before a change.
pub(super) struct Before {
    objects: BTreeMap<ObjectId, Tracked>,
    ledger: Ledger,
}

impl Mapper {
    /// Applies the changes that follow from the boxes of a frame: removes objects, changes classes, and adds
    /// objects.
    pub(super) fn revise(&mut self, seen: Seen, report: &mut FrameReport) {
        let Some(pose) = self.pose(report.frame) else { return };
        for (id, view) in &seen.boxes {
            if let Tracked::Waiting(sights) = self.objects.entry(*id).or_default() {
                sights.add(view, &pose, &self.camera);
            }
        }
        let moved = report.moved.iter().flat_map(|moved| [moved.from, moved.into]);
        let changed = moved.chain(report.merged.iter().map(|merge| merge.into));
        let mut ids: BTreeSet<ObjectId> =
            seen.boxes.keys().copied().chain(changed.map(|id| self.names.now(id))).collect();
        // objects removed in this frame can only come back with their next detection
        ids.retain(|id| !report.withdrawn.contains(&object_key(*id)));
        let due: Vec<(ObjectId, Due)> = ids.iter().filter_map(|id| Some((*id, self.due(*id)?))).collect();
        let is_changed = seen.up_moved || !due.is_empty();
        if is_changed {
            self.change(due, seen.up_moved, report);
        }
        for id in report.moved.iter().map(|moved| moved.from) {
            if self.measured(id).is_some_and(|measured| measured.detections == 0 && measured.prior.is_none())
            {
                self.forget(id);
            }
        }
        self.teach(seen.learned, report);
    }

    /// Stores corrections to earlier frames, which are applied with the next frame.
    pub(super) fn teach(&mut self, learned: Learned, report: &mut FrameReport) {
        report.forgotten.clone_from(&learned.forgotten);
        if self.pending.is_empty() && learned.is_nothing() {
            learned.forgotten.iter().for_each(|id| self.forget(*id));
        } else {
            // forgotten objects may have boxes that move
            self.pending.push(learned);
        }
    }

    /// Changes the map; restores the previous state if the update fails.
    fn change(&mut self, due: Vec<(ObjectId, Due)>, up_moved: bool, report: &mut FrameReport) {
        let (before, gone) = (self.before(), report.withdrawn.len());
        if up_moved {
            self.ask_all_again(report);
        }
        for (id, due) in due {
            match due {
                Due::Withdrawal(rejection) => self.withdraw(id, &rejection, report),
                Due::Revision(class) => self.ask_again(id, class, report),
                Due::Birth => self.bear(id, report),
            }
        }
        if report.born.is_empty() && report.withdrawn.len() == gone && report.revised.is_empty() {
            return;
        }
        match self.session.update() {
            Ok(update) => report.updates.push(update),
            Err(error) => {
                let withdrawn = report.withdrawn.drain(gone..);
                let keys = report.born.drain(..).chain(withdrawn).chain(report.revised.drain(..));
                let keys: Vec<Key> = keys.collect();
                let keys: Vec<&str> = keys.iter().map(Key::as_str).collect();
                report.refused.push(format!("changes of {}: {error}", keys.join(", ")));
                self.restore(before);
            }
        }
    }

    pub(super) fn before(&self) -> Before {
        Before { objects: self.objects.clone(), ledger: self.ledger.clone() }
    }

    pub(super) fn restore(&mut self, Before { objects, ledger }: Before) {
        (self.objects, self.ledger) = (objects, ledger);
    }

    /// Returns the due change of an object after a new box.
    fn due(&self, id: ObjectId) -> Option<Due> {
        let (measured, settings) = (self.measured(id)?, &self.settings.objects);
        match self.objects.get(&id)? {
            Tracked::Waiting(sights) => {
                let degrees = settings.birth_parallax_deg.max(*settings.min_parallax_deg);
                let is_due =
                    sights.are_enough(measured, degrees) && rejection::sound(measured, settings).is_ok();
                is_due.then_some(Due::Birth)
            }
            Tracked::Mapped(mapped) => match rejection::sound(measured, settings).and_then(|()| {
                let last = &measured.views[measured.views.len().saturating_sub(LAST)..];
                let depth_error = self.settings.detections.depth_error;
                rejection::still(measured, last, |frame| self.at(frame), &self.camera, *depth_error)
            }) {
                Err(rejection) => Some(Due::Withdrawal(rejection)),
                Ok(()) if measured.class_name() != mapped.class.as_deref() => {
                    Some(Due::Revision(measured.class_name().map(str::to_owned)))
                }
                Ok(()) => None,
            },
            Tracked::Withdrawn => None,
        }
    }

    /// Removes an object from the map.
    fn withdraw(&mut self, id: ObjectId, rejection: &Rejection, report: &mut FrameReport) {
        let comes_back = matches!(rejection, Rejection::Views { .. }) && self.leaves_nothing(id);
        let owners = self.take_out(id, report);
        if comes_back {
            // its boxes moved to different objects, and it may get new ones
            self.objects.insert(id, Tracked::Waiting(self.sights(id)));
        }
        self.ask(&owners, report);
        tracing::info!(object = %id, "taken out of the map: {rejection}");
        report.withdrawn.push(object_key(id));
    }

    /// Removes an object from the map, with all its factors. Returns the objects that semantic rules
    /// connected with it.
    pub(super) fn take_out(&mut self, id: ObjectId, report: &mut FrameReport) -> Vec<ObjectId> {
        let key = object_key(id);
        let (mut factors, owners) = self.ledger.revoke(|other| *other == key);
        self.ledger.forget(id);
        if let Some(Tracked::Mapped(mapped)) = self.objects.insert(id, Tracked::Withdrawn) {
            factors.extend(mapped.boxes.into_iter().map(|(_, factor)| factor));
        }
        self.remove(&factors, report);
        let left = self.session.marginalize(&[&key]);
        report.refused.extend(left.err().map(|error| error.to_string()));
        owners
    }

    /// Applies the semantic rules again to an object whose class changed, and to the objects connected with
    /// it.
    fn ask_again(&mut self, id: ObjectId, class: Option<String>, report: &mut FrameReport) {
        if let Some(Tracked::Mapped(mapped)) = self.objects.get_mut(&id) {
            mapped.class = class;
        }
        let key = object_key(id);
        let (ids, mut owners) = self.ledger.revoke(|other| *other == key);
        owners.push(id);
        self.remove(&ids, report);
        self.ask(&owners, report);
        report.revised.push(key);
    }

    /// Creates all semantic factors again.
    fn ask_all_again(&mut self, report: &mut FrameReport) {
        let (ids, owners) = self.ledger.revoke(|_| true);
        self.remove(&ids, report);
        self.ask(&owners, report);
        report.revised.extend(owners.into_iter().map(object_key));
    }

    /// Initializes an object and adds it to the map.
    fn bear(&mut self, id: ObjectId, report: &mut FrameReport) {
        let Some(measured) = self.measured(id) else { return };
        let started = rejection::start(measured, |i| self.at(i), self.camera, &self.settings);
        let (views, class) = (measured.views.clone(), measured.class_name().map(str::to_owned));
        let born = started.map_err(|rejection| rejection.to_string());
        let born = born.and_then(|start| self.push_object(id, start, &views));
        let (start, boxes) = match born {
            Ok(born) => born,
            Err(why) => {
                tracing::info!(object = %id, "not placed yet: {why}");
                if let Some(Tracked::Waiting(sights)) = self.objects.get_mut(&id) {
                    sights.note_try(views.len());
                }
                return;
            }
        };
        self.objects.insert(id, Tracked::Mapped(Mapped { start, boxes, class }));
        report.born.push(object_key(id));
        // it may be the neighbour that a rule requires
        if self.settings.semantics.iter().any(|rule| rule.near.is_some()) {
            let mapped = self.objects.iter().filter(|(_, object)| object.is_mapped());
            let mapped: Vec<ObjectId> = mapped.map(|(id, _)| *id).collect();
            self.ask(&mapped, report);
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
        let before = self.ledger.clone();
        let mut all = self.candidates();
        if let Some(measured) = self.measured(id) {
            all.push(as_candidate(measured, start));
        }
        let up = self.up.frame().and_then(|frame| frame.up);
        let ruled = self.ledger.ask(&[id], &all, &settings, up).map_err(|error| error.to_string())?;
        let entries: Vec<FactorEntry> = ruled.iter().map(|ruled| ruled.entry.clone()).collect();
        let all: Vec<&FactorEntry> = boxes.iter().chain(&entries).collect();
        let start = match settings.objects.refinements {
            0 => start,
            _ => refined(&key, start, &all, &self.around(&all, &key), up),
        };
        let (mut graph, mut values) = (Graph::new(), Values::new());
        for entry in all {
            graph.push(entry.clone());
        }
        values.insert(key, start);
        match self.session.push(&graph, &values) {
            Ok(mut ids) => {
                let of_rules = ids.split_off(boxes.len());
                self.ledger.name(of_rules);
                Ok((start, frames.into_iter().zip(ids).collect()))
            }
            Err(error) => {
                self.ledger = before;
                Err(error.to_string())
            }
        }
    }

    /// Returns the factors of the boxes whose poses are in the smoother, with their frames.
    pub(super) fn entries_of(&self, key: &Key, views: &[ObjectBox]) -> (Vec<usize>, Vec<FactorEntry>) {
        let there = views.iter().filter(|view| self.pose(view.frame).is_some());
        let entries = there.flat_map(|view| {
            let entries = view_entries(view, key, self.camera, &self.settings.detections);
            entries.map(|entry| (view.frame, entry))
        });
        entries.unzip()
    }

    /// Returns the estimates of all variables of some factors, except `but`.
    fn around(&self, entries: &[&FactorEntry], but: &Key) -> Values {
        let mut values = Values::new();
        for key in entries.iter().flat_map(|entry| &entry.keys).filter(|key| *key != but) {
            if let (false, Some(value)) = (values.contains(key.as_str()), self.session.estimate(key.as_str()))
            {
                values.insert_boxed(key.clone(), value);
            }
        }
        values
    }

    /// Returns the mapped objects as candidates for semantic rules.
    fn candidates(&self) -> Vec<Candidate> {
        let mapped = self.objects.iter().filter(|(_, object)| object.is_mapped());
        mapped
            .filter_map(|(id, object)| {
                let now = self.quadric(*id).or(object.born_as())?;
                Some(as_candidate(self.measured(*id)?, now))
            })
            .collect()
    }

    /// Applies the semantic rules to some objects, and pushes the new factors.
    pub(super) fn ask(&mut self, about: &[ObjectId], report: &mut FrameReport) {
        let (all, before) = (self.candidates(), self.ledger.clone());
        let up = self.up.frame().and_then(|frame| frame.up);
        let pushed = match self.ledger.ask(about, &all, &self.settings, up) {
            Ok([]) => return,
            Ok(ruled) => {
                let mut graph = Graph::new();
                for ruled in ruled {
                    graph.push(ruled.entry.clone());
                }
                self.session.push(&graph, &Values::new()).map_err(|error| error.to_string())
            }
            Err(error) => Err(error.to_string()),
        };
        match pushed {
            Ok(ids) => self.ledger.name(ids),
            Err(why) => {
                self.ledger = before;
                report.refused.push(why);
            }
        }
    }

    /// Removes the factors that are still in the smoother.
    pub(super) fn remove(&mut self, factors: &[FactorId], report: &mut FrameReport) {
        let there = factors.iter().copied().filter(|id| self.session.entry(*id).is_some());
        let removed = self.session.remove(&there.collect::<Vec<_>>());
        report.refused.extend(removed.err().map(|error| error.to_string()));
    }
}
