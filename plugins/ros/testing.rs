//! Recordings for tests.
use mcap::records::MessageHeader;
use std::collections::{BTreeMap, HashMap};
use std::io::Cursor;

/// Name and definition of a message type.
pub(crate) type MessageType = (&'static str, &'static str);

pub(crate) const STRING: MessageType = ("std_msgs/msg/String", "string data");
pub(crate) const POSE_STAMPED: MessageType = (
    "geometry_msgs/msg/PoseStamped",
    "std_msgs/Header header\nPose pose\n\
     ===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
     ===\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n\
     ===\nMSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n\
     ===\nMSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\
     ===\nMSG: geometry_msgs/Quaternion\nfloat64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1",
);

/// Content of a message, little-endian and aligned.
#[derive(Default)]
pub(crate) struct Cdr(Vec<u8>);

impl Cdr {
    pub(crate) fn new() -> Self {
        Self::default()
    }
    fn put(mut self, bytes: &[u8]) -> Self {
        while !self.0.len().is_multiple_of(bytes.len()) {
            self.0.push(0);
        }
        self.0.extend_from_slice(bytes);
        self
    }
    pub(crate) fn u8(self, x: u8) -> Self {
        self.put(&[x])
    }
    pub(crate) fn u32(self, x: u32) -> Self {
        self.put(&x.to_le_bytes())
    }
    pub(crate) fn i64(self, x: i64) -> Self {
        self.put(&x.to_le_bytes())
    }
    pub(crate) fn f32(self, x: f32) -> Self {
        self.put(&x.to_le_bytes())
    }
    pub(crate) fn f64(self, x: f64) -> Self {
        self.put(&x.to_le_bytes())
    }
    pub(crate) fn string(self, text: &str) -> Self {
        let mut cdr = self.u32(text.len() as u32 + 1);
        cdr.0.extend_from_slice(text.as_bytes());
        cdr.0.push(0);
        cdr
    }
    pub(crate) fn bytes(self) -> Vec<u8> {
        [vec![0, 1, 0, 0], self.0].concat()
    }
}

pub(crate) fn string_message(text: &str) -> Vec<u8> {
    Cdr::new().string(text).bytes()
}

pub(crate) fn pose_message(sec: u32, frame: &str, position: [f64; 3]) -> Vec<u8> {
    let header = Cdr::new().u32(sec).u32(0).string(frame);
    position.into_iter().chain([0.0, 0.0, 0.0, 1.0]).fold(header, Cdr::f64).bytes()
}

/// Returns an MCAP file with compressed chunks. Messages have a topic, a time in seconds, and a content.
pub(crate) fn recording<'a>(
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
