//! First estimates of objects from the boxes that show them. Chosen by name: `svd`, `rays`, `depth`,
//! and `first_of` several.
mod depth;
mod first_of;
mod rays;
mod shape;
mod svd;

use crate::shapes::BoundingBox;
use crate::shapes::DualQuadric;
use crate::shapes::Ellipsoid;
use crate::shapes::NotAnEllipsoid;
use manifactor_geometry::{Camera, Se3};
use manifactor_graph::Manifold;
use nalgebra::Vector3;
use std::fmt::Debug;

pub use depth::Depth;
pub use first_of::FirstOf;
pub use rays::Rays;
pub use svd::Svd;

/// A way to a first estimate of an object.
#[typetag::serialize(tag = "type")]
pub trait Initialiser: Debug + Send + Sync {
    /// An object that all views show, in the frame of their poses.
    ///
    /// # Errors
    /// If the views do not say enough, or what they say is no object in front of them.
    fn initialise(&self, views: &[View]) -> Result<DualQuadric, InitialiseError>;
}

manifactor_graph::kind!(dyn Initialiser, "initialiser");

/// One box that shows the object, and where it was seen from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The pose of the camera.
    pub world_from_camera: Se3,
    /// The camera.
    pub camera: Camera,
    /// The box, in pixels.
    pub bounding_box: BoundingBox,
    /// Which of its sides xmin, ymin, xmax, ymax are the object's own; the others are the border's.
    pub observed: [bool; 4],
    /// How far away the object's surface is in the middle of the box, in metres along the optical axis.
    pub depth: Option<f64>,
}

/// Why an object could not be had from its views. Views count from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum InitialiseError {
    /// Not enough of them.
    #[error("{found} views, {needed} are needed")]
    TooFewViews {
        /// How many there are.
        found: usize,
        /// How many there should be.
        needed: usize,
    },
    /// The border cuts off too much of the boxes.
    #[error("{found} of the boxes' sides are inside of the image, {needed} are needed")]
    TooFewSides {
        /// How many there are.
        found: usize,
        /// How many there should be.
        needed: usize,
    },
    /// No view has a depth above zero.
    #[error("no view has a depth")]
    NoDepth,
    /// A pose or a depth that is not a number.
    #[error("view {view} has a pose or a depth that is not finite")]
    NotFinite {
        /// The view.
        view: usize,
    },
    /// All views look along nearly the same line.
    #[error("the largest angle between two lines of sight is {degrees:.2}°, {needed}° are needed")]
    TooLittleParallax {
        /// The largest angle between the lines of sight of two views.
        degrees: f64,
        /// How large it should be.
        needed: f64,
    },
    /// The equations have no solution of their own.
    #[error("the views leave the object undetermined")]
    Undetermined,
    /// The surface that fits the views best is none.
    #[error(transparent)]
    NotAnEllipsoid(#[from] NotAnEllipsoid),
    /// The object came out behind one of the cameras.
    #[error("the object came out behind the camera of view {view}")]
    Behind {
        /// The view.
        view: usize,
    },
    /// The object came out around one of the cameras.
    #[error("the object came out around the camera of view {view}")]
    Around {
        /// The view.
        view: usize,
    },
    /// The object came out beside one of the cameras, across its plane.
    #[error("the outline of the object in view {view} is no ellipse")]
    NotAnEllipse {
        /// The view.
        view: usize,
    },
    /// None of several ways succeeded.
    #[error("{}", .0.iter().map(|(name, error)| format!("{name}: {error}")).collect::<Vec<_>>().join("; "))]
    All(Vec<(&'static str, InitialiseError)>),
}

impl View {
    /// A box with all its sides, without depth.
    pub fn new(world_from_camera: Se3, camera: Camera, bounding_box: BoundingBox) -> Self {
        Self { world_from_camera, camera, bounding_box, observed: [true; 4], depth: None }
    }
    /// Lines of the observed sides.
    fn lines(&self) -> impl Iterator<Item = Vector3<f64>> + use<> {
        let lines = self.bounding_box.lines().into_iter().zip(self.observed);
        lines.filter_map(|(line, observed)| observed.then_some(line))
    }
    /// Lines through the middle of the box, from side to side; of those axes that have both.
    fn middle_lines(&self) -> impl Iterator<Item = Vector3<f64>> + use<> {
        let middle = self.bounding_box.centre();
        let vertical = (self.observed[0] && self.observed[2]).then(|| Vector3::new(1.0, 0.0, -middle.x));
        let horizontal = (self.observed[1] && self.observed[3]).then(|| Vector3::new(0.0, 1.0, -middle.y));
        vertical.into_iter().chain(horizontal)
    }
    /// The unit normal, in the world's frame, of the plane through the camera and a line in its image.
    fn normal(&self, line: &Vector3<f64>) -> Vector3<f64> {
        self.world_from_camera.rotation.act(&self.camera.matrix().tr_mul(line).normalize())
    }
    /// The direction of sight of the middle of the box, in the world's frame.
    fn sight(&self) -> Vector3<f64> {
        let ray = self.camera.ray(self.bounding_box.centre());
        self.world_from_camera.rotation.act(&ray.normalize())
    }
}

/// The largest angle between the lines of sight of two views, in degrees; 0 for fewer than two.
pub fn parallax(views: &[View]) -> f64 {
    let sights: Vec<_> = views.iter().map(View::sight).collect();
    let pairs = sights.iter().enumerate().flat_map(|(i, a)| sights[..i].iter().map(move |b| a.dot(b)));
    pairs.fold(1.0, f64::min).clamp(-1.0, 1.0).acos().to_degrees()
}

fn check_parallax(views: &[View], needed: f64) -> Result<(), InitialiseError> {
    let degrees = if needed > 0.0 { parallax(views) } else { 0.0 };
    if degrees >= needed { Ok(()) } else { Err(InitialiseError::TooLittleParallax { degrees, needed }) }
}

/// Enough views, all of numbers.
fn check_views(views: &[View], needed: usize) -> Result<(), InitialiseError> {
    if views.len() < needed {
        return Err(InitialiseError::TooFewViews { found: views.len(), needed });
    }
    let bad = |v: &View| !v.world_from_camera.is_finite() || v.depth.is_some_and(|d| !d.is_finite());
    match views.iter().position(bad) {
        Some(view) => Err(InitialiseError::NotFinite { view }),
        None => Ok(()),
    }
}

/// That every view sees all of the object in front of it.
fn check_visible(quadric: &DualQuadric, views: &[View]) -> Result<(), InitialiseError> {
    for (view, seen_by) in views.iter().enumerate() {
        let pose = &seen_by.world_from_camera;
        if quadric.is_in_front_of(pose) {
            continue;
        }
        return Err(if Ellipsoid::seen(pose, quadric).centroid.z <= 0.0 {
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
