//! From a recording to a factor graph, and from the graph to an estimate.
//!
//! [`settings`] describe a run. [`Mapping`](mapping::Mapping) makes its graph: a [motion model](motion) ties the frames, detections
//! become measurements of objects, [`gravity`] gives the vertical, and rules ([`semantics`]) add orientation factors. An
//! [`Estimate`](estimate::Estimate) is the solved graph.
pub mod estimate;
pub mod gravity;
pub mod mapping;
pub mod motion;
pub mod semantics;
pub mod settings;

pub use estimate::{refine, variance};
pub use mapping::measurements;
pub use settings::run_document;
