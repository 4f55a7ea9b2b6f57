//! Recordings for tests.
#![allow(clippy::unwrap_used, reason = "for tests")]
use crate::definitions;
use manifactor_geometry::Se3;
use mcap::records::MessageHeader;
use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;
use std::path::Path;

/// Name and definition of a message type.
pub type MessageType = (&'static str, &'static str);

/// A text.
pub const STRING: MessageType = ("std_msgs/msg/String", "string data");

/// A pose.
pub const POSE_STAMPED: MessageType = ("geometry_msgs/msg/PoseStamped", definitions::POSE_STAMPED);
/// Odometry.
pub const ODOMETRY: MessageType = ("nav_msgs/msg/Odometry", definitions::ODOMETRY);
/// Transforms between frames.
pub const TRANSFORMS: MessageType = ("tf2_msgs/msg/TFMessage", definitions::TRANSFORMS);
/// Calibration of a camera.
pub const CAMERA_INFO: MessageType = ("sensor_msgs/msg/CameraInfo", definitions::CAMERA_INFO);
/// Accelerations.
pub const IMU: MessageType = ("sensor_msgs/msg/Imu", definitions::IMU);
/// Positions by satellites.
pub const FIX: MessageType = ("sensor_msgs/msg/NavSatFix", definitions::FIX);
/// Boxes.
pub const DETECTIONS: MessageType = ("vision_msgs/msg/Detection2DArray", definitions::DETECTIONS);

/// Content of a message, little-endian and aligned.
#[derive(Debug, Default)]
pub struct Cdr(Vec<u8>);

impl Cdr {
    /// Creates an empty content.
    pub fn new() -> Self {
        Self::default()
    }
    fn put(mut self, bytes: &[u8]) -> Self {
        while !self.0.len().is_multiple_of(bytes.len()) {
            self.0.push(0);
        }
        self.0.extend_from_slice(bytes);
        self
    }
    /// Appends a byte.
    pub fn u8(self, x: u8) -> Self {
        self.put(&[x])
    }
    /// Appends a number.
    pub fn u16(self, x: u16) -> Self {
        self.put(&x.to_le_bytes())
    }
    /// Appends a number.
    pub fn u32(self, x: u32) -> Self {
        self.put(&x.to_le_bytes())
    }
    /// Appends a number.
    pub fn i64(self, x: i64) -> Self {
        self.put(&x.to_le_bytes())
    }
    /// Appends a number.
    pub fn f32(self, x: f32) -> Self {
        self.put(&x.to_le_bytes())
    }
    /// Appends a number.
    pub fn f64(self, x: f64) -> Self {
        self.put(&x.to_le_bytes())
    }
    /// Appends a text.
    pub fn string(self, text: &str) -> Self {
        let mut cdr = self.u32(text.len() as u32 + 1);
        cdr.0.extend_from_slice(text.as_bytes());
        cdr.0.push(0);
        cdr
    }
    /// Returns the bytes with the header of the encoding.
    pub fn bytes(self) -> Vec<u8> {
        [vec![0, 1, 0, 0], self.0].concat()
    }
}

/// Returns a [`STRING`] message.
pub fn string_message(text: &str) -> Vec<u8> {
    Cdr::new().string(text).bytes()
}

/// Returns the header of a message; the time is rounded to nanoseconds.
fn header(cdr: Cdr, seconds: f64, frame: &str) -> Cdr {
    let nanoseconds = (seconds * 1e9).round() as u64;
    cdr.u32((nanoseconds / 1_000_000_000) as u32).u32((nanoseconds % 1_000_000_000) as u32).string(frame)
}

fn pose(cdr: Cdr, pose: &Se3) -> Cdr {
    let position: [f64; 3] = pose.translation.into();
    position.into_iter().chain(pose.rotation.quaternion_xyzw()).fold(cdr, Cdr::f64)
}

/// Returns a [`POSE_STAMPED`] message.
pub fn pose_message(seconds: f64, frame: &str, at: &Se3) -> Vec<u8> {
    pose(header(Cdr::new(), seconds, frame), at).bytes()
}

/// Returns an [`ODOMETRY`] message.
pub fn odometry_message(seconds: f64, frame: &str, child: &str, at: &Se3) -> Vec<u8> {
    let cdr = pose(header(Cdr::new(), seconds, frame).string(child), at);
    // the covariance, and the velocity with its own
    [0.0; 36 + 6 + 36].into_iter().fold(cdr, Cdr::f64).bytes()
}

/// Returns a [`TRANSFORMS`] message with one transform.
pub fn transform_message(seconds: f64, parent: &str, child: &str, at: &Se3) -> Vec<u8> {
    pose(header(Cdr::new().u32(1), seconds, parent).string(child), at).bytes()
}

/// Returns an [`IMU`] message with an acceleration.
pub fn imu_message(seconds: f64, frame: &str, acceleration: [f64; 3]) -> Vec<u8> {
    let cdr = header(Cdr::new(), seconds, frame);
    // orientation and angular velocity with their covariances
    let cdr = [0.0; 4 + 9 + 3 + 9].into_iter().fold(cdr, Cdr::f64);
    acceleration.into_iter().chain([0.0; 9]).fold(cdr, Cdr::f64).bytes()
}

/// Returns a [`FIX`] message with latitude, longitude and altitude, and a standard deviation, if it is known.
pub fn fix_message(seconds: f64, frame: &str, status: i8, at: [f64; 3], sigma: Option<f64>) -> Vec<u8> {
    let cdr = header(Cdr::new(), seconds, frame).u8(status.to_le_bytes()[0]).u16(1);
    let variance = sigma.map_or(0.0, |sigma| sigma * sigma);
    let covariance = (0..9).map(|i| if i % 4 == 0 { variance } else { 0.0 });
    at.into_iter().chain(covariance).fold(cdr, Cdr::f64).u8(u8::from(sigma.is_some())).bytes()
}

/// Returns a [`CAMERA_INFO`] message of a camera with fx, fy, cx, cy, its width and height, and its distortion.
pub fn camera_message(
    frame: &str,
    [fx, fy, cx, cy]: [f64; 4],
    [width, height]: [u32; 2],
    (model, d): (&str, &[f64]),
) -> Vec<u8> {
    let cdr = header(Cdr::new(), 1.0, frame).u32(height).u32(width).string(model).u32(d.len() as u32);
    let k = [fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0];
    let r = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
    let p = [fx, 0.0, cx, 0.0, 0.0, fy, cy, 0.0, 0.0, 0.0, 1.0, 0.0];
    let cdr = d.iter().copied().chain(k).chain(r).chain(p).fold(cdr, Cdr::f64);
    // binning, and the region of interest
    [0; 6].into_iter().fold(cdr, Cdr::u32).u8(0).bytes()
}

/// Returns a [`DETECTIONS`] message of boxes with sides xmin, ymin, xmax, ymax, a class and a score.
pub fn detections_message(seconds: f64, frame: &str, boxes: &[([f64; 4], &str, f64)]) -> Vec<u8> {
    let cdr = header(Cdr::new(), seconds, frame).u32(boxes.len() as u32);
    let add = |cdr: Cdr, ([xmin, ymin, xmax, ymax], class, score): &([f64; 4], &str, f64)| {
        let cdr = header(cdr, seconds, frame).u32(1).string(class).f64(*score);
        // the pose of the object with its covariance
        let cdr = [0.0; 7 + 36].into_iter().fold(cdr, Cdr::f64);
        let center = [0.5 * (xmin + xmax), 0.5 * (ymin + ymax), 0.0];
        center.into_iter().chain([xmax - xmin, ymax - ymin]).fold(cdr, Cdr::f64).string("")
    };
    boxes.iter().fold(cdr, add).bytes()
}

/// Writes an SQLite file, with or without the definitions of types. Messages have a topic, a time in seconds, and a
/// content.
///
/// # Panics
/// If a message has an unknown topic, or the file cannot be written.
pub fn database(
    file: &Path,
    topics: &[(&str, MessageType)],
    messages: &[(&str, f64, Vec<u8>)],
    with_definitions: bool,
) {
    let mut database = rusqlite::Connection::open(file).unwrap();
    let tables = "CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);\
                  CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER, data BLOB);\
                  CREATE INDEX timestamp_idx ON messages (timestamp ASC);";
    database.execute_batch(tables).unwrap();
    if with_definitions {
        let table = "CREATE TABLE message_definitions (id INTEGER PRIMARY KEY, topic_type TEXT, encoding TEXT, \
                     encoded_message_definition TEXT)";
        database.execute_batch(table).unwrap();
    }
    let all = database.transaction().unwrap();
    for ((topic, (name, definition)), id) in topics.iter().zip(0_i64..) {
        all.execute("INSERT INTO topics VALUES (?1, ?2, ?3, 'cdr')", (id, topic, name)).unwrap();
        if with_definitions {
            let insert = "INSERT INTO message_definitions VALUES (?1, ?2, 'ros2msg', ?3)";
            all.execute(insert, (id, name, definition)).unwrap();
        }
    }
    for (topic, seconds, data) in messages {
        let id = topics.iter().position(|(name, _)| name == topic).unwrap() as i64;
        let insert = "INSERT INTO messages (topic_id, timestamp, data) VALUES (?1, ?2, ?3)";
        all.execute(insert, (id, (seconds * 1e9) as i64, data)).unwrap();
    }
    all.commit().unwrap();
}

/// Returns an MCAP file with compressed chunks. Messages have a topic, a time in seconds, and a content.
///
/// # Panics
/// If a message has an unknown topic.
pub fn recording<'a>(
    topics: &[(&str, MessageType)],
    messages: impl Iterator<Item = (&'a str, f64, Vec<u8>)>,
) -> Vec<u8> {
    let mut file = Cursor::new(vec![]);
    let mut writer = mcap::WriteOptions::new().chunk_size(Some(256)).create(&mut file).unwrap();
    let mut channels = HashMap::new();
    for (topic, (name, definition)) in topics {
        let schema = writer.add_schema(name, "ros2msg", definition.as_bytes()).unwrap();
        channels.insert(*topic, writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap());
    }
    for (topic, seconds, data) in messages {
        let time = (seconds * 1e9) as u64;
        let header =
            MessageHeader { channel_id: channels[topic], sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &data).unwrap();
    }
    writer.finish().unwrap();
    drop(writer);
    file.into_inner()
}
