//! Cameras, and points as they see them.
mod bal_camera;
mod camera;
mod projection;
mod projection_bal;

pub use bal_camera::BalCamera;
pub use camera::{Camera, NotACamera};
pub use projection::Projection;
pub use projection_bal::ProjectionBal;
