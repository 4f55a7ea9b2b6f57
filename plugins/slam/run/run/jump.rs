//! Relocalization of a stream in its own map after a jump of its odometry.
use super::location::StartSearch;
use manifactor_geometry::Se3;
use manifactor_mapping::settings::RunSettings;
use manifactor_online::{Mapper, Relocalization};
use manifactor_recording::sequence::jumps::OdometryJump;
use manifactor_recording::sequence::{Observation, Sequence, SequenceHeader};
use std::sync::Arc;

/// Time after a jump at which the search ends, in seconds.
const MAX_SEARCH_S: f64 = 30.0;

/// Search for the pose of the camera after a jump, in the map from the frames before it.
#[derive(Debug)]
pub(super) struct JumpSearch {
    pub jump: OdometryJump,
    /// Index of the first frame after the jump.
    pub first: usize,
    /// Pose of the frame before the jump, in the frame of the map.
    pub before: Se3,
    search: StartSearch,
    /// Map of the frames since the jump alone.
    scout: Mapper,
}

/// Returns a mapper that maps many objects soon.
fn scout(header: SequenceHeader, mapper: &Mapper) -> Mapper {
    let settings = RunSettings { prior_map: None, ..mapper.settings().of_completion() };
    Mapper::new(header, &settings)
}

impl JumpSearch {
    /// Begins a search in the map of the frames before the jump. `mapper` has the settings. `None` if this map has no
    /// objects.
    pub(super) fn new(
        (jump, first): (OdometryJump, usize),
        sequence: &Sequence,
        mapper: &Mapper,
    ) -> Option<Self> {
        let mut known = scout(sequence.header(), mapper);
        for observation in sequence.observations().take(first) {
            if let Err(error) = known.add_frame(&observation) {
                tracing::debug!("{error}");
            }
        }
        let (map, before) = (known.prior_map(), known.pose_of(first.checked_sub(1)?)?);
        let (at, objects) = (jump.timestamp, map.objects.len());
        tracing::info!(at, objects, "the odometry jumps: looks for the pose in the map");
        let search = StartSearch::in_map(Arc::new(map));
        (objects > 0).then(|| Self { jump, first, before, search, scout: scout(sequence.header(), mapper) })
    }

    /// Adds a frame, and returns the pose of the first frame after the jump once it is found.
    pub(super) fn add_frame(&mut self, observation: &Observation) -> Option<Relocalization> {
        let report =
            self.scout.add_frame(observation).inspect_err(|error| tracing::debug!("{error}")).ok()?;
        let found = self.search.search_after_frame(&report, &self.scout)?;
        let (at, matches) = (observation.frame.timestamp, found.matches.len());
        tracing::info!(at, matches, found.lead, found.overlap, found.seen, "found the pose after the jump");
        Some(found)
    }

    /// Returns whether the search has taken too long.
    pub(super) fn is_over(&self, timestamp: f64) -> bool {
        timestamp - self.jump.timestamp > MAX_SEARCH_S
    }
}
