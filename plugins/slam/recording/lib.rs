//! The input of a run: frames with odometry, detections and ground truth, and the sources that read them.
//!
//! A [`SequenceSource`](source::SequenceSource) gives a [`Sequence`](sequence::Sequence), or its frames one
//! by one as a [`FrameStream`](source::stream::FrameStream). A detection has a box, scores of classes, and
//! further quantities, each a [`Measurement`](measurement::Measurement).
#[doc(hidden)]
pub mod __private {
    pub use {inventory, schemars, serde_json};
}

pub mod camera;
pub mod class;
pub mod ellipse;
pub mod fusion;
pub mod georeference;
pub mod keys;
pub mod measurement;
pub mod prior_map;
pub mod recording;
pub mod sequence;
pub mod source;

pub use sequence::pose_graph;
pub use source::{journal, stream};
