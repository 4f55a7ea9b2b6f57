//! Online estimate of the up direction.
use manifactor_mapping::gravity::{GravityError, MapFrame};
use manifactor_mapping::settings::RunSettings;
use manifactor_recording::sequence::{Observation, Sequence, SequenceHeader};

/// Change of the up direction at which factors are created again: half a degree in radians.
const MIN_UP_CHANGE_RAD: f64 = 0.01;

/// The up direction from the first frames, until it is final.
#[derive(Debug, Clone)]
pub(super) struct UpEstimate {
    /// Relevant data of the frames so far.
    seen: Sequence,
    found: Option<MapFrame>,
    is_final: bool,
}

impl UpEstimate {
    pub(super) fn new(opening: SequenceHeader) -> Self {
        Self { seen: opening.into_sequence(), found: None, is_final: false }
    }

    /// Returns the frame of the map; `None` before the first frame.
    pub(super) fn map_frame(&self) -> Option<MapFrame> {
        self.found
    }

    /// Returns a copy to restore if the next frame is rejected; `None` once the direction is final.
    pub(super) fn backup_unless_final(&self) -> Option<Self> {
        (!self.is_final).then(|| self.clone())
    }

    /// Adds the next frame. Returns whether the up direction changed, so that the factors that use it
    /// have to be created again.
    pub(super) fn add_frame(
        &mut self,
        observation: &Observation,
        settings: &RunSettings,
    ) -> Result<bool, GravityError> {
        if self.is_final {
            return Ok(false);
        }
        let frames = self.seen.frames.len();
        self.seen.frames.push(observation.frame.clone());
        self.seen.accelerometer.extend(observation.accelerometer.iter().cloned());
        let gravity = &settings.gravity;
        let first = self.seen.frames.first().unwrap_or(&observation.frame);
        let anchored = |located| settings.anchor().map_or(located, |anchor| anchor.map_frame(first, located));
        let found = match (gravity.locate(&self.seen).map(anchored), self.found) {
            (Ok(found), _) => found,
            // readings may cancel out for a while; then the earlier result stays
            (Err(_), Some(before)) => before,
            (Err(error), None) => {
                self.seen.frames.truncate(frames);
                return Err(error);
            }
        };
        let first = self.seen.frames.first().map_or(0.0, |frame| frame.timestamp);
        self.is_final = observation.frame.timestamp - first >= gravity.final_after_s();
        if self.is_final {
            self.seen = SequenceHeader::new(self.seen.cameras.clone()).into_sequence();
        }
        let Some(before) = self.found else {
            self.found = Some(found);
            return Ok(false);
        };
        let angle = match (before.up, found.up) {
            (Some(a), Some(b)) => (*a - *b).norm(),
            (None, None) => 0.0,
            _ => f64::INFINITY,
        };
        // the last update is used even if the change is small
        if angle < if self.is_final { f64::EPSILON } else { MIN_UP_CHANGE_RAD } {
            return Ok(false);
        }
        // poses stay unchanged: only the first frame defines the position of the map
        self.found = Some(MapFrame { up: found.up, ..before });
        Ok(true)
    }
}
