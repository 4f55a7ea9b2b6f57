//! A motion model: frames that are connected only by a random walk.
use manifactor::config::{Document, Format};
use manifactor::geometry::{Between, Se3};
use manifactor::graph::FactorEntry;
use manifactor::prelude::*;
use manifactor::slam::motion::{MotionError, MotionModel, MotionStep, pose_key};
use manifactor::slam::run::Run;
use manifactor::slam::run_document::RunDocument;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A camera that moves randomly around its position.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct RandomWalk {
    /// Standard deviation after one second. Unit: rad and m.
    sigma: f64,
}

#[typetag::serialize(name = "test_random_walk")]
impl MotionModel for RandomWalk {
    fn predict(&self, _: &MotionStep<'_>, from: &Se3) -> Se3 {
        *from
    }

    fn factors(&self, step: &MotionStep<'_>) -> Result<Vec<FactorEntry>, MotionError> {
        let noise = Noise::sigma(self.sigma * step.seconds.sqrt()).map_err(|why| step.error(&why))?;
        let keys = step.frames.map(pose_key).to_vec();
        let factor = Arc::new(Between { relative: Se3::identity() });
        Ok(vec![FactorEntry { keys, name: None, factor, noise, loss: None }])
    }
}
register!(dyn MotionModel, "test_random_walk", RandomWalk);

/// Returns the estimated distance from the first pose to the last. Unit: metres.
fn run(sigma: f64) -> Result<f64, String> {
    let text = format!(
        "source = {{ type = 'simulated', trajectory = {{ frames = 40 }}, detector = {{ depth_error = 0.01 }}, odometry = {{ translation = 0.0, rotation = 0.0 }} }}
         objects = {{ initialiser = {{ type = 'rays' }} }}
         motion = {{ type = 'test_random_walk', sigma = {sigma} }}"
    );
    let document = Document::parse("run.toml", text, Format::Toml).unwrap();
    let document = RunDocument::read(&document).unwrap_or_else(|e| panic!("{e}"));
    let done = Run::new(&document, None).run_variant(&document.variants[0], &mut Silent);
    let (estimate, report) = done.map_err(|error| error.to_string())?;
    assert!(report.counts.objects > 3, "{:?}", report.warnings);
    let path = estimate.trajectory();
    Ok((path[39].pose.translation - path[0].pose.translation).norm())
}

#[test]
fn a_run_names_it() {
    let (free, held) = (run(1.0).unwrap(), run(1e-3).unwrap());
    assert!(free > 0.1 && held < 0.1 * free, "boxes move a camera that may move: {free} m, {held} m");
}

#[test]
fn a_step_without_a_factor_ends_the_run_with_its_place() {
    let error = run(0.0).unwrap_err();
    assert!(error.starts_with("no motion from frame 0 to frame 1"), "{error}");
}
