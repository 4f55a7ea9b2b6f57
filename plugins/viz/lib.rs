//! Pictures of a run: trajectories and objects from above and from the side, images with their boxes, charts; as SVG and PNG.
//!
//! A [`Scene`] says what there is to see, of an estimate or of anything else; [`plot`] draws it from a [`View`].
mod chart;
mod color;
mod experiment_page;
mod image;
mod outline;
mod page;
mod picture;
mod plot;
mod run;
mod run_page;
mod scene;
mod view;
mod xml;

pub use chart::{Chart, Distribution};
pub use experiment_page::{experiment_page, experiment_pictures};
pub use image::{frames_seen, image};
pub use outline::Shape;
pub use page::Page;
pub use picture::{NotDrawn, Picture};
pub use plot::plot;
pub use run_page::{RunPage, run_pictures};
pub use scene::{Object, Scene, Track, TrackKind};
pub use view::View;
pub use xml::escape;
