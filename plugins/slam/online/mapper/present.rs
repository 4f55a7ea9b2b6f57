//! Access to the current map for viewers of a stream.
use super::Mapper;
use super::object::ObjectState;
use manifactor_geometry::Se3;
use manifactor_graph::Direction;
use manifactor_mapping::mapping::measurements::ObjectMeasurements;
use manifactor_mapping::mapping::object_key;
use manifactor_mapping::settings::RunSettings;
use manifactor_quadric::{Camera, DualQuadric};
use manifactor_recording::sequence::{ObjectId, Observation};
use nalgebra::DMatrix;

impl Mapper {
    /// Returns the camera of all frames.
    pub fn camera(&self) -> &Camera {
        &self.cameras.first().model
    }

    /// Returns the up direction in the map; `None` if unknown.
    pub fn up(&self) -> Option<Direction> {
        self.up.map_frame().and_then(|frame| frame.up)
    }

    /// Returns the settings with the current noise of the stream.
    pub fn settings(&self) -> &RunSettings {
        &self.settings
    }

    /// Returns the estimated pose of a frame; after it has left the window, the estimate at its time.
    pub fn pose_of(&self, frame: usize) -> Option<Se3> {
        self.pose(frame).or_else(|| self.live_poses.get(frame).map(|live| live.pose))
    }

    /// Returns the camera pose by odometry alone, in the frame of the map; `None` before the first frame.
    pub fn odometry(&self, observation: &Observation) -> Option<Se3> {
        Some(self.up.map_frame()?.map_from_odometry.compose(&observation.frame.world_from_camera))
    }

    /// Returns the mapped objects by id, with their measurements and estimates.
    pub fn objects(&self) -> impl Iterator<Item = (&ObjectMeasurements, DualQuadric)> {
        let mapped = self.objects.iter().filter(|(_, object)| ObjectState::is_mapped(object));
        mapped.filter_map(|(id, _)| Some((self.measured(*id)?, self.quadric(*id)?)))
    }

    /// Returns the objects by id with their measurements, and the estimates of mapped ones. Objects that were
    /// removed from the map are left out.
    pub fn tracked_objects(&self) -> impl Iterator<Item = (&ObjectMeasurements, Option<DualQuadric>)> {
        self.objects.iter().filter_map(|(id, object)| match object {
            ObjectState::Mapped(_) => Some((self.measured(*id)?, self.quadric(*id))),
            ObjectState::Tentative(_) => Some((self.measured(*id)?, None)),
            ObjectState::Removed => None,
        })
    }

    /// Returns the covariance of a mapped object, 9 × 9 in tangent order: rotation in rad and centre in m, both
    /// in the object's frame, then the logarithms of the semi-axes. `None` if the object is not mapped, or a
    /// direction of it is undetermined.
    pub fn object_covariance(&self, id: ObjectId) -> Option<DMatrix<f64>> {
        self.smoother.covariance(&[object_key(id).as_str()]).ok()
    }
}
