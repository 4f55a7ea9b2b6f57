//! The likelihood of image points, given the rotation that the gyroscope measured.
//!
//! Two images and the rotation between them leave the direction of the translation open. Each tracked point is in a
//! plane with both cameras, and its distance from that plane is a residual in pixels. The direction of each pair is
//! found in closed form, and the bias of the gyroscope by Gauss-Newton steps.
use super::Recording;
use super::clocks::median;
use crate::samples::ImuReading;
use manifactor_geometry::{Camera, So3};
use nalgebra::{DMatrix, DVector, Matrix3, SVector, Vector2, Vector3};
use std::collections::BTreeMap;

/// Time between the two images of a pair, in seconds: long enough for a parallax, short enough for a track.
const SPAN: f64 = 0.2;
/// Minimum number of points in both images.
pub(super) const MIN_POINTS: usize = 6;
/// Scale of the Cauchy distribution of residuals, in pixels.
const SCALE: f64 = 1.0;
/// Number of Gauss-Newton steps for the bias, and for bias and rotation.
const STEPS: [usize; 2] = [5, 20];
/// Standard deviation of the gyroscope's bias, in rad/s, before any measurement.
const BIAS: f64 = 0.1;
/// Smallest sine between a ray and the direction of the translation.
const MIN_SINE: f64 = 0.05;
/// Directions that are tried at first, from two points each.
const CANDIDATES: usize = 40;

/// Two images with the pixels of the points in both.
#[derive(Debug, Clone)]
pub(super) struct ImagePair {
    pub(super) from: f64,
    pub(super) to: f64,
    pub(super) pixels: Vec<[Vector2<f64>; 2]>,
}

/// Returns every `stride`-th pair of images that follow each other, with readings for all of the time between them.
pub(super) fn pairs(recording: &Recording, stride: usize) -> Vec<ImagePair> {
    let (Some(first), Some(last)) = (recording.readings.first(), recording.readings.last()) else {
        return vec![];
    };
    let images = &recording.images;
    let covered = |time: &f64| (first.timestamp..=last.timestamp).contains(time);
    let (mut pairs, mut j) = (vec![], 0);
    while let Some((from, before)) = images.get(j) {
        let k = j + 1 + images[j + 1..].partition_point(|(time, _)| time - from < SPAN - 1e-3);
        let Some((to, after)) = images.get(k) else { break };
        j = k;
        let before: BTreeMap<u64, Vector2<f64>> = before.iter().copied().collect();
        let both = |(id, pixel): &(u64, Vector2<f64>)| Some([*before.get(id)?, *pixel]);
        let pixels: Vec<_> = after.iter().filter_map(both).collect();
        if pixels.len() >= MIN_POINTS && to - from < 3.0 * SPAN && covered(from) && covered(to) {
            pairs.push(ImagePair { from: *from, to: *to, pixels });
        }
    }
    pairs.into_iter().step_by(stride).collect()
}

/// The rotation of the IMU between two times: from the frame at the end to the frame at the beginning, and its derivative
/// with respect to the gyroscope's bias, in the frame at the end.
pub(super) fn rotation(
    readings: &[ImuReading],
    from: f64,
    to: f64,
    bias: &Vector3<f64>,
) -> (So3, Matrix3<f64>) {
    let (mut rotation, mut by_bias) = (So3::identity(), Matrix3::zeros());
    let samples = ImuReading::samples(readings, from, to, f64::INFINITY).unwrap_or_default();
    for sample in samples {
        let turn = So3::exp(&((sample.gyroscope - bias) * sample.seconds));
        rotation = rotation.compose(&turn);
        by_bias = turn.matrix().transpose() * by_bias - Matrix3::identity() * sample.seconds;
    }
    (rotation, by_bias)
}

/// A pair of images with rays.
pub(super) struct View {
    /// Rays at the beginning, in the camera's frame at the end, and rays at the end. All have length one.
    pub(super) rays: Vec<[Vector3<f64>; 2]>,
    /// Rotates from the camera's frame at the beginning to that at the end.
    between: Matrix3<f64>,
    /// Derivative of the camera's rotation with respect to the bias, in the frame at the end.
    by_bias: Matrix3<f64>,
}

/// The result of a fit.
#[derive(Debug, Clone)]
pub(super) struct RotationFit {
    /// Negative logarithm of the likelihood.
    pub(super) cost: f64,
    /// Median of the residuals, in pixels.
    pub(super) median: f64,
    /// Number of points in all pairs.
    pub(super) points: usize,
    /// Bias of the gyroscope, in rad/s.
    pub(super) bias: Vector3<f64>,
    /// Rotation of the camera in its own frame that fits best, if it was free.
    pub(super) turn: So3,
}

impl View {
    pub(super) fn new(pair: &ImagePair, recording: &Recording, bias: &Vector3<f64>, turn: &So3) -> Self {
        let mounting = recording.body_from_camera.rotation.compose(turn);
        let (rotation, by_bias) = rotation(&recording.readings, pair.from, pair.to, bias);
        // from the camera at the beginning to the camera at the end
        let between = mounting.inverse().compose(&rotation.inverse()).compose(&mounting);
        let ray = |pixel: Vector2<f64>| recording.ray(pixel).normalize();
        let rays = pair.pixels.iter().map(|[a, b]| [between.act(&ray(*a)), ray(*b)]).collect();
        Self { rays, between: between.matrix(), by_bias: mounting.matrix().transpose() * by_bias }
    }

    /// Returns the residual of a point in pixels, and the factor from its distance to the plane.
    pub(super) fn residual(
        camera: &Camera,
        [a, b]: &[Vector3<f64>; 2],
        direction: &Vector3<f64>,
    ) -> (f64, f64) {
        let spread = (direction.cross(a).norm_squared() + direction.cross(b).norm_squared()).sqrt();
        // far from the centre, a pixel is a smaller angle: without this, a tiny focal length would explain all points
        let factor = camera.fx / (spread.max(MIN_SINE) * b.z.max(MIN_SINE));
        (factor * direction.dot(&a.cross(b)), factor)
    }

    fn cost(&self, camera: &Camera, direction: &Vector3<f64>) -> f64 {
        self.rays.iter().map(|rays| loss(Self::residual(camera, rays, direction).0)).sum()
    }

    /// Returns the direction of the translation, in the frame at the end.
    fn direction(&self, camera: &Camera) -> Vector3<f64> {
        let normals: Vec<Vector3<f64>> = self.rays.iter().map(|[a, b]| a.cross(b)).collect();
        let n = normals.len();
        // two points each, spread over all points
        let candidates = (0..CANDIDATES).filter_map(|c| {
            let (i, j) = (c % n, (c % n + 1 + c / n * 3) % n);
            normals[i].cross(&normals[j]).try_normalize(1e-12)
        });
        let costs = candidates.map(|direction| (self.cost(camera, &direction), direction));
        let best = costs.min_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, direction)| direction);
        let mut direction = best.unwrap_or_else(Vector3::z);
        for _ in 0..3 {
            let mut sum = Matrix3::zeros();
            for (rays, normal) in self.rays.iter().zip(&normals) {
                let (residual, factor) = Self::residual(camera, rays, &direction);
                let weight = factor * factor / (1.0 + (residual / SCALE).powi(2));
                sum += normal * normal.transpose() * weight;
            }
            let eigen = sum.symmetric_eigen();
            let next = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
            if self.cost(camera, &next) >= self.cost(camera, &direction) {
                break;
            }
            direction = next;
        }
        direction
    }
}

/// The negative logarithm of Cauchy's density, without its constant.
pub(super) fn loss(residual: f64) -> f64 {
    (residual / SCALE).powi(2).ln_1p()
}

/// Fits the bias of the gyroscope, and the rotation of the camera if that is free. Starts without a bias, at the given mounting.
pub(super) fn fit(recording: &Recording, pairs: &[ImagePair], is_free: bool) -> RotationFit {
    let camera = &recording.camera;
    let mut best: Option<RotationFit> = None;
    let (mut bias, mut turn) = (Vector3::zeros(), So3::identity());
    let steps = STEPS[usize::from(is_free)];
    for step in 0..=steps {
        let mut residuals = vec![];
        let mut cost = (bias / BIAS).norm_squared() * 0.5;
        let unknowns = if is_free { 6 } else { 3 };
        let (mut h, mut g) = (DMatrix::<f64>::zeros(unknowns, unknowns), DVector::<f64>::zeros(unknowns));
        for i in 0..3 {
            h[(i, i)] = 1.0 / (BIAS * BIAS);
            g[i] = bias[i] / (BIAS * BIAS);
        }
        for pair in pairs {
            let view = View::new(pair, recording, &bias, &turn);
            let direction = view.direction(camera);
            for rays in &view.rays {
                let (residual, factor) = View::residual(camera, rays, &direction);
                cost += loss(residual);
                residuals.push(residual.abs());
                let [a, b] = rays;
                // turns of `a` in the frame at the end
                let by_turn = a.cross(&b.cross(&direction)) * factor;
                let by_bias = -(view.by_bias.transpose() * by_turn);
                let mut row = SVector::<f64, 6>::zeros();
                row.fixed_rows_mut::<3>(0).copy_from(&by_bias);
                if is_free {
                    // the mounting acts at both ends
                    row.fixed_rows_mut::<3>(3).copy_from(&(view.between.transpose() * by_turn - by_turn));
                }
                let row = row.rows(0, unknowns);
                let weight = 2.0 / (SCALE * SCALE + residual * residual);
                h.ger(weight, &row, &row, 1.0);
                g.axpy(weight * residual, &row, 1.0);
            }
        }
        if best.as_ref().is_none_or(|best| cost < best.cost) {
            let points = residuals.len();
            let median = median(residuals.into_iter()).unwrap_or(0.0);
            best = Some(RotationFit { cost, median, points, bias, turn });
        }
        if step == steps {
            break;
        }
        let Some(solved) = h.cholesky().map(|h| h.solve(&-g)) else { break };
        if solved.norm() < 1e-7 {
            break;
        }
        bias += solved.fixed_rows::<3>(0);
        if is_free {
            turn = turn.compose(&So3::exp(&solved.fixed_rows::<3>(3).into_owned()));
        }
    }
    best.unwrap_or(RotationFit { cost: 0.0, median: 0.0, points: 0, bias, turn })
}
