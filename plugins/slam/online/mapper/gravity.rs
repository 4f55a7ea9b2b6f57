//! Up, as far as it is known yet.
use manifactor_mapping::gravity::{GravityError, MapFrame};
use manifactor_mapping::settings::Settings;
use manifactor_recording::sequence::{Observation, Opening, Sequence};

/// Up moves by this much, in radians, before factors are made again: half a degree.
const MOVED: f64 = 0.01;

/// What the way up is found from: the first frames, until it is settled.
#[derive(Debug, Clone)]
pub(super) struct Up {
    /// What came until now, as far as it is looked at.
    seen: Sequence,
    found: Option<MapFrame>,
    is_settled: bool,
}

impl Up {
    pub(super) fn new(opening: Opening) -> Self {
        Self { seen: opening.into_sequence(), found: None, is_settled: false }
    }

    /// The frame of the map; `None` before the first frame.
    pub(super) fn frame(&self) -> Option<MapFrame> {
        self.found
    }

    /// As it is now, to go back if the next frame is refused; `None` once it is settled.
    pub(super) fn unsettled(&self) -> Option<Self> {
        (!self.is_settled).then(|| self.clone())
    }

    /// Looks at the next frame; whether up is another now, so that factors that know it have to be made again.
    pub(super) fn look(
        &mut self,
        observation: &Observation,
        settings: &Settings,
    ) -> Result<bool, GravityError> {
        if self.is_settled {
            return Ok(false);
        }
        let frames = self.seen.frames.len();
        self.seen.frames.push(observation.frame.clone());
        self.seen.accelerometer.extend(observation.accelerometer.iter().cloned());
        let gravity = &settings.gravity;
        let first = self.seen.frames.first().unwrap_or(&observation.frame);
        let anchored = |located| settings.anchor().map_or(located, |anchor| anchor.frame(first, located));
        let found = match (gravity.locate(&self.seen).map(anchored), self.found) {
            (Ok(found), _) => found,
            // readings may cancel out for a while; what was found before is as good as it gets
            (Err(_), Some(before)) => before,
            (Err(error), None) => {
                self.seen.frames.truncate(frames);
                return Err(error);
            }
        };
        let first = self.seen.frames.first().map_or(0.0, |frame| frame.timestamp);
        self.is_settled = observation.frame.timestamp - first >= gravity.settled_after();
        if self.is_settled {
            self.seen = Opening::new(self.seen.camera).into_sequence();
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
        // the last look counts, however little it changes
        if angle < if self.is_settled { f64::EPSILON } else { MOVED } {
            return Ok(false);
        }
        // poses stay where they are: only the first frame says where the map lies
        self.found = Some(MapFrame { up: found.up, ..before });
        Ok(true)
    }
}
