//! Where a run begins in a map that was made before.
use super::RunError;
use crate::output::report::Found;
use manifactor_mapping::settings::Settings;
use manifactor_online::{FrameReport, Located, Mapper};
use manifactor_recording::prior_map::PriorMap;
use manifactor_recording::sequence::Sequence;
use manifactor_solve::Observer;

/// A search for the place of a stream in a map, as long as it is not known.
#[derive(Debug)]
pub(super) struct Search {
    /// With its objects as they are trusted.
    map: Option<PriorMap>,
    /// Frames since it was last looked for.
    frames: usize,
}

/// It is looked for when an object is new, and after so many frames, in which those that are there have become better known.
const FRAMES: usize = 15;

impl Search {
    pub(super) fn new(settings: &Settings) -> Self {
        Self { map: settings.unknown_start().map(|prior| prior.trusted_map()), frames: 0 }
    }

    /// Looks for the place after a frame; it is found once at most.
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

/// Where a sequence begins in the settings' prior map, if that is to be found, and is.
///
/// # Errors
/// If a session cannot begin.
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
        // what cannot be taken is told when all is mapped
        let Ok(report) = mapper.take(&observation) else { continue };
        if let Some(located) = search.look(&report, &mapper) {
            return Ok(Some(Found { frame: report.frame, located }));
        }
    }
    Ok(None)
}
