//! The frames of a sequence, one by one.
use super::pose_graph::{PoseFactor, PoseGraphChanges, correct_frames};
use super::{Detection, Observation, Sequence, UnusedInput, remove_repeated};

/// Frames of a sequence in order of arrival. A reading of the accelerometer belongs to the first frame at or
/// after its time.
pub(crate) struct Observations<S> {
    sequence: S,
    frames: usize,
    boxes: usize,
    readings: usize,
    pose_factors: usize,
}

impl<S: AsRef<Sequence>> Observations<S> {
    pub(crate) fn from_sequence(sequence: S) -> Self {
        Self { sequence, frames: 0, boxes: 0, readings: 0, pose_factors: 0 }
    }
}

impl<S: AsRef<Sequence>> Iterator for Observations<S> {
    type Item = Observation;

    fn next(&mut self) -> Option<Observation> {
        let sequence = self.sequence.as_ref();
        let frame = sequence.frames.get(self.frames)?;
        let own = sequence.detections.get(self.boxes..).unwrap_or_default();
        let own = &own[..own.partition_point(|detection| detection.frame <= self.frames)];
        self.boxes += own.len();
        let felt = sequence.accelerometer.get(self.readings..).unwrap_or_default();
        let felt = &felt[..felt.partition_point(|reading| reading.timestamp <= frame.timestamp)];
        self.readings += felt.len();
        let factors = sequence.pose_factors.get(self.pose_factors..).unwrap_or_default();
        let factors = &factors[..factors.partition_point(|(arrived, _)| *arrived <= self.frames)];
        self.pose_factors += factors.len();
        let factors = factors.iter().map(|(_, factor)| factor.clone()).collect();
        self.frames += 1;
        // unused rows of a file belong to no frame; the first frame carries them
        let unused = if self.frames == 1 { sequence.unused.clone() } else { vec![] };
        Some(Observation {
            frame: frame.clone(),
            detections: own.to_vec(),
            accelerometer: felt.to_vec(),
            pose_graph: PoseGraphChanges { factors, ..PoseGraphChanges::default() },
            unused,
        })
    }
}

impl Observation {
    /// Adds an image of the same time, by another camera.
    pub(crate) fn join(&mut self, other: Self) {
        self.detections.extend(other.detections);
        self.unused.extend(other.unused);
        self.unused.extend(without_repeated(self.frame.timestamp, &mut self.detections));
        self.accelerometer.extend(other.accelerometer);
        self.pose_graph.factors.extend(other.pose_graph.factors);
        self.pose_graph.removed.extend(other.pose_graph.removed);
        self.pose_graph.corrected.extend(other.pose_graph.corrected);
    }
}

/// Removes the boxes of an image that show what another one shows, and returns them as unused input.
fn without_repeated(timestamp: f64, boxes: &mut Vec<Detection>) -> Vec<UnusedInput> {
    remove_repeated(boxes).into_iter().map(|repeated| UnusedInput::repeated(timestamp, repeated)).collect()
}

/// Largest difference between two equal poses. Unit: rad and m.
const SAME_POSE: f64 = 1e-9;

impl Sequence {
    /// Appends a frame with its boxes and readings, and [applies](Self::apply_pose_graph) its changes of the pose
    /// graph.
    pub fn push(&mut self, observation: Observation) {
        let frame = self.frames.len();
        let timestamp = observation.frame.timestamp;
        self.apply_pose_graph((frame, timestamp), observation.pose_graph);
        self.frames.push(observation.frame);
        self.detections.extend(observation.detections.into_iter().map(|d| Detection { frame, ..d }));
        self.accelerometer.extend(observation.accelerometer);
        self.unused.extend(observation.unused);
    }

    /// Appends a frame as [`push`](Self::push). Images of one time and pose, by several cameras, are one frame. A frame
    /// that does not come after the one before becomes unused input.
    pub(crate) fn append(&mut self, observation: Observation) {
        let Some(last) = self.frames.last().cloned() else { return self.push(observation) };
        let timestamp = observation.frame.timestamp;
        if timestamp > last.timestamp {
            return self.push(observation);
        }
        let apart = last.world_from_camera.between(&observation.frame.world_from_camera).log().norm();
        if timestamp < last.timestamp || apart > SAME_POSE {
            let fault = format!(
                "the frame at {timestamp} s does not come after the one before, at {} s: it is left out with its changes",
                last.timestamp
            );
            self.unused.push(UnusedInput::Image { boxes: observation.detections.len(), fault });
            return;
        }
        let frame = self.frames.len() - 1;
        let own = self.detections.partition_point(|detection| detection.frame < frame);
        let mut boxes = self.detections.split_off(own);
        boxes.extend(observation.detections.into_iter().map(|d| Detection { frame, ..d }));
        self.unused.extend(without_repeated(timestamp, &mut boxes));
        self.detections.extend(boxes);
        self.accelerometer.extend(observation.accelerometer);
        self.unused.extend(observation.unused);
        self.apply_pose_graph((frame, timestamp), observation.pose_graph);
    }

    /// Corrects poses, and adds and removes factors on poses that arrive with a frame, by its index and time. Corrections of unknown frames and
    /// removals of unknown factors become unused input.
    pub fn apply_pose_graph(&mut self, (frame, timestamp): (usize, f64), changes: PoseGraphChanges) {
        let PoseGraphChanges { factors, removed, corrected } = changes;
        let unused = |field: String, fault: String| UnusedInput::PoseGraph { timestamp, field, fault };
        let unknown = correct_frames(&mut self.frames, &corrected);
        self.unused.extend(unknown.iter().map(|error| unused("corrected".into(), error.to_string())));
        let has = |id: &str, factor: &PoseFactor| factor.id.as_deref() == Some(id);
        for id in removed {
            let before = self.pose_factors.len();
            self.pose_factors.retain(|(_, factor)| !has(&id, factor));
            if self.pose_factors.len() == before {
                self.unused.push(unused(format!("removed `{id}`"), "there is no such factor".into()));
            }
        }
        // the one that a factor replaces stays, in case that the new one cannot be used
        self.pose_factors.extend(factors.into_iter().map(|factor| (frame, factor)));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::pose_graph::PoseFactorKey;
    use crate::sequence::{Frame, SequenceHeader};
    use manifactor_geometry::{Between, Se3};
    use manifactor_graph::Noise;
    use manifactor_quadric::Camera;
    use std::sync::Arc;

    #[test]
    fn a_factor_arrives_with_the_frame_that_its_image_joins() {
        let camera = Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap();
        let mut sequence = SequenceHeader::new(camera).into_sequence();
        for timestamp in [0.0, 1.0, 1.0] {
            let factor = PoseFactor {
                id: None,
                keys: vec![PoseFactorKey::Timestamp(0.0), PoseFactorKey::Timestamp(timestamp)],
                factor: Arc::new(Between { relative: Se3::identity() }),
                noise: Noise::default(),
                loss: None,
            };
            let pose_graph = PoseGraphChanges { factors: vec![factor], ..Default::default() };
            let frame = Frame::new(timestamp, Se3::identity());
            sequence.append(Observation { pose_graph, ..Observation::new(frame) });
        }
        let arrived: Vec<usize> = sequence.pose_factors.iter().map(|(arrived, _)| *arrived).collect();
        assert_eq!(arrived, [0, 1, 1]);
        let replayed = sequence.observations().map(|seen| seen.pose_graph.factors.len());
        assert_eq!(replayed.collect::<Vec<_>>(), [1, 2]);
    }
}
