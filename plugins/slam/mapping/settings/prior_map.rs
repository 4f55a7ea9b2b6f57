use crate::gravity::MapFrame;
use manifactor_config::{Errors, Fault, Node, Placed};
use manifactor_geometry::Se3;
use manifactor_graph::checked::{NotNegative, Positive};
use manifactor_graph::loss::{Cauchy, Loss};
use manifactor_graph::{Direction, Noise};
use manifactor_recording::class::ClassAliases;
use manifactor_recording::prior_map::{PriorMap, PriorObject};
use manifactor_recording::sequence::Frame;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `[prior_map]`: map of an earlier run, which this run continues.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PriorMapSettings {
    /// The map file: `map.json` in the output folder of a variant.
    pub file: PathBuf,
    /// Pose of the first camera in the map frame. Its noise is `prior.noise`, by default 0.001 rad and 1 mm;
    /// set a larger noise for a start that was measured by hand. Default: unknown, found by relocalization
    /// from the detected objects.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Se3>,
    /// Factor on the standard deviations of the map's objects. Their covariances assume independent errors,
    /// but a detector's errors last for many frames.
    #[serde(default = "sigma_scale")]
    pub sigma_scale: Positive,
    /// Additional standard deviation of the map's objects: of the rotation in rad, of the centre as a
    /// fraction of the mean semi-axis, and of the logarithms of the semi-axes. An object that is not an
    /// ellipsoid gives a different ellipsoid from each side.
    #[serde(default = "shape_error")]
    pub shape_error: NotNegative,
    /// Robust loss of the factors that hold the map's objects. Default: Cauchy, because objects may have been
    /// moved.
    #[serde(default = "loss")]
    pub loss: Arc<dyn Loss>,
    /// The map as read, before `sigma_scale` and `shape_error` are applied.
    #[serde(skip)]
    #[schemars(skip)]
    pub map: Arc<PriorMap>,
    /// Path of the file that was read, and the position of its name in the document.
    #[serde(skip)]
    #[schemars(skip)]
    pub read_from: Option<Placed<PathBuf>>,
}

fn sigma_scale() -> Positive {
    Positive::literal(2.5)
}

fn shape_error() -> NotNegative {
    NotNegative::literal(0.3)
}

fn loss() -> Arc<dyn Loss> {
    Arc::new(Cauchy::default())
}

/// A map, and the pose of the first camera in it.
#[derive(Debug, Clone, Copy)]
pub struct MapAnchor<'a> {
    /// The map of an earlier run.
    pub map: &'a PriorMap,
    /// Pose of the first camera in it, map from camera.
    pub start: Se3,
}

impl PriorMapSettings {
    /// Reads the file, relative to `folder`. Its class names are unified by `aliases`.
    pub(super) fn read(
        &mut self,
        folder: &Path,
        aliases: &ClassAliases,
        settings: &Node,
        errors: &Errors,
    ) -> Option<()> {
        let place = settings.field("prior_map").and_then(|prior| prior.field("file"));
        let place = place.unwrap_or(settings).place.clone();
        let file = folder.join(&self.file);
        match PriorMap::read(&file) {
            Ok(map) => {
                self.map = Arc::new(map.with_classes(aliases));
                self.read_from = Some(Placed { place, value: file });
            }
            Err(diagnostics) => {
                errors.report(place, Fault::invalid("names no map that can be read"));
                errors.extend(diagnostics);
                return None;
            }
        }
        Some(())
    }

    /// Returns the map and the start in it, if the start is known.
    pub(super) fn anchor(&self) -> Option<MapAnchor<'_>> {
        Some(MapAnchor { map: &self.map, start: self.start? })
    }

    /// Returns an object of the map with its covariance enlarged by `sigma_scale` and `shape_error`. Maps are
    /// written with the covariance that was read, because each reader applies its own settings.
    pub(crate) fn inflated_object(&self, object: &PriorObject) -> PriorObject {
        object.inflated(*self.sigma_scale, *self.shape_error)
    }

    /// Returns the map with the enlarged covariances of all objects.
    pub fn inflated_map(&self) -> PriorMap {
        let objects = self.map.objects.iter().map(|object| Arc::new(self.inflated_object(object)));
        PriorMap::new(self.map.up, objects.collect())
    }
}

/// Largest angle between the up directions of a map and of a run in it, in radians: a start has an error of its own.
const MAX_TILT: f64 = 0.26;

impl MapAnchor<'_> {
    /// Returns the frame of the map, for an odometry that begins with the frame `first`. The up direction
    /// comes from the map, or from `located` if the map has none. If both have one, and they contradict each other, a
    /// warning is logged.
    pub fn map_frame(&self, first: &Frame, located: MapFrame) -> MapFrame {
        let map_from_odometry = self.start.compose(&first.world_from_camera.inverse());
        let moved = map_from_odometry.compose(&located.map_from_odometry.inverse());
        let found = located.up.and_then(|up| Direction::new(moved.rotation.act(&up)).ok());
        if let (Some(map), Some(found)) = (self.map.up, found)
            && map.angle(&*found) > MAX_TILT
        {
            tracing::warn!(
                "`prior_map.start` turns the up direction of the run by {:.0}° from that of the map: check `start`, `gravity` and \
                 `up` in the map",
                map.angle(&*found).to_degrees()
            );
        }
        MapFrame { map_from_odometry, up: self.map.up.or(found) }
    }
}

impl super::RunSettings {
    /// Returns the prior map and the start in it, if the start is known.
    pub fn anchor(&self) -> Option<MapAnchor<'_>> {
        self.prior_map.as_ref().and_then(PriorMapSettings::anchor)
    }

    /// Returns the settings of the prior map if its start is unknown and has to be found by relocalization.
    pub fn unknown_start(&self) -> Option<&PriorMapSettings> {
        self.prior_map.as_ref().filter(|prior| prior.start.is_none())
    }

    /// Returns these settings with a start that relocalization found, and its noise.
    pub fn with_start(&self, start: Se3, noise: Noise) -> Self {
        let mut settings = self.clone();
        if let Some(prior) = &mut settings.prior_map {
            prior.start = Some(start);
        }
        settings.prior.noise = noise;
        settings
    }
}
