//! The pictures and their parts.
mod axes;
mod chart;
mod distribution;
mod image;
mod intervals;
mod labels;
mod legend;
mod map;
pub(crate) mod outline;
mod picture;
mod scale;
mod scene;
mod series;
mod viewpoint;

pub(crate) use axes::{Axes, HEAD, LABELS, NUMBERS, title};
pub(crate) use chart::{Chart, Curve, TIME, figure};
pub(crate) use distribution::Distribution;
pub(crate) use image::{frames_seen, image};
pub(crate) use intervals::{Intervals, Mean};
pub(crate) use labels::{Label, place};
pub(crate) use legend::{Entry, legend};
pub(crate) use map::{Extent, Plot, map};
pub use picture::{NotDrawn, Picture};
pub(crate) use scale::Scale;
#[cfg(test)]
pub(crate) use scene::{Object, Track};
pub(crate) use scene::{Palette, Scene, ellipsoid};
pub(crate) use series::{spaced, stretches};
pub(crate) use viewpoint::{Plane, Viewpoint};
