//! The most informative boxes of an object.
use super::super::MapEstimate;
use super::fit::SIDES;
use manifactor_geometry::Se3;
use manifactor_quadric::BoundingBox;
use manifactor_recording::camera::MountedCamera;
use manifactor_recording::measurement::Quantities;
use nalgebra::Vector3;
use std::sync::Arc;

/// A box with the camera pose that it was seen from.
#[derive(Debug, Clone)]
pub(super) struct PosedDetection {
    pub frame: usize,
    pub camera: Arc<MountedCamera>,
    pub world_from_camera: Se3,
    pub bounding_box: BoundingBox,
    /// Further measurements of the detection.
    pub quantities: Quantities,
}

impl PosedDetection {
    /// Returns the number of residual rows.
    pub(super) fn rows(&self) -> usize {
        SIDES + self.quantities.rows()
    }
}

/// A few detections from different sides, including the latest.
#[derive(Debug, Clone, Default)]
pub(super) struct PosedDetections(Vec<PosedDetection>);

/// Maximum number of detections.
const MAX_DETECTIONS: usize = 24;
/// Change of direction at which a detection is new information, in radians.
const NEW_DIRECTION_RAD: f64 = 0.03;
/// Logarithmic change of the distance at which a detection is new information.
const NEW_LOG_DISTANCE: f64 = 0.1;
/// Number of frames after which a detection is new information, because the detector errs differently by then.
const NEW_AFTER_FRAMES: usize = 30;

impl PosedDetections {
    pub(super) fn all(&self) -> &[PosedDetection] {
        &self.0
    }

    /// Adds a detection of an object at `centre`. The previous one stays only if it adds information to the
    /// rest.
    pub(super) fn add(&mut self, detection: PosedDetection, centre: &Vector3<f64>) {
        if let Some((last, rest)) = self.0.split_last() {
            let from = |s: &PosedDetection| s.world_from_camera.translation - centre;
            let is_new = rest.iter().all(|other| {
                let (a, b) = (from(last), from(other));
                a.angle(&b) > NEW_DIRECTION_RAD
                    || (a.norm() / b.norm()).ln().abs() > NEW_LOG_DISTANCE
                    || other.frame + NEW_AFTER_FRAMES < last.frame
            });
            if !is_new {
                self.0.pop();
            }
        }
        self.0.push(detection);
        self.thin(centre);
    }

    /// Removes the detection of an image.
    pub(super) fn remove(&mut self, (frame, camera): (usize, usize)) {
        self.0.retain(|detection| (detection.frame, detection.camera.index) != (frame, camera));
    }

    /// Returns the detections of both, in the order of frames.
    pub(super) fn merged_with(&self, others: &Self) -> Self {
        let mut all: Vec<PosedDetection> = self.0.iter().chain(&others.0).cloned().collect();
        all.sort_by_key(|detection| detection.frame);
        Self(all)
    }

    /// Removes the detections whose direction differs least from a neighbour, until few enough remain.
    pub(super) fn thin(&mut self, centre: &Vector3<f64>) {
        while self.0.len() > MAX_DETECTIONS {
            let from = |i: usize| self.0[i].world_from_camera.translation - centre;
            let news = |i: usize| {
                let own = from(i);
                from(i - 1).angle(&own).min(own.angle(&from(i + 1)))
            };
            let least = (1..self.0.len() - 1).min_by(|a, b| news(*a).total_cmp(&news(*b)));
            self.0.remove(least.unwrap_or_default());
        }
    }

    /// Replaces the poses by their current estimates.
    pub(super) fn update_poses(&mut self, map: &dyn MapEstimate) {
        for detection in &mut self.0 {
            if let Some(pose) = map.pose(detection.frame) {
                detection.world_from_camera = detection.camera.pose(&pose);
            }
        }
    }
}
