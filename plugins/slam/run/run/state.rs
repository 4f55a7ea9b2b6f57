//! The frames of a stream with the map made from them.
use super::noise::NoiseEstimation;
use crate::output::report::AssociationHistory;
use manifactor_mapping::settings::RunSettings;
use manifactor_online::{FrameError, FrameReport, Mapper};
use manifactor_recording::sequence::{Observation, Sequence, SequenceHeader};

/// The accepted frames with the map made from them.
#[derive(Debug)]
pub(super) struct StreamState {
    pub mapper: Mapper,
    pub sequence: Sequence,
    pub association: AssociationHistory,
    /// `None` if the noise is given.
    noise: Option<NoiseEstimation>,
}

impl StreamState {
    pub(super) fn new(opening: SequenceHeader, settings: &RunSettings) -> Self {
        let mapper = Mapper::new(opening.clone(), settings);
        let (association, noise) = (AssociationHistory::default(), NoiseEstimation::new(settings));
        Self { mapper, sequence: opening.into_sequence(), association, noise }
    }

    /// Adds a frame, and applies the estimated noise when its time has come.
    pub(super) fn add_frame(&mut self, observation: &Observation) -> Result<FrameReport, FrameError> {
        let taken = self.mapper.add_frame(observation);
        if taken.is_err() {
            // later poses refer to them
            self.sequence.apply_pose_graph(observation.frame.timestamp, observation.pose_graph.clone());
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
        Ok(report)
    }

    /// Maps the same frames with different settings. Replaces `report` by the one of the last frame, with all
    /// changes to the new map.
    pub(super) fn remap(self, settings: &RunSettings, report: &mut FrameReport) -> Self {
        let (mut again, mut before) = (Self::new(self.sequence.header(), settings), None);
        let mut refused = vec![];
        for observation in self.sequence.observations() {
            match again.add_frame(&observation) {
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
        again
    }

    /// Returns the map, and the accepted frames with the current objects of their boxes.
    pub(super) fn into_parts(self) -> (Mapper, Sequence, AssociationHistory) {
        let Self { mapper, sequence, association, .. } = self;
        let sequence = with_current_objects(sequence, &association, &mapper);
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
