//! The likelihood of the specific force: gravity has one direction and one length, and the acceleration moves the
//! camera such that points stay in front of it.
use super::Recording;
use super::rotation::{ImagePair, RotationFit, View, loss};
use crate::samples::{ImuReading, ImuSample};
use manifactor_geometry::So3;
use nalgebra::{Matrix3, Vector3};

/// Length of a window, in seconds.
const WINDOW: f64 = 1.0;
/// Standard deviation of the mean acceleration in a window, in m/s²: changes of the velocity.
const ACCELERATION: f64 = 0.5;
/// Standard deviation of the length of gravity, in m/s²: the accelerometer's bias.
const LENGTH: f64 = 0.2;
/// Standard deviation of the velocity, in m/s, before any measurement.
const VELOCITY: f64 = 5.0;
/// Number of pairs of images that share an initial velocity. In the time of more of them, the accelerometer's bias
/// moves the camera too far.
const PAIRS: usize = 4;

/// The orientation of the IMU at each sample, in the frame at the beginning of the recording.
struct Orientations {
    samples: Vec<ImuSample>,
    /// At the beginning of each sample.
    rotations: Vec<So3>,
}

impl Orientations {
    fn new(recording: &Recording, bias: &Vector3<f64>) -> Self {
        let ends = recording.readings.first().zip(recording.readings.last());
        let samples = ends.and_then(|(first, last)| {
            ImuReading::samples(&recording.readings, first.timestamp, last.timestamp, f64::INFINITY).ok()
        });
        let samples = samples.unwrap_or_default();
        let rotations = samples.iter().scan(So3::identity(), |at, sample| {
            let next = at.compose(&So3::exp(&((sample.gyroscope - bias) * sample.seconds)));
            Some(std::mem::replace(at, next))
        });
        Self { rotations: rotations.collect(), samples }
    }

    /// Returns the mean specific force of each window.
    fn forces(&self) -> Vec<Vector3<f64>> {
        let (mut sum, mut seconds, mut windows) = (Vector3::zeros(), 0.0, vec![]);
        for (sample, rotation) in self.samples.iter().zip(&self.rotations) {
            sum += rotation.act(&sample.accelerometer) * sample.seconds;
            seconds += sample.seconds;
            if seconds >= WINDOW {
                windows.push(sum / seconds);
                (sum, seconds) = (Vector3::zeros(), 0.0);
            }
        }
        windows
    }
}

/// Gravity as the readings of the whole recording show it.
#[derive(Debug, Clone, Copy)]
pub(super) struct GravityFit {
    /// Negative logarithm of the likelihood.
    pub(super) cost: f64,
    /// Mean specific force, in the frame at the beginning, in m/s².
    pub(super) mean: Vector3<f64>,
    /// Number of windows.
    pub(super) windows: usize,
}

/// Fits a constant gravity.
pub(super) fn fit(recording: &Recording, bias: &Vector3<f64>) -> GravityFit {
    let forces = Orientations::new(recording, bias).forces();
    if forces.is_empty() {
        return GravityFit { cost: 0.0, mean: Vector3::zeros(), windows: 0 };
    }
    let share =
        |force: &Vector3<f64>, mean: &Vector3<f64>| (force - mean).norm_squared() / ACCELERATION.powi(2);
    let mut mean = forces.iter().sum::<Vector3<f64>>() / forces.len() as f64;
    for _ in 0..10 {
        let weights: Vec<f64> = forces.iter().map(|force| 1.0 / (1.0 + share(force, &mean))).collect();
        let sum: Vector3<f64> = forces.iter().zip(&weights).map(|(force, weight)| force * *weight).sum();
        mean = sum / weights.iter().sum::<f64>();
    }
    // Cauchy's distribution in three dimensions
    let spread: f64 = forces.iter().map(|force| 2.0 * share(force, &mean).ln_1p()).sum();
    let expected = if recording.has_no_gravity { 0.0 } else { recording.gravity };
    let cost = spread + 0.5 * ((mean.norm() - expected) / LENGTH).powi(2);
    GravityFit { cost, mean, windows: forces.len() }
}

/// A pair of images, and the motion between them for an initial velocity of zero.
struct Motion {
    view: View,
    /// Rotates from the frame at the beginning of the recording to the camera's frame at the end of the pair.
    camera_from_start: Matrix3<f64>,
    /// Displacement of the camera without the part of the initial velocity, in metres.
    displacement: Vector3<f64>,
    seconds: f64,
}

/// Points that are behind the camera.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Behind {
    /// Negative logarithm of their likelihood: at best they are very far away.
    pub(super) cost: f64,
    /// Their number.
    pub(super) points: usize,
}

/// Returns the points that are behind the camera, if acceleration and gravity move it.
pub(super) fn behind(recording: &Recording, pairs: &[ImagePair], rotation: &RotationFit) -> Behind {
    let gravity = fit(recording, &rotation.bias).mean;
    let orientations = Orientations::new(recording, &rotation.bias);
    let Some(first) = recording.readings.first() else { return Behind::default() };
    let mounting = recording.body_from_camera;
    let mut behind = Behind::default();
    let mut sample = 0;
    let mut time = first.timestamp;
    for group in pairs.chunks_exact(PAIRS) {
        if group.windows(2).any(|two| two[0].to < two[1].from - 1e-6) {
            continue;
        }
        let (mut velocity, mut position) = (Vector3::zeros(), Vector3::zeros());
        let mut motions = vec![];
        // integrates up to a time
        let mut advance = |until: f64, velocity: &mut Vector3<f64>, position: &mut Vector3<f64>| {
            while sample + 1 < orientations.samples.len()
                && time + 0.5 * orientations.samples[sample].seconds < until
            {
                let ImuSample { seconds, accelerometer, .. } = &orientations.samples[sample];
                let force = orientations.rotations[sample].act(accelerometer);
                let acceleration = if recording.has_no_gravity { force } else { force - gravity };
                *position += *velocity * *seconds + acceleration * (0.5 * seconds * seconds);
                *velocity += acceleration * *seconds;
                time += seconds;
                sample += 1;
            }
            // readings that are not in order have no samples
            orientations.rotations.get(sample).copied().unwrap_or_else(So3::identity)
        };
        let mut before = advance(group[0].from, &mut velocity, &mut position);
        (velocity, position) = (Vector3::zeros(), Vector3::zeros());
        for pair in group {
            let start = position;
            let after = advance(pair.to, &mut velocity, &mut position);
            let arm = after.act(&mounting.translation) - before.act(&mounting.translation);
            motions.push(Motion {
                view: View::new(pair, recording, &rotation.bias, &So3::identity()),
                camera_from_start: after.compose(&mounting.rotation).matrix().transpose(),
                displacement: position - start + arm,
                seconds: pair.to - pair.from,
            });
            before = after;
        }
        behind_in_group(recording, &motions, &mut behind);
    }
    behind
}

fn behind_in_group(recording: &Recording, motions: &[Motion], behind: &mut Behind) {
    let camera = &recording.camera;
    let mut initial = Vector3::zeros();
    let direction = |motion: &Motion, initial: &Vector3<f64>| {
        motion.camera_from_start * (motion.displacement + initial * motion.seconds)
    };
    for _ in 0..8 {
        let mut h = Matrix3::identity() / (VELOCITY * VELOCITY);
        let mut g = initial / (VELOCITY * VELOCITY);
        for motion in motions {
            let moved = direction(motion, &initial);
            let length = moved.norm().max(1e-3);
            for rays in &motion.view.rays {
                let (residual, factor) = View::residual(camera, rays, &(moved / length));
                let factor = factor / length;
                let row = motion.camera_from_start.transpose()
                    * rays[0].cross(&rays[1])
                    * (factor * motion.seconds);
                let weight = 2.0 / (1.0 + residual * residual);
                h += row * row.transpose() * weight;
                g += row * (weight * residual);
            }
        }
        let Some(inverse) = h.try_inverse() else { break };
        initial -= inverse * g;
    }
    for motion in motions {
        let moved = direction(motion, &initial);
        for [a, b] in &motion.view.rays {
            let normal = a.cross(b);
            // the depths at both ends have equal signs unless the parallax is small
            if a.cross(&moved).dot(&normal) > 0.0 {
                behind.cost += loss(camera.fx * normal.norm());
                behind.points += 1;
            }
        }
    }
}
