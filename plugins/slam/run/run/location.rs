//! Search for the start pose in a prior map.
use super::RunError;
use super::state::StreamState;
use crate::output::report::FoundStart;
use manifactor_mapping::settings::RunSettings;
use manifactor_online::{FrameReport, Mapper, Relocalization};
use manifactor_recording::prior_map::PriorMap;
use manifactor_recording::sequence::Sequence;
use manifactor_solve::Observer;
use std::sync::Arc;

/// Repeated search for the pose of a stream in a prior map, until it is found.
#[derive(Debug)]
pub(super) struct StartSearch {
    /// The prior map.
    map: Option<Arc<PriorMap>>,
    /// Frames since the last search.
    frames: usize,
}

/// Frames after which the search is repeated without a new object, because the existing objects are more
/// accurate by then.
const RETRY_AFTER_FRAMES: usize = 15;

impl StartSearch {
    pub(super) fn new(settings: &RunSettings) -> Self {
        Self { map: settings.unknown_start().map(|prior| Arc::clone(&prior.map)), frames: 0 }
    }

    /// Creates a search in a map.
    pub(super) fn in_map(map: Arc<PriorMap>) -> Self {
        Self { map: Some(map), frames: 0 }
    }

    /// Searches for the pose after a frame. Returns it at most once.
    pub(super) fn search_after_frame(
        &mut self,
        report: &FrameReport,
        mapper: &Mapper,
    ) -> Option<Relocalization> {
        let map = self.map.as_ref()?;
        self.frames += 1;
        if report.initialized.is_empty() && report.merged.is_empty() && self.frames < RETRY_AFTER_FRAMES {
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
pub(super) fn find_start(
    sequence: &Sequence,
    settings: &RunSettings,
    observer: &mut dyn Observer,
) -> Result<Option<FoundStart>, RunError> {
    let mut search = StartSearch::new(settings);
    if search.map.is_none() {
        return Ok(None);
    }
    let mut state = StreamState::new(sequence.header(), settings);
    for observation in sequence.observations() {
        if observer.poll().is_break() {
            break;
        }
        // rejected frames are reported when the sequence is mapped
        let Ok(report) = state.add_frame(&observation) else { continue };
        if let Some(located) = search.search_after_frame(&report, &state.mapper) {
            return Ok(Some(FoundStart { frame: report.frame, located }));
        }
    }
    Ok(None)
}
