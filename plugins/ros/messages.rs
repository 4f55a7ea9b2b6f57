//! Types of messages, with the fields that are used. Names of fields are those of ROS 2.
use crate::{BagMessage, DecodeError};
use manifactor_geometry::{RotationError, Se3, So3};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

/// Time of a message.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Stamp {
    /// Whole seconds.
    pub sec: i64,
    /// Nanoseconds of the last second.
    pub nanosec: u32,
}

impl Stamp {
    /// Returns the time in seconds.
    pub fn seconds(&self) -> f64 {
        self.sec as f64 + 1e-9 * f64::from(self.nanosec)
    }
}

/// Time and frame of a message.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Header {
    /// Time at which the data were measured.
    pub stamp: Stamp,
    /// Name of the frame of the data.
    pub frame_id: String,
}

/// Three coordinates.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Coordinates {
    x: f64,
    y: f64,
    z: f64,
}

/// Unit quaternion.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Quaternion {
    x: f64,
    y: f64,
    z: f64,
    w: f64,
}

/// Pose of a frame, `geometry_msgs/Pose` or `geometry_msgs/Transform`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
pub struct Pose {
    #[serde(alias = "translation")]
    position: Coordinates,
    #[serde(alias = "rotation")]
    orientation: Quaternion,
}

impl Pose {
    /// Returns the pose.
    ///
    /// # Errors
    /// If the quaternion is not one of a rotation, such as all zeros.
    pub fn to_se3(&self) -> Result<Se3, RotationError> {
        let Self { position: p, orientation: q } = self;
        let rotation = So3::from_quaternion_xyzw([q.x, q.y, q.z, q.w])?;
        Ok(Se3::new(rotation, Vector3::new(p.x, p.y, p.z)))
    }
}

#[derive(Deserialize)]
struct PoseWithCovariance {
    pose: Pose,
}

/// `nav_msgs/msg/Odometry`.
#[derive(Deserialize)]
struct Odometry {
    header: Header,
    child_frame_id: String,
    pose: PoseWithCovariance,
}

/// `geometry_msgs/msg/PoseStamped`.
#[derive(Deserialize)]
struct PoseStamped {
    header: Header,
    pose: Pose,
}

/// `geometry_msgs/msg/PoseWithCovarianceStamped`.
#[derive(Deserialize)]
struct PoseWithCovarianceStamped {
    header: Header,
    pose: PoseWithCovariance,
}

/// `geometry_msgs/msg/TransformStamped`: the pose of a frame in its parent frame.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct TransformStamped {
    /// Time, and name of the parent frame.
    pub header: Header,
    /// Name of the frame.
    pub child_frame_id: String,
    /// parent_from_child.
    pub transform: Pose,
}

/// `tf2_msgs/msg/TFMessage`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct TransformList {
    /// The transforms.
    pub transforms: Vec<TransformStamped>,
}

/// A pose with its time and frames.
#[derive(Debug, Clone, PartialEq)]
pub struct FramedPose {
    /// Time, and name of the outer frame.
    pub header: Header,
    /// Name of the frame with this pose, if the message has it.
    pub child: Option<String>,
    /// header_from_child.
    pub pose: Pose,
}

/// Types of messages with a pose.
pub const POSE_TYPES: [&str; 3] =
    ["nav_msgs/msg/Odometry", "geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/PoseWithCovarianceStamped"];
/// Type of messages with transforms between frames.
pub const TRANSFORM_TYPE: &str = "tf2_msgs/msg/TFMessage";
/// Type of messages of an IMU.
pub const IMU_TYPE: &str = "sensor_msgs/msg/Imu";
/// Type of messages with a position by satellites.
pub const FIX_TYPE: &str = "sensor_msgs/msg/NavSatFix";
/// Type of messages with boxes.
pub const DETECTION_TYPE: &str = "vision_msgs/msg/Detection2DArray";
/// Type of messages with the calibration of a camera.
pub const CAMERA_TYPE: &str = "sensor_msgs/msg/CameraInfo";

impl FramedPose {
    /// Reads a message of one of the [`POSE_TYPES`]; `None` for another type.
    ///
    /// # Errors
    /// If the message cannot be decoded.
    pub fn of(message: &BagMessage<'_>) -> Option<Result<Self, DecodeError>> {
        let [odometry, pose, covariance] = POSE_TYPES;
        let kind = message.topic.message_type.as_str();
        if kind == odometry {
            return Some(message.decode().map(|Odometry { header, child_frame_id, pose }| Self {
                header,
                child: Some(child_frame_id).filter(|name| !name.is_empty()),
                pose: pose.pose,
            }));
        }
        if kind == pose {
            return Some(message.decode().map(|PoseStamped { header, pose }| Self {
                header,
                child: None,
                pose,
            }));
        }
        (kind == covariance).then(|| {
            message.decode().map(|PoseWithCovarianceStamped { header, pose }| Self {
                header,
                child: None,
                pose: pose.pose,
            })
        })
    }
}

/// `sensor_msgs/msg/CameraInfo`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct CameraInfo {
    /// Time, and name of the camera frame: x right, y down, z forward.
    pub header: Header,
    /// Height of the image. Unit: pixels.
    pub height: u32,
    /// Width of the image. Unit: pixels.
    pub width: u32,
    /// Name of the distortion model.
    pub distortion_model: String,
    /// Coefficients of the distortion.
    pub d: Vec<f64>,
    /// Camera matrix of the raw image, by rows: 3 × 3.
    pub k: Vec<f64>,
    /// Projection matrix of the rectified image, by rows: 3 × 4.
    pub p: Vec<f64>,
}

/// `sensor_msgs/msg/Imu`, without the orientation.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Imu {
    /// Time, and name of the frame of the sensor.
    pub header: Header,
    linear_acceleration: Coordinates,
    #[serde(default)]
    linear_acceleration_covariance: Vec<f64>,
}

impl Imu {
    /// Returns the specific force in the frame of the sensor, which points up at rest. Unit: m/s².
    ///
    /// # Errors
    /// If the sensor has no accelerometer, or the numbers are not finite.
    pub fn acceleration(&self) -> Result<Vector3<f64>, &'static str> {
        let Coordinates { x, y, z } = self.linear_acceleration;
        // by the definition of the message
        if self.linear_acceleration_covariance.first() == Some(&-1.0) {
            return Err("the covariance of the acceleration begins with -1: the sensor has no accelerometer");
        }
        let acceleration = Vector3::new(x, y, z);
        let is_finite = acceleration.iter().all(|x| x.is_finite());
        is_finite.then_some(acceleration).ok_or("the acceleration is not finite")
    }
}

/// `sensor_msgs/msg/NavSatFix`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct NavSatFix {
    /// Time, and name of the frame of the antenna.
    pub header: Header,
    status: NavSatStatus,
    // numbers that are not finite are decoded as none
    latitude: Option<f64>,
    longitude: Option<f64>,
    /// Height above the ellipsoid of WGS 84, if it is known. Unit: metres.
    pub altitude: Option<f64>,
    position_covariance: Vec<Option<f64>>,
    position_covariance_type: u8,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct NavSatStatus {
    status: i8,
}

impl NavSatFix {
    /// Returns the latitude, positive to the north, and the longitude, positive to the east, in degrees.
    ///
    /// # Errors
    /// If the receiver has no position.
    pub fn latitude_longitude(&self) -> Result<[f64; 2], &'static str> {
        // by the definition of the message
        if self.status.status < 0 {
            return Err("the receiver has no position: its status is negative");
        }
        match (self.latitude, self.longitude) {
            (Some(latitude), Some(longitude)) if latitude.abs() <= 90.0 && longitude.abs() <= 360.0 => {
                Ok([latitude, longitude])
            }
            _ => Err("expected a latitude from -90 to 90 and a longitude from -360 to 360 degrees"),
        }
    }

    /// Returns the covariance of the position to the east, to the north and upwards, in m²; `None` if the receiver
    /// does not know it.
    pub fn covariance(&self) -> Option<Matrix3<f64>> {
        let numbers: Vec<f64> = self.position_covariance.iter().copied().collect::<Option<_>>()?;
        let is_known = self.position_covariance_type != 0 && numbers.len() == 9;
        is_known.then(|| Matrix3::from_row_slice(&numbers))
    }
}

/// `vision_msgs/msg/Detection2DArray`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Detection2DArray {
    /// Time of the image, and name of the camera frame.
    pub header: Header,
    /// The boxes.
    pub detections: Vec<Detection2D>,
}

/// `vision_msgs/msg/Detection2D`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Detection2D {
    results: Vec<ObjectHypothesisWithPose>,
    bbox: BoundingBox2D,
}

// releases of vision_msgs differ: the class and score are in `hypothesis` or beside it, and the class is `class_id` or `id`
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct ObjectHypothesisWithPose {
    hypothesis: Option<ObjectHypothesis>,
    id: Option<ClassId>,
    score: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct ObjectHypothesis {
    #[serde(alias = "id")]
    class_id: ClassId,
    score: Option<f64>,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
enum ClassId {
    Name(String),
    Number(i64),
}

impl ClassId {
    fn into_name(self) -> String {
        match self {
            Self::Name(name) => name,
            Self::Number(number) => number.to_string(),
        }
    }
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct BoundingBox2D {
    center: BoxCenter,
    size_x: f64,
    size_y: f64,
}

// releases of vision_msgs differ: the coordinates are in `position` or beside it
#[derive(Debug, Clone, PartialEq, Deserialize)]
struct BoxCenter {
    position: Option<Point2D>,
    x: Option<f64>,
    y: Option<f64>,
    #[serde(default)]
    theta: f64,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
struct Point2D {
    x: f64,
    y: f64,
}

impl Detection2D {
    /// Returns the sides xmin, ymin, xmax, ymax in pixels. A turned box gives the upright box around it.
    ///
    /// # Errors
    /// If the message has no centre.
    pub fn bounds(&self) -> Result<[f64; 4], &'static str> {
        let BoundingBox2D { center, size_x, size_y } = &self.bbox;
        let (x, y) = match (&center.position, center.x, center.y) {
            (Some(Point2D { x, y }), ..) => (*x, *y),
            (None, Some(x), Some(y)) => (x, y),
            _ => return Err("expected the centre of the box as finite x and y"),
        };
        let (sin, cos) = center.theta.sin_cos();
        let half = |a: f64, b: f64| 0.5 * ((a * cos).abs() + (b * sin).abs());
        let (width, height) = (half(*size_x, *size_y), half(*size_y, *size_x));
        Ok([x - width, y - height, x + width, y + height])
    }

    /// Returns the classes, by the name or number that the detector gives, and their scores.
    ///
    /// # Errors
    /// If a result has no class or score.
    pub fn scores(&self) -> Result<Vec<(String, f64)>, &'static str> {
        let score = |result: &ObjectHypothesisWithPose| {
            let class = result.hypothesis.as_ref().map(|h| &h.class_id).or(result.id.as_ref());
            let score = result.hypothesis.as_ref().and_then(|h| h.score).or(result.score);
            let both = class.cloned().map(ClassId::into_name).zip(score);
            both.ok_or("expected a class and a finite score in each result")
        };
        self.results.iter().map(score).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn boxes_of_all_releases_are_read() {
        let new = json!({
            "results": [{"hypothesis": {"class_id": "cup", "score": 0.7}, "pose": {}}],
            "bbox": {"center": {"position": {"x": 50.0, "y": 40.0}, "theta": 0.0}, "size_x": 20.0, "size_y": 10.0},
            "id": "3",
        });
        let old = json!({
            "results": [{"id": 41, "score": 0.7}],
            "bbox": {"center": {"x": 50.0, "y": 40.0, "theta": std::f64::consts::FRAC_PI_2}, "size_x": 10.0, "size_y": 20.0},
        });
        for (message, class) in [(new, "cup"), (old, "41")] {
            let seen: Detection2D = serde_json::from_value(message).unwrap();
            let bounds = seen.bounds().unwrap();
            let expected = [40.0, 35.0, 60.0, 45.0];
            assert!(bounds.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-9), "{bounds:?}");
            assert_eq!(seen.scores().unwrap(), [(class.to_owned(), 0.7)]);
        }
    }

    #[test]
    fn a_quaternion_of_zeros_is_no_pose() {
        let pose = json!({"position": {"x": 1.0, "y": 2.0, "z": 3.0}, "orientation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 0.0}});
        assert!(serde_json::from_value::<Pose>(pose).unwrap().to_se3().is_err());
        let transform = json!({"translation": {"x": 1.0, "y": 2.0, "z": 3.0}, "rotation": {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}});
        let pose = serde_json::from_value::<Pose>(transform).unwrap().to_se3().unwrap();
        assert_eq!(pose.translation, Vector3::new(1.0, 2.0, 3.0));
    }
}
