//! Preintegration: the samples between two states as one relative motion.
use crate::samples::{ImuDensities, ImuSample, SampleError};
use manifactor_geometry::{ImuBias, So3};
use manifactor_graph::{Jet, JetOf, Manifold, Scalar};
use nalgebra::{Const, SMatrix, SVector, Vector3};

/// Directions of one step: rotation, position and velocity before it, rate and acceleration.
const DIRECTIONS: usize = 15;

/// The motion over some time without gravity, in the frame at its beginning.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RelativeMotion<T: Scalar = f64> {
    /// Rotates directions from the frame at the end to the frame at the beginning.
    pub rotation: So3<T>,
    /// Change of position without the part due to the initial velocity, in metres.
    pub position: Vector3<T>,
    /// Change of velocity, in m/s.
    pub velocity: Vector3<T>,
}

impl<T: Scalar> RelativeMotion<T> {
    /// Returns no motion.
    pub fn identity() -> Self {
        Self { rotation: So3::identity(), position: Vector3::zeros(), velocity: Vector3::zeros() }
    }

    /// Returns the motion followed by `seconds` with constant rate and specific force, both in the frame of
    /// the IMU. This is the exact solution: the force turns with the IMU during the step.
    pub fn then(&self, rate: &Vector3<T>, force: &Vector3<T>, seconds: f64) -> Self {
        let turn = rate * T::from(seconds);
        let (velocity, position) = So3::integrals(&turn, force);
        Self {
            rotation: self.rotation.compose(&So3::exp(&turn)),
            position: self.position
                + self.velocity * T::from(seconds)
                + self.rotation.act(&position) * T::from(seconds * seconds),
            velocity: self.velocity + self.rotation.act(&velocity) * T::from(seconds),
        }
    }
}

/// The samples between two states as one relative motion. It has a covariance and derivatives with respect to
/// the biases, so that a new bias needs no second integration.
///
/// Errors are in the order rotation (rad), position (m), velocity (m/s), bias of the gyroscope (rad/s), bias of
/// the accelerometer (m/s²). Errors of the rotation are in the frame at the end, those of position and velocity in the frame
/// at the beginning. See Forster, Carlone, Dellaert and Scaramuzza, *On-Manifold Preintegration for
/// Real-Time Visual-Inertial Odometry*, T-RO 2017. Samples hold for their whole duration.
#[derive(Debug, Clone, PartialEq)]
pub struct Preintegration {
    /// Motion with the bias `bias`.
    pub motion: RelativeMotion,
    /// Bias that was subtracted.
    pub bias: ImuBias,
    /// Duration, in seconds.
    pub seconds: f64,
    /// Covariance of motion and biases at the end, for a known bias at the beginning.
    pub covariance: SMatrix<f64, 15, 15>,
    /// Derivative of the motion with respect to the bias.
    pub by_bias: SMatrix<f64, 9, 6>,
}

impl Preintegration {
    /// Begins a preintegration without samples.
    pub fn new(bias: ImuBias) -> Self {
        Self {
            motion: RelativeMotion::identity(),
            bias,
            seconds: 0.0,
            covariance: SMatrix::zeros(),
            by_bias: SMatrix::zeros(),
        }
    }

    /// Integrates samples, which follow each other without gaps.
    ///
    /// # Errors
    /// If there is no sample, or one cannot be integrated.
    pub fn of(samples: &[ImuSample], densities: &ImuDensities, bias: ImuBias) -> Result<Self, SampleError> {
        let mut preintegration = Self::new(bias);
        for (index, sample) in samples.iter().enumerate() {
            sample.check(index)?;
            preintegration.add(sample, densities);
        }
        if samples.is_empty() { Err(SampleError::None) } else { Ok(preintegration) }
    }

    /// Adds a sample.
    pub fn add(&mut self, sample: &ImuSample, densities: &ImuDensities) {
        let dt = sample.seconds;
        let rate = sample.gyroscope - self.bias.gyroscope();
        let force = sample.accelerometer - self.bias.accelerometer();
        let next = self.motion.then(&rate, &force, dt);
        let step = self.derivative(&next, &rate, &force, dt);
        let (before, inputs) = (step.fixed_columns::<9>(0), step.fixed_columns::<6>(9));
        // a bias is subtracted from the inputs
        let mut transition = SMatrix::<f64, 15, 15>::identity();
        transition.fixed_view_mut::<9, 9>(0, 0).copy_from(&before);
        transition.fixed_view_mut::<9, 6>(0, 9).copy_from(&-inputs);
        // the mean of white noise over the sample's duration
        let white = |density: f64| density * density / dt;
        let [gyroscope, accelerometer] = [*densities.gyroscope, *densities.accelerometer].map(white);
        let noise = SVector::<f64, 6>::from_fn(|i, _| if i < 3 { gyroscope } else { accelerometer });
        let mut covariance = transition * self.covariance * transition.transpose();
        let mut motion = covariance.fixed_view_mut::<9, 9>(0, 0);
        motion += inputs * SMatrix::from_diagonal(&noise) * inputs.transpose();
        // white noise within the sample moves the position beyond what its mean does: σ²dt³ (1/3 - 1/4)
        (3..6).for_each(|i| motion[(i, i)] += accelerometer * dt.powi(4) / 12.0);
        for i in 0..6 {
            let walk = if i < 3 { densities.gyroscope_walk } else { densities.accelerometer_walk };
            covariance[(9 + i, 9 + i)] += walk.get().powi(2) * dt;
        }
        self.covariance = (covariance + covariance.transpose()) * 0.5;
        self.by_bias = before * self.by_bias - inputs;
        self.motion = next;
        self.seconds += dt;
    }

    /// Returns the derivative of one step, by the code of the step itself.
    fn derivative(
        &self,
        next: &RelativeMotion,
        rate: &Vector3<f64>,
        force: &Vector3<f64>,
        seconds: f64,
    ) -> SMatrix<f64, 9, DIRECTIONS> {
        type J = JetOf<Const<DIRECTIONS>>;
        let seed = |x: &Vector3<f64>, first: usize| {
            Vector3::from_fn(|i, _| {
                let unit = SVector::<f64, DIRECTIONS>::from_fn(|k, _| if k == first + i { 1.0 } else { 0.0 });
                J::with_gradient(x[i], unit.as_slice())
            })
        };
        let before = RelativeMotion {
            rotation: self.motion.rotation.seed_in::<J>(DIRECTIONS, 0),
            position: seed(&self.motion.position, 3),
            velocity: seed(&self.motion.velocity, 6),
        };
        let after = before.then(&seed(rate, 9), &seed(force, 12), seconds);
        let turned = next.rotation.lift::<J>().between(&after.rotation).log();
        let rows = turned.iter().chain(&after.position).chain(&after.velocity);
        let mut derivative = SMatrix::zeros();
        for (row, entry) in rows.enumerate() {
            for (column, slope) in entry.gradient().unwrap_or_default().iter().enumerate() {
                derivative[(row, column)] = *slope;
            }
        }
        derivative
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_graph::checked::Positive;
    use proptest::prelude::*;
    use rand::SeedableRng;
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    fn any_samples() -> impl Strategy<Value = Vec<ImuSample>> {
        let numbers = prop::array::uniform6(-3.0..3.0_f64);
        prop::collection::vec((numbers, 0.001..0.02_f64), 1..40).prop_map(|samples| {
            let sample = |(x, seconds): ([f64; 6], f64)| ImuSample {
                seconds,
                gyroscope: Vector3::new(x[0], x[1], x[2]),
                accelerometer: Vector3::new(x[3], x[4], x[5] + 9.81),
            };
            samples.into_iter().map(sample).collect()
        })
    }

    fn difference(a: &RelativeMotion, b: &RelativeMotion) -> SVector<f64, 9> {
        let (turn, p, v) = (a.rotation.local(&b.rotation), b.position - a.position, b.velocity - a.velocity);
        SVector::from_iterator(turn.iter().chain(&p).chain(&v).copied())
    }

    proptest! {
        #[test]
        fn the_motion_is_the_limit_of_many_small_steps(samples in any_samples()) {
            let preintegration = Preintegration::of(&samples, &ImuDensities::default(), ImuBias::zero()).unwrap();
            // Euler steps with half the error for twice the number of steps, extrapolated to none (Richardson)
            let euler = |count: u32| {
                let mut motion = RelativeMotion::<f64>::identity();
                for sample in &samples {
                    let dt = sample.seconds / f64::from(count);
                    for _ in 0..count {
                        let force = motion.rotation.act(&sample.accelerometer);
                        motion.position += motion.velocity * dt + force * (0.5 * dt * dt);
                        motion.velocity += force * dt;
                        motion.rotation = motion.rotation.retract(&(sample.gyroscope * dt));
                    }
                }
                difference(&preintegration.motion, &motion)
            };
            let (coarse, middle, fine) = (euler(16), euler(32), euler(64));
            let limit = (fine * 8.0 - middle * 6.0 + coarse) / 3.0;
            prop_assert!(limit.norm() < 1e-7, "{limit}");
        }

        #[test]
        fn a_new_bias_changes_the_motion_by_its_derivative(samples in any_samples(), bias in prop::array::uniform6(-1.0..1.0_f64)) {
            let densities = ImuDensities::default();
            let of = |bias| Preintegration::of(&samples, &densities, bias).unwrap();
            let there = SVector::<f64, 6>::from(bias) * 1e-4;
            let (ahead, behind) = (of(ImuBias(there)), of(ImuBias(-there)));
            let expected = of(ImuBias::zero()).by_bias * there * 2.0;
            let found = difference(&behind.motion, &ahead.motion);
            prop_assert!((found - expected).norm() < 1e-9, "{}", found - expected);
        }
    }

    #[test]
    fn the_covariance_is_that_of_simulated_noise() {
        let densities = ImuDensities {
            gyroscope: Positive::literal(1e-3),
            accelerometer: Positive::literal(1e-2),
            gyroscope_walk: Positive::literal(2e-3),
            accelerometer_walk: Positive::literal(2e-2),
        };
        let sample = |k: usize| {
            let t = k as f64 * 0.01;
            ImuSample {
                seconds: 0.01,
                gyroscope: Vector3::new(t.sin(), 0.5, -t),
                accelerometer: Vector3::new(1.0, 2.0 * t, 9.81),
            }
        };
        let samples: Vec<_> = (0..50).map(sample).collect();
        let truth = Preintegration::of(&samples, &densities, ImuBias::zero()).unwrap();
        let information = truth.covariance.try_inverse().unwrap();
        let mut random = Pcg64::seed_from_u64(7);
        let mut normal = |scale: f64| {
            Vector3::from_fn(|_, _| {
                let x: f64 = StandardNormal.sample(&mut random);
                scale * x
            })
        };
        let runs = 400;
        let mut sum = 0.0;
        for _ in 0..runs {
            let mut bias = ImuBias::zero();
            let noisy = samples.iter().map(|sample| {
                let noisy = ImuSample {
                    seconds: sample.seconds,
                    gyroscope: sample.gyroscope + bias.gyroscope() + normal(1e-3 / 0.1),
                    accelerometer: sample.accelerometer + bias.accelerometer() + normal(1e-2 / 0.1),
                };
                let (g, a) = (normal(2e-3 * 0.1), normal(2e-2 * 0.1));
                bias = ImuBias(bias.0 + SVector::<f64, 6>::from_iterator(g.iter().chain(&a).copied()));
                noisy
            });
            let noisy: Vec<_> = noisy.collect();
            let measured = Preintegration::of(&noisy, &densities, ImuBias::zero()).unwrap();
            // the true motion minus the measured one, and the bias at the end
            let motion = difference(&measured.motion, &truth.motion);
            let error = SVector::<f64, 15>::from_iterator(motion.iter().chain(bias.0.iter()).copied());
            sum += error.dot(&(information * error));
        }
        // the sum is χ² distributed with 15 degrees of freedom a run; three standard deviations
        let degrees = 15.0 * f64::from(runs);
        assert!((sum - degrees).abs() < 3.0 * (2.0 * degrees).sqrt(), "{sum} for {degrees}");
    }
}
