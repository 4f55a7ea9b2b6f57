use manifactor_ros::{BagError, TransformError};
use std::path::PathBuf;

/// Error that prevents reading a sequence from a recording.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum McapError {
    /// The recording cannot be read.
    #[error(transparent)]
    Bag(#[from] BagError),
    /// No topic has messages of the needed types.
    #[error("{}: no topic has messages of {types}; {instead}. Topics: {topics}", file.display())]
    NoTopic {
        /// The recording.
        file: PathBuf,
        /// The types.
        types: String,
        /// Setting that supplies the data in another way.
        instead: &'static str,
        /// All topics with their types.
        topics: String,
    },
    /// Several topics could be meant.
    #[error("{}: several topics have messages of {types}: set `source.{setting}` to one of {topics}", file.display())]
    SeveralTopics {
        /// The recording.
        file: PathBuf,
        /// The types.
        types: String,
        /// The setting.
        setting: Box<str>,
        /// The topics.
        topics: String,
    },
    /// A setting names a topic that does not exist or has a different type.
    #[error("{}: `source.{setting}` names `{topic}`, which {fault}. Topics: {topics}", file.display())]
    WrongTopic {
        /// The recording.
        file: PathBuf,
        /// The setting.
        setting: Box<str>,
        /// The topic.
        topic: String,
        /// The fault.
        fault: String,
        /// All topics with their types.
        topics: String,
    },
    /// A frame has no name.
    #[error("{}: the messages of `{topic}` do not name {what}: set `source.{setting}`, or give `body_from_camera`", file.display())]
    NoFrame {
        /// The recording.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// The frame.
        what: &'static str,
        /// The setting.
        setting: Box<str>,
    },
    /// The boxes come from several cameras.
    #[error("{}: the boxes of `{topic}` come from several cameras, {cameras}: set `source.camera_frame` to one of them", file.display())]
    SeveralCameras {
        /// The recording.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// Their frames.
        cameras: String,
    },
    /// The pose of the camera on the body is not known.
    #[error("{}: the pose of the camera is not known: {source}; `body_from_camera` can give it", file.display())]
    NoTransform {
        /// The recording.
        file: PathBuf,
        /// The reason.
        source: TransformError,
    },
    /// The orientation of the IMU is not known.
    #[error("{}: the orientation of the IMU is not known: {fault}; leave `source.imu` out, or record the transform", file.display())]
    NoImuTransform {
        /// The recording.
        file: PathBuf,
        /// The reason.
        fault: Box<str>,
    },
    /// The position of the satellite receiver's antenna is not known.
    #[error("{}: the position of the antenna is not known: {fault}; `source.fixes.antenna` can give it if the camera does not move on the body", file.display())]
    NoAntenna {
        /// The recording.
        file: PathBuf,
        /// The reason.
        fault: Box<str>,
    },
    /// A further camera shares its topic of boxes, but does not say which frame is its own.
    #[error("{}: `source.cameras.{camera}` shares the topic `{topic}` with another camera: set its `camera_frame`", file.display())]
    SharedTopic {
        /// The recording.
        file: PathBuf,
        /// Name of the camera.
        camera: String,
        /// The topic.
        topic: String,
    },
    /// A camera moves on the body, but several cameras need constant poses.
    #[error("{}: the frame `{camera}` moves in `{body}`: with several cameras, give each a constant `body_from_camera`", file.display())]
    MovingCamera {
        /// The recording.
        file: PathBuf,
        /// Frame of the camera.
        camera: String,
        /// Frame of the body.
        body: String,
    },
    /// All poses are missing or cannot be used.
    #[error("{}: `{topic}` has no pose that can be used{why}", file.display())]
    NoPoses {
        /// The recording.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// The reason, with a colon before it.
        why: String,
    },
    /// The calibration cannot be used.
    #[error("{}: the calibration in `{topic}` cannot be used: {fault}; `source.camera` can give the camera", file.display())]
    Camera {
        /// The recording.
        file: PathBuf,
        /// The topic.
        topic: String,
        /// The fault.
        fault: String,
    },
}
