//! The factor of an inertial measurement unit between two states.
use crate::preintegration::Preintegration;
use crate::samples::{ImuDensities, ImuSample, SampleError};
use manifactor_geometry::{Coordinates, ImuBias, Se3, So3, Velocity};
use manifactor_graph::prelude::*;
use nalgebra::{Const, SMatrix, SVector};
use std::sync::Arc;

/// The samples of an inertial measurement unit between two states, preintegrated.
///
/// Variables: pose xᵢ and velocity vᵢ of the IMU in the world, its bias bᵢ, and the same at the end. With
/// (ΔR, Δp, Δv) integrated over the duration T and corrected for the bias bᵢ:
/// r = W (Log(ΔRᵀ RᵢᵀRⱼ), Rᵢᵀ(pⱼ - pᵢ - vᵢT - ½gT²) - Δp, Rᵢᵀ(vⱼ - vᵢ - gT) - Δv, bⱼ - bᵢ). W whitens by the
/// covariance that `noise` implies, so the `noise` of the factor stays at unit. Source: Forster, Carlone,
/// Dellaert and Scaramuzza, *On-Manifold Preintegration*, T-RO 2017.
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "v0", "b0", "x1", "v1", "b1"]
///
/// [factors.factor]
/// type = "imu"
/// seconds = [0.005, 0.005, 0.005]
/// gyroscope = [[0.1, 0.0, 0.2], [0.1, 0.0, 0.2], [0.1, 0.0, 0.25]]
/// accelerometer = [[0.2, 0.0, 9.8], [0.2, 0.1, 9.8], [0.2, 0.1, 9.7]]
/// noise = { gyroscope = 1.7e-4, accelerometer = 2e-3, gyroscope_walk = 2e-5, accelerometer_walk = 3e-3 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct Imu {
    document: Arc<Document>,
    preintegration: Arc<Preintegration>,
    /// W, with WᵀW = Σ⁻¹.
    whitening: Arc<SMatrix<f64, 15, 15>>,
}

/// The samples of an inertial measurement unit between two states, preintegrated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Imu")]
struct Document {
    /// Duration of each sample, in seconds.
    seconds: Vec<f64>,
    /// Rates of rotation, in rad/s.
    gyroscope: Vec<Coordinates<3>>,
    /// Specific forces, in m/s²: acceleration minus gravity.
    accelerometer: Vec<Coordinates<3>>,
    /// Noise densities of the IMU. Default: a small MEMS sensor.
    #[serde(default)]
    noise: ImuDensities,
    /// Bias for the integration, close to the solution. Default: zero.
    #[serde(default, skip_serializing_if = "is_zero")]
    bias: BiasDocument,
    /// Gravity in the world, in m/s². Default: 9.81 m/s² along -z.
    #[serde(default = "earth", skip_serializing_if = "is_earth")]
    gravity: Coordinates<3>,
}

/// A bias of an IMU.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
#[schemars(transparent)]
struct BiasDocument(ImuBias);

impl Default for BiasDocument {
    fn default() -> Self {
        Self(ImuBias::zero())
    }
}

fn is_zero(bias: &BiasDocument) -> bool {
    bias.0 == ImuBias::zero()
}

/// Returns gravity on Earth, with z up.
fn earth() -> Coordinates<3> {
    Coordinates::new(Vector3::new(0.0, 0.0, -9.81)).unwrap_or_default()
}

fn is_earth(gravity: &Coordinates<3>) -> bool {
    *gravity == earth()
}

impl Imu {
    /// Preintegrates samples, which follow each other without gaps. `bias` should be close to the
    /// solution. `gravity` is in the world, in m/s².
    ///
    /// # Errors
    /// If there is no sample, or one cannot be integrated.
    pub fn new(
        samples: &[ImuSample],
        noise: ImuDensities,
        bias: ImuBias,
        gravity: Coordinates<3>,
    ) -> Result<Self, SampleError> {
        let preintegration = Preintegration::of(samples, &noise, bias)?;
        let seconds = preintegration.seconds;
        let whitening = whitening(&preintegration.covariance).ok_or(SampleError::Covariance { seconds })?;
        let document = Document {
            seconds: samples.iter().map(|sample| sample.seconds).collect(),
            gyroscope: samples.iter().filter_map(|x| Coordinates::new(x.gyroscope).ok()).collect(),
            accelerometer: samples.iter().filter_map(|x| Coordinates::new(x.accelerometer).ok()).collect(),
            noise,
            bias: BiasDocument(bias),
            gravity,
        };
        Ok(Self {
            document: Arc::new(document),
            preintegration: Arc::new(preintegration),
            whitening: Arc::new(whitening),
        })
    }

    /// Returns the preintegrated samples.
    pub fn preintegration(&self) -> &Preintegration {
        &self.preintegration
    }

    /// Returns pose and velocity at the end of the samples from those at the beginning, for the bias of the
    /// integration.
    pub fn predict(&self, pose: &Se3, velocity: &Velocity) -> (Se3, Velocity) {
        let Preintegration { motion, seconds, .. } = &*self.preintegration;
        let (time, gravity) = (*seconds, self.gravity());
        let translation = pose.translation
            + velocity.0 * time
            + gravity * (0.5 * time * time)
            + pose.rotation.act(&motion.position);
        let velocity = velocity.0 + gravity * time + pose.rotation.act(&motion.velocity);
        (Se3::new(pose.rotation.compose(&motion.rotation), translation), Velocity(velocity))
    }

    /// Returns gravity in the world, in m/s².
    pub fn gravity(&self) -> Vector3<f64> {
        *self.document.gravity
    }
}

/// Returns W with WᵀW = Σ⁻¹: the inverse of the lower Cholesky factor. The scale of the rows is removed first,
/// because their variances differ by many orders of magnitude.
fn whitening(covariance: &SMatrix<f64, 15, 15>) -> Option<SMatrix<f64, 15, 15>> {
    let scale = covariance.diagonal().map(|variance| variance.sqrt().recip());
    let scaled = SMatrix::<f64, 15, 15>::from_fn(|i, j| covariance[(i, j)] * scale[i] * scale[j]);
    let mut whitening = scaled.cholesky()?.l().try_inverse()?;
    for (mut column, scale) in whitening.column_iter_mut().zip(&scale) {
        column *= *scale;
    }
    whitening.iter().all(|x| x.is_finite()).then_some(whitening)
}

impl TryFrom<Document> for Imu {
    type Error = SampleError;
    fn try_from(document: Document) -> Result<Self, SampleError> {
        let Document { seconds, gyroscope, accelerometer, noise, bias, gravity } = document;
        if seconds.len() != gyroscope.len() || seconds.len() != accelerometer.len() {
            return Err(SampleError::Lengths {
                seconds: seconds.len(),
                gyroscope: gyroscope.len(),
                accelerometer: accelerometer.len(),
            });
        }
        let parts = seconds.iter().zip(&gyroscope).zip(&accelerometer);
        let samples = parts.map(|((seconds, gyroscope), accelerometer)| ImuSample {
            seconds: *seconds,
            gyroscope: **gyroscope,
            accelerometer: **accelerometer,
        });
        Self::new(&samples.collect::<Vec<_>>(), noise, bias.0, gravity)
    }
}

impl From<Imu> for Document {
    fn from(imu: Imu) -> Self {
        Arc::unwrap_or_clone(imu.document)
    }
}

/// The relative motion of two states without gravity, and the residual before whitening.
struct Unwhitened<T: Scalar> {
    /// Corrected ΔRᵀ RᵢᵀRⱼ.
    turned: So3<T>,
    /// RᵢᵀRⱼ.
    rotation: So3<T>,
    /// Rᵢᵀ(pⱼ - pᵢ - vᵢT - ½gT²).
    position: Vector3<T>,
    /// Rᵢᵀ(vⱼ - vᵢ - gT).
    velocity: Vector3<T>,
    residual: SVector<T, 15>,
}

impl Imu {
    fn unwhitened<T: Scalar>(
        &self,
        (xi, vi, bi, xj, vj, bj): Lifted<<Self as Residual>::Variables, T>,
    ) -> Unwhitened<T> {
        let Preintegration { motion, bias, seconds, by_bias, .. } = &*self.preintegration;
        let change = by_bias.lift::<T>() * (bi - bias.lift::<T>());
        let rows = |first: usize| Vector3::new(change[first], change[first + 1], change[first + 2]);
        let (gravity, time) = (self.gravity(), *seconds);
        let inverse = xi.rotation.inverse();
        let rotation = inverse.compose(&xj.rotation);
        let free_fall = xi.translation + vi * T::from(time) + (gravity * (0.5 * time * time)).lift::<T>();
        let position = inverse.act(&(xj.translation - free_fall));
        let velocity = inverse.act(&(vj - vi - (gravity * time).lift::<T>()));
        let measured = motion.rotation.lift::<T>().compose(&So3::exp(&rows(0)));
        let turned = measured.between(&rotation);
        let parts = [
            turned.log(),
            position - motion.position.lift::<T>() - rows(3),
            velocity - motion.velocity.lift::<T>() - rows(6),
        ];
        let walk = bj - bi;
        let residual = SVector::from_fn(|i, _| if i < 9 { parts[i / 3][i % 3] } else { walk[i - 9] });
        Unwhitened { turned, rotation, position, velocity, residual }
    }
}

impl Residual for Imu {
    type Variables = (Se3, Velocity, ImuBias, Se3, Velocity, ImuBias);
    type Dim = Const<15>;

    fn residual<T: Scalar>(&self, variables: Lifted<Self::Variables, T>) -> SVector<T, 15> {
        self.whitening.lift::<T>() * self.unwhitened(variables).residual
    }

    fn linearize(
        &self,
        (xi, vi, bi, xj, vj, bj): Refs<'_, Self::Variables>,
        _free: &[bool],
        jacobians: &mut Jacobians<Self>,
    ) -> SVector<f64, 15> {
        let Preintegration { bias, seconds, by_bias, .. } = &*self.preintegration;
        let Unwhitened { turned, rotation, position, velocity, residual } =
            self.unwhitened((*xi, vi.0, bi.0, *xj, vj.0, bj.0));
        let logarithm = So3::inverse_right_jacobian(&turned.log());
        let inverse = xi.rotation.matrix().transpose();
        let (turn, identity) = (by_bias.fixed_rows::<3>(0), Matrix3::identity());
        let correction = turn * (bi.0 - bias.0);
        let corrected =
            So3::right_jacobian(&Vector3::new(correction[0], correction[1], correction[2])) * turn;
        let mut blocks = (
            SMatrix::<f64, 15, 6>::zeros(),
            SMatrix::<f64, 15, 3>::zeros(),
            SMatrix::<f64, 15, 6>::zeros(),
            SMatrix::<f64, 15, 6>::zeros(),
            SMatrix::<f64, 15, 3>::zeros(),
            SMatrix::<f64, 15, 6>::zeros(),
        );
        let place = |block: &mut SMatrix<f64, 15, 6>, row: usize, column: usize, part: &Matrix3<f64>| {
            block.fixed_view_mut::<3, 3>(row, column).copy_from(part);
        };
        place(&mut blocks.0, 0, 0, &(-logarithm * rotation.matrix().transpose()));
        place(&mut blocks.0, 3, 0, &position.cross_matrix());
        place(&mut blocks.0, 3, 3, &-identity);
        place(&mut blocks.0, 6, 0, &velocity.cross_matrix());
        blocks.1.fixed_view_mut::<3, 3>(3, 0).copy_from(&(-inverse * *seconds));
        blocks.1.fixed_view_mut::<3, 3>(6, 0).copy_from(&-inverse);
        blocks
            .2
            .fixed_view_mut::<3, 6>(0, 0)
            .copy_from(&(-logarithm * turned.matrix().transpose() * corrected));
        blocks.2.fixed_view_mut::<6, 6>(3, 0).copy_from(&-by_bias.fixed_rows::<6>(3));
        blocks.2.fixed_view_mut::<6, 6>(9, 0).fill_with_identity();
        blocks.2.fixed_view_mut::<6, 6>(9, 0).neg_mut();
        place(&mut blocks.3, 0, 0, &logarithm);
        place(&mut blocks.3, 3, 3, &rotation.matrix());
        blocks.4.fixed_view_mut::<3, 3>(6, 0).copy_from(&inverse);
        blocks.5.fixed_view_mut::<6, 6>(9, 0).fill_with_identity();
        let whitening = &*self.whitening;
        jacobians.0 = whitening * blocks.0;
        jacobians.1 = whitening * blocks.1;
        jacobians.2 = whitening * blocks.2;
        jacobians.3 = whitening * blocks.3;
        jacobians.4 = whitening * blocks.4;
        jacobians.5 = whitening * blocks.5;
        whitening * residual
    }
}

register_factor!("imu", Imu);

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::testing::{any_imu_bias, any_se3, any_velocity, se3_tangent};
    use manifactor_testing::{factor_laws, jacobian_laws};
    use proptest::prelude::*;

    fn sample(x: [f64; 6]) -> ImuSample {
        ImuSample {
            seconds: 0.01,
            gyroscope: Vector3::new(x[0], x[1], x[2]),
            accelerometer: Vector3::new(x[3], x[4], x[5]),
        }
    }

    fn any_imu() -> impl Strategy<Value = Imu> {
        let samples = prop::collection::vec(prop::array::uniform6(-5.0..5.0_f64).prop_map(sample), 1..20);
        // noise of the size of the variables, so that whitened entries are comparable
        let noise = ImuDensities {
            gyroscope: Positive::literal(1.0),
            accelerometer: Positive::literal(1.0),
            gyroscope_walk: Positive::literal(1.0),
            accelerometer_walk: Positive::literal(1.0),
        };
        (samples, any_imu_bias())
            .prop_map(move |(samples, bias)| Imu::new(&samples, noise, bias, earth()).unwrap())
    }

    factor_laws! { imu }
    jacobian_laws! {
        jacobians_agree: (any_imu(), any_se3(), any_velocity(), any_imu_bias(), se3_tangent(), any_velocity(), any_imu_bias())
            .prop_map(|(factor, x, v, b, d, w, c)| (factor, x, v, b, x.retract(&d), w, c));
    }

    #[test]
    fn states_that_follow_the_samples_cost_nothing() {
        let bias = ImuBias(Vector6::new(0.01, -0.02, 0.03, 0.1, 0.2, -0.1));
        let samples: Vec<_> =
            (0..20).map(|k| sample([0.1, f64::from(k) * 0.1, -0.5, 1.0, 2.0, 9.81])).collect();
        let imu = Imu::new(&samples, ImuDensities::default(), bias, earth()).unwrap();
        let (x, v) = (Se3::exp(&Vector6::new(0.3, -0.2, 1.0, 2.0, 3.0, 4.0)), Vector3::new(1.0, -2.0, 0.5));
        let (end, after) = imu.predict(&x, &Velocity(v));
        let r = imu.residual::<f64>((x, v, bias.0, end, after.0, bias.0));
        assert!(r.norm() < 1e-6, "{r}");
    }

    #[test]
    fn an_imu_at_rest_stays_in_place() {
        let samples = vec![sample([0.0, 0.0, 0.0, 0.0, 0.0, 9.81]); 10];
        let imu = Imu::new(&samples, ImuDensities::default(), ImuBias::zero(), earth()).unwrap();
        let rest = (Se3::identity(), Vector3::zeros(), Vector6::zeros());
        let r = imu.residual::<f64>((rest.0, rest.1, rest.2, rest.0, rest.1, rest.2));
        assert!(r.norm() < 1e-9, "{r}");
    }

    #[test]
    fn a_document_reads_back() {
        let imu = Imu::new(&[sample([0.1; 6])], ImuDensities::default(), ImuBias::zero(), earth()).unwrap();
        let text = serde_json::to_string(&imu).unwrap();
        assert_eq!(serde_json::from_str::<Imu>(&text).unwrap(), imu);
    }

    #[test]
    fn wrong_samples_are_named() {
        let read = |text: &str| serde_json::from_str::<Imu>(text).unwrap_err().to_string();
        let none = read(r#"{"seconds": [], "gyroscope": [], "accelerometer": []}"#);
        assert!(none.contains("at least one sample"), "{none}");
        let lengths =
            read(r#"{"seconds": [0.1, 0.1], "gyroscope": [[0, 0, 0]], "accelerometer": [[0, 0, 9.8]]}"#);
        assert!(lengths.contains("2 durations, 1 samples of the gyroscope"), "{lengths}");
        let degrees =
            read(r#"{"seconds": [0.1], "gyroscope": [[0, 400, 0]], "accelerometer": [[0, 0, 9.8]]}"#);
        assert!(degrees.contains("convert degrees to radians"), "{degrees}");
        let backward =
            read(r#"{"seconds": [-0.1], "gyroscope": [[0, 0, 0]], "accelerometer": [[0, 0, 9.8]]}"#);
        assert!(backward.contains("sample 0 lasts -0.1 s"), "{backward}");
    }
}
