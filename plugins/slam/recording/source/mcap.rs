use super::assemble::{
    MatchedDetections, TimeMatching, default_share, is_default_share, match_by_time, read_ground_truth,
};
use super::camera::CameraChoice;
use super::extrinsics::Extrinsics;
use super::rectification::Rectification;
use super::rig::Rig;
use super::{DetectionsFile, InputFolders, SequenceSource, SourceError, found_files};
use crate::camera::{Cameras, MountedCamera};
use crate::sequence::{Acceleration, ClassScores, Detection, Sequence, UnusedInput};
use calibration::camera_of;
use fixes::FixedOdometry;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::checked::{NotNegative, Positive, Share};
use manifactor_graph::{Direction, register};
use manifactor_quadric::BoundingBox;
use manifactor_ros::{Contents, Role};
use nalgebra::Vector3;
use recorded_messages::{BoxesOfImage, Calibration, RecordedMessages};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

mod calibration;
mod error;
mod fixes;
mod recorded_messages;

pub use error::McapError;
pub use fixes::McapFixes;

/// A recording of a robot that runs ROS 2, in MCAP or SQLite (db3).
///
/// It needs three topics: poses (`nav_msgs/Odometry`, `geometry_msgs/PoseStamped`,
/// `geometry_msgs/PoseWithCovarianceStamped`, or transforms), boxes (`vision_msgs/Detection2DArray`), and the
/// calibration of the camera (`sensor_msgs/CameraInfo`). A topic that is the only one of its type need not be named.
/// The pose of the camera on the robot comes from the transforms (`/tf`, `/tf_static`). `manifactor inspect` lists
/// the topics of a file. Poses are interpolated at the times of the images.
///
/// ```toml
/// source = { type = "mcap", file = "drive.mcap", odometry = "/odom", detections = "/detections" }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mcap {
    /// Path of the recording, relative to the document: a file, or a folder of files that are read by their number.
    pub file: PathBuf,
    /// Topic of the poses. Default: the only topic with a type of poses.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<String>,
    /// Topic of the boxes. Default: the only topic of its type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detections: Option<String>,
    /// File of boxes in place of a topic, relative to the document, for a detector that ran later: a CSV file, or a
    /// table with the `format` of another program.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detections_file: Option<DetectionsFile>,
    /// Topic of the camera's calibration. Default: the only topic of its type, or the only one with the frame of
    /// the boxes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_info: Option<String>,
    /// Topic of an IMU, for `gravity = { type = "accelerometer" }`; its readings are turned to the camera frame.
    /// Default: the only topic of its type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub imu: Option<String>,
    /// Positions by satellites. Without this table they are not used.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixes: Option<McapFixes>,
    /// The camera in place of a topic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraChoice>,
    /// Set if the boxes were found in the rectified image.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub rectified: bool,
    /// Outer frame of the odometry, if `odometry` is a topic of transforms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry_frame: Option<String>,
    /// Frame that has the poses of the odometry. Default: `child_frame_id` of the messages.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_frame: Option<String>,
    /// Frame of the camera: x to the right, y down, z forward. Default: that of the camera's calibration, or of the
    /// boxes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_frame: Option<String>,
    /// Pose of the camera in the frame of the body, in place of transforms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<Se3>,
    /// Further cameras on the body, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub cameras: BTreeMap<String, FurtherMcapCamera>,
    /// Names of the classes by their number from 0, for a detector that gives numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub classes: Vec<String>,
    /// Largest time between two poses, to interpolate the pose of an image between them. Unit: seconds.
    #[serde(default = "pose_gap")]
    pub max_pose_gap: Positive,
    /// Largest expected share of boxes without a pose at their time, from 0 to 1. If more lack a pose, the run ends
    /// with exit code 1.
    #[serde(default = "default_share", skip_serializing_if = "is_default_share")]
    pub max_without_pose: Share,
    /// Ground-truth trajectory of the body, if there is one: path of a file in TUM's format, relative to the
    /// document.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_truth: Option<PathBuf>,
    /// Up direction in the odometry frame, if known. In frames of ROS it is [0, 0, 1].
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Direction>,
}

/// A further camera in a recording, at a constant pose on the body.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FurtherMcapCamera {
    /// Topic of its boxes. Cameras with one topic differ in `camera_frame`.
    pub detections: String,
    /// Topic of its calibration. Default: the only one with the frame of its boxes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_info: Option<String>,
    /// The camera in place of a topic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraChoice>,
    /// Frame of the camera. Default: that of its boxes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_frame: Option<String>,
    /// Pose of the camera in the frame of the body, in place of transforms.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<Se3>,
}

fn pose_gap() -> Positive {
    Positive::literal(0.5)
}

#[typetag::serialize(name = "mcap")]
impl SequenceSource for Mcap {
    fn load(&self, folders: &InputFolders) -> Result<Sequence, SourceError> {
        let file = folders.beside_document(&self.file);
        let mut ground_truth = match &self.ground_truth {
            Some(truth) => read_ground_truth(&folders.document, Some(truth))?,
            None => None,
        };
        let mut messages = RecordedMessages::read(self, &file)?;
        let lens = self.lens(&file, self.camera.as_ref(), messages.calibrations.first(), folders)?;
        let (poses, body_from_camera) = self.camera_poses(&file, &mut messages)?;
        let accelerometer = self.accelerometer(&file, &mut messages, body_from_camera)?;
        if let (Some(pose), Some(truth)) = (body_from_camera, &mut ground_truth) {
            Extrinsics::new(pose).apply_to_ground_truth(truth);
        }
        let mut rig = Rig::new(lens, body_from_camera);
        for (i, (name, further)) in self.cameras.iter().enumerate() {
            let calibration = messages.calibrations.get(i + 1);
            let lens = self.lens(&file, further.camera.as_ref(), calibration, folders)?;
            rig.add(name, lens, self.further_pose(&file, &messages, (name, i + 1), further)?)?;
        }
        let (mut images, mut rows, mut unused) = self.detections(&messages.boxes, &rig.cameras);
        if let Some(file) = &self.detections_file {
            let of_file = file.read(&folders.document, rig.cameras.first())?;
            images.extend(of_file.iter().map(|(timestamp, _)| *timestamp));
            rows.extend(of_file);
        }
        let by = TimeMatching {
            within: NotNegative::literal(1e-6),
            without_pose: self.max_without_pose,
            max_pose_gap: Some(self.max_pose_gap),
        };
        let from = [&messages.detections_topic, &messages.odometry_topic].map(Path::new);
        let (frames, mut detections, without): MatchedDetections =
            match_by_time(&poses, images, rows, by, from)?;
        unused.extend(rig.apply(&mut detections, &frames)?);
        unused.extend(without);
        let (mut georeference, mut pose_factors) = (None, vec![]);
        if let Some(settings) = &self.fixes {
            let antenna = self.antenna(&file, &messages, settings, body_from_camera)?;
            let max_gap = self.max_pose_gap.get();
            let odometry = FixedOdometry { poses: &poses, frames: &frames, max_gap, up: self.up };
            match fixes::georeference(&messages.fixes, settings, &antenna, &odometry, &mut messages.unused) {
                Ok((place, factors)) => (georeference, pose_factors) = (Some(place), factors),
                Err(why) => messages.unused.push(format!("the positions by satellites are not used: {why}")),
            }
        }
        unused.extend(messages.unused.into_iter().map(UnusedInput::Recording));
        Ok(Sequence {
            cameras: rig.cameras,
            body_from_camera,
            frames,
            detections,
            up: self.up,
            georeference,
            accelerometer,
            ground_truth,
            pose_factors,
            corrected_jumps: vec![],
            unused,
        })
    }

    fn find_files(&self, folders: &InputFolders) -> Result<Vec<PathBuf>, SourceError> {
        let further = self.cameras.values().map(|further| &further.camera);
        let cameras = std::iter::once(&self.camera).chain(further);
        let cameras = cameras.map(|camera| camera.as_ref().and_then(CameraChoice::file));
        let others = [Some(self.file.as_path()), self.ground_truth.as_deref()].into_iter().chain(cameras);
        let rows = self.detections_file.iter().flat_map(DetectionsFile::files);
        let files: Vec<_> = others.chain(rows.map(Some)).collect();
        found_files(&folders.document, &files)
    }

    fn may_have_up(&self) -> bool {
        self.up.is_some()
    }
}
register!(dyn SequenceSource, "mcap", Mcap);

impl Mcap {
    /// Returns the topic that a setting names, or the only one with a use.
    fn topic(
        &self,
        file: &Path,
        contents: &Contents,
        role: Role,
        (setting, named): (&str, Option<&String>),
        instead: &'static str,
    ) -> Result<String, McapError> {
        let all = || {
            let topic = |(name, topic): (&String, &manifactor_ros::TopicContents)| {
                format!("`{name}` ({}, {} messages)", topic.message_type, topic.messages)
            };
            let all: Vec<String> = contents.topics.iter().map(topic).collect();
            if all.is_empty() { "none".to_owned() } else { all.join(", ") }
        };
        let types = || role.types().join(" or ");
        let file = file.to_owned();
        let allows_transforms = role == Role::Odometry;
        // poses of messages are not mixed with transforms
        let is_of_transforms = allows_transforms && self.odometry_frame.is_some();
        let messages = "has poses itself, and `source.odometry_frame` is for a topic of transforms";
        if let Some(named) = named {
            let fault = match contents.topics.get(named) {
                None => "is not in the recording".to_owned(),
                Some(topic) if topic.role == Some(role) && !is_of_transforms => return Ok(named.clone()),
                Some(topic) if topic.role == Some(Role::Transforms) && allows_transforms => {
                    return Ok(named.clone());
                }
                Some(topic) if topic.role == Some(role) => messages.to_owned(),
                Some(topic) => format!("has messages of {}, not of {}", topic.message_type, types()),
            };
            let (setting, topic) = (setting.into(), named.clone());
            return Err(McapError::WrongTopic { file, setting, topic, fault, topics: all() });
        }
        match contents.with_role(role)[..] {
            [] => Err(McapError::NoTopic { file, types: types(), instead, topics: all() }),
            [(only, _)] if is_of_transforms => {
                let (setting, topic, fault) = (setting.into(), only.to_owned(), messages.to_owned());
                Err(McapError::WrongTopic { file, setting, topic, fault, topics: all() })
            }
            [(only, _)] => Ok(only.to_owned()),
            ref several => {
                let several: Vec<String> = several.iter().map(|(name, _)| format!("`{name}`")).collect();
                let (setting, topics) = (setting.into(), several.join(", "));
                Err(McapError::SeveralTopics { file, types: types(), setting, topics })
            }
        }
    }

    /// Returns a camera from the document, or from its calibration in the recording.
    fn lens(
        &self,
        file: &Path,
        choice: Option<&CameraChoice>,
        calibration: Option<&Calibration>,
        folders: &InputFolders,
    ) -> Result<Rectification, SourceError> {
        if let Some(choice) = choice {
            return Rectification::new(choice, None, &folders.document);
        }
        let topic = calibration.map_or("camera_info", |calibration| &calibration.topic).to_owned();
        let info = calibration.and_then(|calibration| calibration.info.as_ref());
        let found = match info {
            Some(info) => camera_of(info, self.rectified),
            // `read` has made sure that there is a topic
            None => Err("no message can be decoded".into()),
        };
        found.map_err(|fault| McapError::Camera { file: file.to_owned(), topic, fault }.into())
    }

    /// Returns the frame of the body.
    fn body_frame<'a>(&'a self, file: &Path, messages: &'a RecordedMessages) -> Result<&'a str, McapError> {
        let body = self.body_frame.as_deref().or(messages.body_frame.as_deref());
        body.ok_or_else(|| McapError::NoFrame {
            file: file.to_owned(),
            topic: messages.odometry_topic.clone(),
            what: "the frame that has the pose (`child_frame_id`)",
            setting: "body_frame".into(),
        })
    }

    /// Returns the pose of a further camera on the body.
    fn further_pose(
        &self,
        file: &Path,
        messages: &RecordedMessages,
        (name, index): (&str, usize),
        further: &FurtherMcapCamera,
    ) -> Result<Se3, McapError> {
        let no_transform = |source| McapError::NoTransform { file: file.to_owned(), source };
        let constant_pose = |camera: &str| {
            let body = self.body_frame(file, messages)?;
            if camera == body {
                return Ok(Se3::identity());
            }
            if !messages.transforms.times(body, camera).map_err(no_transform)?.is_empty() {
                let [camera, body] = [camera, body].map(str::to_owned);
                return Err(McapError::MovingCamera { file: file.to_owned(), camera, body });
            }
            messages.transforms.pose(body, camera, 0.0).map_err(no_transform)
        };
        let first = self.camera_frame.as_deref().or(messages.camera_frame.as_deref());
        if let Some(first) = first.filter(|_| self.body_from_camera.is_none()) {
            constant_pose(first)?;
        }
        if let Some(pose) = further.body_from_camera {
            return Ok(pose);
        }
        let frame = further.camera_frame.clone().or_else(|| messages.frame_of(index));
        let camera = frame.ok_or_else(|| McapError::NoFrame {
            file: file.to_owned(),
            topic: further.detections.clone(),
            what: "the frame of the camera",
            setting: format!("cameras.{name}.camera_frame").into(),
        })?;
        constant_pose(&camera)
    }

    /// Returns the poses of the camera in the odometry frame, and the pose of the camera on the body if it is
    /// constant.
    fn camera_poses(
        &self,
        file: &Path,
        messages: &mut RecordedMessages,
    ) -> Result<(Vec<StampedPose>, Option<Se3>), McapError> {
        let no_transform = |source| McapError::NoTransform { file: file.to_owned(), source };
        let mut poses = std::mem::take(&mut messages.poses);
        if let Some(pose) = self.body_from_camera {
            poses.iter_mut().for_each(|stamped| Extrinsics::new(pose).apply_to_pose(&mut stamped.pose));
            return Ok((poses, Some(pose)));
        }
        let body = self.body_frame(file, messages)?;
        let camera = self.camera_frame.as_deref().or(messages.camera_frame.as_deref());
        let camera = camera.ok_or_else(|| McapError::NoFrame {
            file: file.to_owned(),
            topic: messages.detections_topic.clone(),
            what: "the frame of the camera",
            setting: "camera_frame".into(),
        })?;
        let transforms = &messages.transforms;
        if body == camera {
            return Ok((poses, None));
        }
        if transforms.times(body, camera).map_err(no_transform)?.is_empty() {
            let pose = transforms.pose(body, camera, 0.0).map_err(no_transform)?;
            poses.iter_mut().for_each(|stamped| Extrinsics::new(pose).apply_to_pose(&mut stamped.pose));
            return Ok((poses, Some(pose)));
        }
        let (count, mut fault) = (poses.len(), None);
        poses.retain_mut(|stamped| match transforms.pose(body, camera, stamped.timestamp) {
            Ok(pose) => {
                Extrinsics::new(pose).apply_to_pose(&mut stamped.pose);
                true
            }
            Err(error) => {
                fault.get_or_insert(error);
                false
            }
        });
        match fault {
            Some(source) if poses.is_empty() => Err(no_transform(source)),
            Some(error) => {
                let left_out = count - poses.len();
                messages.unused.push(format!("{left_out} of {count} poses are left out: {error}"));
                Ok((poses, None))
            }
            None => Ok((poses, None)),
        }
    }

    /// Returns the readings of the accelerometer in the camera frame. Readings of a topic that the document does not name
    /// are left out if their frame is not known.
    fn accelerometer(
        &self,
        file: &Path,
        messages: &mut RecordedMessages,
        body_from_camera: Option<Se3>,
    ) -> Result<Vec<Acceleration>, McapError> {
        let Some(sensor) = messages.imu_frame.clone() else { return Ok(vec![]) };
        match self.camera_from_sensor(file, messages, body_from_camera, &sensor) {
            Ok(camera_from_sensor) => {
                let mut readings = std::mem::take(&mut messages.accelerometer);
                for reading in &mut readings {
                    reading.acceleration = camera_from_sensor.rotation.act(&reading.acceleration);
                }
                readings.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
                Ok(readings)
            }
            Err(fault) if self.imu.is_some() => {
                Err(McapError::NoImuTransform { file: file.to_owned(), fault })
            }
            Err(fault) => {
                let count = messages.accelerometer.len();
                messages.unused.push(format!("{count} readings of the accelerometer are left out: {fault}"));
                Ok(vec![])
            }
        }
    }

    /// Returns the pose of a sensor in the frame of the camera.
    ///
    /// # Errors
    /// The reason, as a text.
    fn camera_from_sensor(
        &self,
        file: &Path,
        messages: &RecordedMessages,
        body_from_camera: Option<Se3>,
        sensor: &str,
    ) -> Result<Se3, Box<str>> {
        let pose = |frame: &str| {
            messages.transforms.pose(frame, sensor, 0.0).map_err(|fault| fault.to_string().into())
        };
        let camera = self.camera_frame.as_deref().or(messages.camera_frame.as_deref());
        if let (None, Some(camera)) = (self.body_from_camera, camera) {
            return pose(camera);
        }
        let body_from_sensor = pose(self.body_frame(file, messages).map_err(|fault| fault.to_string())?)?;
        Ok(body_from_camera.map_or(body_from_sensor, |camera| camera.inverse().compose(&body_from_sensor)))
    }

    /// Returns the position of the satellite receiver's antenna in the frame of the camera; zero if there is no position by
    /// satellites.
    fn antenna(
        &self,
        file: &Path,
        messages: &RecordedMessages,
        settings: &McapFixes,
        body_from_camera: Option<Se3>,
    ) -> Result<Vector3<f64>, McapError> {
        let frame = match (&settings.antenna, &messages.antenna_frame) {
            (Some(_), _) => self.body_frame(file, messages)?,
            (None, Some(frame)) => frame,
            (None, None) => return Ok(Vector3::zeros()),
        };
        let place = self.camera_from_sensor(file, messages, body_from_camera, frame);
        let place = place.map_err(|fault| McapError::NoAntenna { file: file.to_owned(), fault })?;
        Ok(place.act(&settings.antenna.map_or(Vector3::zeros(), |antenna| antenna.vector())))
    }

    /// Returns the times of the images and their boxes, and boxes that cannot be used.
    fn detections(
        &self,
        boxes: &[BoxesOfImage],
        cameras: &Cameras,
    ) -> (Vec<f64>, Vec<(f64, Detection)>, Vec<UnusedInput>) {
        let (mut rows, mut unused) = (vec![], vec![]);
        for image in boxes {
            let Some(camera) = cameras.iter().nth(image.camera) else { continue };
            for (place, seen) in image.boxes.iter().enumerate() {
                match seen.clone().and_then(|(bounds, scores)| self.detection(bounds, scores, camera)) {
                    Ok(detection) => rows.push((image.timestamp, detection)),
                    Err(fault) => {
                        unused.push(UnusedInput::Box { timestamp: image.timestamp, place: place + 1, fault });
                    }
                }
            }
        }
        (boxes.iter().map(|image| image.timestamp).collect(), rows, unused)
    }

    fn detection(
        &self,
        bounds: [f64; 4],
        scores: Vec<(String, f64)>,
        camera: &Arc<MountedCamera>,
    ) -> Result<Detection, String> {
        let bounding_box = BoundingBox::new(bounds).map_err(|error| error.to_string())?;
        if let Some((class, score)) = scores.iter().find(|(_, score)| !(0.0..=1.0).contains(score)) {
            return Err(format!("the score of `{class}` must be a number from 0 to 1, got {score}"));
        }
        let name = |class: String| {
            let named = class.parse::<usize>().ok().and_then(|number| self.classes.get(number));
            named.cloned().unwrap_or(class)
        };
        let scores: ClassScores = scores.into_iter().map(|(class, score)| (name(class), score)).collect();
        Ok(Detection::new(camera.clone(), bounding_box, scores))
    }
}

#[cfg(test)]
mod tests;
