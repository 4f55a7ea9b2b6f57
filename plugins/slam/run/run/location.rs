//! Search for the start pose in a prior map.
use super::RunError;
use crate::output::report::Found;
use manifactor_mapping::settings::Settings;
use manifactor_online::{FrameReport, Located, Mapper};
use manifactor_recording::prior_map::PriorMap;
use manifactor_recording::sequence::Sequence;
use manifactor_solve::Observer;

/// Repeated search for the pose of a stream in a prior map, until it is found.
#[derive(Debug)]
pub(super) struct Search {
    /// The prior map with trusted covariances.
    map: Option<PriorMap>,
    /// Frames since the last search.
    frames: usize,
}

/// Frames after which the search is repeated without a new object, because the existing objects are more
/// accurate by then.
const FRAMES: usize = 15;

impl Search {
    pub(super) fn new(settings: &Settings) -> Self {
        Self { map: settings.unknown_start().map(|prior| prior.trusted_map()), frames: 0 }
    }

    /// Searches for the pose after a frame. Returns it at most once.
    pub(super) fn look(&mut self, report: &FrameReport, mapper: &Mapper) -> Option<Located> {
        let map = self.map.as_ref()?;
        self.frames += 1;
        if report.born.is_empty() && report.merged.is_empty() && self.frames < FRAMES {
            return None;
        }
        self.frames = 0;
        let located = mapper.locate(map)?;
        self.map = None;
        Some(located)
    }
}

/// Searches for the start pose of a sequence in the prior map of the settings.
///
/// # Errors
/// If the smoother cannot be started.
pub(super) fn find(
    sequence: &Sequence,
    settings: &Settings,
    observer: &mut dyn Observer,
) -> Result<Option<Found>, RunError> {
    let mut search = Search::new(settings);
    if search.map.is_none() {
        return Ok(None);
    }
    let mut mapper = Mapper::new(sequence.opening(), settings);
    for observation in sequence.observations() {
        if observer.poll().is_break() {
            break;
        }
        // rejected frames are reported when the sequence is mapped
        let Ok(report) = mapper.take(&observation) else { continue };
        if let Some(located) = search.look(&report, &mapper) {
            return Ok(Some(Found { frame: report.frame, located }));
        }
    }
    Ok(None)
}
