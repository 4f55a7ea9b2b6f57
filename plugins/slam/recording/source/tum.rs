use super::assemble::{Matching, a_tenth, is_a_tenth, read_ground_truth, read_matched};
use super::camera::{CameraChoice, by_folder};
use super::rectification::{Distortion, Rectification};
use super::{Folders, Source, SourceError};
use crate::sequence::{Acceleration, Sequence};
use manifactor_formats::accelerometer;
use manifactor_graph::checked::{NotNegative, Share};
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// A sequence of the TUM RGB-D benchmark, with detections beside it.
///
/// `sequence` is a folder: an absolute path, one beside the document, or one in the folder that `--data` or the
/// environment variable `MANIFACTOR_DATA` names. In it lie `odometry`, a trajectory whose consecutive relative poses
/// are the motion that was measured; `detections`, a CSV of boxes with the objects that they show; and, where there
/// are any, `groundtruth.txt` and `accelerometer.txt`. Each pose of the odometry is a frame.
///
/// ```toml
/// source = { type = "tum", sequence = "rgbd_dataset_freiburg1_desk", odometry = "trajectories/dvo_vo.txt" }
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TumRgbd {
    /// The folder of the sequence.
    pub sequence: PathBuf,
    /// The odometry in it, in TUM's format.
    pub odometry: PathBuf,
    /// The detections in it.
    #[serde(default = "detections")]
    pub detections: PathBuf,
    /// The ground truth in it. Default: `groundtruth.txt`, if there is such a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ground_truth: Option<PathBuf>,
    /// The camera: by name, or by its numbers. Default: the one that the folder's name tells.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraChoice>,
    /// Coefficients k₁, k₂, p₁, p₂, k₃ of a `radial_tangential` camera, in the order of OpenCV: boxes are rectified. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<Distortion>,
    /// How far apart in time a detection and its pose may be, in seconds. Time stamps are written to the
    /// microsecond: as it stands, only equal ones match.
    #[serde(default = "exact")]
    pub max_time_difference: NotNegative,
    /// Largest expected share of detections without a pose at their time, from 0 to 1. With more, the run ends with exit code 1.
    #[serde(default = "a_tenth", skip_serializing_if = "is_a_tenth")]
    pub max_without_pose: Share,
}

fn detections() -> PathBuf {
    "detections_yolov3_associated.csv".into()
}
fn exact() -> NotNegative {
    NotNegative::literal(1e-6)
}

#[typetag::serialize(name = "tum")]
impl Source for TumRgbd {
    fn load(&self, folders: &Folders) -> Result<Sequence, SourceError> {
        let folder = folders.data_set(&self.sequence)?;
        let lens = match &self.camera {
            Some(choice) => Rectification::new(choice, self.distortion)?,
            None => Rectification::of_pinhole(by_folder(&folder)?, self.distortion),
        };
        let (odometry, detections) = (folder.join(&self.odometry), folder.join(&self.detections));
        let by = Matching { within: self.max_time_difference, without_pose: self.max_without_pose };
        let (frames, mut detections, unused) = read_matched(&odometry, &detections, by)?;
        lens.apply(&mut detections)?;
        let truth = read_ground_truth(&folder, self.ground_truth.as_deref())?;
        let file = folder.join("accelerometer.txt");
        let readings = if file.is_file() { accelerometer::read(&file)? } else { vec![] };
        let reading = |r: accelerometer::Acceleration| Acceleration {
            timestamp: r.timestamp,
            acceleration: r.acceleration,
        };
        Ok(Sequence {
            camera: lens.camera,
            frames,
            detections,
            up: None,
            accelerometer: readings.into_iter().map(reading).collect(),
            ground_truth: truth,
            unused,
        })
    }
}
register!(dyn Source, "tum", TumRgbd);
