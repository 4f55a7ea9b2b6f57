//! Pictures and pages of a run: trajectories and objects from above and from the side, images with their boxes, charts, as
//! SVG and PNG; and one page with all of it and the map in 3D.
//!
//! All of it is drawn from the [record](manifactor_slam::record) of a run, so that it can be drawn again.
mod canvas;
mod drawing;
mod latencies;
mod pages;
mod ply;
mod run;
mod xml;

pub use canvas::Theme;
pub use drawing::{NotDrawn, Picture};
pub use latencies::latencies;
pub use pages::{LiveMap, Phase, experiment_page, experiment_pictures, live_page, run_page};
pub use ply::ply;
pub use run::run_pictures;
pub use xml::escape;
