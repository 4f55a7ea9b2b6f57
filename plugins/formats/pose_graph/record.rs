//! Records of pose graph files, independent of the file format.
use crate::error::Mistake;
use manifactor_geometry::{Point2, Point3, Se2, Se3, So2};
use nalgebra::DMatrix;

/// Content of one line.
#[derive(Debug, Clone)]
pub(crate) enum Record {
    Vertex {
        id: u64,
        value: Vertex,
    },
    Edge(Edge),
    /// A measurement of one vertex in the world frame.
    Absolute(Absolute),
    /// Vertices that are held at their values.
    Fix(Vec<u64>),
    /// Two vertices at one place.
    Equivalent(u64, u64),
    /// Pose of a sensor on the vehicle.
    Sensor {
        id: u64,
        pose: Se3,
    },
}

#[derive(Debug, Clone, Copy)]
pub(crate) enum Vertex {
    Se2(Se2),
    Se3(Se3),
    Point2(Point2),
    Point3(Point3),
}

#[derive(Debug, Clone)]
pub(crate) struct Edge {
    pub(crate) from: u64,
    pub(crate) to: u64,
    pub(crate) measurement: Measurement,
    /// In the tangent order of this library; `None` if the file has none, which means unit information.
    pub(crate) information: Option<DMatrix<f64>>,
}

#[derive(Debug, Clone)]
pub(crate) struct Absolute {
    pub(crate) id: u64,
    pub(crate) measurement: AbsoluteMeasurement,
    /// In the tangent order of this library.
    pub(crate) information: DMatrix<f64>,
}

/// Measurement of a vertex in the world frame.
#[derive(Debug, Clone, Copy)]
pub(crate) enum AbsoluteMeasurement {
    Se2(Se2),
    /// Position of a pose in the plane, along the world axes.
    Position2(Point2),
    /// Pose of the sensor with this number.
    Se3 {
        pose: Se3,
        sensor: u64,
    },
}

/// Measurement of the second vertex in the frame of the first.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Measurement {
    Se2(Se2),
    Se3(Se3),
    Point2(Point2),
    /// Direction of a point in the plane, counter-clockwise from the pose's x axis.
    Bearing2(So2),
    /// Point in the frame of the sensor with this number, or in the vehicle frame.
    Point3 {
        position: Point3,
        sensor: Option<u64>,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum VertexType {
    Se2,
    Se3,
    Point2,
    Point3,
}

impl VertexType {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Se2 => "2D pose",
            Self::Se3 => "3D pose",
            Self::Point2 => "2D point",
            Self::Point3 => "3D point",
        }
    }
    pub(crate) fn is_pose(self) -> bool {
        matches!(self, Self::Se2 | Self::Se3)
    }
}

impl Vertex {
    pub(crate) fn vertex_type(&self) -> VertexType {
        match self {
            Self::Se2(_) => VertexType::Se2,
            Self::Se3(_) => VertexType::Se3,
            Self::Point2(_) => VertexType::Point2,
            Self::Point3(_) => VertexType::Point3,
        }
    }
}

impl Measurement {
    /// Returns the types of the two vertices.
    pub(crate) fn ends(&self) -> (VertexType, VertexType) {
        match self {
            Self::Se2(_) => (VertexType::Se2, VertexType::Se2),
            Self::Se3(_) => (VertexType::Se3, VertexType::Se3),
            Self::Point2(_) | Self::Bearing2(_) => (VertexType::Se2, VertexType::Point2),
            Self::Point3 { .. } => (VertexType::Se3, VertexType::Point3),
        }
    }
}

/// Parser of a line with a known tag.
pub(crate) type Parse = fn(&str) -> Result<Record, Mistake>;

/// Returns the symmetric `n` × `n` matrix whose upper triangle is given by rows.
pub(crate) fn upper_triangle(n: usize, numbers: &[f64]) -> DMatrix<f64> {
    DMatrix::from_fn(n, n, |r, c| {
        let (r, c) = (r.min(c), r.max(c));
        numbers.get(r * (2 * n - r - 1) / 2 + c).copied().unwrap_or_default()
    })
}

/// Swaps translation-first and rotation-first order in a 6 × 6 matrix; it is its own inverse.
pub(crate) fn exchange_halves(m: &DMatrix<f64>) -> DMatrix<f64> {
    DMatrix::from_fn(6, 6, |r, c| m[((r + 3) % 6, (c + 3) % 6)])
}
