use super::assemble::{TimeMatching, default_share, is_default_share, read_ground_truth, read_matched};
use super::camera::{CameraChoice, by_folder};
use super::rectification::Rectification;
use super::rig::Rig;
use super::{DetectionsFile, InputFolders, SequenceSource, SourceError, found_files, usual_files};
use crate::sequence::{Acceleration, Sequence};
use manifactor_formats::accelerometer;
use manifactor_geometry::Distortion;
use manifactor_graph::checked::{NotNegative, Positive, Share};
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A sequence of the TUM RGB-D benchmark, with detections.
///
/// `sequence` is a folder: an absolute path, a path relative to the document, or a path in the folder that
/// `--data` or the environment variable `MANIFACTOR_DATA` names. It contains `odometry`, a trajectory whose
/// consecutive relative poses are the measured motion; `detections`, a CSV file of boxes with the objects
/// that they show; and optionally `groundtruth.txt` and `accelerometer.txt`. Each odometry pose is a frame.
///
/// ```toml
/// source = { type = "tum", sequence = "rgbd_dataset_freiburg1_desk", odometry = "trajectories/dvo_vo.txt" }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TumRgbd {
    /// Folder of the sequence.
    pub sequence: PathBuf,
    /// Odometry file in the folder, in TUM's format.
    pub odometry: PathBuf,
    /// Detections in the folder: a CSV file, or a table with the `format` of another program.
    #[serde(default = "detections")]
    pub detections: DetectionsFile,
    /// Ground-truth file in the folder. Default: `groundtruth.txt`, if there is such a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_truth: Option<PathBuf>,
    /// Camera by name or by its parameters. Default: the camera that the folder's name contains.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraChoice>,
    /// Coefficients k₁, k₂, p₁, p₂, k₃, k₄, k₅, k₆ of a `radial_tangential` camera in the order of OpenCV, the first
    /// four, five or all, to rectify boxes. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Distortion>,
    /// Largest time difference between a detection and its pose. Timestamps are written to the microsecond,
    /// so the default matches only equal ones. Unit: seconds.
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

fn detections() -> DetectionsFile {
    "detections_yolov3_associated.csv".into()
}
fn exact() -> NotNegative {
    NotNegative::literal(1e-6)
}

#[typetag::serialize(name = "tum")]
impl SequenceSource for TumRgbd {
    fn load(&self, folders: &InputFolders) -> Result<Sequence, SourceError> {
        let folder = folders.data_set(&self.sequence, "source.sequence")?;
        let lens = match &self.camera {
            Some(choice) => Rectification::new(choice, self.distortion, &folders.document)?,
            None => Rectification::of_pinhole(by_folder(&folder)?, self.distortion),
        };
        let rig = Rig::new(lens, None);
        let by = TimeMatching {
            within: self.max_time_difference,
            without_pose: self.max_without_pose,
            max_pose_gap: self.max_pose_gap,
        };
        let (frames, mut detections, mut unused) =
            read_matched(&folder, &self.odometry, &[(&self.detections, rig.cameras.first())], by)?;
        unused.extend(rig.apply(&mut detections, &frames)?);
        let truth = read_ground_truth(&folder, self.ground_truth.as_deref())?;
        let file = folder.join("accelerometer.txt");
        let readings = if file.is_file() { accelerometer::read(&file)? } else { vec![] };
        let reading = |r: accelerometer::StampedAcceleration| Acceleration {
            timestamp: r.timestamp,
            acceleration: r.acceleration,
        };
        Ok(Sequence {
            cameras: rig.cameras,
            body_from_camera: None,
            frames,
            detections,
            up: None,
            accelerometer: readings.into_iter().map(reading).collect(),
            ground_truth: truth,
            georeference: None,
            pose_factors: vec![],
            corrected_jumps: vec![],
            unused,
        })
    }

    fn find_files(&self, folders: &InputFolders) -> Result<Vec<PathBuf>, SourceError> {
        let folder = folders.data_set(&self.sequence, "source.sequence")?;
        let named = std::iter::once(self.odometry.as_path()).chain(self.detections.files()).map(Some);
        let files: Vec<_> = named.chain([self.ground_truth.as_deref()]).collect();
        let found = found_files(&folder, &files)?;
        let camera = found_files(&folders.document, &[self.camera.as_ref().and_then(CameraChoice::file)])?;
        Ok([found, camera, usual_files(&folder)].concat())
    }

    fn may_have_up(&self) -> bool {
        false
    }
}
register!(dyn SequenceSource, "tum", TumRgbd);
