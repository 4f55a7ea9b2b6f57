//! One frame: its pose and its boxes, then what they change in the map.
use super::association::{Corrected, Known};
use super::object::Tracked;
use super::{FrameError, Located, Mapper};
use manifactor_association::{Image, Learned, Merge, Move};
use manifactor_geometry::Se3;
use manifactor_graph::{Direction, Graph, Key, Manifold, Values};
use manifactor_mapping::gravity::MapFrame;
use manifactor_mapping::mapping::measurements::{ObjectBox, Sifted, sift};
use manifactor_mapping::mapping::{known_entry, object_key, pose_key, prior_entry, step, view_entries};
use manifactor_mapping::semantics::RuleError;
use manifactor_mapping::settings::Settings;
use manifactor_recording::sequence::{Detection, Frame, ObjectId, Observation, UnusedDetection};
use manifactor_smoother::{ChangeError, FactorId, Report};
use serde::Serialize;
use std::collections::BTreeMap;

/// What a frame came to.
#[derive(Debug, Clone, Serialize)]
pub struct FrameReport {
    /// Counts the frames that were taken, from 0.
    pub frame: usize,
    /// In seconds.
    pub timestamp: f64,
    /// The pose as it is estimated now, in the map's frame.
    pub pose: Se3,
    /// Where the stream began in a map that was made before, if this frame has shown it: all names are those of that map from now on,
    /// and poses in its frame. All frames were taken again then, and what this report tells of objects, refusals and updates is of all of them:
    /// what was told before is of a map that is no more.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub located: Option<Located>,
    /// Boxes that passed the filters.
    pub boxes: usize,
    /// The object of each box, in the order of the frame's; of a box that was left out, none.
    pub names: Vec<Option<ObjectId>>,
    /// Objects that were seen too rarely to be any: their boxes are of none.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub forgotten: Vec<ObjectId>,
    /// Boxes of earlier frames that turned out to show other objects, before this one was named.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub moved: Vec<Move>,
    /// Objects that turned out to be others, after that and before this frame was named.
    pub merged: Vec<Merge>,
    /// Objects that came into the map.
    pub born: Vec<Key>,
    /// Objects that left it: their boxes turned out to be those of several things, or to be too few, or are others now, and they begin again.
    pub withdrawn: Vec<Key>,
    /// Objects that rules were asked about again, as their class has changed.
    pub revised: Vec<Key>,
    /// What could not be taken, and why.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refused: Vec<String>,
    /// What the session did: once for the frame with what earlier ones have taught, and once more where objects come or go.
    pub updates: Vec<Report>,
}

/// What a frame shows.
pub(super) struct Seen {
    /// Boxes that passed the filters, by object.
    pub boxes: BTreeMap<ObjectId, ObjectBox>,
    /// What it has taught of earlier frames.
    pub learned: Learned,
    /// Whether up is another than it was.
    pub up_moved: bool,
}

impl Seen {
    /// No box.
    pub(super) fn nothing() -> Self {
        Self { boxes: BTreeMap::new(), learned: Learned::default(), up_moved: false }
    }
}

impl FrameReport {
    pub(super) fn new(frame: usize, timestamp: f64) -> Self {
        Self {
            frame,
            timestamp,
            pose: Se3::identity(),
            located: None,
            boxes: 0,
            names: vec![],
            forgotten: vec![],
            moved: vec![],
            merged: vec![],
            born: vec![],
            withdrawn: vec![],
            revised: vec![],
            refused: vec![],
            updates: vec![],
        }
    }

    /// Tells what has happened in an earlier frame as well.
    pub fn tell_after(&mut self, before: Self) {
        fn put<T>(mut first: Vec<T>, last: &mut Vec<T>) {
            first.append(last);
            *last = first;
        }
        put(before.forgotten, &mut self.forgotten);
        put(before.moved, &mut self.moved);
        put(before.merged, &mut self.merged);
        put(before.born, &mut self.born);
        put(before.withdrawn, &mut self.withdrawn);
        put(before.revised, &mut self.revised);
        put(before.refused, &mut self.refused);
        let is_told = |update: &Report| {
            update.solved_batch || !(update.rejected.is_empty() && update.readmitted.is_empty())
        };
        put(before.updates.into_iter().filter(is_told).collect(), &mut self.updates);
    }
}

impl Mapper {
    /// Takes in a pose, with the boxes of objects that are mapped and what earlier frames have taught: in one update of the session. Where
    /// that fails, without what they have taught; where that fails as well, the pose alone.
    pub(super) fn take_pose(
        &mut self,
        observation: &Observation,
        report: &mut FrameReport,
    ) -> Result<Seen, FrameError> {
        let frame = &observation.frame;
        let timestamp = frame.timestamp;
        if !(timestamp.is_finite() && frame.world_from_camera.is_finite()) {
            return Err(FrameError::NotFinite { timestamp });
        }
        if let Some(before) = self.last.as_ref().map(|last| last.timestamp).filter(|t| *t >= timestamp) {
            return Err(FrameError::Time { timestamp, before });
        }
        let up = self.up.unsettled();
        let up_moved = self.up.look(observation, &self.settings)?;
        let taken = self.take_located(observation, up_moved, report);
        if taken.is_err()
            && let Some(up) = up
        {
            self.up = up;
        }
        taken
    }

    /// The same, once the frame has said which way is up.
    fn take_located(
        &mut self,
        observation: &Observation,
        up_moved: bool,
        report: &mut FrameReport,
    ) -> Result<Seen, FrameError> {
        let (frame, timestamp) = (&observation.frame, observation.frame.timestamp);
        let (graph, values) = self.tied(frame, report)?;
        // nothing may be pending in the session when a frame is refused
        if !report.pose.is_finite() {
            return Err(FrameError::NotFinite { timestamp });
        }
        report.refused.extend(observation.unused.iter().filter_map(|unused| match unused {
            UnusedDetection::Box { place, fault, .. } => Some(format!("box {place} is left out: {fault}")),
            UnusedDetection::WithoutPose(_) => None,
        }));
        self.session.set_time(timestamp)?;
        self.session.push(&graph, &values)?;
        let corrected = self.correct(report);
        let detections = &observation.detections;
        let image = Image { frame: report.frame, timestamp, detections };
        let predicted = self.known((report.frame, report.pose));
        report.names = self.associator.associate(&image, &predicted);
        let named = report.names.iter().zip(detections);
        let named = named.map(|(object, d)| Detection { frame: report.frame, object: *object, ..d.clone() });
        let named: Vec<Detection> = named.collect();
        let mut seen = Seen { boxes: self.boxes(&named), learned: Learned::default(), up_moved };
        report.boxes = seen.boxes.len();
        let is_taken = self.update_with(&seen.boxes, corrected, (&graph, &values), report)?;
        self.last = Some(frame.clone());
        if is_taken {
            for detection in &named {
                let Settings { detections, aliases, .. } = &*self.settings;
                self.measurements.add(detection, &self.camera, detections, aliases);
            }
            let newest = (report.frame, self.pose(report.frame).unwrap_or(report.pose));
            let (live, session, measurements) = (&self.live, &self.session, &self.measurements);
            let known = Known { newest, live, session, measurements };
            seen.learned = self.associator.learn(&image, &report.names, &known);
        } else {
            seen.boxes.clear();
            report.names.fill(None);
        }
        Ok(seen)
    }

    /// A frame's pose, tied to the last one or to the map's frame; `report` has the prediction.
    fn tied(&mut self, frame: &Frame, report: &mut FrameReport) -> Result<(Graph, Values), FrameError> {
        let map = self.up.frame().unwrap_or_else(|| MapFrame::of_odometry(None));
        let (mut graph, mut values) = (Graph::new(), Values::new());
        report.pose = match &self.last {
            Some(last) => {
                let from = self.pose(report.frame - 1).unwrap_or_else(Se3::identity);
                let estimates = |key: &str| self.session.estimate(key);
                let frames = [report.frame - 1, report.frame];
                let step = step(frames, [last, frame], &self.settings.odometry, &estimates);
                let motion = &self.settings.motion;
                let pose = motion.predict(&step, &from);
                graph.factors_mut().extend(motion.factors(&step)?);
                values = motion.variables(&step, [&from, &pose]);
                pose
            }
            None => {
                self.check_rules(map.up)?;
                let first = map.map_from_odometry.compose(&frame.world_from_camera);
                graph.push(prior_entry(first, &self.settings));
                self.settings.own.add_to(&mut graph, &mut values);
                for known in self.measurements.objects.iter().filter_map(|measured| measured.prior.as_ref()) {
                    graph.push(known_entry(known, &self.settings));
                    values.insert(object_key(known.id), known.quadric);
                }
                first
            }
        };
        values.insert(pose_key(report.frame), report.pose);
        Ok((graph, values))
    }

    /// Updates the session with a frame's boxes beside its pose, `alone`, and what was corrected, which are pushed. Whether the boxes were
    /// taken.
    fn update_with(
        &mut self,
        boxes: &BTreeMap<ObjectId, ObjectBox>,
        corrected: Option<Corrected>,
        alone: (&Graph, &Values),
        report: &mut FrameReport,
    ) -> Result<bool, FrameError> {
        let mut pushed = self.push_boxes_of_frame(boxes);
        let mut update = self.session.update();
        match (corrected, &update) {
            (Some(corrected), Ok(_)) => self.names = corrected.names,
            (Some(corrected), Err(error)) => {
                self.undo(corrected, &error.to_string(), report);
                self.session.set_time(report.timestamp)?;
                self.session.push(alone.0, alone.1)?;
                pushed = self.push_boxes_of_frame(boxes);
                update = self.session.update();
            }
            (None, _) => {}
        }
        let why = match (update, pushed) {
            (Ok(update), Ok(pushed)) => {
                report.updates.push(update);
                for (owner, factor) in pushed {
                    if let Some(Tracked::Mapped(mapped)) = self.objects.get_mut(&owner) {
                        mapped.boxes.push((report.frame, factor));
                    }
                }
                return Ok(true);
            }
            (Ok(update), Err(why)) => {
                report.updates.push(update);
                why.to_string()
            }
            (Err(why), Ok(pushed)) if !pushed.is_empty() => {
                self.session.set_time(report.timestamp)?;
                self.session.push(alone.0, alone.1)?;
                report.updates.push(self.session.update()?);
                why.to_string()
            }
            (Err(why), _) => return Err(why.into()),
        };
        report.refused.push(format!("the boxes at {} s: {why}", report.timestamp));
        Ok(false)
    }

    /// Pushes those boxes of a frame whose objects are mapped. Returns these, and their factors.
    fn push_boxes_of_frame(
        &mut self,
        boxes: &BTreeMap<ObjectId, ObjectBox>,
    ) -> Result<Vec<(ObjectId, FactorId)>, ChangeError> {
        let (mut graph, mut owners) = (Graph::new(), vec![]);
        for (id, view) in boxes.iter().filter(|(id, _)| self.objects.get(id).is_some_and(Tracked::is_mapped))
        {
            for entry in view_entries(view, &object_key(*id), self.camera, &self.settings.detections) {
                graph.push(entry);
                owners.push(*id);
            }
        }
        Ok(owners.into_iter().zip(self.session.push(&graph, &Values::new())?).collect())
    }

    /// That rules which need to know up do.
    fn check_rules(&self, up: Option<Direction>) -> Result<(), RuleError> {
        let waiting = self.settings.semantics.iter().find(|rule| up.is_none() && rule.factor.wants_up());
        match waiting {
            Some(rule) => Err(RuleError::NoUp { factor: rule.factor.name().to_owned() }),
            None => Ok(()),
        }
    }

    /// The boxes of a frame that pass the filters, by object; of several boxes of an object the last.
    fn boxes(&self, named: &[Detection]) -> BTreeMap<ObjectId, ObjectBox> {
        let view = |detection: &Detection| match sift(detection, &self.camera, &self.settings.detections) {
            Sifted::View(view) => Some((detection.object?, view)),
            _ => None,
        };
        named.iter().filter_map(view).collect()
    }
}
