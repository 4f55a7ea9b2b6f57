//! Confirmation of timestamps that are far ahead, by later frames.
use crate::sequence::Observation;
use crate::source::SourceError;
use std::collections::VecDeque;

/// A frame that is more than this number of seconds ahead of the previous frame waits for the next one. A
/// longer pause of a robot delays one frame.
const MAX_JUMP_S: f64 = 10.0;
/// This limit as a multiple of the last interval between frames, for sources with, for example, one frame per
/// minute.
const MAX_JUMP_INTERVALS: f64 = 10.0;

type ReadFrame = Result<Observation, SourceError>;

/// Frames in their order. A frame whose timestamp jumps ahead is delayed until a later frame is close behind
/// it, or until two later frames continue from there. Without this check, a single wrong timestamp would make
/// all later frames look old. The first frame waits for the second one for the same reason.
pub struct OrderedFrames<I> {
    frames: I,
    /// Timestamp of the last frame that was returned. Unit: seconds.
    last: Option<f64>,
    /// Interval between the last two returned frames. Unit: seconds.
    interval: f64,
    /// Frames that were read early to confirm a timestamp.
    ahead: VecDeque<ReadFrame>,
}

/// Returns the timestamp of a readable frame, if it is finite.
fn timestamp(read: &ReadFrame) -> Option<f64> {
    let timestamp = read.as_ref().ok()?.frame.timestamp;
    timestamp.is_finite().then_some(timestamp)
}

impl<I: Iterator<Item = ReadFrame>> OrderedFrames<I> {
    /// Frames as they are read.
    pub fn new(frames: I) -> Self {
        Self { frames, last: None, interval: 0.0, ahead: VecDeque::new() }
    }

    fn accept_frame(&mut self, read: ReadFrame) -> Option<ReadFrame> {
        if let Some(timestamp) = timestamp(&read) {
            self.interval = self.last.map_or(0.0, |last| timestamp - last);
            self.last = Some(timestamp);
        }
        Some(read)
    }

    /// Returns the first frame unless the next two frames contradict it: they ascend, and both come before
    /// it. A pause after the first frame is no contradiction, because it makes no later frame look old.
    fn check_first(&mut self, read: ReadFrame, first: f64) -> Option<ReadFrame> {
        if let Some(second) = self.later_timestamp(0).filter(|second| *second < first)
            && let Some(third) = self.later_timestamp(1).filter(|third| *third > second && *third < first)
        {
            return Some(Err(SourceError::FirstAhead { timestamp: first, next: [second, third] }));
        }
        self.accept_frame(read)
    }

    /// Returns the timestamp of the `n`-th later frame, from 0; `None` at the end.
    fn later_timestamp(&mut self, n: usize) -> Option<f64> {
        loop {
            if let Some(found) = self.ahead.iter().filter_map(timestamp).nth(n) {
                return Some(found);
            }
            let read = self.frames.next()?;
            self.ahead.push_back(read);
        }
    }
}

impl<I: Iterator<Item = ReadFrame>> Iterator for OrderedFrames<I> {
    type Item = ReadFrame;

    fn next(&mut self) -> Option<ReadFrame> {
        let read = self.ahead.pop_front().or_else(|| self.frames.next())?;
        let Some(here) = timestamp(&read) else { return self.accept_frame(read) };
        let Some(last) = self.last else { return self.check_first(read, here) };
        let limit = MAX_JUMP_S.max(MAX_JUMP_INTERVALS * self.interval);
        if here - last <= limit {
            return self.accept_frame(read);
        }
        let is_confirmed = match self.later_timestamp(0) {
            // the last frame makes no later frame look old
            None => true,
            Some(next) if next <= here => false,
            Some(next) if next - here <= limit => true,
            Some(next) => self.later_timestamp(1).is_none_or(|third| third > next),
        };
        match is_confirmed {
            true => self.accept_frame(read),
            false => Some(Err(SourceError::Ahead { timestamp: here, ahead: here - last })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::Frame;
    use manifactor_geometry::Se3;

    fn observation(timestamp: f64) -> ReadFrame {
        let frame = Frame::new(timestamp, Se3::identity());
        Ok(Observation::new(frame))
    }

    fn confirmed(stamps: &[f64]) -> Vec<Option<f64>> {
        let read = OrderedFrames::new(stamps.iter().copied().map(observation));
        read.map(|read| read.ok().map(|observation| observation.frame.timestamp)).collect()
    }

    #[test]
    fn a_single_timestamp_far_ahead_is_refused() {
        let expected = [Some(0.0), Some(0.1), None, Some(0.2), Some(0.3)];
        assert_eq!(confirmed(&[0.0, 0.1, 1e12, 0.2, 0.3]), expected);
        // two wrong timestamps, apart from each other and consecutive
        assert_eq!(confirmed(&[0.0, 500.0, 0.1, 700.0, 0.2]), [Some(0.0), None, Some(0.1), None, Some(0.2)]);
        assert_eq!(confirmed(&[0.0, 0.1, 1e12, 2e12, 0.2, 0.3])[2..], [None, None, Some(0.2), Some(0.3)]);
    }

    #[test]
    fn a_first_timestamp_ahead_of_the_next_two_is_refused() {
        assert_eq!(confirmed(&[1e12, 1.0, 1.1, 1.2]), [None, Some(1.0), Some(1.1), Some(1.2)]);
        // one frame per minute, and two wrong timestamps
        assert_eq!(confirmed(&[1e12, 60.0, 120.0]), [None, Some(60.0), Some(120.0)]);
        assert_eq!(confirmed(&[2e12, 1e12, 1.0, 1.1, 1.2])[2..], [Some(1.0), Some(1.1), Some(1.2)]);
        assert_eq!(confirmed(&[1e12, 1.0, 5e11, 1.1]), [None, Some(1.0), None, Some(1.1)]);
        // a frame with NaN as its timestamp in between
        assert_eq!(confirmed(&[1e12, f64::NAN, 1.0, 1.1])[2..], [Some(1.0), Some(1.1)]);
    }

    #[test]
    fn a_first_timestamp_stays_if_one_of_the_next_two_comes_after_it() {
        let streams: [&[f64]; 7] = [
            &[0.0],
            &[1e12],
            &[0.0, 0.1],
            &[1e12, 1.0],
            &[5.0, 4.9, 5.1, 5.2],
            &[1.0, 1.0, 1.0, 1.1],
            // a pause
            &[0.0, 1000.0, 1000.1],
        ];
        for stamps in streams {
            let all: Vec<_> = stamps.iter().copied().map(Some).collect();
            assert_eq!(confirmed(stamps), all);
        }
    }

    #[test]
    fn a_first_frame_waits_for_the_second_one_alone() {
        let read = std::cell::Cell::new(0);
        let frames = [0.0, 0.1, 0.2].map(observation).into_iter().inspect(|_| read.set(read.get() + 1));
        assert!(OrderedFrames::new(frames).next().is_some_and(|first| first.is_ok()));
        assert_eq!(read.get(), 2);
    }

    #[test]
    fn a_pause_is_confirmed_by_the_next_frame() {
        let stamps = [0.0, 0.1, 1000.0, 1000.1, 1000.2];
        assert_eq!(confirmed(&stamps), stamps.map(Some));
        // NaN confirms nothing
        assert_eq!(confirmed(&[0.0, 0.1, 1e12, f64::NAN, 0.2])[2], None);
        // one frame per minute
        let slow = [0.0, 60.0, 120.0, 180.0];
        assert_eq!(confirmed(&slow), slow.map(Some));
    }
}
