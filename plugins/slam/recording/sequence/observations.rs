//! The frames of a sequence, one by one.
use super::{Detection, Observation, Sequence};

/// Frames of a sequence in order of arrival. A reading of the accelerometer belongs to the first frame at or
/// after its time.
pub(crate) struct Observations<S> {
    sequence: S,
    frames: usize,
    boxes: usize,
    readings: usize,
}

impl<S: AsRef<Sequence>> Observations<S> {
    pub(crate) fn from_sequence(sequence: S) -> Self {
        Self { sequence, frames: 0, boxes: 0, readings: 0 }
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
        self.frames += 1;
        // unused rows of a file belong to no frame; the first frame carries them
        let unused = if self.frames == 1 { sequence.unused.clone() } else { vec![] };
        Some(Observation {
            frame: frame.clone(),
            detections: own.to_vec(),
            accelerometer: felt.to_vec(),
            unused,
        })
    }
}

impl Sequence {
    /// Appends a frame with its boxes and readings.
    pub fn push(&mut self, observation: Observation) {
        let frame = self.frames.len();
        self.frames.push(observation.frame);
        self.detections.extend(observation.detections.into_iter().map(|d| Detection { frame, ..d }));
        self.accelerometer.extend(observation.accelerometer);
        self.unused.extend(observation.unused);
    }
}
