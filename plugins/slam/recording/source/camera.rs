//! Cameras by name.
use super::SourceError;
use manifactor_geometry::{AnyCamera, Distortion, KannalaBrandt, RadialTangential, Se3};
use manifactor_quadric::Camera;
use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{self, IntoDeserializer, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

mod calibration;

pub use calibration::CalibrationFile;

/// Cameras of TUM RGB-D, 640 × 480, without distortion, as in the paper.
const PRESETS: [(&str, [f64; 4]); 3] = [
    ("freiburg1", [517.3, 516.5, 318.6, 255.3]),
    ("freiburg2", [520.9, 521.0, 325.1, 249.7]),
    ("freiburg3", [535.4, 539.2, 320.1, 247.6]),
];

/// A camera by its parameters or by its name.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum CameraChoice {
    /// `freiburg1`, `freiburg2` or `freiburg3`: cameras of TUM RGB-D.
    Named(CameraName),
    /// A pinhole camera by its parameters. Unit: pixels.
    Pinhole(Camera),
    /// A camera model by its `type`.
    Model(Arc<dyn AnyCamera>),
    /// A calibration file of Kalibr, OpenCV, ROS or COLMAP.
    File(CalibrationFile),
}

/// Pose of a camera on a body.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum CameraPose {
    /// The pose: the translation in metres, and the rotation as a unit quaternion (x, y, z, w).
    Pose(Se3),
    /// A calibration file of Kalibr: the pose in the frame of its IMU (`T_cam_imu`) or, without an IMU, of its first
    /// camera (`T_cn_cnm1`).
    File(CalibrationFile),
}

impl From<Se3> for CameraPose {
    fn from(pose: Se3) -> Self {
        Self::Pose(pose)
    }
}

impl<'de> Deserialize<'de> for CameraPose {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        manifactor_config::deserialize_with(from, |node| {
            let pose = match node.field("file") {
                Some(_) => Self::File(node.try_read()?),
                None => Self::Pose(node.try_read()?),
            };
            Ok(Box::new(pose))
        })
    }
}

impl CameraPose {
    /// Returns the pose in the frame of the body. A calibration file is relative to `folder`.
    ///
    /// # Errors
    /// A calibration file that cannot be read, or has no pose.
    pub(super) fn read(&self, folder: &Path) -> Result<Se3, SourceError> {
        match self {
            Self::Pose(pose) => Ok(*pose),
            Self::File(file) => file.read_pose(folder),
        }
    }

    /// Returns the calibration file, if there is one.
    pub(super) fn file(&self) -> Option<&Path> {
        match self {
            Self::File(calibration) => Some(&calibration.file),
            Self::Pose(_) => None,
        }
    }
}

/// Cameras of TUM RGB-D.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum CameraName {
    /// fx 517.3, fy 516.5, cx 318.6, cy 255.3
    Freiburg1,
    /// fx 520.9, fy 521.0, cx 325.1, cy 249.7
    Freiburg2,
    /// fx 535.4, fy 539.2, cx 320.1, cy 247.6
    Freiburg3,
}

// serde's own untagged enum would only report that no variant fits, and not the error in a field
impl<'de> Deserialize<'de> for CameraChoice {
    fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
        struct UntaggedCamera(CameraChoice);
        struct CameraVisitor;
        impl<'de> Visitor<'de> for CameraVisitor {
            type Value = CameraChoice;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a camera, or a table of its fx, fy, cx, cy, width and height, with the `type` of another model than the pinhole, or the `file` of a calibration")
            }
            fn visit_str<E: de::Error>(self, name: &str) -> Result<CameraChoice, E> {
                CameraName::deserialize(name.into_deserializer()).map(CameraChoice::Named)
            }
            fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<CameraChoice, A::Error> {
                Camera::deserialize(MapAccessDeserializer::new(table)).map(CameraChoice::Pinhole)
            }
        }
        impl<'de> Deserialize<'de> for UntaggedCamera {
            fn deserialize<D: Deserializer<'de>>(from: D) -> Result<Self, D::Error> {
                from.deserialize_any(CameraVisitor).map(Self)
            }
        }
        manifactor_config::deserialize_with(from, |node| {
            let choice = match node.field("type") {
                Some(_) => Self::Model(node.try_read()?),
                None if node.field("file").is_some() => Self::File(node.try_read()?),
                None => node.try_read::<UntaggedCamera>()?.0,
            };
            Ok(Box::new(choice))
        })
    }
}

impl CameraChoice {
    /// Returns the pinhole camera of the rectified image, and the model of the images if it is another.
    ///
    /// # Errors
    /// A calibration file that cannot be read.
    pub(super) fn read(&self, folder: &Path) -> Result<(Camera, Option<Arc<dyn AnyCamera>>), SourceError> {
        let model = match self {
            Self::Pinhole(camera) => return Ok((*camera, None)),
            Self::Named(name) => return Ok((preset(PRESETS[*name as usize].1), None)),
            Self::Model(model) => Arc::clone(model),
            Self::File(file) => file.read(folder)?,
        };
        Ok((model.pinhole(), Some(model)))
    }

    /// Returns the calibration file, if there is one.
    pub(super) fn file(&self) -> Option<&Path> {
        match self {
            Self::File(calibration) => Some(&calibration.file),
            _ => None,
        }
    }
}

/// Returns a camera with the distortion of a model as ROS, Kalibr or OpenCV name it.
///
/// # Errors
/// An unknown model, or a wrong number of coefficients.
pub(super) fn with_distortion(
    camera: Camera,
    model: &str,
    coefficients: &[f64],
) -> Result<Arc<dyn AnyCamera>, String> {
    // a fisheye without distortion is no pinhole
    let is_fisheye = matches!(model, "equidistant" | "fisheye");
    if !is_fisheye && coefficients.iter().all(|coefficient| *coefficient == 0.0) {
        return Ok(Arc::new(camera));
    }
    match model {
        "plumb_bob" | "radtan" | "rational_polynomial" => {
            let distortion =
                Distortion::try_from(coefficients.to_vec()).map_err(|error| error.to_string())?;
            Ok(Arc::new(RadialTangential::new(camera, distortion)))
        }
        _ if is_fisheye => match *coefficients {
            [k1, k2, k3, k4] => Ok(Arc::new(KannalaBrandt::new(camera, [k1, k2, k3, k4]))),
            _ => Err(format!("expected 4 coefficients of `{model}`, got {}", coefficients.len())),
        },
        other => Err(format!(
            "expected the distortion model `plumb_bob` (`radtan`), `rational_polynomial` or `equidistant`, got `{other}`"
        )),
    }
}

fn preset([fx, fy, cx, cy]: [f64; 4]) -> Camera {
    Camera { fx, fy, cx, cy, skew: 0.0, width: 640, height: 480 }
}

/// Returns the camera whose name is part of the folder's name.
pub(super) fn by_folder(folder: &Path) -> Result<Camera, SourceError> {
    let name = folder.file_name().map(|n| n.to_string_lossy().to_lowercase()).unwrap_or_default();
    let known = PRESETS.iter().find(|(camera, _)| name.contains(camera));
    known.map(|(_, numbers)| preset(*numbers)).ok_or_else(|| SourceError::UnknownCamera {
        folder: folder.to_owned(),
        known: PRESETS.iter().map(|(camera, _)| *camera).collect(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zeros_are_no_distortion_of_a_pinhole_and_an_ideal_fisheye() {
        let camera = preset(PRESETS[0].1);
        let read = |model, coefficients: &[f64]| {
            with_distortion(camera, model, coefficients).map(|camera| format!("{camera:?}"))
        };
        for model in ["plumb_bob", "none", ""] {
            assert!(read(model, &[0.0; 5]).unwrap().starts_with("Camera"));
            assert!(read(model, &[]).unwrap().starts_with("Camera"));
        }
        assert!(read("equidistant", &[0.0; 4]).unwrap().starts_with("KannalaBrandt"));
        assert!(read("equidistant", &[]).unwrap_err().contains("expected 4 coefficients"));
    }

    #[test]
    fn names_and_folders_tell_the_same_camera() {
        let named = CameraChoice::Named(CameraName::Freiburg2).read(Path::new("")).unwrap().0;
        assert_eq!(named.fx, 520.9);
        assert_eq!(by_folder(Path::new("x/rgbd_dataset_freiburg2_desk")).unwrap(), named);
        assert!(by_folder(Path::new("x/desk")).unwrap_err().to_string().contains("freiburg1, freiburg2"));
    }
}
