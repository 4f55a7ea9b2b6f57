//! What there is to see in a run.
use crate::drawing::outline::Shape;
use manifactor_graph::Direction;
use nalgebra::Vector3;

/// Trajectories and objects in one frame, in metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Scene {
    /// Written over the picture.
    pub title: String,
    /// Up, in the frame of the scene.
    pub up: Direction,
    /// Trajectories, drawn in this order.
    pub tracks: Vec<Track>,
    /// Objects.
    pub objects: Vec<Object>,
}

/// A trajectory.
#[derive(Debug, Clone, PartialEq)]
pub struct Track {
    /// What it is; decides how it is drawn.
    pub kind: TrackKind,
    /// Its name in the legend.
    pub name: String,
    /// Where the camera was, in order of time.
    pub positions: Vec<Vector3<f64>>,
}

/// What a trajectory is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TrackKind {
    /// Where the camera was.
    Truth,
    /// Where odometry alone puts it.
    Odometry,
    /// Where the solver puts it.
    Estimate,
}

/// An object: where it is, where it is estimated to be, or both.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// Its class, which decides its colour.
    pub class: String,
    /// What it is.
    pub truth: Option<Shape>,
    /// What the solver makes of it.
    pub estimate: Option<Shape>,
}
