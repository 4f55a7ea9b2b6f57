//! Contents of a recording: its topics, and what they can be used for.
use crate::bag::{BagError, Ending, read};
use crate::messages::{CAMERA_TYPE, DETECTION_TYPE, FIX_TYPE, Header, IMU_TYPE, POSE_TYPES, TRANSFORM_TYPE};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// Contents of a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Contents {
    /// Topics by name.
    pub topics: BTreeMap<String, TopicContents>,
    /// Reason why the rest of the file was not read.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

/// Contents of a topic.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TopicContents {
    /// Type of the messages.
    pub message_type: String,
    /// Number of messages.
    pub messages: usize,
    /// Time at which the first and the last message were recorded. Unit: seconds.
    pub log_times: [f64; 2],
    /// Frame of the first message, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frame: Option<String>,
    /// Use of the topic, if it has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub role: Option<Role>,
    /// Reason why the first message cannot be decoded.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
}

/// Use of a topic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Role {
    /// Poses of the body or the camera.
    Odometry,
    /// Boxes.
    Detections,
    /// Calibration of the camera.
    CameraInfo,
    /// Accelerations.
    Imu,
    /// Positions by satellites.
    Fixes,
    /// Transforms between frames.
    Transforms,
}

impl Role {
    /// Returns the use of messages of a type; `None` if there is none.
    pub fn of(message_type: &str) -> Option<Self> {
        match message_type {
            DETECTION_TYPE => Some(Self::Detections),
            CAMERA_TYPE => Some(Self::CameraInfo),
            IMU_TYPE => Some(Self::Imu),
            FIX_TYPE => Some(Self::Fixes),
            TRANSFORM_TYPE => Some(Self::Transforms),
            other => POSE_TYPES.contains(&other).then_some(Self::Odometry),
        }
    }

    /// Returns the types of messages with this use.
    pub fn types(self) -> &'static [&'static str] {
        match self {
            Self::Odometry => &POSE_TYPES,
            Self::Detections => &[DETECTION_TYPE],
            Self::CameraInfo => &[CAMERA_TYPE],
            Self::Imu => &[IMU_TYPE],
            Self::Fixes => &[FIX_TYPE],
            Self::Transforms => &[TRANSFORM_TYPE],
        }
    }
}

#[derive(Deserialize)]
struct WithHeader {
    header: Header,
}

impl TopicContents {
    /// Returns the mean number of messages per second; 0 for fewer than two.
    pub fn rate(&self) -> f64 {
        let [first, last] = self.log_times;
        if last > first { (self.messages.saturating_sub(1)) as f64 / (last - first) } else { 0.0 }
    }
}

impl Contents {
    /// Reads the topics of a recording, a file or a folder.
    ///
    /// # Errors
    /// As [`read`].
    pub fn of(path: &Path) -> Result<Self, BagError> {
        let mut topics = BTreeMap::<String, TopicContents>::new();
        let ending = read(path, |message| {
            if let Some(topic) = topics.get_mut(&message.topic.name) {
                topic.messages += 1;
                let [first, last] = topic.log_times;
                topic.log_times = [first.min(message.log_time), last.max(message.log_time)];
                return;
            }
            let message_type = message.topic.message_type.clone();
            let fault = message.decode::<serde_json::Value>().err().map(|error| error.to_string());
            let frame = message.decode::<WithHeader>().ok().map(|found| found.header.frame_id);
            topics.insert(
                message.topic.name.clone(),
                TopicContents {
                    role: Role::of(&message_type),
                    message_type,
                    messages: 1,
                    log_times: [message.log_time; 2],
                    frame: frame.filter(|name| !name.is_empty()),
                    fault,
                },
            );
        })?;
        let fault = match ending {
            Ending::Complete => None,
            Ending::Fault(fault) => Some(fault),
        };
        Ok(Self { topics, fault })
    }

    /// Returns the topics with a use, sorted by name.
    pub fn with_role(&self, role: Role) -> Vec<(&str, &TopicContents)> {
        let topics = self.topics.iter().filter(|(_, topic)| topic.role == Some(role));
        topics.map(|(name, topic)| (name.as_str(), topic)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{POSE_STAMPED, STRING, pose_message, recording, string_message};

    #[test]
    fn topics_are_counted_and_their_use_is_guessed() {
        let texts = (0..3).map(|i| ("/chatter", f64::from(i), string_message("hello")));
        let poses = (0..5_u32).map(|i| {
            (
                "/pose",
                0.5 * f64::from(i),
                pose_message(i.into(), "map", &manifactor_geometry::Se3::identity()),
            )
        });
        let bytes = recording(&[("/chatter", STRING), ("/pose", POSE_STAMPED)], texts.chain(poses));
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), bytes).unwrap();
        let contents = Contents::of(file.path()).unwrap();
        assert_eq!((contents.topics["/chatter"].messages, contents.topics["/chatter"].role), (3, None));
        let pose = &contents.topics["/pose"];
        assert_eq!((pose.messages, pose.rate(), pose.frame.as_deref()), (5, 2.0, Some("map")));
        assert_eq!(contents.with_role(Role::Odometry), [("/pose", pose)]);
        assert_eq!(contents.fault, None);
    }
}
