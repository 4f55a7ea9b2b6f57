//! Object SLAM: data sources, simulator, semantics, pipeline, metrics.
pub mod sequence;
