//! Initial estimates of objects from bounding boxes, selected by name: `svd`, `rays`, `depth`, and `first_of`
//! several.
mod depth;
mod first_of;
mod rays;
mod shape;
mod svd;

use crate::shapes::BoundingBox;
use crate::shapes::DualQuadric;
use crate::shapes::Ellipsoid;
use crate::shapes::EllipsoidError;
use manifactor_geometry::{Camera, Se3};
use manifactor_graph::Manifold;
use nalgebra::Vector3;
use std::fmt::Debug;

pub use depth::DepthInitialiser;
pub use first_of::FirstOfInitialiser;
pub use rays::RaysInitialiser;
pub use svd::SvdInitialiser;

/// A method for the initial estimate of an object.
#[typetag::serialize(tag = "type")]
pub trait Initialiser: Debug + Send + Sync {
    /// Estimates an object that is visible in all views, in the frame of their poses.
    ///
    /// # Errors
    /// If the views do not determine the object, or if the result is not an object in front of all cameras.
    fn initialise(&self, views: &[ObjectView]) -> Result<DualQuadric, InitialiseError>;
}

manifactor_graph::kind!(dyn Initialiser, "initialiser");

/// A bounding box of the object, with the pose and the calibration of the camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectView {
    /// Pose of the camera.
    pub world_from_camera: Se3,
    /// Calibration of the camera.
    pub camera: Camera,
    /// Bounding box, in pixels.
    pub bounding_box: BoundingBox,
    /// Which of the sides xmin, ymin, xmax, ymax belong to the object; the remaining sides are cut by the
    /// image border.
    pub observed: [bool; 4],
    /// Depth of the object's surface at the centre of the box, in metres along the optical axis.
    pub depth: Option<f64>,
}

/// The reason why an object could not be initialized. Views count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InitialiseError {
    /// There are not enough views.
    #[error("{found} views, {needed} are needed")]
    TooFewViews {
        /// The number of views.
        found: usize,
        /// The minimum number of views.
        needed: usize,
    },
    /// The image border cuts off too many sides of the boxes.
    #[error("{found} of the boxes' sides are inside of the image, {needed} are needed")]
    TooFewSides {
        /// The number of sides.
        found: usize,
        /// The minimum number of sides.
        needed: usize,
    },
    /// No view has a depth above zero.
    #[error("no view has a depth")]
    NoDepth,
    /// A pose or a depth is not finite.
    #[error("view {view} has a pose or a depth that is not finite")]
    NotFinite {
        /// Index of the view.
        view: usize,
    },
    /// All views have nearly parallel lines of sight.
    #[error("the largest angle between two lines of sight is {degrees:.2}°, {needed}° are needed")]
    TooLittleParallax {
        /// Largest angle between the lines of sight of two views, in degrees.
        degrees: f64,
        /// Minimum angle, in degrees.
        needed: f64,
    },
    /// The equations have no unique solution.
    #[error("the views leave the object undetermined")]
    Undetermined,
    /// The best-fitting surface is not an ellipsoid.
    #[error(transparent)]
    NotAnEllipsoid(#[from] EllipsoidError),
    /// The estimated object is behind a camera.
    #[error("the object came out behind the camera of view {view}")]
    Behind {
        /// Index of the view.
        view: usize,
    },
    /// The estimated object contains a camera.
    #[error("the object came out around the camera of view {view}")]
    Around {
        /// Index of the view.
        view: usize,
    },
    /// The estimated object is beside a camera, across its plane.
    #[error("the outline of the object in view {view} is no ellipse")]
    NotAnEllipse {
        /// Index of the view.
        view: usize,
    },
    /// All of several methods failed.
    #[error("{}", .0.iter().map(|(name, error)| format!("{name}: {error}")).collect::<Vec<_>>().join("; "))]
    All(Vec<(&'static str, InitialiseError)>),
}

impl ObjectView {
    /// Creates a view with all sides observed and without depth.
    pub fn new(world_from_camera: Se3, camera: Camera, bounding_box: BoundingBox) -> Self {
        Self { world_from_camera, camera, bounding_box, observed: [true; 4], depth: None }
    }
    /// Returns the lines of the observed sides.
    fn lines(&self) -> impl Iterator<Item = Vector3<f64>> + use<> {
        let lines = self.bounding_box.lines().into_iter().zip(self.observed);
        lines.filter_map(|(line, observed)| observed.then_some(line))
    }
    /// Returns the lines through the centre of the box, for each image axis with both sides observed.
    fn middle_lines(&self) -> impl Iterator<Item = Vector3<f64>> + use<> {
        let middle = self.bounding_box.centre();
        let vertical = (self.observed[0] && self.observed[2]).then(|| Vector3::new(1.0, 0.0, -middle.x));
        let horizontal = (self.observed[1] && self.observed[3]).then(|| Vector3::new(0.0, 1.0, -middle.y));
        vertical.into_iter().chain(horizontal)
    }
    /// Returns the unit normal, in the world frame, of the plane through the camera centre and a line in its
    /// image.
    fn normal(&self, line: &Vector3<f64>) -> Vector3<f64> {
        self.world_from_camera.rotation.act(&self.camera.matrix().tr_mul(line).normalize())
    }
    /// Returns the viewing direction of the box centre, in the world frame.
    fn sight(&self) -> Vector3<f64> {
        let ray = self.camera.ray(self.bounding_box.centre());
        self.world_from_camera.rotation.act(&ray.normalize())
    }
}

/// Returns the largest angle between the lines of sight of two views, in degrees; 0 for fewer than two.
pub fn parallax(views: &[ObjectView]) -> f64 {
    let sights: Vec<_> = views.iter().map(ObjectView::sight).collect();
    let pairs = sights.iter().enumerate().flat_map(|(i, a)| sights[..i].iter().map(move |b| a.dot(b)));
    pairs.fold(1.0, f64::min).clamp(-1.0, 1.0).acos().to_degrees()
}

fn check_parallax(views: &[ObjectView], needed: f64) -> Result<(), InitialiseError> {
    let degrees = if needed > 0.0 { parallax(views) } else { 0.0 };
    if degrees >= needed { Ok(()) } else { Err(InitialiseError::TooLittleParallax { degrees, needed }) }
}

/// Checks that there are enough views and that all numbers are finite.
fn check_views(views: &[ObjectView], needed: usize) -> Result<(), InitialiseError> {
    if views.len() < needed {
        return Err(InitialiseError::TooFewViews { found: views.len(), needed });
    }
    let bad = |v: &ObjectView| !v.world_from_camera.is_finite() || v.depth.is_some_and(|d| !d.is_finite());
    match views.iter().position(bad) {
        Some(view) => Err(InitialiseError::NotFinite { view }),
        None => Ok(()),
    }
}

/// Checks that the whole object is in front of every camera.
fn check_visible(quadric: &DualQuadric, views: &[ObjectView]) -> Result<(), InitialiseError> {
    for (view, seen_by) in views.iter().enumerate() {
        let pose = &seen_by.world_from_camera;
        if quadric.is_in_front_of(pose) {
            continue;
        }
        return Err(if Ellipsoid::in_camera_frame(pose, quadric).centroid.z <= 0.0 {
            InitialiseError::Behind { view }
        } else if quadric.contains(&pose.translation) {
            InitialiseError::Around { view }
        } else {
            InitialiseError::NotAnEllipse { view }
        });
    }
    Ok(())
}

#[cfg(test)]
mod tests;
