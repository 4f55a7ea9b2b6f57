//! Timestamps far ahead, which a second frame has to confirm.
use crate::input::sequence::Observation;
use crate::input::source::SourceError;

/// A frame that is so many seconds ahead of the one before waits for the next one. A longer pause of a robot delays one frame.
const AHEAD: f64 = 10.0;
/// The same as a multiple of the time between the two frames before, for sources with a frame a minute.
const INTERVALS: f64 = 10.0;

type Read = Result<Observation, SourceError>;

/// Frames in their order. A frame whose timestamp jumps ahead is given on once the next one has a timestamp after it: a single
/// wrong timestamp would make all later frames look old.
pub(super) struct Confirmed<I> {
    frames: I,
    /// Timestamp of the last frame that was given on, in seconds.
    last: Option<f64>,
    /// Time between the last two of these, in seconds.
    interval: f64,
    /// The frame after one that was confirmed, or refused.
    next: Option<Read>,
}

impl<I: Iterator<Item = Read>> Confirmed<I> {
    pub(super) fn new(frames: I) -> Self {
        Self { frames, last: None, interval: 0.0, next: None }
    }

    fn give(&mut self, read: Read) -> Option<Read> {
        if let Ok(observation) = &read {
            let timestamp = observation.frame.timestamp;
            self.interval = self.last.map_or(0.0, |last| timestamp - last);
            self.last = Some(timestamp);
        }
        Some(read)
    }
}

impl<I: Iterator<Item = Read>> Iterator for Confirmed<I> {
    type Item = Read;

    fn next(&mut self) -> Option<Read> {
        let read = self.next.take().or_else(|| self.frames.next())?;
        let (Ok(observation), Some(last)) = (&read, self.last) else { return self.give(read) };
        let timestamp = observation.frame.timestamp;
        let ahead = timestamp - last;
        // also what is not a number is for others to refuse
        if ahead.is_nan() || ahead <= AHEAD.max(INTERVALS * self.interval) {
            return self.give(read);
        }
        self.next = self.frames.next();
        match &self.next {
            Some(Ok(next)) if next.frame.timestamp <= timestamp => {
                Some(Err(SourceError::Ahead { timestamp, ahead }))
            }
            // the last frame makes no other one look old
            _ => self.give(read),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::sequence::Frame;
    use manifactor_geometry::Se3;

    fn confirmed(stamps: &[f64]) -> Vec<Option<f64>> {
        let observation = |timestamp: &f64| {
            let frame = Frame { timestamp: *timestamp, world_from_camera: Se3::identity() };
            Ok(Observation { frame, detections: vec![], accelerometer: vec![], unused: vec![] })
        };
        let read = Confirmed::new(stamps.iter().map(observation));
        read.map(|read| read.ok().map(|observation| observation.frame.timestamp)).collect()
    }

    #[test]
    fn a_single_timestamp_far_ahead_is_refused() {
        let expected = [Some(0.0), Some(0.1), None, Some(0.2), Some(0.3)];
        assert_eq!(confirmed(&[0.0, 0.1, 1e12, 0.2, 0.3]), expected);
        // two wrong ones, apart from each other and in a row
        assert_eq!(confirmed(&[0.0, 500.0, 0.1, 700.0, 0.2]), [Some(0.0), None, Some(0.1), None, Some(0.2)]);
    }

    #[test]
    fn a_pause_is_confirmed_by_the_next_frame() {
        let stamps = [0.0, 0.1, 1000.0, 1000.1, 1000.2];
        assert_eq!(confirmed(&stamps), stamps.map(Some));
        // one frame a minute
        let slow = [0.0, 60.0, 120.0, 180.0];
        assert_eq!(confirmed(&slow), slow.map(Some));
    }
}
