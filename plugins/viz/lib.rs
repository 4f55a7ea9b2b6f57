//! Pictures and pages of a run. Pictures show trajectories and objects from above and from the side, images
//! with their boxes, and charts, as SVG and PNG. The page shows all of them, and the map in 3D.
//!
//! Everything is drawn from the [record](manifactor_slam::record) of a run, so it can be drawn again. A
//! [`GraphScene`] has the pictures and the page of any solved graph.
mod canvas;
mod drawing;
pub mod figures;
mod graph;
mod latencies;
mod pages;
mod ply;
mod run;
mod scene_recording;
mod xml;

pub use canvas::Theme;
pub use drawing::{NotDrawn, Picture};
pub use graph::GraphScene;
pub use latencies::latencies;
pub use pages::{
    LiveMap, Phase, SolveSummary, experiment_page, experiment_pictures, graph_page, live_page, run_page,
};
pub use ply::ply;
pub use run::run_pictures;
pub use scene_recording::SceneRecording;
pub use xml::escape;
