//! Inertial measurement units (IMUs).
//!
//! A gyroscope and an accelerometer measure many times between two frames of a camera. [`Preintegration`]
//! turns these samples into one relative motion, with its covariance and its derivative with respect to the
//! biases. [`Imu`] is the factor of this motion. Its variables are pose, velocity and bias at both ends, so
//! every other factor on poses works beside it.
mod damage;
pub mod diagnosis;
mod imu;
mod preintegration;
mod samples;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
pub mod visual;

pub use damage::{Damage, DamageKind, find_damage};
pub use imu::Imu;
pub use preintegration::{Preintegration, RelativeMotion};
pub use samples::{CoverageError, ImuDensities, ImuReading, ImuSample, MAX_RATE, SampleError};
