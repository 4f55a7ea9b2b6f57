//! Fit of an ellipsoid to boxes from known poses, from the first box on.
//!
//! One box determines an object except for its depth. A weak prior constrains the rest: the usual depth of
//! the scene, axes of similar length, and a rotation close to that of the first camera.
use super::posed_detections::PosedDetection;
use manifactor_geometry::Se3;
use manifactor_graph::{Manifold, Residual};
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric, QuadricPrior};
use manifactor_recording::measurement::{MeasurementSigmas, ResidualRows};
use nalgebra::{Cholesky, SMatrix, SVector, Vector3, Vector4};

type Matrix9 = SMatrix<f64, 9, 9>;
type Vector9 = SVector<f64, 9>;

/// Noise of boxes and of the measurements that come with them.
#[derive(Debug, Clone, Copy)]
pub(super) struct BoxNoise {
    /// Standard deviation of a side, in pixels.
    pub px: f64,
    /// Standard deviation of a side, relative to width and height.
    pub of_size: f64,
    /// Noise of further measurements of a detection.
    pub others: MeasurementSigmas,
}

/// Prior of an object, independent of its later boxes.
#[derive(Debug, Clone)]
pub(super) enum ObjectPrior {
    /// From the first box.
    FirstBox(FirstBoxPrior),
    /// From a prior map.
    Known {
        /// Ellipsoid in the prior map.
        quadric: DualQuadric,
        /// Square root W of the information, WᵀW = Σ⁻¹.
        root: Box<Matrix9>,
    },
}

/// Prior of an object from its first box.
#[derive(Debug, Clone, Copy)]
pub(super) struct FirstBoxPrior {
    /// Ellipsoid at the assumed distance.
    quadric: DualQuadric,
    /// Camera centre of the first box.
    eye: Vector3<f64>,
    /// Assumed distance from the camera, in metres.
    distance: f64,
    /// Standard deviation of the logarithm of the distance.
    spread: f64,
}

/// An ellipsoid with its covariance.
#[derive(Debug, Clone, Copy)]
pub(super) struct FittedEllipsoid {
    pub quadric: DualQuadric,
    /// In the tangent space of the quadric.
    pub covariance: Matrix9,
}

impl FittedEllipsoid {
    /// Returns whether one of two ellipsoids contains the centre of the other.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        let (own, others) = (&self.quadric, &other.quadric);
        own.contains(&others.centroid()) || others.contains(&own.centroid())
    }
}

/// Standard deviation of the logarithm of a semi-axis, relative to the one from the first box and the
/// distance.
const SHAPE_SIGMA: f64 = 0.5;
/// Standard deviation of the rotation, in radians.
const ROTATION_SIGMA_RAD: f64 = 0.5;
/// Maximum number of steps of a fit.
const MAX_STEPS: usize = 8;
/// The fit ends when a step reduces the cost by less than this share.
const MIN_RELATIVE_DECREASE: f64 = 1e-3;
/// Squared scale of Cauchy's loss: squared residuals beyond it are down-weighted.
const CAUCHY_SCALE_SQUARED: f64 = 9.0;
/// Cost of a box if the ellipsoid has no projection in its image.
const INVISIBLE_COST: f64 = 40.0;

impl BoxNoise {
    /// Returns the standard deviations of the sides.
    pub(super) fn deviations(&self, b: &BoundingBox) -> Vector4<f64> {
        let (x, y) = (self.px.hypot(self.of_size * b.width()), self.px.hypot(self.of_size * b.height()));
        Vector4::new(x, y, x, y)
    }
}

impl ObjectPrior {
    /// Returns the prior of an object seen once, at `depth` metres, with the standard deviation `spread` of
    /// its logarithm.
    pub(super) fn new(seen: &PosedDetection, depth: f64, spread: f64) -> Self {
        let (b, camera) = (&seen.bounding_box, &seen.camera.model);
        let ray = camera.ray(b.centre());
        let eye = seen.world_from_camera.translation;
        let centre = seen.world_from_camera.act(&(ray * depth));
        let size = |length: f64, focal: f64| (0.5 * length.max(1.0) * depth / focal).max(1e-3);
        let (x, y) = (size(b.width(), camera.fx), size(b.height(), camera.fy));
        let pose = Se3::new(seen.world_from_camera.rotation, centre);
        let quadric = DualQuadric { pose, semi_axes: Vector3::new(x, y, (x * y).sqrt()) };
        Self::FirstBox(FirstBoxPrior { quadric, eye, distance: (centre - eye).norm(), spread })
    }

    /// Returns the prior of an object with the mean and covariance of an estimate.
    pub(super) fn from_estimate(fitted: &FittedEllipsoid) -> Self {
        let information = Cholesky::new(fitted.covariance).map(|factor| factor.inverse());
        let root = information.and_then(Cholesky::new).map(|factor| factor.l().transpose());
        // a covariance that was read from a file is positive definite
        Self::Known { quadric: fitted.quadric, root: Box::new(root.unwrap_or_else(Matrix9::identity)) }
    }

    /// Returns the ellipsoid that a fit starts from.
    pub(super) fn initial_quadric(&self) -> DualQuadric {
        match self {
            Self::FirstBox(first) => first.quadric,
            Self::Known { quadric, .. } => *quadric,
        }
    }

    /// Returns the residual of the prior and its Jacobian.
    fn rows(&self, quadric: &DualQuadric) -> (Vector9, Matrix9) {
        match self {
            Self::FirstBox(first) => first.rows(quadric),
            Self::Known { quadric: value, root } => {
                let mut jacobians = (Matrix9::zeros(),);
                let r = QuadricPrior { value: *value }.linearize((quadric,), &[true; 9], &mut jacobians);
                (**root * r, **root * jacobians.0)
            }
        }
    }
}

impl FirstBoxPrior {
    /// Returns the residual of the distance, three semi-axes and three angles. The last two rows are zero.
    fn rows(&self, quadric: &DualQuadric) -> (Vector9, Matrix9) {
        let away = quadric.centroid() - self.eye;
        let log = (away.norm().max(1e-6) / self.distance).ln();
        // the tangent of the translation is in the frame of the ellipsoid
        let by_place = quadric.pose.rotation.inverse().act(&away) / away.norm_squared().max(1e-12);
        let turn = self.quadric.pose.rotation.between(&quadric.pose.rotation).log();
        let (mut r, mut j) = (Vector9::zeros(), Matrix9::zeros());
        r[0] = log / self.spread;
        for c in 0..3 {
            j[(0, 3 + c)] = by_place[c] / self.spread;
            r[1 + c] = ((quadric.semi_axes[c] / self.quadric.semi_axes[c]).ln() - log) / SHAPE_SIGMA;
            for k in 0..3 {
                j[(1 + c, 3 + k)] = -by_place[k] / SHAPE_SIGMA;
            }
            j[(1 + c, 6 + c)] = 1.0 / SHAPE_SIGMA;
            r[4 + c] = turn[c] / ROTATION_SIGMA_RAD;
            j[(4 + c, c)] = 1.0 / ROTATION_SIGMA_RAD;
        }
        (r, j)
    }
}

/// The predicted box of an ellipsoid, with the Jacobians of its sides by pose and ellipsoid.
pub(super) struct PredictedBox {
    pub bounding_box: BoundingBox,
    pub by_pose: SMatrix<f64, SIDES, 6>,
    pub by_quadric: SMatrix<f64, SIDES, 9>,
}

/// Number of sides of a box.
pub(super) const SIDES: usize = 4;

/// Predicts the box of an ellipsoid; `None` if no part of it is in the image.
pub(super) fn predict(pose: &Se3, quadric: &DualQuadric, camera: &Camera) -> Option<PredictedBox> {
    let nothing = BoundingBox { xmin: 0.0, ymin: 0.0, xmax: 0.0, ymax: 0.0 };
    let factor = BoundingBoxFactor { bounding_box: nothing, camera: *camera, model: BoxModel::Truncated };
    if !factor.is_defined((pose, quadric)) {
        return None;
    }
    let mut jacobians = (SMatrix::zeros(), SMatrix::zeros());
    let b = factor.linearize((pose, quadric), &[true; 15], &mut jacobians);
    let bounding_box = BoundingBox::new(b.into()).ok()?;
    Some(PredictedBox { bounding_box, by_pose: jacobians.0, by_quadric: jacobians.1 })
}

/// Fits an ellipsoid by damped Gauss-Newton steps from `start`; `None` if the data do not determine it.
pub(super) fn fit(
    belief: &ObjectPrior,
    start: DualQuadric,
    seen: &[PosedDetection],
    noise: &BoxNoise,
) -> Option<FittedEllipsoid> {
    let (mut quadric, mut damping) = (start, 1e-3);
    let mut system = NormalEquations::new(belief, &quadric, seen, noise);
    for _ in 0..MAX_STEPS {
        let damped = system.h + Matrix9::from_diagonal(&system.h.diagonal()) * damping;
        let step = -Cholesky::new(damped)?.solve(&system.gradient);
        let next = quadric.retract(&step);
        let there = NormalEquations::new(belief, &next, seen, noise);
        if there.cost >= system.cost {
            damping *= 10.0;
            continue;
        }
        let is_done = system.cost - there.cost < MIN_RELATIVE_DECREASE * system.cost;
        (quadric, system) = (next, there);
        if is_done {
            break;
        }
        damping *= 0.1;
    }
    let covariance = Cholesky::new(system.h)?.inverse();
    covariance.iter().all(|x| x.is_finite()).then_some(FittedEllipsoid { quadric, covariance })
}

/// Cost and normal equations of the fit of an ellipsoid.
struct NormalEquations {
    cost: f64,
    gradient: Vector9,
    h: Matrix9,
}

impl NormalEquations {
    fn new(belief: &ObjectPrior, quadric: &DualQuadric, seen: &[PosedDetection], noise: &BoxNoise) -> Self {
        let (r, j) = belief.rows(quadric);
        let mut all = Self { cost: r.norm_squared(), gradient: j.tr_mul(&r), h: j.tr_mul(&j) };
        for seen in seen {
            match WhitenedResidual::new(quadric, seen, noise) {
                None => all.cost += INVISIBLE_COST,
                Some(whitened) => {
                    // Cauchy's loss of a detection as a whole
                    let square = whitened.square / CAUCHY_SCALE_SQUARED;
                    all.cost += CAUCHY_SCALE_SQUARED * square.ln_1p();
                    all.gradient += whitened.gradient / (1.0 + square);
                    all.h += whitened.h / (1.0 + square);
                }
            }
        }
        all
    }
}

impl PredictedBox {
    /// Returns the predicted minus the measured sides.
    pub(super) fn error(&self, b: &BoundingBox) -> Vector4<f64> {
        Vector4::from(self.bounding_box.bounds()) - Vector4::from(b.bounds())
    }
}

/// The whitened residuals of a detection, summed over its box and further measurements: Σr², Jᵀr and JᵀJ.
struct WhitenedResidual {
    square: f64,
    gradient: Vector9,
    h: Matrix9,
}

impl WhitenedResidual {
    /// Returns `None` if the ellipsoid has no box in this image.
    fn new(quadric: &DualQuadric, seen: &PosedDetection, noise: &BoxNoise) -> Option<Self> {
        let predicted = predict(&seen.world_from_camera, quadric, &seen.camera.model)?;
        let mut all = Self { square: 0.0, gradient: Vector9::zeros(), h: Matrix9::zeros() };
        all.add(
            predicted.error(&seen.bounding_box),
            &predicted.by_quadric,
            &noise.deviations(&seen.bounding_box).map(|sigma| 1.0 / sigma),
        );
        for measurement in seen.quantities.iter() {
            let Some(innovation) = measurement.innovation(&seen.world_from_camera, quadric) else { continue };
            let sigma = measurement.deviations(&noise.others, &ResidualRows::zeros());
            let weights =
                ResidualRows::from_fn(|i, _| if i < innovation.rows { 1.0 / sigma[i] } else { 0.0 });
            all.add(innovation.residual, &innovation.by_object, &weights);
        }
        Some(all)
    }

    fn add(&mut self, r: Vector4<f64>, j: &SMatrix<f64, SIDES, 9>, weights: &Vector4<f64>) {
        let (r, j) = (r.component_mul(weights), SMatrix::from_diagonal(weights) * j);
        self.square += r.norm_squared();
        self.gradient += j.tr_mul(&r);
        self.h += j.tr_mul(&j);
    }
}

/// Returns the squared whitened residual of a detection under Cauchy's loss.
pub(super) fn squared_error(quadric: &DualQuadric, seen: &PosedDetection, noise: &BoxNoise) -> f64 {
    let error = WhitenedResidual::new(quadric, seen, noise);
    error.map_or(INVISIBLE_COST, |error| CAUCHY_SCALE_SQUARED * (error.square / CAUCHY_SCALE_SQUARED).ln_1p())
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_recording::camera::Cameras;
    use manifactor_recording::measurement::Quantities;
    use nalgebra::Vector2;

    const CAMERA: Camera =
        Camera { fx: 500.0, fy: 500.0, cx: 320.0, cy: 240.0, skew: 0.0, width: 640, height: 480 };
    const NOISE: BoxNoise = BoxNoise { px: 2.0, of_size: 0.02, others: MeasurementSigmas { depth: 0.03 } };

    /// A camera that is `x` metres to the right and looks straight ahead.
    fn detection_at(x: f64, frame: usize, quadric: &DualQuadric) -> PosedDetection {
        let world_from_camera = Se3 { translation: Vector3::x() * x, ..Se3::identity() };
        let bounding_box = predict(&world_from_camera, quadric, &CAMERA).unwrap().bounding_box;
        let camera = Cameras::new(CAMERA).first().clone();
        PosedDetection { frame, camera, world_from_camera, bounding_box, quantities: Quantities::NONE }
    }

    fn ball(z: f64) -> DualQuadric {
        let pose = Se3 { translation: Vector3::new(0.1, 0.0, z), ..Se3::identity() };
        DualQuadric { pose, semi_axes: Vector3::new(0.1, 0.15, 0.1) }
    }

    #[test]
    fn one_box_says_all_but_the_depth() {
        let first = detection_at(0.0, 0, &ball(2.0));
        let belief = ObjectPrior::new(&first, 3.0, 0.5);
        let found = fit(&belief, belief.initial_quadric(), &[first], &NOISE).unwrap();
        let away = found.quadric.centroid();
        assert!((away.z - 3.0).abs() < 0.1, "{away}");
        let ray = CAMERA.ray(Vector2::new(345.0, 240.0)) * 3.0;
        assert!((away - ray).norm() < 0.05, "{away}");
        let [x, _, z] = [3, 4, 5].map(|i| found.covariance[(i, i)].sqrt());
        assert!(z > 0.8 && x < 0.3 * z, "{x} {z}");
    }

    #[test]
    fn boxes_from_the_side_say_the_depth() {
        let detections: Vec<_> =
            (0..8).map(|i| detection_at(0.1 * f64::from(i), i as usize, &ball(2.0))).collect();
        let belief = ObjectPrior::new(&detections[0], 3.0, 0.5);
        let found = fit(&belief, belief.initial_quadric(), &detections, &NOISE).unwrap();
        assert!((found.quadric.centroid() - ball(2.0).centroid()).norm() < 0.1, "{}", found.quadric);
        assert!(found.covariance[(5, 5)].sqrt() < 0.15);
        assert!(squared_error(&found.quadric, &detections[7], &NOISE) < 1.0);
        assert!(squared_error(&ball(4.0), &detections[7], &NOISE) > 10.0);
    }

    #[test]
    fn derivatives_of_a_belief_are_right() {
        let belief = ObjectPrior::new(&detection_at(0.0, 0, &ball(2.0)), 3.0, 0.5);
        check_derivatives(&belief);
        let covariance = Matrix9::from_fn(|r, c| if r == c { 0.04 } else { 0.01 });
        check_derivatives(&ObjectPrior::from_estimate(&FittedEllipsoid { quadric: ball(2.0), covariance }));
    }

    fn check_derivatives(belief: &ObjectPrior) {
        let at = belief.initial_quadric().retract(&Vector9::from_fn(|i, _| 0.02 * (i as f64 - 4.0)));
        let (_, j) = belief.rows(&at);
        for c in 0..9 {
            let step = Vector9::from_fn(|i, _| if i == c { 1e-6 } else { 0.0 });
            let (up, down) = (belief.rows(&at.retract(&step)).0, belief.rows(&at.retract(&-step)).0);
            let numeric = (up - down) / 2e-6;
            // the log of the rotation is linearized at the start, which is close
            let tolerance = if c < 3 { 0.1 } else { 1e-5 };
            assert!((numeric - j.column(c)).norm() < tolerance * (1.0 + numeric.norm()), "{c}");
        }
    }
}
