//! Camera models and the projection of points into images.
mod bal_camera;
mod camera;
pub(crate) mod camera_model;
mod camera_view;
mod intrinsics;
mod inverse_depth;
mod projection;
mod projection_bal;
mod radial;
mod radial_tangential;
mod stereo;
mod uncalibrated;
mod wide;

pub use bal_camera::BalCamera;
pub use camera::{Camera, CameraError};
pub use camera_model::{AnyCamera, CameraModel, UncalibratedModel};
pub use camera_view::CameraView;
pub use intrinsics::{Intrinsics, IntrinsicsOver};
pub use inverse_depth::InverseDepthProjection;
pub use projection::Projection;
pub use projection_bal::ProjectionBal;
pub use radial::Radial;
pub use radial_tangential::{Distortion, DistortionError, RadialTangential};
pub use stereo::Stereo;
pub use uncalibrated::UncalibratedProjection;
pub use wide::{DoubleSphere, ExtendedUnified, KannalaBrandt};
