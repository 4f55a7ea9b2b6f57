//! Factors of ellipsoids: boxes in images, orientation, depth and size.
mod bounding_box;
mod centroid_depth;
mod orientation;
mod quadric_prior;
mod shape_prior;
mod size_prior;

pub use bounding_box::{BoundingBoxFactor, BoxModel};
pub use centroid_depth::CentroidDepth;
pub use orientation::{
    HorizontalOrientation, HorizontalOrientationSmooth, VerticalOrientation, VerticalOrientationSmooth,
};
pub use quadric_prior::QuadricPrior;
pub use shape_prior::ShapePrior;
pub use size_prior::SizePrior;
