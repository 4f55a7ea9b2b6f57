//! Object SLAM: from a camera's odometry and a detector's boxes to a map of objects.
//!
//! A [`RunDocument`](run_document::RunDocument) describes a run. A [`Source`](source::Source) provides a
//! [`Sequence`](sequence::Sequence), and a [`Mapping`](mapping::Mapping) turns it into a factor graph. A
//! solver computes an [`Estimate`](estimate::Estimate), which a [`report`] compares with ground truth.
#[doc(hidden)]
pub mod __private {
    pub use {inventory, serde_json};
}

pub mod association;
pub mod estimate;
pub mod experiment;
pub mod gravity;
mod input;
pub mod mapping;
pub mod metrics;
pub mod motion;
pub mod online;
pub mod output;
pub mod run;
pub mod semantics;
pub mod settings;

pub use estimate::{refine, variance};
pub use experiment::schema;
pub use input::{
    class, fusion, journal, measurement, prior_map, recording, sequence, simulator, source, stream,
};
pub use mapping::measurements;
pub use output::{record, report};
pub use settings::run_document;
