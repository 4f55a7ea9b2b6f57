//! The map as it is now, for those who look at it while frames come.
use super::Mapper;
use super::object::Tracked;
use manifactor_geometry::Se3;
use manifactor_graph::Direction;
use manifactor_mapping::mapping::measurements::Measured;
use manifactor_quadric::{Camera, DualQuadric};
use manifactor_recording::sequence::Observation;

impl Mapper {
    /// The camera of all frames.
    pub fn camera(&self) -> &Camera {
        &self.camera
    }

    /// Up in the map; `None` where it is unknown, or not known yet.
    pub fn up(&self) -> Option<Direction> {
        self.up.frame().and_then(|frame| frame.up)
    }

    /// The pose of a frame as it is estimated now; of one that has left the window, as it was when it came.
    pub fn pose_of(&self, frame: usize) -> Option<Se3> {
        self.pose(frame).or_else(|| self.live.get(frame).map(|live| live.pose))
    }

    /// Where odometry alone puts the camera, in the frame of the map; `None` before the first frame.
    pub fn odometry(&self, observation: &Observation) -> Option<Se3> {
        Some(self.up.frame()?.map_from_odometry.compose(&observation.frame.world_from_camera))
    }

    /// Objects in the map, by number: what is measured of each, and where it is estimated to be.
    pub fn objects(&self) -> impl Iterator<Item = (&Measured, DualQuadric)> {
        let mapped = self.objects.iter().filter(|(_, object)| Tracked::is_mapped(object));
        mapped.filter_map(|(id, _)| Some((self.measured(*id)?, self.quadric(*id)?)))
    }
}
