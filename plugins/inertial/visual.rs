//! Visual-inertial estimation: the motion of an IMU and a camera from readings and tracked points.
//!
//! Every n-th image is a keyframe, with the variables pose, velocity and bias. Readings between keyframes become
//! a factor [`Imu`]; a tracked point becomes a variable once it can be triangulated. The smoother updates the
//! estimate after each keyframe.
mod document;
mod initial;
mod landmark;

use crate::imu::Imu;
use crate::samples::{CoverageError, ImuDensities, ImuReading, SampleError};
use initial::at_rest;
use landmark::Track;
use manifactor_geometry::{
    Between, Camera, CameraModel, Coordinates, CoordinatesError, ImuBias, Point3, Prior, Projection, Se3,
    So3, Velocity,
};
use manifactor_graph::checked::Positive;
use manifactor_graph::loss::{GemanMcClure, Loss};
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{Graph, Noise, ValueError, Values};
use manifactor_smoother::{ChangeError, Smoother, SmootherSettings, UpdateError};
use manifactor_solve::{Auto, CompileError, Observer, Outcome};
use nalgebra::{DMatrix, Matrix3, Vector2, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::num::NonZeroUsize;
use std::sync::Arc;

pub use document::VisualInertialDocument;
pub use initial::NotAtRest;

/// Settings of visual-inertial estimation.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct VisualInertialSettings {
    /// Every n-th image is a keyframe. Default: 3.
    pub every: NonZeroUsize,
    /// Standard deviation of a tracked point, in pixels. Default: 1.
    pub sigma: Positive,
    /// Robust loss of tracked points, since tracks may slip to a different point. Default: Geman-McClure with
    /// scale 3.
    pub loss: Arc<dyn Loss>,
    /// Noise densities of the IMU. Default: a small MEMS sensor.
    pub noise: ImuDensities,
    /// Largest time between two readings of the IMU, in seconds. Default: 0.1.
    pub max_gap: Positive,
    /// Time at rest at the beginning, in seconds. It determines the direction of gravity and the gyroscope's
    /// bias. Default: 0.5.
    pub rest: Positive,
    /// Length of gravity, in m/s². Default: 9.81.
    pub gravity: Positive,
    /// Standard deviation of the accelerometer's bias before the first measurement, in m/s². Default: 0.1.
    pub accelerometer_bias: Positive,
    /// Settings of the smoother, without a window.
    pub smoother: SmootherSettings,
}

impl Default for VisualInertialSettings {
    fn default() -> Self {
        Self {
            every: NonZeroUsize::MIN.saturating_add(2),
            sigma: Positive::literal(1.0),
            loss: Arc::new(GemanMcClure { scale: Positive::literal(3.0) }),
            noise: ImuDensities::default(),
            max_gap: Positive::literal(0.1),
            rest: Positive::literal(0.5),
            gravity: Positive::literal(9.81),
            accelerometer_bias: Positive::literal(0.1),
            smoother: SmootherSettings::default(),
        }
    }
}

/// The state of the IMU at a keyframe. The world's z axis points up, and its origin is the first position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InertialState {
    /// Timestamp, in seconds.
    pub timestamp: f64,
    /// Pose of the IMU in the world.
    pub pose: Se3,
    /// Velocity in the world, in m/s.
    pub velocity: Velocity,
    /// Bias of the IMU.
    pub bias: ImuBias,
}

/// The reason why a keyframe cannot be added.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VisualInertialError {
    /// The smoother has a window, but the solve at the end needs all poses.
    #[error("a window of the smoother is not supported here: remove `settings.smoother.window`")]
    Window,
    /// The readings at the beginning do not determine the state.
    #[error(transparent)]
    NotAtRest(#[from] NotAtRest),
    /// The readings do not cover the time between two keyframes.
    #[error(transparent)]
    Coverage(#[from] CoverageError),
    /// A reading cannot be integrated.
    #[error("between {from:.3} and {to:.3} s: {source}")]
    Sample {
        /// Time of the keyframe before the samples.
        from: f64,
        /// Time of the keyframe after them.
        to: f64,
        /// The reason.
        source: SampleError,
    },
    /// A pixel or gravity is not finite.
    #[error(transparent)]
    Coordinates(#[from] CoordinatesError),
    /// A noise model is invalid.
    #[error(transparent)]
    Noise(#[from] NoiseError),
    /// The factors do not fit.
    #[error(transparent)]
    Change(#[from] ChangeError),
    /// The smoother's update failed.
    #[error("the update at {timestamp:.3} s failed: {source}")]
    Update {
        /// Time of the keyframe.
        timestamp: f64,
        /// The reason.
        source: UpdateError,
    },
    /// A variable has no estimate.
    #[error(transparent)]
    Value(#[from] ValueError),
    /// The batch solve failed.
    #[error(transparent)]
    Batch(#[from] CompileError),
}

/// The final estimate of all keyframes.
#[derive(Debug)]
pub struct VisualInertialEstimate {
    /// States in the order of time.
    pub states: Vec<InertialState>,
    /// Outcome of the batch solve that follows the updates.
    pub outcome: Outcome,
    /// Number of landmarks in the estimate.
    pub landmarks: usize,
    /// Number of tracks that were too short or too close to the direction of motion for a landmark.
    pub short_tracks: usize,
}

/// The number of a landmark, and its pixel in an undistorted image.
pub type TrackedPoint = (u64, Vector2<f64>);

/// An estimation in progress.
pub struct VisualInertial {
    settings: VisualInertialSettings,
    camera: Camera,
    body_from_camera: Se3,
    smoother: Smoother,
    /// Estimate of each keyframe, as of its own update.
    states: Vec<InertialState>,
    tracks: BTreeMap<u64, Track>,
}

/// Standard deviations of the first pose: the direction of the heading and the position are free to choose.
const GAUGE_SIGMA: f64 = 1e-4;
/// Standard deviation of the velocity at rest, in m/s.
const REST_SIGMA: f64 = 0.05;
/// Standard deviation of the gyroscope's bias from the readings at rest, in rad/s.
const GYROSCOPE_BIAS_SIGMA: f64 = 5e-3;

/// Median motion of points, beyond a rotation, up to which the camera stands still. A share of the standard
/// deviation of a point.
const STANDING_SHARE: f64 = 0.5;
/// Minimum number of points that show it.
const MIN_STANDING_POINTS: usize = 5;
/// Standard deviation of the motion between two keyframes of a camera that stands still, in metres.
const STANDING_SIGMA: f64 = 1e-3;

/// Adds the factors of a camera that stands still: no velocity at the end, and no motion in between.
fn stand_still(graph: &mut Graph, [from, to]: &[[String; 3]; 2]) -> Result<(), NoiseError> {
    graph.add([to[1].as_str()], Prior { value: Velocity::zero() }).noise(Noise::sigma(REST_SIGMA)?);
    let only_translation = [false, false, false, true, true, true];
    let noise = Noise::sigma(STANDING_SIGMA)?.observing(&only_translation);
    graph.add([from[0].as_str(), to[0].as_str()], Between { relative: Se3::identity() }).noise(noise);
    Ok(())
}

fn keys(keyframe: usize) -> [String; 3] {
    ["x", "v", "b"].map(|kind| format!("{kind}{keyframe}"))
}

fn landmark_key(landmark: u64) -> String {
    format!("l{landmark}")
}

impl VisualInertial {
    /// Begins at the time `timestamp` of the first keyframe, which sees `points`, with the IMU at rest. `readings`
    /// cover the time at rest. `body_from_camera` is the pose of the camera in the frame of the IMU. Points are
    /// pixels of undistorted images, with the number of their landmark.
    ///
    /// # Errors
    /// If the IMU is not at rest, or a point is not finite.
    pub fn begin(
        settings: VisualInertialSettings,
        camera: Camera,
        body_from_camera: Se3,
        timestamp: f64,
        points: &[TrackedPoint],
        readings: &[ImuReading],
    ) -> Result<Self, VisualInertialError> {
        if settings.smoother.window.is_some() {
            return Err(VisualInertialError::Window);
        }
        let state = at_rest(&settings, timestamp, readings)?;
        let (mut graph, mut values) = (Graph::new(), Values::new());
        let [x, v, b] = keys(0);
        // the bias of the accelerometer tilts the direction of gravity by this angle
        let tilt = settings.accelerometer_bias.get() / settings.gravity.get();
        // rotations about x and y of the world; the prior's rows are in the frame of the IMU
        let rotation = state.pose.rotation.matrix();
        let mut covariance = DMatrix::from_diagonal_element(6, 6, GAUGE_SIGMA * GAUGE_SIGMA);
        let horizontal = Vector3::new(tilt * tilt, tilt * tilt, GAUGE_SIGMA * GAUGE_SIGMA);
        let local = rotation.transpose() * Matrix3::from_diagonal(&horizontal) * rotation;
        covariance.view_mut((0, 0), (3, 3)).copy_from(&((local + local.transpose()) * 0.5));
        graph.add([x.as_str()], Prior { value: state.pose }).noise(Noise::covariance(covariance)?);
        graph.add([v.as_str()], Prior { value: state.velocity }).noise(Noise::sigma(REST_SIGMA)?);
        let [g, a] = [GYROSCOPE_BIAS_SIGMA, settings.accelerometer_bias.get()];
        graph.add([b.as_str()], Prior { value: state.bias }).noise(Noise::sigmas(&[g, g, g, a, a, a])?);
        insert(&mut values, 0, &state);
        let smoother = Smoother::new(settings.smoother.clone());
        let mut estimation =
            Self { settings, camera, body_from_camera, smoother, states: vec![], tracks: BTreeMap::new() };
        estimation.update(&state, points, &graph, &values)?;
        Ok(estimation)
    }

    /// Adds a keyframe with the pixels of its tracked points, and updates the estimate. `readings` cover the
    /// time since the last keyframe. Returns the state at the keyframe.
    ///
    /// # Errors
    /// If the readings do not cover the time, a point is not finite, or the update fails. Nothing is added then.
    pub fn add_keyframe(
        &mut self,
        timestamp: f64,
        points: &[TrackedPoint],
        readings: &[ImuReading],
    ) -> Result<InertialState, VisualInertialError> {
        let keyframe = self.states.len();
        let last = self.estimate(keyframe - 1)?;
        let from = last.timestamp;
        let samples = ImuReading::samples(readings, from, timestamp, self.settings.max_gap.get())?;
        let gravity = Coordinates::new(Vector3::new(0.0, 0.0, -self.settings.gravity.get()))?;
        let imu = Imu::new(&samples, self.settings.noise, last.bias, gravity)
            .map_err(|source| VisualInertialError::Sample { from, to: timestamp, source })?;
        let (pose, velocity) = imu.predict(&last.pose, &last.velocity);
        let predicted = InertialState { timestamp, pose, velocity, bias: last.bias };
        let (mut graph, mut values) = (Graph::new(), Values::new());
        insert(&mut values, keyframe, &predicted);
        let ends = [keys(keyframe - 1), keys(keyframe)];
        if self.is_standing(&imu.preintegration().motion.rotation, points) {
            stand_still(&mut graph, &ends)?;
        }
        graph.add(ends.iter().flatten().map(String::as_str), imu);
        let mapped = self.add_landmarks(&pose, points, &mut graph, &mut values)?;
        let state = self.update(&predicted, points, &graph, &values)?;
        for landmark in mapped {
            self.tracks.entry(landmark).or_default().is_mapped = true;
        }
        Ok(state)
    }

    /// Updates the smoother, and adds the keyframe with its points if that succeeds.
    fn update(
        &mut self,
        predicted: &InertialState,
        points: &[TrackedPoint],
        graph: &Graph,
        values: &Values,
    ) -> Result<InertialState, VisualInertialError> {
        let (keyframe, timestamp) = (self.states.len(), predicted.timestamp);
        for (_, pixel) in points {
            Coordinates::new(*pixel)?;
        }
        self.smoother.push(graph, values)?;
        self.smoother.update().map_err(|source| VisualInertialError::Update { timestamp, source })?;
        self.states.push(*predicted);
        let state = self.estimate(keyframe)?;
        self.states[keyframe] = state;
        for (landmark, pixel) in points {
            self.tracks.entry(*landmark).or_default().push(keyframe, *pixel);
        }
        Ok(state)
    }

    /// Returns whether the camera stands still since the last keyframe: a rotation alone explains how its points
    /// have moved. `rotation` is the turn of the IMU.
    fn is_standing(&self, rotation: &So3, points: &[TrackedPoint]) -> bool {
        let mounting = &self.body_from_camera.rotation;
        // the rotation of the camera
        let turn = mounting.inverse().compose(rotation).compose(mounting);
        let last = self.states.len() - 1;
        let moved = points.iter().filter_map(|(landmark, pixel)| {
            let before = self.tracks.get(landmark)?.pixel_in(last)?;
            let seen = turn.inverse().act(&self.camera.ray(before));
            self.camera.sees(&seen).then(|| (self.camera.project(&seen) - pixel).norm())
        });
        let mut moved: Vec<f64> = moved.collect();
        moved.sort_by(f64::total_cmp);
        moved.len() >= MIN_STANDING_POINTS
            && moved[moved.len() / 2] <= STANDING_SHARE * self.settings.sigma.get()
    }

    /// Adds the new points of landmarks, and the landmarks that can be triangulated now. Returns the latter.
    /// `pose` is the predicted pose of the new keyframe.
    fn add_landmarks(
        &self,
        pose: &Se3,
        points: &[TrackedPoint],
        graph: &mut Graph,
        values: &mut Values,
    ) -> Result<Vec<u64>, VisualInertialError> {
        let (keyframe, sigma) = (self.states.len(), self.settings.sigma.get());
        let noise = Noise::sigma(sigma)?;
        let mut mapped = vec![];
        for (landmark, pixel) in points {
            let key = landmark_key(*landmark);
            let track = self.tracks.get(landmark);
            let mut seen = vec![(keyframe, *pixel)];
            if !track.is_some_and(|track| track.is_mapped) {
                let earlier = track.map_or(&[][..], |track| track.points());
                let mut views = vec![];
                for (keyframe, pixel) in earlier {
                    let [x, ..] = keys(*keyframe);
                    views.push((self.smoother.get::<Se3>(&x)?.compose(&self.body_from_camera), *pixel));
                }
                views.push((pose.compose(&self.body_from_camera), *pixel));
                let Some(position) = landmark::triangulate(&views, &self.camera, sigma) else { continue };
                values.insert(key.as_str(), Point3::new(position));
                seen.splice(0..0, earlier.iter().copied());
                mapped.push(*landmark);
            }
            for (keyframe, pixel) in seen {
                let factor = Projection {
                    pixel: Coordinates::new(pixel)?,
                    camera: self.camera,
                    body_from_camera: Some(self.body_from_camera),
                };
                let [x, ..] = keys(keyframe);
                let entry = graph.add([x.as_str(), key.as_str()], factor).noise(noise.clone());
                entry.loss = Some(self.settings.loss.clone());
            }
        }
        Ok(mapped)
    }

    /// Returns the estimate of a keyframe.
    fn estimate(&self, keyframe: usize) -> Result<InertialState, VisualInertialError> {
        let [x, v, b] = keys(keyframe);
        Ok(InertialState {
            timestamp: self.states[keyframe].timestamp,
            pose: self.smoother.get(&x)?,
            velocity: self.smoother.get(&v)?,
            bias: self.smoother.get(&b)?,
        })
    }

    /// Returns the state of each keyframe as of its own update, without later keyframes.
    pub fn causal_states(&self) -> &[InertialState] {
        &self.states
    }

    /// Solves all keyframes and landmarks as one batch.
    ///
    /// # Errors
    /// If the batch cannot be compiled.
    pub fn finish(&self, observer: &mut dyn Observer) -> Result<VisualInertialEstimate, VisualInertialError> {
        let finished = self.smoother.finish(&Auto::default(), observer)?;
        let states = self.states.iter().enumerate().map(|(keyframe, own)| {
            let [x, v, b] = keys(keyframe);
            Ok(InertialState {
                timestamp: own.timestamp,
                pose: *finished.values.get(&x)?,
                velocity: *finished.values.get(&v)?,
                bias: *finished.values.get(&b)?,
            })
        });
        let mapped = self.tracks.values().filter(|track| track.is_mapped).count();
        Ok(VisualInertialEstimate {
            states: states.collect::<Result<_, ValueError>>()?,
            outcome: finished.outcome,
            landmarks: mapped,
            short_tracks: self.tracks.len() - mapped,
        })
    }
}

fn insert(values: &mut Values, keyframe: usize, state: &InertialState) {
    let [x, v, b] = keys(keyframe);
    values.insert(x.as_str(), state.pose);
    values.insert(v.as_str(), state.velocity);
    values.insert(b.as_str(), state.bias);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::SimulatedFlight;
    use manifactor_solve::Silent;

    fn flown(flight: &SimulatedFlight, settings: VisualInertialSettings) -> VisualInertial {
        let mut images = flight.images.iter().step_by(settings.every.get());
        let (timestamp, points) = images.next().unwrap();
        let (camera, mounting) = (flight.camera, flight.body_from_camera);
        let mut estimation =
            VisualInertial::begin(settings, camera, mounting, *timestamp, points, &flight.readings).unwrap();
        for (timestamp, points) in images {
            estimation.add_keyframe(*timestamp, points, &flight.readings).unwrap();
        }
        estimation
    }

    /// Root mean square of the position errors, in the frame of the first pose.
    fn error(flight: &SimulatedFlight, states: &[InertialState], every: usize) -> f64 {
        let truth = flight.poses.iter().step_by(every);
        let from = flight.poses[0].compose(&states[0].pose.inverse());
        let errors = truth
            .zip(states)
            .map(|(truth, state)| (from.act(&state.pose.translation) - truth.translation).norm_squared());
        (errors.sum::<f64>() / states.len() as f64).sqrt()
    }

    #[test]
    fn a_flight_with_wrong_tracks_is_estimated() {
        for seed in 0..3 {
            let flight = SimulatedFlight::new(10.0, seed);
            let estimation = flown(&flight, VisualInertialSettings::default());
            let online = error(&flight, estimation.causal_states(), 3);
            assert!(online < 0.06, "online, seed {seed}: {online} m");
            let estimate = estimation.finish(&mut Silent).unwrap();
            assert!(estimate.outcome.termination.is_converged(), "{}", estimate.outcome.termination);
            let whole = error(&flight, &estimate.states, 3);
            assert!(whole < 0.03, "batch, seed {seed}: {whole} m");
            let bias = estimate.states.last().unwrap().bias;
            assert!((bias.gyroscope() - flight.bias.gyroscope()).norm() < 2e-3, "{bias:?}");
            assert!((bias.accelerometer() - flight.bias.accelerometer()).norm() < 0.05, "{bias:?}");
            assert!(estimate.landmarks > 30, "{}", estimate.landmarks);
        }
    }

    #[test]
    fn a_keyframe_that_fails_leaves_the_last_good_state() {
        let mut flight = SimulatedFlight::new(3.0, 0);
        let every = 3;
        let whole = flown(&flight, VisualInertialSettings::default());
        let (images, readings) = (flight.images.clone(), flight.readings.clone());
        flight.readings.retain(|reading| !(2.0..2.2).contains(&reading.timestamp));
        let (camera, mounting) = (flight.camera, flight.body_from_camera);
        let settings = VisualInertialSettings::default();
        let mut estimation =
            VisualInertial::begin(settings, camera, mounting, 0.0, &images[0].1, &readings).unwrap();
        let mut errors = vec![];
        for (timestamp, points) in images.iter().skip(every).step_by(every) {
            if let Err(error) = estimation.add_keyframe(*timestamp, points, &flight.readings) {
                errors.push(error.to_string());
                let bad = [(1, Vector2::new(f64::NAN, 0.0))];
                errors.push(estimation.add_keyframe(*timestamp, &bad, &readings).unwrap_err().to_string());
                estimation.add_keyframe(*timestamp, points, &readings).unwrap();
            }
        }
        assert!(errors[0].contains("no reading for 0.205 s after 1.995 s"), "{}", errors[0]);
        assert!(errors[1].contains("expected finite numbers"), "{}", errors[1]);
        assert_eq!(estimation.causal_states(), whole.causal_states());
    }
}
