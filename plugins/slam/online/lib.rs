//! Object maps that grow frame by frame.
//!
//! A [`Mapper`] takes one frame at a time. It associates the frame's detections with objects, adds what is
//! new to the map, updates poses and objects with the incremental smoother, and revises earlier decisions
//! that later frames contradict. With a map of an earlier run it first finds the camera in that map.
mod mapper;
mod object_updates;

pub use mapper::{FinishError, FrameError, FrameReport, Mapper, Relocalization};
pub use object_updates::{ObjectStatus, ObjectUpdate, ObjectUpdates};
