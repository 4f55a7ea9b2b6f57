//! Data association in a batch: frame by frame, then a second pass with all frames known.
use super::RunError;
use super::state::StreamState;
use crate::output::report::AssociationReport;
use manifactor_mapping::settings::RunSettings;
use manifactor_recording::sequence::{Observation, Sequence};
use manifactor_solve::Observer;
use std::ops::Range;
use std::sync::Arc;

/// Result of the data association.
pub(super) struct AssociatedSequence {
    /// The sequence with the assigned objects.
    pub sequence: Arc<Sequence>,
    /// Report; `None` if the source provides the objects.
    pub report: Option<AssociationReport>,
}

/// Assigns the boxes of a sequence to objects with the `association` of the settings: frame by frame as in a
/// stream, then once more with the final estimate. Boxes of frames that the mapper rejects, and of frames
/// after an interruption by `observer`, have no object.
///
/// # Errors
/// If the smoother cannot be started.
pub(super) fn associate_sequence(
    sequence: Arc<Sequence>,
    settings: &RunSettings,
    observer: &mut dyn Observer,
) -> Result<AssociatedSequence, RunError> {
    if settings.association.uses_source_ids() {
        return Ok(AssociatedSequence { sequence, report: None });
    }
    let mut state = StreamState::new(sequence.header(), settings);
    let mut named = Sequence::clone(&sequence);
    let mut taken = vec![];
    let (mut rejections, mut first_rejection) = (0, None);
    let mut interrupted = false;
    for observation in sequence.observations() {
        interrupted |= observer.poll().is_break();
        if interrupted {
            taken.push(None);
            continue;
        }
        match state.add_frame(&observation) {
            Ok(report) => {
                report.refused.iter().for_each(|refused| tracing::warn!("{refused}"));
                taken.push(Some(report.frame));
            }
            Err(error) => {
                rejections += 1;
                first_rejection.get_or_insert(error);
                taken.push(None);
            }
        }
    }
    match first_rejection {
        Some(error) if taken.iter().all(Option::is_none) && !interrupted => {
            return Err(RunError::NoFrameMapped(error));
        }
        Some(error) => {
            tracing::warn!("association rejects {rejections} of {} frames, the first: {error}", taken.len());
        }
        None => {}
    }
    let StreamState { mut mapper, sequence: mapped, association, .. } = state;
    // the poses after a jump of the odometry are corrected
    let accepted = named.frames.iter_mut().zip(&taken).filter(|(_, frame)| frame.is_some());
    for ((frame, _), mapped) in accepted.zip(&mapped.frames) {
        frame.world_from_camera = mapped.world_from_camera;
    }
    named.corrected_jumps = mapped.corrected_jumps;
    let mut history = association.with_skipped(
        with_boxes(&sequence)
            .zip(&taken)
            .map(|((observation, _), frame)| (observation.detections, frame.is_some())),
    );
    mapper.finish_association().refused.iter().for_each(|refused| tracing::warn!("{refused}"));
    let corrected = Arc::new(named.clone());
    for ((observation, boxes), frame) in with_boxes(&corrected).zip(&taken) {
        if let Some(frame) = *frame {
            history.replace_objects(boxes, mapper.id_changes(), |names| {
                mapper.reassociate(frame, &observation, names)
            });
        }
    }
    for (detection, name) in named.detections.iter_mut().zip(history.current_objects(mapper.id_changes())) {
        detection.object = name;
    }
    history.match_true_objects(&mut named, mapper.id_changes());
    let report = history.report(&*settings.association, mapper.id_changes());
    Ok(AssociatedSequence { sequence: Arc::new(named), report })
}

/// Returns the frames of a sequence, each with the index range of its boxes.
fn with_boxes(sequence: &Sequence) -> impl Iterator<Item = (Observation, Range<usize>)> {
    let mut first = 0;
    sequence.observations().map(move |observation| {
        let boxes = first..first + observation.detections.len();
        first = boxes.end;
        (observation, boxes)
    })
}
