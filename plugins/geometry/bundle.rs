//! Camera models and the projection of points into images.
mod bal_camera;
mod camera;
pub(crate) mod camera_model;
mod inverse_depth;
mod projection;
mod projection_bal;
mod radial_tangential;
mod stereo;
mod wide;

pub use bal_camera::BalCamera;
pub use camera::{Camera, CameraError};
pub use camera_model::{AnyCamera, CameraModel};
pub use inverse_depth::InverseDepthProjection;
pub use projection::Projection;
pub use projection_bal::ProjectionBal;
pub use radial_tangential::{Distortion, DistortionError, RadialTangential};
pub use stereo::Stereo;
pub use wide::{DoubleSphere, ExtendedUnified, KannalaBrandt};
