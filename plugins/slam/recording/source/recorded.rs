use super::assemble::{
    TimeMatching, default_share, is_default_share, read_ground_truth, read_matched, read_objects,
};
use super::camera::{CameraChoice, CameraPose};
use super::extrinsics::Extrinsics;
use super::rectification::Rectification;
use super::rig::Rig;
use super::{DetectionsFile, InputFolders, SequenceSource, SourceError, found_files, usual_files};
use crate::sequence::Sequence;
use manifactor_geometry::Distortion;
use manifactor_graph::checked::{NotNegative, Positive, Share};
use manifactor_graph::{Direction, register};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Odometry and detections from the user's own files.
///
/// `folder` is found in the same way as the `sequence` of `tum`. It contains `odometry.txt` and
/// `detections.csv`, and optionally `groundtruth.txt` and `objects.json`: poses
/// `timestamp tx ty tz qx qy qz qw`, boxes by column names, and true objects in the format of
/// `manifactor simulate`.
///
/// ```toml
/// source = { type = "recorded", folder = "my_recording", camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 } }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Recorded")]
pub struct RecordedFiles {
    /// Folder of the files.
    pub folder: PathBuf,
    /// The camera.
    pub camera: CameraChoice,
    /// Pose of the camera in the frame of the body, if odometry and ground truth are poses of a body, such as a
    /// robot: a pose, or the `file` of a calibration. The camera frame has x to the right, y down and z forward. Default:
    /// they are poses of the camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub body_from_camera: Option<CameraPose>,
    /// Further cameras on the same body, by name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub cameras: BTreeMap<String, FurtherRecordedCamera>,
    /// Coefficients k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆ of a `radial_tangential` camera in the order of OpenCV, the first
    /// four, five or all, to rectify boxes. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Distortion>,
    /// Odometry file in the folder.
    #[serde(default = "odometry")]
    pub odometry: PathBuf,
    /// Detections in the folder: a CSV file, or a table with the `format` of another program.
    #[serde(default = "detections")]
    pub detections: DetectionsFile,
    /// Ground-truth file in the folder. Default: `groundtruth.txt`, if there is such a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_truth: Option<PathBuf>,
    /// File of true objects in the folder, in the ground-truth frame. Default: `objects.json`, if there is
    /// such a file and a ground truth.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub objects: Option<PathBuf>,
    /// Up direction in the odometry frame, if known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub up: Option<Direction>,
    /// Largest time difference between a detection and its pose. Unit: seconds.
    #[serde(default = "exact")]
    pub max_time_difference: NotNegative,
    /// Largest expected share of detections without a pose at their time, from 0 to 1. If more lack a pose,
    /// the run ends with exit code 1.
    #[serde(default = "default_share", skip_serializing_if = "is_default_share")]
    pub max_without_pose: Share,
    /// Largest time between two poses, to interpolate the pose of a detection between them. Then the frames of the
    /// map are the times with detections. Default: a detection needs a pose at its time. Unit: seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_pose_gap: Option<Positive>,
}

/// A further camera on the body, with its own detections.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FurtherRecordedCamera {
    /// The camera.
    pub camera: CameraChoice,
    /// Pose of the camera in the frame of the body; without `source.body_from_camera`, in the frame of the first camera.
    pub body_from_camera: CameraPose,
    /// Detections in its images, in the folder: a CSV file, or a table with the `format` of another program.
    pub detections: DetectionsFile,
}

fn odometry() -> PathBuf {
    "odometry.txt".into()
}
fn detections() -> DetectionsFile {
    "detections.csv".into()
}
fn exact() -> NotNegative {
    NotNegative::literal(1e-6)
}

#[typetag::serialize(name = "recorded")]
impl SequenceSource for RecordedFiles {
    fn load(&self, folders: &InputFolders) -> Result<Sequence, SourceError> {
        let folder = folders.data_set(&self.folder, "source.folder")?;
        let mounting = self.body_from_camera.as_ref().map(|pose| pose.read(&folders.document));
        let body_from_camera = mounting.transpose()?;
        let lens = Rectification::new(&self.camera, self.distortion, &folders.document)?;
        let others =
            self.cameras.iter().map(|(name, further)| (name, &further.camera, &further.body_from_camera));
        let rig = Rig::new(lens, body_from_camera).with(others, &folders.document)?;
        let by = TimeMatching {
            within: self.max_time_difference,
            without_pose: self.max_without_pose,
            max_pose_gap: self.max_pose_gap,
        };
        let files =
            std::iter::once(&self.detections).chain(self.cameras.values().map(|further| &further.detections));
        let files: Vec<_> = files.zip(rig.cameras.iter()).collect();
        let (mut frames, mut detections, mut unused) = read_matched(&folder, &self.odometry, &files, by)?;
        unused.extend(rig.apply(&mut detections, &frames)?);
        let mut truth = read_ground_truth(&folder, self.ground_truth.as_deref())?;
        if self.objects.is_some() || truth.is_some() {
            let objects = read_objects(&folder, self.objects.as_deref())?;
            truth.get_or_insert_default().objects = objects;
        }
        if let Some(extrinsics) = body_from_camera.map(Extrinsics::new) {
            frames.iter_mut().for_each(|frame| extrinsics.apply_to_pose(&mut frame.world_from_camera));
            truth.iter_mut().for_each(|truth| extrinsics.apply_to_ground_truth(truth));
        }
        Ok(Sequence {
            cameras: rig.cameras,
            body_from_camera,
            frames,
            detections,
            up: self.up,
            accelerometer: vec![],
            ground_truth: truth,
            georeference: None,
            pose_factors: vec![],
            corrected_jumps: vec![],
            unused,
        })
    }

    fn find_files(&self, folders: &InputFolders) -> Result<Vec<PathBuf>, SourceError> {
        let folder = folders.data_set(&self.folder, "source.folder")?;
        let others = self.cameras.values().flat_map(|further| further.detections.files());
        let named = std::iter::once(self.odometry.as_path()).chain(self.detections.files()).chain(others);
        let files: Vec<_> =
            named.map(Some).chain([self.ground_truth.as_deref(), self.objects.as_deref()]).collect();
        let found = found_files(&folder, &files)?;
        let further = self.cameras.values();
        let others = further.flat_map(|further| [further.camera.file(), further.body_from_camera.file()]);
        let pose = self.body_from_camera.as_ref().and_then(CameraPose::file);
        let cameras: Vec<_> = [self.camera.file(), pose].into_iter().chain(others).collect();
        Ok([found, found_files(&folders.document, &cameras)?, usual_files(&folder)].concat())
    }

    fn may_have_up(&self) -> bool {
        self.up.is_some()
    }
}
register!(dyn SequenceSource, "recorded", RecordedFiles);
