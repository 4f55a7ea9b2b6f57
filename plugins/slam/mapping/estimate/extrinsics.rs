//! Errors in the poses of further cameras on the body, from their boxes.
use super::{Estimate, EstimateError};
use crate::mapping::Warning;
use crate::settings::RunSettings;
use manifactor_geometry::{OnBody, OnBodyError, Se3};
use manifactor_graph::{Graph, Key, Manifold};
use manifactor_recording::camera::MountedCamera;
use manifactor_solve::{Observer, Termination, solve};
use std::sync::Arc;

/// Smallest rotation that is reported, in radians: 1°.
const MIN_ROTATION: f64 = 0.017;
/// Smallest gain that is reported, in nats. Errors of a detector persist over many frames and look like rotations.
const MIN_GAIN: f64 = 50.0;

impl Estimate {
    /// Adds a warning for each further camera whose boxes contradict its pose on the body: the graph is solved again
    /// with that pose as a variable.
    ///
    /// # Errors
    /// If the graph cannot be compiled.
    pub fn check_extrinsics(
        mut self,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Self, EstimateError> {
        let sequence = self.sequence.clone();
        for camera in sequence.cameras.iter().skip(1) {
            if self.solution.outcome.termination == Termination::Interrupted {
                break;
            }
            let found = self.fit_extrinsics(camera, settings, observer)?;
            if let Some((rotation, gain)) =
                found.filter(|(rotation, gain)| *rotation > MIN_ROTATION && *gain > MIN_GAIN)
            {
                let camera = camera.name.clone();
                self.mapping.warnings.push(Warning::Extrinsics { camera, rotation, gain });
            }
        }
        Ok(self)
    }

    /// Returns the angle between the given and the estimated rotation of a camera on the body, in radians, and the gain in
    /// log-likelihood.
    fn fit_extrinsics(
        &self,
        camera: &MountedCamera,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Option<(f64, f64)>, EstimateError> {
        let Some(given) = camera.first_from_camera.map(|pose| pose.inverse()) else { return Ok(None) };
        let key = Key::from(format!("extrinsics of {}", camera.name));
        let Ok(mut graph) = with_free_extrinsics(&self.mapping.graph, &given, &key) else { return Ok(None) };
        let mut values = self.solution.values.clone();
        values.insert(key.clone(), given);
        let free = graph.clone();
        graph.fix(key.clone());
        // the second stage has fixed poses, so that both solves begin at its end
        let fixed = solve(&graph, &values, &*settings.solver, observer)?;
        let free = solve(&free, &fixed.values, &*settings.solver, observer)?;
        let Ok(found) = free.values.get::<Se3>(key.as_str()) else { return Ok(None) };
        if [&fixed, &free].iter().any(|solved| solved.outcome.termination == Termination::Interrupted) {
            return Ok(None);
        }
        let rotation = given.local(found).fixed_rows::<3>(0).norm();
        let gain = fixed.outcome.final_cost - free.outcome.final_cost;
        let degrees = rotation.to_degrees();
        tracing::info!(camera = camera.name, "its boxes turn it by {degrees:.2}°, gain {gain:.1}");
        Ok(Some((rotation, gain)))
    }
}

/// Returns the graph with the pose of a camera on the body as a variable, in place of a constant.
fn with_free_extrinsics(graph: &Graph, given: &Se3, key: &Key) -> Result<Graph, OnBodyError> {
    let mut free = graph.clone();
    for entry in free.factors_mut() {
        if let Some((factor, Some(pose))) = OnBody::content(&*entry.factor)
            && pose == given
        {
            entry.factor = Arc::new(OnBody::new(factor.clone(), None, Some(vec![0]))?);
            entry.keys.push(key.clone());
        }
    }
    Ok(free)
}
