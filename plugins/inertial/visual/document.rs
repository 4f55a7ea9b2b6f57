//! The document of a visual-inertial recording.
use super::VisualInertialSettings;
use manifactor_geometry::{Camera, Se3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The document of visual-inertial estimation. Paths are relative to it.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "VisualInertial")]
pub struct VisualInertialDocument {
    /// Readings of the IMU: CSV with the columns `timestamp` (s, or ns as `timestamp [ns]`), `wx`, `wy`, `wz`
    /// (rad/s), `ax`, `ay`, `az` (m/s²), or the names of EuRoC.
    pub imu: PathBuf,
    /// Tracked points: CSV with the columns `timestamp`, `landmark`, and `u`, `v` (pixels) or `u_norm`, `v_norm`
    /// (on the plane at depth one), without distortion.
    pub tracks: PathBuf,
    /// The camera.
    pub camera: Camera,
    /// Pose of the camera in the frame of the IMU.
    pub body_from_camera: Se3,
    /// True poses of the IMU, for evaluation: a trajectory in the TUM format, or CSV as in EuRoC.
    #[serde(default)]
    pub ground_truth: Option<PathBuf>,
    /// File of Kalibr with the noise densities of the IMU (YAML), in place of `settings.noise`.
    #[serde(default)]
    pub imu_noise: Option<PathBuf>,
    /// Folder for the results. Default: `out/vio`.
    #[serde(default = "default_output")]
    pub output: PathBuf,
    /// Settings of the estimation.
    #[serde(default)]
    pub settings: VisualInertialSettings,
}

fn default_output() -> PathBuf {
    "out/vio".into()
}
