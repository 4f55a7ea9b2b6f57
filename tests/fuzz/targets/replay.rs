//! Pose graphs, replayed pose by pose.
use super::{SOLVED, is_finite, third};
use manifactor::formats::pose_graph::{self, PoseGraphOptions};
use manifactor::formats::replay::GraphReplay;
use manifactor::graph::GraphError;
use manifactor::prelude::*;
use manifactor::smoother::{ChangeError, Smoother, SmootherSettings};
use std::collections::HashSet;

/// Replays g2o and TORO files pose by pose. Each factor and each variable occurs once, and all estimates
/// are finite.
pub fn replay(data: &[u8]) {
    let Ok(read) =
        pose_graph::parse(&String::from_utf8_lossy(data), "graph.g2o", &PoseGraphOptions::default())
    else {
        return;
    };
    let (graph, values) = (read.graph, read.values);
    if values.len() > SOLVED || graph.factors().len() > SOLVED {
        return;
    }
    let mut session = Smoother::new(SmootherSettings::default());
    let mut steps = GraphReplay::of(&graph, &values);
    let (mut factors, mut keys, has_poses) = (0, HashSet::new(), !steps.is_empty());
    loop {
        let left = steps.len();
        // the factors come from a checked file, so their types fit
        let step = steps.step(|key| session.estimate(key)).unwrap_or_else(|e| panic!("{e}"));
        let Some(step) = step else { break };
        assert_eq!(steps.len() + 1, left);
        factors += step.factors.factors().len();
        for (key, _) in step.values.iter() {
            assert!(keys.insert(key.clone()), "{key} comes twice");
        }
        let before = session.variables();
        match session.push(&step.factors, &step.values) {
            Ok(_) => {}
            // odometry with huge numbers is not a valid initial guess
            Err(ChangeError::Graph(errors))
                if errors.iter().all(|e| matches!(e, GraphError::NotFinite { .. })) =>
            {
                return;
            }
            Err(error) => panic!("{error}"),
        }
        if session.update().is_err() {
            assert_eq!(session.variables(), before);
            is_finite(&session.estimates());
            return;
        }
        is_finite(&session.estimates());
    }
    if has_poses {
        assert_eq!(factors, graph.factors().len(), "not each factor comes once");
        assert_eq!(session.variables(), keys.len());
    }
    if let Ok(finished) = session.finish(&GaussNewton::default(), &mut third()) {
        is_finite(&finished.values);
    }
}
