//! Frames one at a time, as they come.
pub mod confirmed;

use super::SourceError;
use super::journal::Lost;
use crate::sequence::{Observation, Observations, Opening, Sequence};
use confirmed::Confirmed;
use std::fmt;
use std::ops::ControlFlow;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// A sequence whose frames come one by one: from a file, from a simulator, from a sensor.
pub struct Stream {
    /// What is known before the first frame.
    pub opening: Opening,
    /// Frames in the order of time, as far as the source keeps it; what cannot be read is an error, and the next may be sound.
    pub observations: Box<dyn Iterator<Item = Result<Observation, SourceError>> + Send>,
    /// Seconds: frames up to this time have come before, and come again at once.
    pub past: f64,
    /// Frames that its journal could not keep.
    pub lost: Lost,
}

impl Stream {
    /// Frames that come now.
    pub fn new(
        opening: Opening,
        observations: impl Iterator<Item = Result<Observation, SourceError>> + Send + 'static,
    ) -> Self {
        Self { opening, observations: Box::new(observations), past: f64::NEG_INFINITY, lost: Lost::default() }
    }

    /// Waits for the last frame, and keeps all of them.
    ///
    /// # Errors
    /// The first thing that cannot be read.
    pub fn collect(self) -> Result<Sequence, SourceError> {
        let mut all = self.opening.into_sequence();
        for observation in Confirmed::new(self.observations) {
            all.push(observation?);
        }
        Ok(all)
    }
}

/// Frames that a thread of their own waits for, one ahead: who takes them can do something else while none comes.
pub struct Awaited {
    frames: Receiver<Result<Observation, SourceError>>,
    reader: Option<JoinHandle<()>>,
}

/// While no frame comes, it is asked this often whether to go on.
const NAP: Duration = Duration::from_millis(50);

impl Awaited {
    /// Starts the thread that reads the frames.
    pub fn new(observations: Box<dyn Iterator<Item = Result<Observation, SourceError>> + Send>) -> Self {
        let (sender, frames) = sync_channel(0);
        // it ends with the frames, or with the first that nobody takes
        let read = move || {
            for frame in observations {
                if sender.send(frame).is_err() {
                    break;
                }
            }
        };
        Self { frames, reader: Some(std::thread::spawn(read)) }
    }

    /// The next frame, `None` after the last; `Break` where `goes_on` says so before one comes.
    pub fn next(
        &mut self,
        mut goes_on: impl FnMut() -> ControlFlow<()>,
    ) -> ControlFlow<(), Option<Result<Observation, SourceError>>> {
        loop {
            match self.frames.recv_timeout(NAP) {
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

impl From<Arc<Sequence>> for Stream {
    fn from(sequence: Arc<Sequence>) -> Self {
        let opening = sequence.opening();
        Self::new(opening, Observations::of(sequence).map(Ok))
    }
}

impl fmt::Debug for Stream {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Stream").field("opening", &self.opening).finish_non_exhaustive()
    }
}
