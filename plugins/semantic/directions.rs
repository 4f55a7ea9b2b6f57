//! Directions, and their relation to gravity and to each other.
mod accelerometer;
pub(crate) mod axis;
mod parallel;
mod resting;
mod s2;
mod upright;

pub use accelerometer::Accelerometer;
pub use axis::Axis;
pub use parallel::Parallel;
pub use resting::{Resting, RestingAlong};
pub use s2::S2;
pub use upright::{Upright, UprightAlong};
