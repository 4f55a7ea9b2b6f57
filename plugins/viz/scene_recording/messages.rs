//! Messages of Foxglove's schemas, as far as the recording of a scene needs them.
use manifactor_geometry::{Se3, So3};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Serialize;

/// Name of the frame of the map.
pub(super) const MAP_FRAME: &str = "map";

/// A time since the epoch.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
#[schemars(title = "time")]
pub(super) struct Time {
    pub sec: u64,
    pub nsec: u32,
}

/// A duration.
#[derive(Debug, Clone, Copy, Default, Serialize, JsonSchema)]
#[schemars(title = "duration")]
pub(super) struct Duration {
    sec: u64,
    nsec: u32,
}

/// A point or a vector.
#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub(super) struct Coordinates {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub(super) struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub(super) struct Pose {
    position: Coordinates,
    orientation: Quaternion,
}

#[derive(Debug, Clone, Copy, Serialize, JsonSchema)]
pub(super) struct Color {
    r: f64,
    g: f64,
    b: f64,
    a: f64,
}

#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct KeyValue {
    pub key: String,
    pub value: String,
}

/// An ellipsoid.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct Sphere {
    pub pose: Pose,
    /// Lengths of the axes. Unit: metres.
    pub size: Coordinates,
    pub color: Color,
}

#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct Text {
    pub pose: Pose,
    pub billboard: bool,
    pub font_size: f64,
    pub scale_invariant: bool,
    pub color: Color,
    pub text: String,
}

/// An object of a scene. A viewer expects all kinds of shapes, also those that are not used.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct SceneEntity {
    pub timestamp: Time,
    pub frame_id: &'static str,
    pub id: String,
    pub lifetime: Duration,
    pub frame_locked: bool,
    pub metadata: Vec<KeyValue>,
    pub arrows: [Unused; 0],
    pub cubes: [Unused; 0],
    pub spheres: [Sphere; 1],
    pub cylinders: [Unused; 0],
    pub lines: [Unused; 0],
    pub triangles: [Unused; 0],
    pub texts: [Text; 1],
    pub models: [Unused; 0],
}

/// A kind of shape that is not used.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct Unused {}

/// Removal of the entity with an id.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct SceneEntityDeletion {
    pub timestamp: Time,
    /// 0: the one with this id.
    #[serde(rename = "type")]
    pub kind: u8,
    pub id: String,
}

/// `foxglove.SceneUpdate`.
#[derive(Debug, Default, Serialize, JsonSchema)]
pub(super) struct SceneUpdate {
    pub deletions: Vec<SceneEntityDeletion>,
    pub entities: Vec<SceneEntity>,
}

/// `foxglove.FrameTransform`.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct FrameTransform {
    pub timestamp: Time,
    pub parent_frame_id: &'static str,
    pub child_frame_id: String,
    pub translation: Coordinates,
    pub rotation: Quaternion,
}

/// `foxglove.PosesInFrame`.
#[derive(Debug, Serialize, JsonSchema)]
pub(super) struct PosesInFrame {
    pub timestamp: Time,
    pub frame_id: &'static str,
    pub poses: Vec<Pose>,
}

impl Time {
    /// End of the range of times. Unit: seconds.
    pub(super) const END_S: f64 = 1.8e10;

    /// Returns a time in seconds; one out of range is the epoch.
    pub(super) fn of(seconds: f64) -> Self {
        let nanoseconds = Self::nanoseconds(seconds).unwrap_or_default();
        let (sec, rest) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
        Self { sec, nsec: u32::try_from(rest).unwrap_or_default() }
    }

    /// Returns a time in nanoseconds, if it is in range: the format counts them from the epoch in 64 bits.
    pub(super) fn nanoseconds(seconds: f64) -> Option<u64> {
        (0.0..Self::END_S).contains(&seconds).then(|| (seconds * 1e9).round() as u64)
    }
}

impl From<Vector3<f64>> for Coordinates {
    fn from(v: Vector3<f64>) -> Self {
        Self { x: v.x, y: v.y, z: v.z }
    }
}

impl From<So3> for Quaternion {
    fn from(rotation: So3) -> Self {
        let [x, y, z, w] = rotation.quaternion_xyzw();
        Self { x, y, z, w }
    }
}

impl From<&Se3> for Pose {
    fn from(pose: &Se3) -> Self {
        Self { position: pose.translation.into(), orientation: pose.rotation.into() }
    }
}

impl Color {
    /// Returns a colour by red, green and blue up to 255.
    pub(super) fn new(rgb: [u8; 3], a: f64) -> Self {
        let [r, g, b] = rgb.map(|part| f64::from(part) / 255.0);
        Self { r, g, b, a }
    }
}

impl Text {
    /// Creates a label above an object.
    pub(super) fn above(centre: Vector3<f64>, up: Vector3<f64>, text: String) -> Self {
        let pose = Pose::from(&Se3::new(So3::identity(), centre + up));
        Self {
            pose,
            billboard: true,
            font_size: 12.0,
            scale_invariant: true,
            color: Color::new([128; 3], 1.0),
            text,
        }
    }
}
