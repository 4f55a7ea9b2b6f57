//! Estimation of the noise of a stream from its first seconds, beside the mapping of later frames.
use manifactor_mapping::estimate::variance::StreamNoise;
use manifactor_mapping::settings::RunSettings;
use manifactor_online::{FrameReport, Mapper};
use manifactor_recording::sequence::Sequence;
use manifactor_solve::{IterationRecord, Observer};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;

/// A noise that is estimated once.
///
/// The estimate runs in a thread, and takes effect at a frame that does not depend on the speed of the
/// machine: a stream waits for it if it takes longer.
#[derive(Debug)]
pub(super) struct NoiseEstimation {
    settings: RunSettings,
    /// Time of the data, and time until the estimate takes effect, in seconds.
    prefix_s: f64,
    stage: Stage,
}

#[derive(Debug)]
enum Stage {
    /// The next attempt is made with this number of mapped objects.
    Waiting {
        min_objects: usize,
    },
    Running {
        due: f64,
        objects: usize,
        thread: Running,
    },
    Done,
}

/// A thread that ends early when its handle is dropped.
#[derive(Debug)]
struct Running {
    thread: Option<JoinHandle<Result<Option<StreamNoise>, String>>>,
    cancelled: Arc<AtomicBool>,
}

struct Cancellation(Arc<AtomicBool>);

impl Observer for Cancellation {
    fn iteration(&mut self, _record: &IterationRecord) -> ControlFlow<()> {
        self.poll()
    }

    fn poll(&mut self) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

impl NoiseEstimation {
    /// Returns `None` if the noise is given.
    pub(super) fn new(settings: &RunSettings) -> Option<Self> {
        let prefix_s = *settings.variance_components.as_ref()?.prefix_s;
        Some(Self { settings: settings.clone(), prefix_s, stage: Stage::Waiting { min_objects: 1 } })
    }

    /// Starts the estimate if it is due, or applies it to the map if its time has come. `seconds` is the time
    /// since the first frame; `frames` returns the frames so far with the objects of their boxes.
    pub(super) fn after_frame(
        &mut self,
        seconds: f64,
        mapper: &mut Mapper,
        report: &mut FrameReport,
        frames: impl FnOnce(&Mapper) -> Sequence,
    ) {
        self.stage = match std::mem::replace(&mut self.stage, Stage::Done) {
            Stage::Waiting { min_objects } => {
                let objects = mapper.mapped_objects();
                if seconds < self.prefix_s || objects < min_objects {
                    Stage::Waiting { min_objects }
                } else {
                    let thread = Running::start(frames(mapper), self.settings.clone());
                    Stage::Running { due: seconds + self.prefix_s, objects, thread }
                }
            }
            Stage::Running { due, objects, thread } if seconds < due => {
                Stage::Running { due, objects, thread }
            }
            Stage::Running { objects, thread, .. } => match thread.join() {
                Ok(Some(noise)) => {
                    match mapper.set_noise(&noise) {
                        Ok(update) => {
                            report.updates.push(update);
                            report.pose = mapper.pose_of(report.frame).unwrap_or(report.pose);
                        }
                        Err(error) => {
                            report.refused.push(format!("the noise of earlier frames stays: {error}"));
                        }
                    }
                    report.noise = Some(noise);
                    Stage::Done
                }
                Ok(None) => Stage::Waiting { min_objects: objects + 1 },
                Err(why) => {
                    report.refused.push(format!("the noise of the stream stays as it is: {why}"));
                    Stage::Done
                }
            },
            Stage::Done => Stage::Done,
        }
    }
}

impl Running {
    fn start(frames: Sequence, settings: RunSettings) -> Self {
        let cancelled = Arc::new(AtomicBool::new(false));
        let mut observer = Cancellation(cancelled.clone());
        // the thread of the stream waits for the estimate, so its pool cannot compute it
        let pool = rayon::ThreadPoolBuilder::new().num_threads(rayon::current_num_threads()).build();
        let thread = std::thread::spawn(move || {
            let pool = pool.map_err(|error| error.to_string())?;
            let estimate = || StreamNoise::estimate(frames, &settings, &mut observer);
            pool.install(estimate).map_err(|error| error.to_string())
        });
        Self { thread: Some(thread), cancelled }
    }

    fn join(mut self) -> Result<Option<StreamNoise>, String> {
        match self.thread.take().map(JoinHandle::join) {
            Some(Ok(found)) => found,
            Some(Err(_)) | None => Err("its estimate panicked".to_owned()),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}
