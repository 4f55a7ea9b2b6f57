//! Object SLAM: from a camera's odometry and a detector's boxes to a map of objects.
//!
//! Each module is a crate of its own; this crate gathers them under one name. A
//! [`RunDocument`](run_document::RunDocument) describes a run. A [`SequenceSource`](source::SequenceSource)
//! gives a [`Sequence`](sequence::Sequence); a [`Mapping`](mapping::Mapping) makes a graph of it; a solver an
//! [`Estimate`](estimate::Estimate), which is compared with the ground truth in a [`report`].
pub use manifactor_association as association;
pub use manifactor_experiment::{self as experiment, schema};
pub use manifactor_mapping::{
    estimate, gravity, mapping, measurements, motion, refine, run_document, semantics, settings, variance,
};
pub use manifactor_metrics as metrics;
pub use manifactor_online as online;
pub use manifactor_recording::{
    camera, class, fusion, journal, measurement, pose_graph, prior_map, recording, register_measurement,
    sequence, source, stream,
};
pub use manifactor_ros as ros;
pub use manifactor_run::{output, record, report, run};
pub use manifactor_simulator as simulator;
