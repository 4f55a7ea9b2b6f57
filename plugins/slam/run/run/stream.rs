//! Mapping of a stream while its frames arrive.
use super::RunError;
use super::location::StartSearch;
use super::state::StreamState;
use crate::output::report::{FoundStart, OnlineReport, VariantReport};
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::Warning;
use manifactor_mapping::settings::RunSettings;
use manifactor_online::{FrameError, FrameReport, Mapper};
use manifactor_recording::sequence::Observation;
use manifactor_recording::source::SourceError;
use manifactor_recording::stream::confirmed::OrderedFrames;
use manifactor_recording::stream::{FrameStream, PrefetchedFrames};
use manifactor_solve::{IterationRecord, Observer};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Maps a stream frame by frame, solves the whole graph at the end, and evaluates the result. `watch` gets each
/// event, and can end the stream or the solve. A separate thread waits for the next frame. If the stream ends before
/// its source, that thread ends with the next frame.
///
/// # Errors
/// If the smoother cannot be started, the final graph cannot be created, or the journal is that of another stream.
/// Rejected frames are events.
pub fn online(
    name: &str,
    stream: FrameStream,
    settings: &RunSettings,
    watch: &mut dyn StreamWatcher,
) -> Result<(Estimate, VariantReport), RunError> {
    let clock = Instant::now();
    let lost = stream.lost.clone();
    let mut taken = StreamState::new(stream.opening, settings);
    let (mut progress, mut search, mut found) = (OnlineReport::default(), StartSearch::new(settings), None);
    let mut awaited = PrefetchedFrames::new(Box::new(OrderedFrames::new(stream.observations)));
    loop {
        let observation = match awaited.next(|| watch.event(StreamEvent::Idle)) {
            ControlFlow::Continue(Some(observation)) => observation,
            ControlFlow::Continue(None) => break,
            ControlFlow::Break(()) => {
                progress.interrupted = true;
                break;
            }
        };
        // the map so far is that of another stream
        if let Err(error @ SourceError::OtherJournal { .. }) = observation {
            return Err(error.into());
        }
        if let Ok(observation) = &observation
            && observation.frame.timestamp > stream.recorded_frames
            && watch.event(StreamEvent::FrameArrived { timestamp: observation.frame.timestamp }).is_break()
        {
            progress.interrupted = true;
            break;
        }
        let began = Instant::now();
        let report = observation.as_ref().map_err(|error| FrameError::Source(error.to_string()));
        let mut report = report.and_then(|observation| taken.add_frame(observation));
        if let Ok(report) = &mut report
            && let Some(located) = search.search_after_frame(report, &taken.mapper)
        {
            let known = settings.with_start(located.start, located.noise.clone());
            taken = taken.remap(&known, report);
            progress.reset_map_counts();
            report.located = Some(located.clone());
            found = Some(FoundStart { frame: report.frame, located });
        }
        if report.as_ref().is_ok_and(|report| report.jump.is_some()) {
            progress.reset_map_counts();
        }
        let seconds = began.elapsed().as_secs_f64();
        progress.add_frame(report.as_ref(), seconds);
        let (report, observation) = (report.as_ref(), observation.as_ref().ok());
        let mapped = MappedFrame { report, observation, mapper: &mut taken.mapper, seconds };
        if watch.event(StreamEvent::Frame(mapped)).is_break() {
            progress.interrupted = true;
            break;
        }
    }
    // the reader thread may wait forever for a frame; dropping its handle lets it release the source as early
    // as possible
    drop(awaited);
    progress.add_frame_report(&taken.mapper.finish_association());
    progress.add_final_counts(&mut taken.mapper);
    // the stream has ended anyway
    _ = watch.event(StreamEvent::LastFrame { mapper: &mut taken.mapper });
    let observer = &mut SolveEvents(watch);
    let (mapper, sequence, history) = taken.into_parts();
    let association = history.report(&*settings.association, mapper.id_changes());
    let estimate = mapper.finish(Arc::new(sequence), observer)?.check_extrinsics(settings, observer)?;
    progress.compare_live_poses(&estimate, &settings.evaluation);
    let mut report = VariantReport::new(name, &estimate, settings, 0.0);
    report.association = association;
    if settings.evaluation.holdout.is_some() {
        report.warnings.push(Warning::NotHeldOut);
    }
    report.warnings.extend(lost.get().map(Warning::JournalIncomplete));
    report.set_prior_map_report(&estimate, settings, found);
    report.online = Some(progress);
    report.seconds = clock.elapsed().as_secs_f64();
    Ok((estimate, report))
}

/// An event of a stream.
#[derive(Debug)]
pub enum StreamEvent<'a> {
    /// Comes now and then while no frame arrives, and while a long step of the final solve runs.
    Idle,
    /// A frame was read that is not in the journal; it is mapped when the watcher returns.
    FrameArrived {
        /// Timestamp, in seconds.
        timestamp: f64,
    },
    /// A frame was mapped or rejected.
    Frame(MappedFrame<'a>),
    /// The last frame was mapped. The batch solve of the whole graph follows.
    LastFrame {
        /// The map.
        mapper: &'a mut Mapper,
    },
    /// A step of a batch solve.
    Iteration(&'a IterationRecord),
}

/// A frame after its update of the map.
#[derive(Debug)]
pub struct MappedFrame<'a> {
    /// The result, or the reason why the frame was rejected.
    pub report: Result<&'a FrameReport, &'a FrameError>,
    /// The frame, if it was readable.
    pub observation: Option<&'a Observation>,
    /// The map.
    pub mapper: &'a mut Mapper,
    /// Processing time, in seconds.
    pub seconds: f64,
}

/// Receives the events of a stream, in order. Closures are watchers.
pub trait StreamWatcher {
    /// `Break` ends the stream after this event; a frame that has only arrived is left out. While the graph is
    /// solved, it ends the solve with the best values so far.
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()>;
}

impl<F: FnMut(StreamEvent<'_>) -> ControlFlow<()>> StreamWatcher for F {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        self(event)
    }
}

/// Passes the steps of a solve to the watcher of its stream.
struct SolveEvents<'a>(&'a mut dyn StreamWatcher);

impl Observer for SolveEvents<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        self.0.event(StreamEvent::Iteration(record))
    }

    fn poll(&mut self) -> ControlFlow<()> {
        self.0.event(StreamEvent::Idle)
    }
}
