//! Relocalization of a stream in its own map after a jump of its odometry.
use super::location::StartSearch;
use manifactor_geometry::Se3;
use manifactor_mapping::settings::RunSettings;
use manifactor_online::{Mapper, Relocalization};
use manifactor_recording::sequence::jumps::OdometryJump;
use manifactor_recording::sequence::{Observation, SequenceHeader};
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

impl JumpSearch {
    /// Begins a search in the map of `mapper`, with the frames since the jump. `None` if the map has no objects.
    pub(super) fn new(
        (jump, first): (OdometryJump, usize),
        mapper: &Mapper,
        header: SequenceHeader,
        settings: &RunSettings,
    ) -> Option<Self> {
        let map = mapper.prior_map();
        if map.objects.is_empty() {
            return None;
        }
        let before = mapper.pose_of(first.checked_sub(1)?)?;
        let scout = Mapper::new(header, &RunSettings { prior_map: None, ..settings.clone() });
        Some(Self { jump, first, before, search: StartSearch::in_map(Arc::new(map)), scout })
    }

    /// Begins again after a second jump, in the same map.
    pub(super) fn restart(
        self,
        (jump, first): (OdometryJump, usize),
        mapper: &Mapper,
        header: SequenceHeader,
        settings: &RunSettings,
    ) -> Option<Self> {
        let before = mapper.pose_of(first.checked_sub(1)?)?;
        let scout = Mapper::new(header, &RunSettings { prior_map: None, ..settings.clone() });
        Some(Self { jump, first, before, scout, ..self })
    }

    /// Adds a frame, and returns the pose of the first frame after the jump once it is found.
    pub(super) fn add_frame(&mut self, observation: &Observation) -> Option<Relocalization> {
        let report = self.scout.add_frame(observation).ok()?;
        self.search.search_after_frame(&report, &self.scout)
    }

    /// Returns whether the search has taken too long.
    pub(super) fn is_over(&self, timestamp: f64) -> bool {
        timestamp - self.jump.timestamp > MAX_SEARCH_S
    }
}
