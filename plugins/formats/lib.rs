//! File formats: g2o, TORO, BAL, COLMAP, TUM trajectories, detections, inertial measurements, tables.
//!
//! No reader skips any content silently. A malformed line is an error with file and line. All errors of a
//! file are reported together. Content omitted on purpose is counted in a report. Blank lines, `#` comments,
//! repeated spaces and CRLF are accepted everywhere.
// Files are untrusted input: no index is taken for granted.
#![warn(clippy::indexing_slicing)]
mod bundle;
pub mod detections;
mod error;
mod graph_format;
pub mod inertial;
mod lines;
pub mod pose_graph;
pub mod replay;
pub mod table;
mod text;
pub mod timestamps;
pub mod tum;
pub mod whole;

pub use bundle::{bal, colmap};
pub use error::{BadLine, FormatError, Malformed, Mistake};

pub use graph_format::{GraphFormat, GraphRead, GraphText, GraphWriter, InformationRepair, ReadOptions};
pub use inertial::accelerometer;
pub use pose_graph::g2o;
pub use text::{STDIN, plausible, read_text, words};
pub use whole::journal;

#[doc(hidden)]
pub mod __private {
    pub use inventory;
}
