//! Manifolds: vectors, rotations and poses in the plane and in space, and the trait of Lie groups.
mod coordinates;
mod lie_group;
mod matrices;
mod operators;
mod rn;
mod se2;
mod se3;
mod sim3;
mod small_angle;
mod so2;
mod so3;
mod vectors;

pub use coordinates::{Coordinates, CoordinatesError};
pub use lie_group::LieGroup;
pub use matrices::MatrixError;
pub use rn::{Point1, Point2, Point3, Rn};
pub use se2::Se2;
pub use se3::Se3;
pub use sim3::Sim3;
pub use so2::{AngleError, So2, atan2, wrap};
pub use so3::{RotationError, So3};
pub use vectors::{ImuBias, Twist, Velocity};

pub(crate) use se2::quarter_turn;
pub(crate) use so2::Angle;
pub(crate) use so3::{Xyzw, jet};
