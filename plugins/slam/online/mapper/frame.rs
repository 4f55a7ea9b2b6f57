//! Processing of one frame: its pose and boxes, then the changes in the map.
use super::association::{AppliedCorrections, AssociationContext};
use super::object::ObjectState;
use super::{FrameError, Mapper, Relocalization};
use manifactor_association::{Corrections, DetectionMove, FrameDetections, ObjectMerge};
use manifactor_geometry::Se3;
use manifactor_graph::{Direction, Graph, Key, Manifold, Values};
use manifactor_mapping::estimate::variance::StreamNoise;
use manifactor_mapping::gravity::MapFrame;
use manifactor_mapping::mapping::measurements::{FilteredDetection, ObjectBox, filter_detection};
use manifactor_mapping::mapping::{
    motion_step, object_key, pose_key, prior_entry, prior_object_entry, view_entries,
};
use manifactor_mapping::semantics::RuleError;
use manifactor_mapping::settings::RunSettings;
use manifactor_recording::sequence::{Detection, Frame, ObjectId, Observation, UnusedInput};
use manifactor_smoother::{ChangeError, FactorId, UpdateReport};
use serde::Serialize;
use std::collections::BTreeMap;

/// The result of a frame.
#[derive(Debug, Clone, Serialize)]
pub struct FrameReport {
    /// Index among the accepted frames, from 0.
    pub frame: usize,
    /// Unit: seconds.
    pub timestamp: f64,
    /// The estimated pose of the camera in the map frame.
    pub pose: Se3,
    /// The estimated pose of the body in the map frame, if the source has `body_from_camera`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body: Option<Se3>,
    /// The start pose in the prior map, if this frame led to it. From now on ids and poses are those of the
    /// prior map. All frames were processed again, so objects, rejections and updates in this report cover
    /// all frames. Earlier reports refer to a map that was discarded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub located: Option<Relocalization>,
    /// The pose of the first frame after a jump of the odometry, in the map of the frames before it, if this frame
    /// led to it. The poses after the jump are corrected, and all frames were processed again, as for `located`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub jump: Option<Relocalization>,
    /// The estimated noise of all frames, from this one on.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub noise: Option<StreamNoise>,
    /// Number of boxes that passed the filters.
    pub boxes: usize,
    /// Object of each box, in the order of the frame; `None` for skipped boxes.
    #[serde(rename = "names")]
    pub box_objects: Vec<Option<ObjectId>>,
    /// Objects that were detected too rarely. Their boxes have no object.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub forgotten: Vec<ObjectId>,
    /// Boxes of earlier frames that moved to a different object, before the boxes of this frame were
    /// assigned.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub moved: Vec<DetectionMove>,
    /// Objects that were merged, after the moves and before the boxes of this frame were assigned.
    pub merged: Vec<ObjectMerge>,
    /// Objects added to the map.
    #[serde(rename = "born")]
    pub initialized: Vec<Key>,
    /// Objects removed from the map: their boxes belong to several objects, are too few, or changed. They may
    /// be initialized again.
    #[serde(rename = "withdrawn")]
    pub removed: Vec<Key>,
    /// Objects whose class changed, so that the semantic rules were applied again.
    pub revised: Vec<Key>,
    /// Rejected data, with the reasons.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub refused: Vec<String>,
    /// Smoother reports: one for the frame with corrections of earlier frames, a second one if objects are
    /// added or removed.
    pub updates: Vec<UpdateReport>,
}

/// The content of a frame after its pose is added.
pub(super) struct FrameBoxes {
    /// Boxes that passed the filters, by object.
    pub boxes: BTreeMap<(ObjectId, usize), ObjectBox>,
    /// Corrections to earlier frames.
    pub corrections: Corrections,
    /// True if the up direction changed.
    pub up_moved: bool,
}

impl FrameBoxes {
    /// Returns a frame without boxes.
    pub(super) fn without_boxes() -> Self {
        Self { boxes: BTreeMap::new(), corrections: Corrections::default(), up_moved: false }
    }
}

impl FrameReport {
    pub(super) fn new(frame: usize, timestamp: f64) -> Self {
        Self {
            frame,
            timestamp,
            pose: Se3::identity(),
            body: None,
            located: None,
            jump: None,
            noise: None,
            boxes: 0,
            box_objects: vec![],
            forgotten: vec![],
            moved: vec![],
            merged: vec![],
            initialized: vec![],
            removed: vec![],
            revised: vec![],
            refused: vec![],
            updates: vec![],
        }
    }

    /// Adds the changes of an earlier frame to the report.
    pub fn prepend_changes(&mut self, before: Self) {
        fn prepend<T>(mut first: Vec<T>, last: &mut Vec<T>) {
            first.append(last);
            *last = first;
        }
        self.noise = self.noise.take().or(before.noise);
        prepend(before.forgotten, &mut self.forgotten);
        prepend(before.moved, &mut self.moved);
        prepend(before.merged, &mut self.merged);
        prepend(before.initialized, &mut self.initialized);
        prepend(before.removed, &mut self.removed);
        prepend(before.revised, &mut self.revised);
        prepend(before.refused, &mut self.refused);
        let is_told = |update: &UpdateReport| {
            update.solved_batch || !(update.rejected.is_empty() && update.readmitted.is_empty())
        };
        prepend(before.updates.into_iter().filter(is_told).collect(), &mut self.updates);
    }
}

impl Mapper {
    /// Adds a pose in one smoother update, together with boxes of mapped objects and corrections of earlier
    /// frames. If the update fails, tries again without the corrections, then with the pose alone.
    pub(super) fn add_pose(
        &mut self,
        observation: &Observation,
        report: &mut FrameReport,
    ) -> Result<FrameBoxes, FrameError> {
        let frame = &observation.frame;
        let timestamp = frame.timestamp;
        if !(timestamp.is_finite() && frame.world_from_camera.is_finite()) {
            return Err(FrameError::NotFinite { timestamp });
        }
        if let Some(before) = self.frames.last().map(|last| last.timestamp).filter(|t| *t >= timestamp) {
            return Err(FrameError::Timestamp { timestamp, before });
        }
        let up = self.up.backup_unless_final();
        let up_moved = self.up.add_frame(observation, &self.settings)?;
        let taken = self.add_pose_with_up(observation, up_moved, report);
        if taken.is_err()
            && let Some(up) = up
        {
            self.up = up;
        }
        taken
    }

    /// Adds a frame, with the up direction already updated.
    fn add_pose_with_up(
        &mut self,
        observation: &Observation,
        up_moved: bool,
        report: &mut FrameReport,
    ) -> Result<FrameBoxes, FrameError> {
        let (frame, timestamp) = (&observation.frame, observation.frame.timestamp);
        let (graph, values) = self.pose_with_factors(frame, report)?;
        // a rejected frame must not leave pending changes in the smoother
        if !report.pose.is_finite() {
            return Err(FrameError::NotFinite { timestamp });
        }
        report.refused.extend(observation.unused.iter().filter_map(|unused| match unused {
            UnusedInput::Box { place, fault, .. } => Some(format!("box {place} is left out: {fault}")),
            UnusedInput::PoseGraph { field, fault, .. } => Some(format!("{field} is left out: {fault}")),
            UnusedInput::WithoutPose(_) | UnusedInput::Image { .. } | UnusedInput::Recording(_) => None,
        }));
        self.smoother.set_time(timestamp)?;
        self.smoother.push(&graph, &values)?;
        let corrected = self.apply_pending_corrections(report);
        let detections = &observation.detections;
        let image = FrameDetections { frame: report.frame, timestamp, detections };
        let predicted = self.association_context((report.frame, report.pose));
        report.box_objects = self.associator.associate(&image, &predicted);
        let named = report.box_objects.iter().zip(detections);
        let named = named.map(|(object, d)| Detection { frame: report.frame, object: *object, ..d.clone() });
        let named: Vec<Detection> = named.collect();
        let mut seen =
            FrameBoxes { boxes: self.boxes_by_object(&named), corrections: Corrections::default(), up_moved };
        report.boxes = seen.boxes.len();
        let is_taken = self.update_smoother(&seen.boxes, corrected, (&graph, &values), report)?;
        self.frames.push(frame.clone());
        if is_taken {
            for detection in &named {
                let RunSettings { detections, aliases, .. } = &*self.settings;
                self.measurements.add_detection(detection, detections, aliases);
            }
            let newest = (report.frame, self.pose(report.frame).unwrap_or(report.pose));
            let known = AssociationContext {
                newest,
                live_poses: &self.live_poses,
                smoother: &self.smoother,
                measurements: &self.measurements,
            };
            seen.corrections = self.associator.learn_from_frame(&image, &report.box_objects, &known);
        } else {
            seen.boxes.clear();
            report.box_objects.fill(None);
        }
        Ok(seen)
    }

    /// Returns the pose of a frame with its factors: to the last frame, or the prior on the first pose. Sets
    /// the predicted pose in `report`.
    fn pose_with_factors(
        &mut self,
        frame: &Frame,
        report: &mut FrameReport,
    ) -> Result<(Graph, Values), FrameError> {
        let map = self.up.map_frame().unwrap_or_else(|| MapFrame::of_odometry(None));
        let (mut graph, mut values) = (Graph::new(), Values::new());
        report.pose = match self.frames.last() {
            Some(last) => {
                let from = self.pose(report.frame - 1).unwrap_or_else(Se3::identity);
                let estimates = |key: &str| self.smoother.estimate(key);
                let frames = [report.frame - 1, report.frame];
                let step = motion_step(frames, [last, frame], &self.settings, &estimates);
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
                if let Some(place) = &self.georeference {
                    place.add_to(&map.map_from_odometry, &mut graph, &mut values);
                }
                self.settings.own.add_to(&mut graph, &mut values);
                for known in self.measurements.objects.iter().filter_map(|measured| measured.prior.as_ref()) {
                    graph.push(prior_object_entry(known, &self.settings));
                    values.insert(object_key(known.id), known.quadric);
                }
                first
            }
        };
        values.insert(pose_key(report.frame), report.pose);
        Ok((graph, values))
    }

    /// Updates the smoother with the boxes of a frame. Its pose, `alone`, and the corrections are already
    /// pushed. Returns whether the boxes were accepted.
    fn update_smoother(
        &mut self,
        boxes: &BTreeMap<(ObjectId, usize), ObjectBox>,
        corrected: Option<AppliedCorrections>,
        alone: (&Graph, &Values),
        report: &mut FrameReport,
    ) -> Result<bool, FrameError> {
        let mut pushed = self.push_boxes_of_frame(boxes);
        let mut update = self.smoother.update();
        match (corrected, &update) {
            (Some(corrected), Ok(_)) => self.id_changes = corrected.id_changes,
            (Some(corrected), Err(error)) => {
                self.undo_corrections(corrected, &error.to_string(), report);
                self.smoother.set_time(report.timestamp)?;
                self.smoother.push(alone.0, alone.1)?;
                pushed = self.push_boxes_of_frame(boxes);
                update = self.smoother.update();
            }
            (None, _) => {}
        }
        let why = match (update, pushed) {
            (Ok(update), Ok(pushed)) => {
                report.updates.push(update);
                for (owner, factor) in pushed {
                    if let Some(ObjectState::Mapped(mapped)) = self.objects.get_mut(&owner) {
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
                self.smoother.set_time(report.timestamp)?;
                self.smoother.push(alone.0, alone.1)?;
                report.updates.push(self.smoother.update()?);
                why.to_string()
            }
            (Err(why), _) => return Err(why.into()),
        };
        report.refused.push(format!("the boxes at {} s: {why}", report.timestamp));
        Ok(false)
    }

    /// Pushes the boxes of mapped objects of a frame. Returns their objects and factors.
    fn push_boxes_of_frame(
        &mut self,
        boxes: &BTreeMap<(ObjectId, usize), ObjectBox>,
    ) -> Result<Vec<(ObjectId, FactorId)>, ChangeError> {
        let (mut graph, mut owners) = (Graph::new(), vec![]);
        for ((id, _), view) in
            boxes.iter().filter(|((id, _), _)| self.objects.get(id).is_some_and(ObjectState::is_mapped))
        {
            for entry in view_entries(view, &object_key(*id), &self.settings.detections) {
                graph.push(entry);
                owners.push(*id);
            }
        }
        Ok(owners.into_iter().zip(self.smoother.push(&graph, &Values::new())?).collect())
    }

    /// Checks that no semantic rule lacks the up direction.
    fn check_rules(&self, up: Option<Direction>) -> Result<(), RuleError> {
        let waiting = self.settings.semantics.iter().find(|rule| up.is_none() && rule.needs_up());
        match waiting {
            Some(rule) => Err(RuleError::NoUp { factor: rule.factor.factor_type().to_owned() }),
            None => Ok(()),
        }
    }

    /// Returns the boxes of a frame that pass the filters, by object and camera. If an object has several boxes in an
    /// image, the last one counts.
    fn boxes_by_object(&self, named: &[Detection]) -> BTreeMap<(ObjectId, usize), ObjectBox> {
        let view = |detection: &Detection| match filter_detection(detection, &self.settings.detections) {
            FilteredDetection::View(view) => Some(((detection.object?, view.camera.index), view)),
            _ => None,
        };
        named.iter().filter_map(view).collect()
    }
}
