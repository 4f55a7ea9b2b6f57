//! Models of COLMAP as text: a folder with `cameras.txt`, `images.txt` and `points3D.txt`.
//!
//! | file | lines |
//! | --- | --- |
//! | `cameras.txt` | `id model width height parameters` |
//! | `images.txt` | two per image: `id qw qx qy qz tx ty tz camera name`, then `x y point` for each image point |
//! | `points3D.txt` | `id x y z r g b error`, then `image index` for each image point |
//!
//! Rotation and translation of an image map points from the world frame to the camera's frame, x right, y down, z
//! forward; a pose stores the inverse. Pixels count from the corner of the image. Variables get the keys `camera<id>`,
//! `image<id>` and `point<id>`. Each image point with a point in space becomes an `uncalibrated_…` factor with a standard
//! deviation of one pixel; images share the intrinsics of their camera.
//!
//! Held are:
//! - principal points, as in COLMAP's own bundle adjustment, and coefficients that a camera model lacks, such as k₂ of
//!   `SIMPLE_RADIAL`;
//! - cameras and images without observations, and points in fewer than two images;
//! - by default, the pose of one image and one direction of a second one, for the [gauge](crate::bal).
//!
//! `rigs.txt` and `frames.txt` are not read: each image has a pose of its own.
use crate::error::FormatError;
use crate::graph_format::{GraphFormat, GraphText};
use crate::lines::lines;
use crate::text::read_text;
use manifactor_graph::{Graph, Values};
use std::io;
use std::path::Path;

mod build;
mod lens;
mod model;
mod parse;
mod write;

pub use lens::{Lens, LensError, Model as CameraModelName};
pub use model::{Camera, Image, ImagePoint, Model, Point};
pub use parse::camera;

/// Names of the files of a model.
const CAMERAS: &str = "cameras.txt";
const IMAGES: &str = "images.txt";
const POINTS: &str = "points3D.txt";

crate::register_graph_format!(GraphFormat {
    name: "COLMAP",
    extensions: &[],
    folder: Some(IMAGES),
    begins: |text| text.starts_with("# Image list with two lines of data per image"),
    parse: |text, path, reading| {
        let mut read = Model::parse(text, path)?.graph(reading.anchor);
        read.notes.extend(path.parent().and_then(rig_note));
        Ok(read)
    },
    format: Some(format),
});

/// Returns a note if the model has cameras that are mounted together.
fn rig_note(folder: &Path) -> Option<String> {
    let rigs = read_text(&folder.join("rigs.txt")).ok()?;
    let sensors = |line: &str| line.split_whitespace().nth(1).and_then(|n| n.parse::<u32>().ok());
    let has_rig = lines(&rigs).any(|(_, line)| sensors(line).is_some_and(|n| n > 1));
    let note = "rigs.txt: cameras that are mounted together keep no common pose: each image has its own";
    has_rig.then(|| note.to_owned())
}

/// Returns the model of a graph as texts. Names of images and colours come from the model in the folder `like`, if there is
/// one.
fn format(graph: &Graph, values: &Values, like: Option<&Path>) -> Result<GraphText, FormatError> {
    // the model may have been read by its folder or by its file
    let like = like.and_then(|path| if path.is_file() { path.parent() } else { Some(path) });
    let like = like.filter(|folder| folder.join(IMAGES).is_file());
    let (model, notes) = match like {
        Some(folder) => Model::read(folder)?.with_values(values),
        None => Model::of_graph(graph, values),
    };
    if model.images.is_empty() {
        let fault = "no factor of type `uncalibrated_pinhole`, `uncalibrated_radial`, `uncalibrated_radial_tangential` or \
                     `uncalibrated_kannala_brandt`, so the graph is no model of COLMAP: write it as .json or .toml";
        let (path, source) = ("graph".into(), io::Error::new(io::ErrorKind::Unsupported, fault));
        return Err(FormatError::Io { path, source });
    }
    Ok(GraphText { files: model.texts().map(|(name, text)| (Some(name), text)).into(), notes })
}
