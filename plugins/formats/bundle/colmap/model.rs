//! A model of COLMAP, and its texts.
use super::{CAMERAS, IMAGES, Lens, POINTS, lens};
use manifactor_geometry::{Coordinates, Se3};
use nalgebra::Vector3;
use std::fmt::Write;

/// A model of COLMAP: cameras, images and points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Model {
    /// Cameras, in file order.
    pub cameras: Vec<Camera>,
    /// Images, in file order.
    pub images: Vec<Image>,
    /// Points in space, in file order.
    pub points: Vec<Point>,
}

/// A camera, which images share.
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Its number.
    pub id: u64,
    /// Its model.
    pub model: lens::Model,
    /// Its parameters.
    pub lens: Lens,
}

/// An image.
#[derive(Debug, Clone, PartialEq)]
pub struct Image {
    /// Its number.
    pub id: u64,
    /// Maps points from the camera's frame (z forward) to the world frame.
    pub world_from_camera: Se3,
    /// Number of its camera.
    pub camera: u64,
    /// Name of the file.
    pub name: String,
    /// Its image points.
    pub points: Vec<ImagePoint>,
}

/// A point in an image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePoint {
    /// Pixels from the corner of the image, x right and y down.
    pub pixel: Coordinates<2>,
    /// Number of the point in space that is seen there.
    pub point: Option<u64>,
}

/// A point in space.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Its number.
    pub id: u64,
    /// Its position in the world frame.
    pub position: Vector3<f64>,
    /// Red, green and blue.
    pub colour: [u8; 3],
    /// Mean distance between its image points and its projections, in pixels.
    pub error: f64,
    /// The images that see it, each with the index of the image point.
    pub track: Vec<(u64, u64)>,
}

impl Model {
    /// Returns the names and the texts of the model's files. Numbers are written with all digits.
    pub fn texts(&self) -> [(&'static str, String); 3] {
        // writing to a String cannot fail
        let mut cameras = "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n".to_owned();
        let _ = writeln!(cameras, "# Number of cameras: {}", self.cameras.len());
        for Camera { id, model, lens } in &self.cameras {
            let [width, height] = lens.size();
            let _ = write!(cameras, "{id} {} {width} {height}", model.name());
            for parameter in lens.parameters(*model) {
                let _ = write!(cameras, " {parameter:?}");
            }
            cameras.push('\n');
        }
        let mut images = "# Image list with two lines of data per image:\n#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n#   POINTS2D[] as (X, Y, POINT3D_ID)\n".to_owned();
        let _ = writeln!(images, "# Number of images: {}", self.images.len());
        for Image { id, world_from_camera, camera, name, points } in &self.images {
            let camera_from_world = world_from_camera.inverse();
            let [qx, qy, qz, qw] = camera_from_world.rotation.quaternion_xyzw();
            let [x, y, z]: [f64; 3] = camera_from_world.translation.into();
            let _ = writeln!(images, "{id} {qw:?} {qx:?} {qy:?} {qz:?} {x:?} {y:?} {z:?} {camera} {name}");
            for (i, ImagePoint { pixel, point }) in points.iter().enumerate() {
                let space = if i == 0 { "" } else { " " };
                let _ = write!(images, "{space}{:?} {:?} ", pixel.x, pixel.y);
                let _ = match point {
                    Some(point) => write!(images, "{point}"),
                    None => write!(images, "-1"),
                };
            }
            images.push('\n');
        }
        let mut points = "# 3D point list with one line of data per point:\n#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n".to_owned();
        let _ = writeln!(points, "# Number of points: {}", self.points.len());
        for Point { id, position, colour: [r, g, b], error, track } in &self.points {
            let [x, y, z]: [f64; 3] = (*position).into();
            let _ = write!(points, "{id} {x:?} {y:?} {z:?} {r} {g} {b} {error:?}");
            for (image, index) in track {
                let _ = write!(points, " {image} {index}");
            }
            points.push('\n');
        }
        [(CAMERAS, cameras), (IMAGES, images), (POINTS, points)]
    }
}
