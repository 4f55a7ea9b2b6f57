//! Factors on poses besides odometry, and corrected odometry of earlier frames.
use super::frame::FrameReport;
use super::object::ObjectState;
use super::{FrameError, Mapper};
use manifactor_formats::tum::StampedPose;
use manifactor_graph::{FactorEntry, Graph, Key, Manifold, Values, Variable};
use manifactor_mapping::mapping::{motion_step, object_key, pose_key, prior_entry};
use manifactor_mapping::motion::{MotionError, STEP_WITH_NOISE};
use manifactor_quadric::DualQuadric;
use manifactor_recording::pose_graph::{PoseFactor, PoseGraphChanges, correct_frames};
use manifactor_recording::sequence::{Frame, ObjectId};
use manifactor_smoother::{ChangeError, FactorId, UpdateError};
use std::collections::HashMap;

/// A step is replaced if its relative pose changes by more than this norm, in rad and m. Composition of poses
/// rounds to about 1e-15.
const MIN_CHANGE: f64 = 1e-9;

/// Largest number of updates after a correction, and the relative decrease of the cost below which they end.
const MAX_SETTLING_UPDATES: usize = 6;
const MIN_COST_DECREASE: f64 = 1e-3;

impl Mapper {
    /// Replaces the odometry of earlier frames by that of corrected poses. Poses and objects follow in this
    /// update. If it fails, nothing changes.
    pub(super) fn correct_poses(&mut self, corrected: &[StampedPose], report: &mut FrameReport) {
        if corrected.is_empty() {
            return;
        }
        let before = self.frames.clone();
        let unknown = correct_frames(&mut self.frames, corrected);
        report.refused.extend(unknown.iter().map(|error| format!("a corrected pose is left out: {error}")));
        if unknown.len() == corrected.len() {
            return;
        }
        if let Err(why) = self.apply_corrections(&before, report) {
            self.frames = before;
            report.refused.push(format!("the corrected poses: {why}"));
            return;
        }
        self.is_corrected = true;
        let is_tentative = |(id, object): (&ObjectId, &ObjectState)| {
            matches!(object, ObjectState::Tentative(_)).then_some(*id)
        };
        for id in self.objects.iter().filter_map(is_tentative).collect::<Vec<_>>() {
            self.objects.insert(id, ObjectState::Tentative(self.viewing_directions(id)));
        }
    }

    /// Replaces the odometry that differs from `before`, moves the estimates with it, and updates the smoother.
    fn apply_corrections(&mut self, before: &[Frame], report: &mut FrameReport) -> Result<(), FrameError> {
        // nothing is pushed to the smoother before all factors exist
        let outside = self.replace_odometry(self.changed_entries(before)?)?;
        if outside > 0 {
            report.refused.push(format!(
                "corrections of {outside} steps before the window count in the final map only"
            ));
        }
        self.move_estimates(before);
        Ok(self.update_until_settled(report)?)
    }

    /// Updates the smoother until the cost no longer decreases much. The first error is returned; after it, nothing
    /// has changed.
    fn update_until_settled(&mut self, report: &mut FrameReport) -> Result<(), UpdateError> {
        report.updates.push(self.smoother.update()?);
        // the second update without a change relinearizes all variables that still move
        let mut cost = f64::INFINITY;
        for _ in 0..MAX_SETTLING_UPDATES {
            let Ok(update) = self.smoother.update() else { break };
            report.updates.push(update);
            let now = self.smoother.cost();
            if now > (1.0 - MIN_COST_DECREASE) * cost {
                break;
            }
            cost = now;
        }
        Ok(())
    }

    /// Moves poses and objects by the corrections of their frames, so that the update starts near its result. An
    /// object moves with the middle one of its views. Estimates that a linear prior keeps in place stay.
    fn move_estimates(&mut self, before: &[Frame]) {
        let Some(map) = self.up.map_frame().map(|frame| frame.map_from_odometry) else { return };
        let correction = |i: usize| {
            let (was, now) = (before.get(i)?.world_from_camera, self.frames.get(i)?.world_from_camera);
            Some(map.compose(&now.compose(&was.inverse())).compose(&map.inverse()))
        };
        let mut moved: Vec<(Key, Box<dyn Variable>)> = vec![];
        for i in 0..before.len() {
            if let (Some(correction), Some(pose)) = (correction(i), self.pose(i)) {
                moved.push((pose_key(i), Box::new(correction.compose(&pose))));
            }
        }
        for (measured, quadric) in self.objects() {
            let middle = measured.views.get(measured.views.len() / 2);
            if let Some(correction) = middle.and_then(|view| correction(view.frame)) {
                let pose = correction.compose(&quadric.pose);
                moved.push((object_key(measured.id), Box::new(DualQuadric { pose, ..quadric })));
            }
        }
        for (key, value) in moved {
            // an error means that a linear prior keeps the linearization point
            _ = self.smoother.move_to(key.as_str(), &*value);
        }
    }

    /// Replaces factors of the odometry. Returns the number of those that are not in the smoother any more.
    fn replace_odometry(&mut self, entries: Vec<FactorEntry>) -> Result<usize, ChangeError> {
        let (graph, ids) = self.smoother.graph();
        let name = |entry: &FactorEntry| (entry.keys.clone(), entry.factor.typetag_name());
        let is_step = |entry: &FactorEntry| entry.name.as_deref().is_none_or(|name| name == STEP_WITH_NOISE);
        let steps = graph.factors().iter().zip(ids).filter(|(entry, _)| is_step(entry));
        let by_keys: HashMap<(Vec<Key>, &str), FactorId> =
            steps.map(|(entry, id)| (name(entry), id)).collect();
        let mut outside = 0;
        for entry in entries {
            match by_keys.get(&name(&entry)) {
                Some(id) => self.smoother.replace(*id, entry)?,
                None => outside += 1,
            }
        }
        Ok(outside)
    }

    /// Returns the factors of steps whose odometry differs from `before`, and the prior on the first pose if that
    /// one differs.
    fn changed_entries(&self, before: &[Frame]) -> Result<Vec<FactorEntry>, MotionError> {
        let mut entries = vec![];
        if let (Some(was), Some(first), Some(map)) =
            (before.first(), self.frames.first(), self.up.map_frame())
            && was.world_from_camera.local(&first.world_from_camera).norm() > MIN_CHANGE
        {
            entries
                .push(prior_entry(map.map_from_odometry.compose(&first.world_from_camera), &self.settings));
        }
        let step_of = |pair: &[Frame]| pair[0].world_from_camera.between(&pair[1].world_from_camera);
        for (i, (was, pair)) in before.windows(2).zip(self.frames.windows(2)).enumerate() {
            if step_of(was).local(&step_of(pair)).norm() <= MIN_CHANGE {
                continue;
            }
            let estimates = |key: &str| self.smoother.estimate(key);
            let step = motion_step([i, i + 1], [&pair[0], &pair[1]], &self.settings, &estimates);
            entries.extend(self.settings.motion.factors(&step)?);
        }
        Ok(entries)
    }

    /// Removes, adds and replaces factors on poses in an update of their own. Factors that do not fit are
    /// refused; if the update fails, all are.
    pub(super) fn apply_pose_factors(&mut self, changes: &PoseGraphChanges, report: &mut FrameReport) {
        if changes.factors.is_empty() && changes.removed.is_empty() {
            return;
        }
        let before = self.pose_factors.clone();
        let mut changed = 0;
        for id in &changes.removed {
            let removed = match self.pose_factors.get(id) {
                None => Err("there is no such factor".to_owned()),
                Some(factor) => self.smoother.remove(&[*factor]).map_err(|error| left_window(&error)),
            };
            match removed {
                Ok(()) => {
                    self.pose_factors.remove(id);
                    changed += 1;
                }
                Err(why) => report.refused.push(format!("`{id}` cannot be removed: {why}")),
            }
        }
        for factor in &changes.factors {
            match self.push_pose_factor(factor) {
                Ok(()) => changed += 1,
                Err(why) => {
                    report.refused.push(format!("the factor `{}` is left out: {why}", factor.label()));
                }
            }
        }
        if changed == 0 {
            return;
        }
        match self.smoother.update() {
            Ok(update) => report.updates.push(update),
            Err(why) => {
                self.pose_factors = before;
                report.refused.push(format!("the factors on poses: {why}"));
            }
        }
    }

    /// Adds a factor, or replaces the one with its id.
    fn push_pose_factor(&mut self, factor: &PoseFactor) -> Result<(), String> {
        let up = self.up.map_frame().and_then(|frame| frame.up);
        let entry = factor.entry(&self.frames, up).map_err(|error| error.to_string())?;
        let replaced = factor.id.as_ref().and_then(|id| self.pose_factors.get(id)).copied();
        if replaced.is_some_and(|replaced| self.smoother.entry(replaced).is_none()) {
            return Err("a pose of the factor it replaces has left the window; the change counts in the final map only".into());
        }
        let mut graph = Graph::new();
        graph.push(entry);
        let ids = self.smoother.push(&graph, &Values::new()).map_err(|error| left_window(&error))?;
        if let Some(replaced) = replaced {
            self.smoother.remove(&[replaced]).map_err(|error| left_window(&error))?;
        }
        if let (Some(name), Some(id)) = (&factor.id, ids.first()) {
            self.pose_factors.insert(name.clone(), *id);
        }
        Ok(())
    }
}

/// Returns the message of an error; of a pose or factor that has left the window, with its consequence.
fn left_window(error: &ChangeError) -> String {
    match error {
        ChangeError::Marginalized { key } => {
            format!("the pose {key} has left the window; the change counts in the final map only")
        }
        ChangeError::MarginalizedFactor { .. } => {
            "a pose of it has left the window; the change counts in the final map only".to_owned()
        }
        ChangeError::Graph(errors) => errors.first().map_or_else(|| error.to_string(), ToString::to_string),
        other => other.to_string(),
    }
}
