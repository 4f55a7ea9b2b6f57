//! A map as an MCAP file for viewers: objects as ellipsoids, poses of the camera, and its path.
mod messages;
#[cfg(test)]
mod tests;

use crate::canvas::{Ink, Theme};
use manifactor_geometry::Se3;
use manifactor_quadric::DualQuadric;
use manifactor_slam::estimate::Estimate;
use manifactor_slam::online::{ObjectStatus, ObjectUpdate};
use manifactor_slam::sequence::ObjectId;
use mcap::records::MessageHeader;
use mcap::{Compression, McapError, WriteOptions, Writer};
use messages::{
    Color, Duration, FrameTransform, KeyValue, MAP_FRAME, Pose, PosesInFrame, SceneEntity,
    SceneEntityDeletion, SceneUpdate, Sphere, Text, Time,
};
use nalgebra::Vector3;
use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde::Serialize;
use std::collections::{BTreeMap, HashMap};
use std::fs::File;
use std::io::{self, BufWriter, ErrorKind, Read};
use std::path::Path;

/// Start of the name of the program in the header of a file.
const LIBRARY: &str = "manifactor ";
/// Opacity of ellipsoids.
const OPACITY: f64 = 0.6;

/// A map that is written to an MCAP file, with Foxglove's schemas in JSON.
///
/// A variant NAME has the topics `/NAME/objects` (`foxglove.SceneUpdate`), `/NAME/path` (`foxglove.PosesInFrame`) and
/// `/NAME/tf` (`foxglove.FrameTransform`). The frame of the map is `map`, that of the camera `NAME/camera`.
///
/// The first error of writing ends the recording; [`finish`](Self::finish) returns it.
pub struct SceneRecording {
    writer: Writer<BufWriter<File>>,
    channels: HashMap<String, u16>,
    /// Classes in order of appearance, for their colours.
    classes: Vec<String>,
    /// Labels are above objects in this direction.
    up: Vector3<f64>,
    fault: Option<McapError>,
}

impl std::fmt::Debug for SceneRecording {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("SceneRecording").field("channels", &self.channels).finish_non_exhaustive()
    }
}

impl SceneRecording {
    /// Creates the file.
    ///
    /// # Errors
    /// If the file exists, unless `overwrite` is set and it is a map that was written here, or cannot be written.
    pub fn create(file: &Path, overwrite: bool) -> io::Result<Self> {
        let created = match File::create_new(file) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists && overwrite => {
                if !is_map(file)? {
                    return Err(io::Error::other("it is not a map that was written here, so it stays"));
                }
                File::create(file)
            }
            created => created,
        };
        // with threads of its own, the size of chunks could depend on the machine
        let options = WriteOptions::new()
            .library(format!("{LIBRARY}{}", env!("CARGO_PKG_VERSION")))
            .compression(Some(Compression::Zstd))
            .compression_threads(0);
        let writer = options.create(BufWriter::new(created?)).map_err(io_error)?;
        Ok(Self { writer, channels: HashMap::new(), classes: vec![], up: Vector3::z(), fault: None })
    }

    /// Writes the pose of a frame in a stream, and the objects that have changed.
    pub fn add_frame(&mut self, variant: &str, (timestamp, pose): (f64, &Se3), updates: &[ObjectUpdate]) {
        self.add_pose(variant, timestamp, pose);
        let time = Time::of(timestamp);
        let mut scene = SceneUpdate::default();
        for update in updates {
            match &update.state {
                ObjectStatus::Mapped { quadric, .. } => {
                    scene.entities.push(self.entity(
                        time,
                        update.id,
                        update.class.as_deref(),
                        update.boxes,
                        quadric,
                    ));
                }
                ObjectStatus::Merged { .. } | ObjectStatus::Removed => {
                    scene.deletions.push(SceneEntityDeletion {
                        timestamp: time,
                        kind: 0,
                        id: update.id.to_string(),
                    });
                }
                ObjectStatus::Tentative => {}
            }
        }
        if !(scene.entities.is_empty() && scene.deletions.is_empty()) {
            self.write(variant, "objects", "foxglove.SceneUpdate", timestamp, &scene);
        }
    }

    /// Writes a final map: the objects and the path at the time of the first frame, and the pose of each frame.
    pub fn add_estimate(&mut self, variant: &str, estimate: &Estimate) {
        if let Some(up) = estimate.mapping.frame.up {
            self.up = *up;
        }
        let trajectory = estimate.trajectory();
        let first = trajectory.first().map_or(0.0, |first| first.timestamp);
        let time = Time::of(first);
        let mut scene = SceneUpdate::default();
        for landmark in estimate.landmarks() {
            let class = landmark.object.class.as_ref().map(|class| class.name.as_str());
            let (id, boxes) = (landmark.object.id, landmark.object.boxes);
            scene.entities.push(self.entity(time, id, class, boxes, landmark.quadric));
        }
        self.write(variant, "objects", "foxglove.SceneUpdate", first, &scene);
        let poses = trajectory.iter().map(|stamped| Pose::from(&stamped.pose)).collect();
        let path = PosesInFrame { timestamp: time, frame_id: MAP_FRAME, poses };
        self.write(variant, "path", "foxglove.PosesInFrame", first, &path);
        trajectory.iter().for_each(|stamped| self.add_pose(variant, stamped.timestamp, &stamped.pose));
    }

    /// Writes the end of the file, without which some viewers refuse it.
    ///
    /// # Errors
    /// If the file could not be written.
    pub fn finish(mut self) -> io::Result<()> {
        let ended = self.writer.finish().map(drop);
        self.fault.map_or(ended, Err).map_err(io_error)
    }

    fn add_pose(&mut self, variant: &str, timestamp: f64, pose: &Se3) {
        let transform = FrameTransform {
            timestamp: Time::of(timestamp),
            parent_frame_id: MAP_FRAME,
            child_frame_id: format!("{variant}/camera"),
            translation: pose.translation.into(),
            rotation: pose.rotation.into(),
        };
        self.write(variant, "tf", "foxglove.FrameTransform", timestamp, &transform);
    }

    fn entity(
        &mut self,
        timestamp: Time,
        id: ObjectId,
        class: Option<&str>,
        boxes: usize,
        quadric: &DualQuadric,
    ) -> SceneEntity {
        let class = class.unwrap_or("unknown");
        let place = self.classes.iter().position(|known| known == class).unwrap_or_else(|| {
            self.classes.push(class.to_owned());
            self.classes.len() - 1
        });
        let color = Color::new(Ink::Class(place).rgb(Theme::Dark), OPACITY);
        let sphere =
            Sphere { pose: Pose::from(&quadric.pose), size: (2.0 * quadric.semi_axes).into(), color };
        let value = |key: &str, value: String| KeyValue { key: key.to_owned(), value };
        let above = self.up * quadric.semi_axes.amax();
        SceneEntity {
            timestamp,
            frame_id: MAP_FRAME,
            id: id.to_string(),
            lifetime: Duration::default(),
            frame_locked: true,
            metadata: vec![value("class", class.to_owned()), value("boxes", boxes.to_string())],
            arrows: [],
            cubes: [],
            spheres: [sphere],
            cylinders: [],
            lines: [],
            triangles: [],
            texts: [Text::above(quadric.centroid(), above, format!("{class} {id}"))],
            models: [],
        }
    }

    /// Writes a message, unless an earlier one failed.
    fn write<M: Serialize + JsonSchema>(
        &mut self,
        variant: &str,
        topic: &str,
        schema: &str,
        timestamp: f64,
        message: &M,
    ) {
        if self.fault.is_none() {
            self.fault = self.try_write(format!("/{variant}/{topic}"), schema, timestamp, message).err();
        }
    }

    fn try_write<M: Serialize + JsonSchema>(
        &mut self,
        topic: String,
        schema: &str,
        timestamp: f64,
        message: &M,
    ) -> Result<(), McapError> {
        let channel_id = match self.channels.get(&topic) {
            Some(channel) => *channel,
            None => {
                // viewers look for times in the schema itself, not in definitions
                let settings = SchemaSettings::draft07().with(|settings| settings.inline_subschemas = true);
                let text = settings.into_generator().into_root_schema_for::<M>().to_value().to_string();
                let schema = self.writer.add_schema(schema, "jsonschema", text.as_bytes())?;
                let channel = self.writer.add_channel(schema, &topic, "json", &BTreeMap::new())?;
                self.channels.insert(topic, channel);
                channel
            }
        };
        let time = Time::nanoseconds(timestamp).ok_or_else(|| {
            let fault = format!(
                "a map of MCAP has no time {timestamp} s: expected timestamps from 0 to {:.0} s",
                Time::END_S
            );
            McapError::Io(io::Error::new(ErrorKind::InvalidInput, fault))
        })?;
        let header = MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
        let data = serde_json::to_vec(message).map_err(|error| McapError::Io(error.into()))?;
        self.writer.write_to_known_channel(&header, &data)
    }
}

/// Returns whether a file is such a map, by the header of MCAP, or is empty.
fn is_map(file: &Path) -> io::Result<bool> {
    // magic bytes, kind and length of the first record, lengths of an empty profile and of the library
    const BEFORE_LIBRARY: usize = 8 + 1 + 8 + 4 + 4;
    let mut start = vec![];
    File::open(file)?.take((BEFORE_LIBRARY + LIBRARY.len()) as u64).read_to_end(&mut start)?;
    Ok(start.is_empty() || start.starts_with(mcap::MAGIC) && start.ends_with(LIBRARY.as_bytes()))
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}
