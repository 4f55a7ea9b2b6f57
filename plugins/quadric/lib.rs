//! Objects as constrained dual quadrics, and factors that measure and orient them.
mod factors;
mod functions;
pub mod initialise;
mod shapes;
#[cfg(any(test, feature = "testing"))]
pub mod testing;

pub use factors::{BoundingBoxFactor, BoxModel, CentroidDepth, QuadricPrior, ShapePrior, SizePrior};
pub use factors::{
    HorizontalOrientation, HorizontalOrientationSmooth, VerticalOrientation, VerticalOrientationSmooth,
};
pub use manifactor_geometry::{Camera, CameraError};
pub use shapes::{
    AxisOrder, BoundingBox, BoundingBoxError, Box3, Box3Error, Cuboid, DualConic, DualQuadric, Ellipse,
    Ellipsoid, EllipsoidError, LandmarkError, MAX_SEMI_AXIS, MIN_SEMI_AXIS, OnHyperboloid, SIDES, SemiAxes,
    SemiAxesError,
};
