//! Rotations, poses and points, and the factors between them.
//!
//! Conventions: x ⊞ δ = x·Exp(δ) with the full exponential, y ⊟ x = Log(x⁻¹y). In space the tangent
//! is rotation first, (ω, v); in the plane it is (x, y, θ). A pose takes points from its own frame to
//! the outer one.
mod between;
mod coordinates;
mod lie_group;
mod prior;
mod rn;
mod se2;
mod se3;
mod small_angle;
mod so2;
mod so3;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use between::Between;
pub use coordinates::{Coordinates, NoCoordinates};
pub use lie_group::LieGroup;
pub use prior::Prior;
pub use rn::{Point1, Point2, Point3, Rn};
pub use se2::Se2;
pub use se3::Se3;
pub use so2::{NotAnAngle, So2, wrap};
pub use so3::{NotARotation, So3};
