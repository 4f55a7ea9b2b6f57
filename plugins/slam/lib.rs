//! Object SLAM: from a camera's odometry and a detector's boxes to a map of objects.
//!
//! A [`RunDocument`](run_document::RunDocument) says what to do. A [`Source`](source::Source) gives a
//! [`Sequence`](sequence::Sequence); a [`Mapping`](mapping::Mapping) makes a graph of it; a solver an
//! [`Estimate`](estimate::Estimate), which is compared with the truth in a [`report`].
pub mod class;
pub mod estimate;
pub mod experiment;
pub mod fusion;
pub mod gravity;
pub mod mapping;
pub mod measurements;
pub mod metrics;
pub mod output;
pub mod recording;
pub mod refine;
pub mod report;
pub mod run;
pub mod run_document;
pub mod schema;
pub mod semantics;
pub mod sequence;
pub mod settings;
pub mod simulator;
pub mod source;
pub mod variance;
