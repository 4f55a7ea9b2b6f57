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
use manifactor_recording::stream::confirmed::OrderedFrames;
use manifactor_recording::stream::{FrameStream, PrefetchedFrames};
use manifactor_solve::Observer;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

/// Maps a stream frame by frame, solves the whole graph at the end, and evaluates the result. Calls `watch`
/// for each frame with the map and the processing time in seconds; `watch` can end the stream. A separate
/// thread waits for the next frame. If the stream ends before its source, that thread ends with the next
/// frame.
///
/// # Errors
/// If the smoother cannot be started, or the final graph cannot be created. Rejected frames are reported to
/// `watch`.
pub fn online(
    name: &str,
    stream: FrameStream,
    settings: &RunSettings,
    watch: &mut dyn StreamWatcher,
    observer: &mut dyn Observer,
) -> Result<(Estimate, VariantReport), RunError> {
    let clock = Instant::now();
    let lost = stream.lost.clone();
    let mut taken = StreamState::new(stream.opening, settings);
    let (mut progress, mut search, mut found) = (OnlineReport::default(), StartSearch::new(settings), None);
    let mut awaited = PrefetchedFrames::new(Box::new(OrderedFrames::new(stream.observations)));
    loop {
        let observation = match awaited.next(|| watch.on_idle()) {
            ControlFlow::Continue(Some(observation)) => observation,
            ControlFlow::Continue(None) => break,
            ControlFlow::Break(()) => {
                progress.interrupted = true;
                break;
            }
        };
        if let Ok(observation) = &observation
            && observation.frame.timestamp > stream.recorded_frames
            && watch.before_frame(observation.frame.timestamp).is_break()
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
        let goes_on = watch.on_frame(report.as_ref(), observation.as_ref().ok(), &mut taken.mapper, seconds);
        if goes_on.is_break() {
            progress.interrupted = true;
            break;
        }
    }
    // the reader thread may wait forever for a frame; dropping its handle lets it release the source as early
    // as possible
    drop(awaited);
    progress.add_frame_report(&taken.mapper.finish_association());
    progress.add_final_counts(&mut taken.mapper);
    watch.on_end(&mut taken.mapper);
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

/// Observer of a stream of frames.
pub trait StreamWatcher {
    /// Called now and then while no frame arrives. `Break` ends the stream.
    fn on_idle(&mut self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called before each frame with its timestamp in seconds. Returns when the frame is due. `Break` ends
    /// the stream before it.
    fn before_frame(&mut self, _timestamp: f64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Called after each frame with the result, the frame if it was readable, the map, and the processing
    /// time in seconds.
    fn on_frame(
        &mut self,
        report: Result<&FrameReport, &FrameError>,
        observation: Option<&Observation>,
        mapper: &mut Mapper,
        seconds: f64,
    ) -> ControlFlow<()>;

    /// Called after the last frame, before the batch solve of the whole graph.
    fn on_end(&mut self, _mapper: &mut Mapper) {}
}
