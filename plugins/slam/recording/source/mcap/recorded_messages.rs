//! Messages of a recording that a sequence is made of.
use super::fixes::Fix;
use super::{CameraChoice, FurtherMcapCamera, Mcap, McapError};
use crate::sequence::Acceleration;
use manifactor_formats::tum::StampedPose;
use manifactor_graph::Manifold;
use manifactor_ros::messages::{
    CameraInfo, Detection2D, Detection2DArray, FramedPose, Imu, NavSatFix, TransformList,
};
use manifactor_ros::{BagMessage, Contents, DecodeError, Ending, Role, Transforms, read};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Name of topics with constant transforms ends with this.
const STATIC: &str = "tf_static";

/// A box as its sides and classes, or the reason why it cannot be used.
pub(super) type BoxOrFault = Result<([f64; 4], Vec<(String, f64)>), String>;

/// Boxes of an image.
pub(super) struct BoxesOfImage {
    /// Unit: seconds.
    pub timestamp: f64,
    /// Index of the camera.
    pub camera: usize,
    topic: String,
    frame: String,
    pub boxes: Vec<BoxOrFault>,
}

impl BoxesOfImage {
    #[cfg(test)]
    pub(super) fn new(timestamp: f64, boxes: Vec<BoxOrFault>) -> Self {
        Self { timestamp, camera: 0, topic: String::new(), frame: String::new(), boxes }
    }
}

/// Calibration of a camera in the recording.
pub(super) struct Calibration {
    /// Topic; empty if the document gives the camera.
    pub topic: String,
    /// `None` if no message can be decoded.
    pub info: Option<CameraInfo>,
}

/// Messages that a sequence is made of.
#[derive(Default)]
pub(super) struct RecordedMessages {
    pub odometry_topic: String,
    pub detections_topic: String,
    /// Poses of the body in the odometry frame, sorted by time.
    pub poses: Vec<StampedPose>,
    /// Frame that has these poses, if the messages say it.
    pub body_frame: Option<String>,
    /// Frame of the camera, if the messages say it.
    pub camera_frame: Option<String>,
    pub boxes: Vec<BoxesOfImage>,
    /// Calibration of each camera.
    pub calibrations: Vec<Calibration>,
    pub transforms: Transforms,
    /// Readings in the frame of the IMU.
    pub accelerometer: Vec<Acceleration>,
    /// Frame of the IMU, if there are readings.
    pub imu_frame: Option<String>,
    imu_topic: Option<String>,
    pub fixes: Vec<Fix>,
    /// Frame of the antenna, if there are positions.
    pub antenna_frame: Option<String>,
    fix_topic: Option<String>,
    /// What is left out, with the number and the reason.
    pub unused: Vec<String>,
}

/// Messages that cannot be used, by topic: their number, and the first fault.
#[derive(Default)]
struct UnusedMessages(BTreeMap<String, (usize, String)>);

impl UnusedMessages {
    fn add(&mut self, topic: &str, fault: &dyn ToString) {
        self.0.entry(topic.to_owned()).or_insert_with(|| (0, fault.to_string())).0 += 1;
    }
}

impl RecordedMessages {
    /// Reads the messages. Messages that cannot be used are counted.
    ///
    /// # Errors
    /// If the file cannot be read, or lacks something that is needed.
    pub(super) fn read(source: &Mcap, file: &Path) -> Result<Self, McapError> {
        let contents = Contents::of(file)?;
        let instead = "`source.odometry` can name a topic of transforms, such as `/tf`";
        let odometry =
            source.topic(file, &contents, Role::Odometry, ("odometry", source.odometry.as_ref()), instead)?;
        let detections = match &source.detections_file {
            Some(rows) => rows.path(Path::new("")).display().to_string(),
            None => {
                let instead = "`source.detections_file` can name a CSV file of boxes";
                let is_free =
                    |name: &&str| source.cameras.values().all(|further| further.detections != **name);
                let free = contents.with_role(Role::Detections).into_iter().map(|(name, _)| name);
                let free: Vec<&str> = free.filter(is_free).collect();
                let only = free.first().filter(|_| free.len() == 1).map(|name| (*name).to_owned());
                let named = source.detections.clone().or(only);
                source.topic(file, &contents, Role::Detections, ("detections", named.as_ref()), instead)?
            }
        };
        let frame_of_boxes = source
            .camera_frame
            .clone()
            .or_else(|| contents.topics.get(&detections).and_then(|topic| topic.frame.clone()));
        let topic_of =
            |choice: Option<&CameraChoice>, setting: &str, named: Option<&String>, frame: Option<&str>| {
                match choice {
                    Some(_) => Ok(String::new()),
                    None => Self::camera_topic(source, file, &contents, (setting, named), frame),
                }
            };
        let named = source.camera_info.as_ref();
        let mut topics =
            vec![topic_of(source.camera.as_ref(), "camera_info", named, frame_of_boxes.as_deref())?];
        for (name, further) in &source.cameras {
            let is_same = |other: &FurtherMcapCamera| other.detections == further.detections;
            let sharing = source.cameras.values().filter(|other| is_same(other)).count();
            if further.camera_frame.is_none() && (sharing > 1 || further.detections == detections) {
                let (camera, topic) = (name.clone(), further.detections.clone());
                return Err(McapError::SharedTopic { file: file.to_owned(), camera, topic });
            }
            let setting = format!("cameras.{name}.detections");
            let topic =
                source.topic(file, &contents, Role::Detections, (&setting, Some(&further.detections)), "")?;
            let of_topic = || contents.topics.get(&topic).and_then(|topic| topic.frame.as_deref());
            let frame = further.camera_frame.as_deref().or_else(of_topic);
            let setting = format!("cameras.{name}.camera_info");
            topics.push(topic_of(further.camera.as_ref(), &setting, further.camera_info.as_ref(), frame)?);
        }
        let calibrations = topics.into_iter().map(|topic| Calibration { topic, info: None }).collect();
        let further_topics: Vec<&str> =
            source.cameras.values().map(|further| further.detections.as_str()).collect();
        let mut found =
            Self { odometry_topic: odometry, detections_topic: detections, calibrations, ..Self::default() };
        found.imu_topic = match (&source.imu, &contents.with_role(Role::Imu)[..]) {
            (None, [(only, _)]) => Some((*only).to_owned()),
            (None, _) => None,
            (named, _) => Some(source.topic(file, &contents, Role::Imu, ("imu", named.as_ref()), "")?),
        };
        found.fix_topic = match &source.fixes {
            Some(fixes) => {
                let named = ("fixes.topic", fixes.topic.as_ref());
                let instead = "leave `source.fixes` out";
                Some(source.topic(file, &contents, Role::Fixes, named, instead)?)
            }
            None => None,
        };
        let mut unused = UnusedMessages::default();
        let ending = read(file, |message| {
            let name = &message.topic.name;
            let is_transforms = Role::of(&message.topic.message_type) == Some(Role::Transforms);
            let done = if is_transforms {
                found.add_transforms(&message)
            } else if *name == found.odometry_topic {
                found.add_pose(&message)
            } else if *name == found.detections_topic || further_topics.contains(&name.as_str()) {
                found.add_boxes(&message)
            } else if found.imu_topic.as_ref() == Some(name) {
                found.add_acceleration(&message)
            } else if found.fix_topic.as_ref() == Some(name) {
                found.add_fix(&message)
            } else {
                found.add_calibration(&message)
            };
            if let Err(fault) = done {
                unused.add(name, &fault);
            }
        })?;
        if let Ending::Fault(fault) = ending {
            found.unused.push(format!("the rest of the recording is not read: {fault}"));
        }
        found.finish(source, file, &mut unused)?;
        let faults = unused.0.into_iter();
        let what = |(topic, (count, fault))| format!("{count} messages of `{topic}` are left out: {fault}");
        found.unused.extend(faults.map(what));
        Ok(found)
    }

    /// Returns the topic of the calibration: the named one, the only one, or the only one with a frame.
    fn camera_topic(
        source: &Mcap,
        file: &Path,
        contents: &Contents,
        (setting, named): (&str, Option<&String>),
        frame: Option<&str>,
    ) -> Result<String, McapError> {
        let candidates = contents.with_role(Role::CameraInfo).into_iter();
        let of_frame: Vec<&str> = candidates
            .filter(|(_, topic)| frame.is_some() && topic.frame.as_deref() == frame)
            .map(|(name, _)| name)
            .collect();
        let only = of_frame.first().filter(|_| of_frame.len() == 1).map(|name| (*name).to_owned());
        let named = named.cloned().or(only);
        let instead = "`source.camera` can give the camera";
        source.topic(file, contents, Role::CameraInfo, (setting, named.as_ref()), instead)
    }

    fn add_transforms(&mut self, message: &BagMessage<'_>) -> Result<(), String> {
        let is_constant = message.topic.name.ends_with(STATIC);
        let transforms: TransformList = message.decode().map_err(|error| text(&error))?;
        match self.transforms.add(&transforms, is_constant) {
            0 => Ok(()),
            faults => Err(format!("{faults} transforms have no unit quaternion as rotation")),
        }
    }

    fn add_pose(&mut self, message: &BagMessage<'_>) -> Result<(), String> {
        let Some(pose) = FramedPose::of(message) else { return Ok(()) };
        let FramedPose { header, child, pose } = pose.map_err(|error| text(&error))?;
        let pose = pose.to_se3().map_err(|error| error.to_string())?;
        if !pose.is_finite() {
            return Err("a pose is not finite".into());
        }
        self.body_frame = self.body_frame.take().or(child);
        self.poses.push(StampedPose { timestamp: header.stamp.seconds(), pose });
        Ok(())
    }

    fn add_acceleration(&mut self, message: &BagMessage<'_>) -> Result<(), String> {
        let imu: Imu = message.decode().map_err(|error| text(&error))?;
        let (timestamp, acceleration) = (imu.header.stamp.seconds(), imu.acceleration()?);
        self.imu_frame.get_or_insert(imu.header.frame_id);
        self.accelerometer.push(Acceleration { timestamp, acceleration });
        Ok(())
    }

    fn add_fix(&mut self, message: &BagMessage<'_>) -> Result<(), String> {
        let fix: NavSatFix = message.decode().map_err(|error| text(&error))?;
        self.fixes.push(Fix::of(&fix)?);
        self.antenna_frame.get_or_insert(fix.header.frame_id);
        Ok(())
    }

    fn add_calibration(&mut self, message: &BagMessage<'_>) -> Result<(), String> {
        let is_open = |own: &&mut Calibration| own.info.is_none() && own.topic == message.topic.name;
        for own in self.calibrations.iter_mut().filter(is_open) {
            own.info = Some(message.decode().map_err(|error| text(&error))?);
        }
        Ok(())
    }

    fn add_boxes(&mut self, message: &BagMessage<'_>) -> Result<(), String> {
        let Detection2DArray { header, detections } = message.decode().map_err(|error| text(&error))?;
        let read = |seen: &Detection2D| Ok((seen.bounds()?, seen.scores()?));
        let boxes =
            detections.iter().map(|seen| read(seen).map_err(|fault: &str| fault.to_owned())).collect();
        let (timestamp, topic) = (header.stamp.seconds(), message.topic.name.clone());
        self.boxes.push(BoxesOfImage { timestamp, camera: 0, topic, frame: header.frame_id, boxes });
        Ok(())
    }

    /// Sorts the poses, and selects the boxes of one camera.
    fn finish(&mut self, source: &Mcap, file: &Path, unused: &mut UnusedMessages) -> Result<(), McapError> {
        let no_poses = |topic: &str, why: Option<&str>| McapError::NoPoses {
            file: file.to_owned(),
            topic: topic.to_owned(),
            why: why.map_or(String::new(), |why| format!(": {why}")),
        };
        if let (Some(frame), Some(body)) = (&source.odometry_frame, &source.body_frame) {
            let times = self.transforms.times(frame, body);
            let times = times.map_err(|source| McapError::NoTransform { file: file.to_owned(), source })?;
            for timestamp in times {
                match self.transforms.pose(frame, body, timestamp) {
                    Ok(pose) => self.poses.push(StampedPose { timestamp, pose }),
                    Err(fault) => unused.add(&self.odometry_topic, &fault),
                }
            }
        } else if self.poses.is_empty() && !unused.0.contains_key(&self.odometry_topic) {
            let why = "transforms are poses with `source.odometry_frame` and `source.body_frame`";
            return Err(no_poses(&self.odometry_topic, Some(why)));
        }
        let order = self.poses.windows(2).filter(|pair| pair[1].timestamp < pair[0].timestamp).count();
        self.poses.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        let count = self.poses.len();
        self.poses.dedup_by(|b, a| a.timestamp == b.timestamp);
        if order + count - self.poses.len() > 0 {
            self.unused.push(format!(
                "`{}`: {order} poses are out of order and were sorted, {} have the time of another and are left out",
                self.odometry_topic,
                count - self.poses.len()
            ));
        }
        if self.poses.is_empty() {
            let why = unused.0.get(&self.odometry_topic).map(|(_, fault)| fault.as_str());
            return Err(no_poses(&self.odometry_topic, why));
        }
        if let ([only], 2..) = (&self.poses[..], count) {
            let why =
                format!("all {count} messages have the time {} s: their headers need stamps", only.timestamp);
            return Err(no_poses(&self.odometry_topic, Some(&why)));
        }
        self.assign_cameras(source);
        self.count_images_at_one_time();
        let of_first = || self.boxes.iter().filter(|image| image.camera == 0);
        let cameras: BTreeSet<&str> = of_first().map(|image| image.frame.as_str()).collect();
        let wanted = source.camera_frame.as_deref();
        if cameras.len() > 1 && wanted.is_none_or(|wanted| !cameras.contains(wanted)) {
            let cameras: Vec<String> = cameras.iter().map(|name| format!("`{name}`")).collect();
            return Err(McapError::SeveralCameras {
                file: file.to_owned(),
                topic: self.detections_topic.clone(),
                cameras: cameras.join(", "),
            });
        }
        if cameras.len() > 1 {
            let count = self.boxes.len();
            self.boxes.retain(|image| image.camera > 0 || Some(image.frame.as_str()) == wanted);
            let others = count - self.boxes.len();
            self.unused.push(format!("{others} images of other cameras are left out"));
        }
        self.camera_frame = self.frame_of(0);
        Ok(())
    }

    /// Reports images of a camera with the time of another one, with which they become one frame.
    fn count_images_at_one_time(&mut self) {
        let mut times: Vec<(usize, f64)> =
            self.boxes.iter().map(|image| (image.camera, image.timestamp)).collect();
        let count = times.len();
        times.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        times.dedup();
        let others = count - times.len();
        if others > 0 {
            self.unused.push(format!(
                "{others} of {count} images have the time of another image of their camera, and are one frame with it: do \
                 their headers have stamps?"
            ));
        }
    }

    /// Assigns each image to the further camera with its topic and frame; the remaining ones are of the first camera.
    fn assign_cameras(&mut self, source: &Mcap) {
        for image in &mut self.boxes {
            let shows = |further: &FurtherMcapCamera| {
                let frame = further.camera_frame.as_deref().unwrap_or(&image.frame);
                further.detections == image.topic && frame == image.frame
            };
            image.camera = source.cameras.values().position(shows).map_or(0, |place| place + 1);
        }
        // images of a further topic with another frame
        let first = &self.detections_topic;
        let count = self.boxes.len();
        self.boxes.retain(|image| image.camera > 0 || image.topic == *first);
        if self.boxes.len() < count {
            let others = count - self.boxes.len();
            self.unused.push(format!("{others} images are left out: no camera has their topic and frame"));
        }
    }

    /// Returns the frame of a camera, if the messages say it.
    pub(super) fn frame_of(&self, camera: usize) -> Option<String> {
        let info = self.calibrations.get(camera).and_then(|own| own.info.as_ref());
        let of_info = info.map(|info| info.header.frame_id.clone());
        let of_boxes =
            self.boxes.iter().find(|image| image.camera == camera).map(|image| image.frame.clone());
        [of_info, of_boxes].into_iter().flatten().find(|name| !name.is_empty())
    }
}

fn text(error: &DecodeError) -> String {
    error.to_string()
}
