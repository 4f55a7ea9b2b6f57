//! Boxes are put to objects, frame by frame and once more when all are there.
use super::RunError;
use crate::input::sequence::Sequence;
use crate::online::Mapper;
use crate::output::report::{AssociationReport, Naming};
use crate::settings::Settings;
use manifactor_solve::Observer;
use std::sync::Arc;

/// The sequence with its boxes put to objects by the settings' `association`: frame by frame, as they would have come, then once more
/// by what is known in the end. Frames that cannot be mapped so, and those after an interruption by `observer`, have boxes of no
/// object.
///
/// # Errors
/// Where the session cannot begin.
pub(super) fn associated(
    sequence: Arc<Sequence>,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<(Arc<Sequence>, Option<AssociationReport>), RunError> {
    if settings.association.uses_names() {
        return Ok((sequence, None));
    }
    let mut mapper = Mapper::new(sequence.opening(), settings)?;
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
    let mut first = 0;
    for (observation, frame) in sequence.observations().zip(taken) {
        let boxes = first..first + observation.detections.len();
        first = boxes.end;
        if let Some(frame) = frame {
            naming.replace(boxes, mapper.names(), |names| mapper.reconsider(frame, &observation, names));
        }
    }
    for (detection, name) in named.detections.iter_mut().zip(naming.now(mapper.names())) {
        detection.object = name;
    }
    Ok((Arc::new(named), naming.report(&*settings.association, mapper.names())))
}
