//! Camera models and the projection of points into images.
mod bal_camera;
mod camera;
pub(crate) mod camera_model;
mod projection;
mod projection_bal;
mod radial_tangential;
mod wide;

pub use bal_camera::BalCamera;
pub use camera::{Camera, CameraError};
pub use camera_model::{AnyCamera, CameraModel};
pub use projection::Projection;
pub use projection_bal::ProjectionBal;
pub use radial_tangential::{Distortion, DistortionError, RadialTangential};
pub use wide::{DoubleSphere, ExtendedUnified, KannalaBrandt};
