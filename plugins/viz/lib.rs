//! Plots of a run: trajectories and objects, seen from above or from the side, as SVG.
//!
//! A [`Scene`] says what there is to see, of an estimate or of anything else; [`plot`] draws it from a [`View`].
mod color;
mod outline;
mod plot;
mod run;
mod scene;
mod view;

pub use outline::Shape;
pub use plot::plot;
pub use scene::{Object, Scene, Track, TrackKind};
pub use view::View;
