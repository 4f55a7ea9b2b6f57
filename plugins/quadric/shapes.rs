//! Ellipsoids and boxes in space, and ellipses and boxes in an image.
mod axis_order;
mod bounding_box;
mod box3;
mod dual_conic;
mod dual_quadric;
mod ellipse;
mod ellipsoid;
mod from_matrix;
mod landmark;
mod outline;
mod semi_axes;
pub(crate) mod tangent_line;

pub use axis_order::AxisOrder;
pub use bounding_box::{BoundingBox, BoundingBoxError, SIDES};
pub use box3::{Box3, Box3Error};
pub use dual_conic::DualConic;
pub use dual_quadric::DualQuadric;
pub use ellipse::Ellipse;
pub use ellipsoid::Ellipsoid;
pub use from_matrix::{EllipsoidError, OnHyperboloid};
pub use landmark::{Cuboid, LandmarkError};
pub use semi_axes::{MAX_SEMI_AXIS, MIN_SEMI_AXIS, SemiAxes, SemiAxesError};

pub(crate) use dual_quadric::move_and_scale;
pub(crate) use ellipse::Side;
