//! Boxes of an object that say the most about its ellipsoid.
use super::super::Map;
use super::fit::SIDES;
use manifactor_geometry::Se3;
use manifactor_quadric::BoundingBox;
use manifactor_recording::measurement::Quantities;
use nalgebra::Vector3;

/// A box, and from where it was seen.
#[derive(Debug, Clone)]
pub(super) struct Sighting {
    pub frame: usize,
    pub world_from_camera: Se3,
    pub bounding_box: BoundingBox,
    /// What is measured besides the box.
    pub quantities: Quantities,
}

impl Sighting {
    /// How many numbers it measures.
    pub(super) fn rows(&self) -> usize {
        SIDES + self.quantities.rows()
    }
}

/// A few sightings from all sides, the last among them.
#[derive(Debug, Clone, Default)]
pub(super) struct Sightings(Vec<Sighting>);

/// How many are kept.
const KEPT: usize = 24;
/// A sighting says something new from another direction, in radians,
const ANGLE: f64 = 0.03;
/// from another distance, as a part of it,
const DISTANCE: f64 = 0.1;
/// or so many frames later, when the detector errs in another way.
const FRAMES: usize = 30;

impl Sightings {
    /// These, in order of frames.
    pub(super) fn of(all: Vec<Sighting>) -> Self {
        Self(all)
    }

    pub(super) fn all(&self) -> &[Sighting] {
        &self.0
    }

    /// Adds one of an object that is there. The one before stays if it says something new beside all others.
    pub(super) fn add(&mut self, sighting: Sighting, centre: &Vector3<f64>) {
        if let Some((last, rest)) = self.0.split_last() {
            let from = |s: &Sighting| s.world_from_camera.translation - centre;
            let is_new = rest.iter().all(|other| {
                let (a, b) = (from(last), from(other));
                a.angle(&b) > ANGLE
                    || (a.norm() / b.norm()).ln().abs() > DISTANCE
                    || other.frame + FRAMES < last.frame
            });
            if !is_new {
                self.0.pop();
            }
        }
        self.0.push(sighting);
        self.thin(centre);
    }

    /// Leaves out that of a frame.
    pub(super) fn remove(&mut self, frame: usize) {
        self.0.retain(|sighting| sighting.frame != frame);
    }

    /// Those of both.
    pub(super) fn and(&self, others: &Self) -> Self {
        let mut all: Vec<Sighting> = self.0.iter().chain(&others.0).cloned().collect();
        all.sort_by_key(|sighting| sighting.frame);
        Self(all)
    }

    /// Leaves out those that are seen in nearly the same direction as one before or after.
    pub(super) fn thin(&mut self, centre: &Vector3<f64>) {
        while self.0.len() > KEPT {
            let from = |i: usize| self.0[i].world_from_camera.translation - centre;
            let news = |i: usize| {
                let own = from(i);
                from(i - 1).angle(&own).min(own.angle(&from(i + 1)))
            };
            let least = (1..self.0.len() - 1).min_by(|a, b| news(*a).total_cmp(&news(*b)));
            self.0.remove(least.unwrap_or_default());
        }
    }

    /// Takes over the poses as they are estimated now.
    pub(super) fn renew(&mut self, map: &dyn Map) {
        for sighting in &mut self.0 {
            if let Some(pose) = map.pose(sighting.frame) {
                sighting.world_from_camera = pose;
            }
        }
    }
}
