//! The pictures and their parts.
mod axes;
mod chart;
mod distribution;
mod image;
mod labels;
mod legend;
mod map;
pub(crate) mod outline;
mod picture;
mod scale;
mod scene;
mod series;
mod viewpoint;

pub(crate) use chart::{Chart, Curve, figure};
pub(crate) use distribution::Distribution;
pub(crate) use image::{frames_seen, image};
pub(crate) use map::map;
pub use picture::{NotDrawn, Picture};
#[cfg(test)]
pub(crate) use scene::{Object, Track};
pub(crate) use scene::{Palette, Scene};
pub(crate) use series::stretches;
pub(crate) use viewpoint::Viewpoint;
