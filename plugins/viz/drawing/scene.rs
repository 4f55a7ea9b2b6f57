//! The drawable content of a variant.
use super::outline::Shape;
use crate::canvas::{Ink, Stroke};
use manifactor_graph::Direction;
use manifactor_quadric::DualQuadric;
use manifactor_slam::record::{FrameRecord, ObjectRecord, RunRecord, TrueCuboid, VariantRecord};
use nalgebra::{Matrix3, Vector3};

/// Trajectories and objects in one frame. Unit: metres.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Scene {
    /// Title of the picture.
    pub(crate) title: String,
    /// Up, in the frame of the scene.
    pub(crate) up: Direction,
    /// Trajectories, drawn in this order.
    pub(crate) tracks: Vec<Track>,
    /// Objects.
    pub(crate) objects: Vec<Object>,
}

/// A trajectory.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Track {
    /// Its name in the legend.
    pub(crate) name: String,
    /// Style of its line.
    pub(crate) stroke: Stroke,
    /// Position of the camera in each frame; `None` if it is unknown.
    pub(crate) positions: Vec<Option<Vector3<f64>>>,
}

/// An object: its true shape, its estimated shape, or both.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Object {
    /// Its class.
    pub(crate) class: String,
    /// The true shape.
    pub(crate) truth: Option<Shape>,
    /// The estimated shape.
    pub(crate) estimate: Option<Shape>,
}

/// A colour for each class of a run, shared by all of its pictures.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Palette(Vec<String>);

impl Palette {
    /// Creates the palette in alphabetical order over all variants.
    pub(crate) fn of(run: &RunRecord) -> Self {
        Self::new(run.variants.iter().flat_map(VariantRecord::classes))
    }

    pub(crate) fn new<'a>(classes: impl Iterator<Item = &'a str>) -> Self {
        let mut names: Vec<String> = classes.map(str::to_owned).collect();
        names.sort_unstable();
        names.dedup();
        Self(names)
    }

    pub(crate) fn ink(&self, class: &str) -> Ink {
        self.0.binary_search_by(|own| own.as_str().cmp(class)).map_or(Ink::Text, Ink::Class)
    }

    pub(crate) fn names(&self) -> &[String] {
        &self.0
    }
}

/// The three trajectories of a run, each with its style in all pictures.
pub(crate) const TRACKS: [(&str, Stroke); 3] = [
    ("true", Stroke { ink: Ink::Truth, width: 1.6, dashed: true }),
    ("odometry", Stroke { ink: Ink::Odometry, width: 1.6, dashed: false }),
    ("estimated", Stroke { ink: Ink::Estimate, width: 2.0, dashed: false }),
];

/// Reads the position of a trajectory in a frame.
type PositionOf = fn(&FrameRecord) -> Option<Vector3<f64>>;

impl Scene {
    /// Creates the scene of a variant.
    pub(crate) fn of(title: impl Into<String>, variant: &VariantRecord) -> Self {
        let positions: [PositionOf; 3] = [
            |f| f.truth.map(|pose| pose.translation),
            |f| Some(f.odometry.pose.translation),
            |f| Some(f.estimate.pose.translation),
        ];
        let tracks = TRACKS.iter().zip(positions).map(|((name, stroke), of)| Track {
            name: (*name).to_owned(),
            stroke: *stroke,
            positions: variant.frames.iter().map(of).map(|p| p.filter(is_finite)).collect(),
        });
        let object = |object: &ObjectRecord| Object {
            class: object.class.clone(),
            truth: object.truth.as_ref().map(solid),
            estimate: object.estimate.as_ref().map(ellipsoid),
        };
        Self {
            title: title.into(),
            up: variant.up,
            tracks: tracks.filter(|track| track.positions.iter().any(Option::is_some)).collect(),
            objects: variant.objects.iter().map(object).collect(),
        }
    }
}

fn is_finite(position: &Vector3<f64>) -> bool {
    position.iter().all(|x| x.is_finite())
}

/// Returns the shape of an estimate.
pub(crate) fn ellipsoid(quadric: &DualQuadric) -> Shape {
    let axes = quadric.pose.rotation.matrix() * Matrix3::from_diagonal(&quadric.semi_axes);
    Shape { centroid: quadric.pose.translation, axes }
}

/// Returns the ellipsoid that fills the cuboid of a solid.
fn solid(truth: &TrueCuboid) -> Shape {
    let axes = truth.pose.rotation.matrix() * Matrix3::from_diagonal(&Vector3::from(truth.half_extents));
    Shape { centroid: truth.pose.translation, axes }
}
