//! Streams of frames that arrive one by one.
pub mod confirmed;

use super::SourceError;
use super::journal::LostFrameCounter;
use crate::sequence::{Observation, Observations, Sequence, SequenceHeader, UnusedInput};
use confirmed::OrderedFrames;
use std::fmt;
use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// A sequence whose frames arrive one by one: from a file, a simulator or a sensor.
pub struct FrameStream {
    /// Data that are known before the first frame.
    pub opening: SequenceHeader,
    /// Frames in the order of the source, normally by time. Unreadable input is an error, and later frames
    /// may be valid.
    pub observations: Box<dyn Iterator<Item = Result<Observation, SourceError>> + Send>,
    /// Frames up to this time are repeated from a journal and arrive without delay. Unit: seconds.
    pub recorded_frames: f64,
    /// Frames that the journal could not store.
    pub lost: LostFrameCounter,
}

impl FrameStream {
    /// Creates a stream of new frames.
    pub fn new(
        opening: SequenceHeader,
        observations: impl Iterator<Item = Result<Observation, SourceError>> + Send + 'static,
    ) -> Self {
        Self {
            opening,
            observations: Box::new(observations),
            recorded_frames: f64::NEG_INFINITY,
            lost: LostFrameCounter::default(),
        }
    }

    /// Waits for the last frame and returns all frames. Images without a pose, and changes after the last one, become
    /// unused input.
    ///
    /// # Errors
    /// The first other error.
    pub fn collect(self) -> Result<Sequence, SourceError> {
        let mut all = self.opening.into_sequence();
        for observation in OrderedFrames::new(self.observations) {
            match observation {
                Err(error @ SourceError::ImageWithoutPose { boxes, .. }) => {
                    all.unused.push(UnusedInput::Image { boxes, fault: error.to_string() });
                }
                Err(error @ SourceError::ChangesWithoutImage { .. }) => {
                    let timestamp = all.frames.last().map_or(0.0, |frame| frame.timestamp);
                    let (field, fault) = ("after the last image".into(), error.to_string());
                    all.unused.push(UnusedInput::PoseGraph { timestamp, field, fault });
                }
                observation => all.append(observation?),
            }
        }
        Ok(all)
    }
}

/// Frames that a separate thread reads, one ahead, so that the caller can work while no frame arrives.
pub struct PrefetchedFrames {
    frames: Receiver<Result<Observation, SourceError>>,
    reader: Option<JoinHandle<()>>,
}

/// Interval at which `next` calls `goes_on` while no frame arrives.
const POLL_INTERVAL: Duration = Duration::from_millis(50);

impl PrefetchedFrames {
    /// Starts the thread that reads the frames.
    pub fn new(observations: Box<dyn Iterator<Item = Result<Observation, SourceError>> + Send>) -> Self {
        let (sender, frames) = sync_channel(0);
        // the thread ends with the frames, or with the first frame that has no receiver
        let read = move || {
            for frame in observations {
                if sender.send(frame).is_err() {
                    break;
                }
            }
        };
        Self { frames, reader: Some(std::thread::spawn(read)) }
    }

    /// Returns the next frame, or `None` after the last. Returns `Break` if `goes_on` breaks before a frame
    /// arrives.
    pub fn next(
        &mut self,
        mut goes_on: impl FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<(), Option<Result<Observation, SourceError>>> {
        loop {
            match self.frames.recv_timeout(POLL_INTERVAL) {
                Ok(frame) => return ControlFlow::Continue(Some(frame)),
                Err(RecvTimeoutError::Timeout) => goes_on()?,
                Err(RecvTimeoutError::Disconnected) => {
                    if let Some(Err(panic)) = self.reader.take().map(JoinHandle::join) {
                        resume_unwind(panic);
                    }
                    return ControlFlow::Continue(None);
                }
            }
        }
    }
}

impl From<Arc<Sequence>> for FrameStream {
    fn from(sequence: Arc<Sequence>) -> Self {
        let opening = sequence.header();
        Self::new(opening, Observations::from_sequence(sequence).map(Ok))
    }
}

impl fmt::Debug for FrameStream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stream").field("opening", &self.opening).finish_non_exhaustive()
    }
}
