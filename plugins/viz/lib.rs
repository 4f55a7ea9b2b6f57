//! Plots of a run: trajectories and objects, seen from above or from the side, as SVG.
//!
//! A [`Scene`] says what there is to see, of an estimate or of anything else; [`plot`] draws it from a [`View`].
mod chart;
mod color;
mod experiment_page;
mod outline;
mod page;
mod plot;
mod run;
mod run_page;
mod scene;
mod view;

pub use chart::{Chart, Distribution};
pub use experiment_page::experiment_page;
pub use outline::Shape;
pub use page::Page;
pub use plot::plot;
pub use run_page::RunPage;
pub use scene::{Object, Scene, Track, TrackKind};
pub use view::View;
