//! Pictures: what is drawn, and how.
mod chart;
mod color;
mod image;
pub(crate) mod outline;
pub(crate) mod picture;
mod plot;
pub(crate) mod scene;
mod view;

pub use chart::{Chart, Distribution};
pub use image::{frames_seen, image};
pub use outline::Shape;
pub use picture::{NotDrawn, Picture};
pub use plot::plot;
pub use scene::{Object, Scene, Track, TrackKind};
pub use view::View;
