//! The frames of a stream with the map made from them.
use super::jump::JumpSearch;
use super::noise::NoiseEstimation;
use crate::output::report::AssociationHistory;
use manifactor_geometry::Se3;
use manifactor_mapping::settings::RunSettings;
use manifactor_online::{FrameError, FrameReport, Mapper, Relocalization};
use manifactor_recording::sequence::jumps::jump_at;
use manifactor_recording::sequence::{Observation, Sequence, SequenceHeader};

/// The accepted frames with the map made from them.
#[derive(Debug)]
pub(super) struct StreamState {
    pub mapper: Mapper,
    pub sequence: Sequence,
    pub association: AssociationHistory,
    settings: RunSettings,
    /// `None` if the noise is given.
    noise: Option<NoiseEstimation>,
    /// Relocalization after a jump of the odometry; `None` while the frames are processed again.
    jumps: Option<JumpRecovery>,
}

/// Relocalization of a stream after jumps of its odometry.
#[derive(Debug, Default)]
struct JumpRecovery {
    /// Correction of the odometry since the last jump, and the time of that jump. Unit: seconds.
    correction: Option<(f64, Se3)>,
    search: Option<JumpSearch>,
    /// The frame before the last one, with the correction.
    before: Option<Observation>,
}

impl JumpRecovery {
    /// Applies the correction to the poses of a frame.
    fn correct(&self, observation: &mut Observation) {
        let Some((since, correction)) = &self.correction else { return };
        let frame = &mut observation.frame;
        frame.world_from_camera = correction.compose(&frame.world_from_camera);
        for stamped in observation.pose_graph.corrected.iter_mut().filter(|pose| pose.timestamp >= *since) {
            stamped.pose = correction.compose(&stamped.pose);
        }
    }
}

impl StreamState {
    pub(super) fn new(opening: SequenceHeader, settings: &RunSettings) -> Self {
        let mapper = Mapper::new(opening.clone(), settings);
        let (association, noise) = (AssociationHistory::default(), NoiseEstimation::new(settings));
        // with the ids of the source, no object is mapped twice
        let jumps = (!settings.association.uses_source_ids()).then(JumpRecovery::default);
        let (sequence, settings) = (opening.into_sequence(), settings.clone());
        Self { mapper, sequence, association, settings, noise, jumps }
    }

    /// Adds a frame, and applies the estimated noise when its time has come. After a jump of the odometry, looks for
    /// the pose in the map so far.
    pub(super) fn add_frame(&mut self, observation: &Observation) -> Result<FrameReport, FrameError> {
        let mut observation = observation.clone();
        self.jumps.iter().for_each(|jumps| jumps.correct(&mut observation));
        let taken = self.mapper.add_frame(&observation);
        if taken.is_err() {
            // later poses refer to them
            let last = self.sequence.frames.len().saturating_sub(1);
            let arrival = (last, observation.frame.timestamp);
            self.sequence.apply_pose_graph(arrival, observation.pose_graph.clone());
        }
        let mut report = taken?;
        self.association.record_frame(&observation.detections, Some(&report));
        self.sequence.push(observation.clone());
        if let Some(noise) = &mut self.noise {
            let first = self.sequence.frames.first().map_or(report.timestamp, |first| first.timestamp);
            let named =
                |mapper: &Mapper| with_current_objects(self.sequence.clone(), &self.association, mapper);
            noise.after_frame(report.timestamp - first, &mut self.mapper, &mut report, named);
        }
        if let Some((found, first)) = self.search_after_jump(&observation) {
            self.correct_since(first, &found, &mut report);
        }
        Ok(report)
    }

    /// Begins or continues the search for the pose after a jump. Returns the pose once it is found, with the index of
    /// its frame.
    fn search_after_jump(&mut self, observation: &Observation) -> Option<(Relocalization, usize)> {
        let jumps = self.jumps.as_mut()?;
        let before = jumps.before.replace(observation.clone());
        let first = self.sequence.frames.len().checked_sub(2)?;
        if let Some(jump) = jump_at(&self.sequence.frames, first) {
            jumps.search = JumpSearch::new((jump, first), &self.sequence, &self.mapper);
            jumps.search.as_mut()?.add_frame(&before?);
        }
        let found = jumps.search.as_mut()?.add_frame(observation);
        if let Some(found) = found {
            return Some((found, jumps.search.as_ref()?.first));
        }
        if jumps.search.as_ref()?.is_over(observation.frame.timestamp) {
            jumps.search = None;
        }
        None
    }

    /// Corrects the odometry from a frame on, whose pose in the map was found, and maps all frames again.
    fn correct_since(&mut self, first: usize, found: &Relocalization, report: &mut FrameReport) {
        let Some(mut jumps) = self.jumps.take() else { return };
        let Some(search) = jumps.search.take() else { return };
        let frames = &mut self.sequence.frames;
        let poses = first.checked_sub(1).and_then(|before| Some((frames.get(before)?, frames.get(first)?)));
        let Some((before, after)) = poses else { return };
        // the step from the frame before, as the map shows it
        let corrected = before.world_from_camera.compose(&search.before.between(&found.start));
        let correction = corrected.compose(&after.world_from_camera.inverse());
        for frame in frames.iter_mut().skip(first) {
            frame.world_from_camera = correction.compose(&frame.world_from_camera);
        }
        self.sequence.corrected_jumps.push(search.jump);
        let total = jumps.correction.map_or(correction, |(_, earlier)| correction.compose(&earlier));
        jumps.correction = Some((search.jump.timestamp, total));
        if let Some(last) = &mut jumps.before {
            last.frame.world_from_camera = correction.compose(&last.frame.world_from_camera);
        }
        let mut again = Self::new(self.sequence.header(), &self.settings);
        again.jumps = None;
        again.add_all(&self.sequence, report);
        again.sequence.corrected_jumps = std::mem::take(&mut self.sequence.corrected_jumps);
        again.jumps = Some(jumps);
        *self = again;
        report.jump = Some(found.clone());
    }

    /// Maps the same frames with different settings. Replaces `report` by the one of the last frame, with all
    /// changes to the new map.
    pub(super) fn remap(self, settings: &RunSettings, report: &mut FrameReport) -> Self {
        let mut again = Self::new(self.sequence.header(), settings);
        let jumps = again.jumps.take();
        again.add_all(&self.sequence, report);
        again.sequence.corrected_jumps = self.sequence.corrected_jumps;
        // the search for a pose ends, as its map is discarded
        let correction = self.jumps.and_then(|jumps| jumps.correction);
        again.jumps = jumps.map(|jumps| JumpRecovery { correction, ..jumps });
        again
    }

    /// Adds all frames of a sequence. Replaces `report` by the one of the last frame, with all changes.
    fn add_all(&mut self, sequence: &Sequence, report: &mut FrameReport) {
        let (mut before, mut refused): (Option<FrameReport>, _) = (None, vec![]);
        for observation in sequence.observations() {
            match self.add_frame(&observation) {
                Ok(mut taken) => {
                    if let Some(before) = before {
                        taken.prepend_changes(before);
                    }
                    before = Some(taken);
                }
                Err(error) => refused.push(error.to_string()),
            }
        }
        if let Some(last) = before {
            *report = last;
        }
        report.refused.extend(refused);
    }

    /// Returns the map, and the accepted frames with the current objects of their boxes.
    pub(super) fn into_parts(self) -> (Mapper, Sequence, AssociationHistory) {
        let Self { mapper, sequence, association, settings, .. } = self;
        let mut sequence = with_current_objects(sequence, &association, &mapper);
        if !settings.association.uses_source_ids() {
            association.match_true_objects(&mut sequence, mapper.id_changes());
        }
        (mapper, sequence, association)
    }
}

fn with_current_objects(
    mut sequence: Sequence,
    association: &AssociationHistory,
    mapper: &Mapper,
) -> Sequence {
    let objects = association.current_objects(mapper.id_changes());
    for (detection, object) in sequence.detections.iter_mut().zip(objects) {
        detection.object = object;
    }
    sequence
}
