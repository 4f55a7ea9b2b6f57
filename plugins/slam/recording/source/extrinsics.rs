//! Conversion from poses of a body to poses of the camera that is mounted on it.
//!
//! All code after a source uses poses of the camera.
use crate::sequence::pose_graph::{PoseFactor, PoseFactorKey};
use crate::sequence::{GroundTruth, Observation, UnusedInput};
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::{OnBody, Se3};
use manifactor_graph::{Manifold, Noise};
use nalgebra::DMatrix;
use std::sync::Arc;

/// Pose of the camera on the body whose poses a source gives.
#[derive(Debug, Clone, Copy)]
pub(super) struct Extrinsics {
    body_from_camera: Se3,
}

impl Extrinsics {
    pub(super) fn new(body_from_camera: Se3) -> Self {
        Self { body_from_camera }
    }

    /// Converts a pose of the body to the pose of the camera.
    pub(super) fn apply_to_pose(&self, pose: &mut Se3) {
        *pose = pose.compose(&self.body_from_camera);
    }

    fn apply_to_poses(&self, poses: &mut [StampedPose]) {
        poses.iter_mut().for_each(|stamped| self.apply_to_pose(&mut stamped.pose));
    }

    /// Converts the trajectory of the ground truth. Its objects do not depend on the camera.
    pub(super) fn apply_to_ground_truth(&self, truth: &mut GroundTruth) {
        self.apply_to_poses(&mut truth.trajectory);
    }

    /// Converts the pose of a frame, the noise of its step, and its changes of the pose graph. What cannot be
    /// converted is left out and reported.
    pub(super) fn apply_to_frame(&self, observation: &mut Observation) {
        self.apply_to_pose(&mut observation.frame.world_from_camera);
        let timestamp = observation.frame.timestamp;
        let unused = &mut observation.unused;
        let mut report =
            |field: String, fault: String| unused.push(UnusedInput::PoseGraph { timestamp, field, fault });
        if let Some(noise) = observation.frame.odometry_noise.take() {
            match self.noise(&noise) {
                Ok(noise) => observation.frame.odometry_noise = Some(Arc::new(noise)),
                Err(fault) => report("odometry_noise".into(), fault),
            }
        }
        self.apply_to_poses(&mut observation.pose_graph.corrected);
        let mut place = 0;
        observation.pose_graph.factors.retain_mut(|factor| {
            place += 1;
            self.apply_to_factor(factor).map_err(|fault| report(format!("factors {place}"), fault)).is_ok()
        });
    }

    /// Converts the noise of a step of the body to the camera: with the step S and the extrinsics E,
    /// E⁻¹ S exp(δ) E = E⁻¹ S E exp(Ad(E⁻¹) δ).
    fn noise(&self, noise: &Noise) -> Result<Noise, String> {
        if noise.observed().is_some_and(|rows| rows.contains(&false)) {
            return Err("expected a noise of all six rows, to convert it from the body to the camera".into());
        }
        let information = noise.information_matrix(Se3::TANGENT.len()).map_err(|error| error.to_string())?;
        let step = self.body_from_camera.adjoint();
        let information = step.transpose() * information * step;
        let symmetric = DMatrix::from_fn(information.nrows(), information.ncols(), |i, j| {
            0.5 * (information[(i, j)] + information[(j, i)])
        });
        let converted = Noise::information(symmetric);
        converted.map_err(|error| format!("it cannot be converted from the body to the camera: {error}"))
    }

    /// Wraps a factor on poses of the body. Variables of the document stay.
    fn apply_to_factor(&self, factor: &mut PoseFactor) -> Result<(), String> {
        let is_pose = |(place, key): (usize, &PoseFactorKey)| {
            matches!(key, PoseFactorKey::Timestamp(_)).then_some(place)
        };
        let poses: Vec<usize> = factor.keys.iter().enumerate().filter_map(is_pose).collect();
        if poses.is_empty() {
            return Ok(());
        }
        let wrapped = OnBody::new(factor.factor.clone(), self.body_from_camera, Some(poses));
        factor.factor = Arc::new(wrapped.map_err(|error| error.to_string())?);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sequence::Frame;
    use manifactor_geometry::Between;
    use nalgebra::{DVector, Vector6};

    fn extrinsics() -> Extrinsics {
        Extrinsics::new(Se3::exp(&Vector6::new(1.2, -1.2, 1.2, 0.3, -0.1, 0.5)))
    }

    #[test]
    fn the_likelihood_of_a_step_stays() {
        let covariance = DMatrix::from_fn(6, 6, |i, j| if i == j { 1e-4 * (1 + i) as f64 } else { 1e-5 });
        let noise = Noise::covariance(covariance).unwrap();
        let e = extrinsics().body_from_camera;
        let [measured, actual] =
            [0.9, 1.0].map(|t| Se3::exp(&(t * Vector6::new(0.1, 0.2, 0.0, 0.3, 0.0, 1.0))));
        let cost = |noise: &Noise, measured: &Se3, actual: &Se3| {
            let r = DVector::from_iterator(6, measured.local(actual).iter().copied());
            (noise.whitener(6).unwrap().matrix(6) * r).norm_squared()
        };
        let of_body = cost(&noise, &measured, &actual);
        let camera = |step: &Se3| e.inverse().compose(step).compose(&e);
        let of_camera = cost(&extrinsics().noise(&noise).unwrap(), &camera(&measured), &camera(&actual));
        assert!((of_body - of_camera).abs() < 1e-9 * of_body, "{of_body} {of_camera}");
    }

    #[test]
    fn a_change_of_the_pose_graph_that_cannot_be_converted_is_reported() {
        let mut observation = Observation::new(Frame::new(1.0, Se3::identity()));
        let factor = |keys: Vec<PoseFactorKey>| PoseFactor {
            id: None,
            keys,
            factor: Arc::new(Between { relative: Se3::identity() }),
            noise: Noise::default(),
            loss: None,
        };
        let at = PoseFactorKey::Timestamp;
        let anchor = || PoseFactorKey::Key("anchor".into());
        observation.pose_graph.factors = vec![
            factor(vec![at(0.0), at(0.5), at(1.0)]),
            factor(vec![at(0.0), anchor()]),
            factor(vec![anchor()]),
        ];
        let rows = [true, true, false, true, true, true];
        observation.frame.odometry_noise = Some(Arc::new(Noise::sigma(0.1).unwrap().observing(&rows)));
        extrinsics().apply_to_frame(&mut observation);
        let faults: Vec<String> = observation.unused.iter().map(|unused| format!("{unused:?}")).collect();
        assert_eq!(faults.len(), 2, "{faults:?}");
        assert!(faults[0].contains("all six rows") && faults[1].contains("names variable 2"), "{faults:?}");
        let names: Vec<_> =
            observation.pose_graph.factors.iter().map(|factor| factor.factor.typetag_name()).collect();
        assert_eq!(names, ["on_body", "between_se3"]);
    }
}
