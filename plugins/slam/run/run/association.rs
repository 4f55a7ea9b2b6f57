//! Boxes are put to objects, frame by frame and once more when all are there.
use super::RunError;
use crate::output::report::{AssociationReport, Naming};
use manifactor_mapping::settings::Settings;
use manifactor_online::Mapper;
use manifactor_recording::sequence::{Observation, Sequence};
use manifactor_solve::Observer;
use std::ops::Range;
use std::sync::Arc;

/// Boxes put to objects.
pub(super) struct Associated {
    /// The sequence with these names.
    pub sequence: Arc<Sequence>,
    /// How well it went; `None` where the names are those of the source.
    pub report: Option<AssociationReport>,
}

/// The sequence with its boxes put to objects by the settings' `association`: frame by frame, as they would have come, then once more
/// by what is known in the end. Frames that cannot be mapped so, and those after an interruption by `observer`, have boxes of no
/// object.
///
/// # Errors
/// If the session cannot begin.
pub(super) fn associated(
    sequence: Arc<Sequence>,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<Associated, RunError> {
    if settings.association.uses_names() {
        return Ok(Associated { sequence, report: None });
    }
    let mut mapper = Mapper::new(sequence.opening(), settings);
    let (mut named, mut naming) = (Sequence::clone(&sequence), Naming::default());
    let mut taken = vec![];
    let mut interrupted = false;
    for observation in sequence.observations() {
        interrupted |= observer.poll().is_break();
        if interrupted {
            naming.note(&observation.detections, None);
            taken.push(None);
            continue;
        }
        match mapper.take(&observation) {
            Ok(report) => {
                naming.note(&observation.detections, Some(&report));
                report.refused.iter().for_each(|refused| tracing::warn!("{refused}"));
                taken.push(Some(report.frame));
            }
            Err(error) => {
                tracing::warn!("{error}");
                naming.note(&observation.detections, None);
                taken.push(None);
            }
        }
    }
    mapper.settle().refused.iter().for_each(|refused| tracing::warn!("{refused}"));
    for ((observation, boxes), frame) in with_boxes(&sequence).zip(&taken) {
        if let Some(frame) = *frame {
            naming.replace(boxes, mapper.names(), |names| mapper.reconsider(frame, &observation, names));
        }
    }
    for (detection, name) in named.detections.iter_mut().zip(naming.now(mapper.names())) {
        detection.object = name;
    }
    let report = naming.report(&*settings.association, mapper.names());
    Ok(Associated { sequence: Arc::new(named), report })
}

/// The frames of a sequence, each with the places of its boxes among all.
fn with_boxes(sequence: &Sequence) -> impl Iterator<Item = (Observation, Range<usize>)> {
    let mut first = 0;
    sequence.observations().map(move |observation| {
        let boxes = first..first + observation.detections.len();
        first = boxes.end;
        (observation, boxes)
    })
}
