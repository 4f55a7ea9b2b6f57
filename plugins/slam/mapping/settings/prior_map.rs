use crate::gravity::MapFrame;
use manifactor_config::{Errors, Fault, Node, Placed};
use manifactor_geometry::Se3;
use manifactor_graph::checked::{NotNegative, Positive};
use manifactor_graph::loss::{Cauchy, Loss};
use manifactor_graph::{Direction, Noise};
use manifactor_recording::class::Aliases;
use manifactor_recording::prior_map::{PriorMap, PriorObject};
use manifactor_recording::sequence::Frame;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// `[prior_map]`: a map that an earlier run has left, which this one begins with.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PriorMapSettings {
    /// Its file: `map.json` in the folder of a variant.
    pub file: PathBuf,
    /// The pose of the first camera in the map's frame. `[prior]` says how well it is known: by default to 0.001 rad and 1 mm, so that a start
    /// that was measured by hand wants a `prior.noise` of its own. Default: it is not known, and found by the objects that are seen.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub start: Option<Se3>,
    /// How many times as far off its objects may be as their covariances say: a detector's errors last for many frames.
    #[serde(default = "sigma_scale")]
    pub sigma_scale: Positive,
    /// How far off they may be besides, in rad and as a part of their size: what is no ellipsoid is another one from each side.
    #[serde(default = "shape_error")]
    pub shape_error: NotNegative,
    /// How much of a large error of them counts. Default: Cauchy's, as things are moved.
    #[serde(default = "loss")]
    pub loss: Arc<dyn Loss>,
    /// What the file says, before it is asked how far that is trusted.
    #[serde(skip)]
    #[schemars(skip)]
    pub map: Arc<PriorMap>,
    /// Where the file was found, and where the document names it.
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

/// A map, and where a run begins in it.
#[derive(Debug, Clone, Copy)]
pub struct Anchor<'a> {
    /// The map of an earlier run.
    pub map: &'a PriorMap,
    /// Pose of the first camera in it, map from camera.
    pub start: Se3,
}

impl PriorMapSettings {
    /// Reads the file, from `folder`; classes in it are called as `aliases` call them.
    pub(super) fn read(
        &mut self,
        folder: &Path,
        aliases: &Aliases,
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

    /// The map, where it is known where the run begins in it.
    pub(super) fn anchor(&self) -> Option<Anchor<'_>> {
        Some(Anchor { map: &self.map, start: self.start? })
    }

    /// An object of the map, known as well as it is trusted. What is written again is the object as it was read: who reads that has a trust
    /// of its own.
    pub fn trusted(&self, object: &PriorObject) -> PriorObject {
        object.trusted(*self.sigma_scale, *self.shape_error)
    }

    /// The map with its objects as they are trusted.
    pub fn trusted_map(&self) -> PriorMap {
        let objects = self.map.objects.iter().map(|object| Arc::new(self.trusted(object)));
        PriorMap::new(self.map.up, objects.collect())
    }
}

impl Anchor<'_> {
    /// The frame of the map, for an odometry that begins with this frame and knows up as `located` says.
    pub fn frame(&self, first: &Frame, located: MapFrame) -> MapFrame {
        let map_from_odometry = self.start.compose(&first.world_from_camera.inverse());
        let moved = map_from_odometry.compose(&located.map_from_odometry.inverse());
        let up =
            self.map.up.or_else(|| located.up.and_then(|up| Direction::new(moved.rotation.act(&up)).ok()));
        MapFrame { map_from_odometry, up }
    }
}

impl super::Settings {
    /// The map that was made before, where it is known where the run begins in it.
    pub fn anchor(&self) -> Option<Anchor<'_>> {
        self.prior_map.as_ref().and_then(PriorMapSettings::anchor)
    }

    /// The map that was made before, where it is to be found out where the run begins in it.
    pub fn unknown_start(&self) -> Option<&PriorMapSettings> {
        self.prior_map.as_ref().filter(|prior| prior.start.is_none())
    }

    /// The same with a start that was found.
    pub fn beginning_at(&self, start: Se3, noise: Noise) -> Self {
        let mut settings = self.clone();
        if let Some(prior) = &mut settings.prior_map {
            prior.start = Some(start);
        }
        settings.prior.noise = noise;
        settings
    }
}
