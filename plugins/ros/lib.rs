//! Recordings of robots that run ROS 2.
//!
//! [`read`] calls a function for each message of an MCAP or SQLite file. A message is decoded by the definition in the
//! file, and then read as one of the [`messages`]. [`Transforms`] collects the transforms between frames, and [`Contents`]
//! lists what a file holds.
mod bag;
mod contents;
mod decode;
mod definitions;
pub mod messages;
mod transforms;

#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use bag::{BagError, BagMessage, Ending, Topic, is_recording, read};
pub use contents::{Contents, Role, TopicContents};
pub use decode::DecodeError;
pub use transforms::{TransformError, Transforms};
