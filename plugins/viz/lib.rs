//! Pictures of a run: trajectories and objects from above and from the side, images with their boxes, charts; as SVG and PNG.
//!
//! A [`Scene`] says what there is to see, of an estimate or of anything else; [`plot`] draws it from a [`View`].
mod drawing;
mod pages;
mod run;
mod xml;

pub use drawing::{Chart, Distribution, NotDrawn, Object, Picture, Scene, Shape, Track, TrackKind, View};
pub use drawing::{frames_seen, image, plot};
pub use pages::{Page, RunPage, experiment_page, experiment_pictures, run_pictures};
pub use xml::escape;
