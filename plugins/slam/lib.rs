//! Object SLAM: data sources, simulator, semantics, pipeline, metrics.
