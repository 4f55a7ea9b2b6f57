//! Calibration files of other programs.
use super::with_distortion;
use crate::source::SourceError;
use manifactor_config::{Document, Errors, Format, Value};
use manifactor_formats::read_text;
use manifactor_geometry::{AnyCamera, Camera, DoubleSphere, ExtendedUnified, Se3};
use manifactor_graph::checked::{Positive, Share};
use nalgebra::Matrix4;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A calibration file: the YAML file of Kalibr (a chain of cameras), OpenCV or ROS, or `cameras.txt` of COLMAP.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrationFile {
    /// Path of the file, relative to the document.
    pub file: PathBuf,
    /// The camera in the file, such as `cam0` or an id of COLMAP. Default: the only one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
}

/// A camera of a file.
struct NamedCamera {
    name: String,
    camera: Result<Arc<dyn AnyCamera>, String>,
    mounting: Result<Mounting, String>,
}

/// Place and clock of a camera on a body.
#[derive(Clone, Copy)]
struct Mounting {
    camera_from_body: Se3,
    /// Time on the clock of the body minus time on the clock of the camera. Unit: seconds.
    time_offset: f64,
}

/// A camera in the form of Kalibr.
#[derive(Deserialize)]
struct KalibrCamera {
    camera_model: String,
    intrinsics: Vec<f64>,
    #[serde(default)]
    distortion_model: Option<String>,
    #[serde(default)]
    distortion_coeffs: Vec<f64>,
    resolution: [u32; 2],
    /// Pose of the IMU in the frame of the camera.
    #[serde(default, rename = "T_cam_imu")]
    camera_from_imu: Option<[[f64; 4]; 4]>,
    /// Pose of the camera before this one, in its frame.
    #[serde(default, rename = "T_cn_cnm1")]
    camera_from_last: Option<[[f64; 4]; 4]>,
    /// Time on the clock of the IMU minus time on the clock of the camera. Unit: seconds.
    #[serde(default)]
    timeshift_cam_imu: f64,
}

/// A matrix in the form of OpenCV and ROS.
#[derive(Deserialize)]
struct Matrix {
    data: Vec<f64>,
}

/// A camera in the form of OpenCV and ROS.
#[derive(Deserialize)]
struct OpenCvCamera {
    image_width: u32,
    image_height: u32,
    camera_matrix: Matrix,
    #[serde(alias = "distortion_coeffs", alias = "dist_coeffs")]
    distortion_coefficients: Matrix,
    #[serde(default)]
    distortion_model: Option<String>,
}

impl CalibrationFile {
    /// Reads the camera.
    ///
    /// # Errors
    /// A file that cannot be read, a camera that is not in it, or a model that is not supported.
    pub(in crate::source) fn read(&self, folder: &Path) -> Result<Arc<dyn AnyCamera>, SourceError> {
        let NamedCamera { name, camera, .. } = self.find(folder)?;
        camera.map_err(|reason| self.fault(folder, format!("camera `{name}`: {reason}")))
    }

    /// Reads the pose of the camera in the frame of the IMU or, without an IMU, of the first camera.
    ///
    /// # Errors
    /// A file that cannot be read, a camera that is not in it, or a file without poses.
    pub(in crate::source) fn read_pose(&self, folder: &Path) -> Result<Se3, SourceError> {
        let NamedCamera { name, mounting, .. } = self.find(folder)?;
        let mounting = mounting.map_err(|reason| self.fault(folder, format!("camera `{name}`: {reason}")));
        let Mounting { camera_from_body, time_offset } = mounting?;
        if time_offset != 0.0 {
            tracing::warn!(
                "{}: `timeshift_cam_imu` of `{name}` is not used: add {time_offset} s to the timestamps of the images",
                self.file.display()
            );
        }
        Ok(camera_from_body.inverse())
    }

    fn fault(&self, folder: &Path, fault: String) -> SourceError {
        SourceError::Calibration { file: folder.join(&self.file), fault }
    }

    fn find(&self, folder: &Path) -> Result<NamedCamera, SourceError> {
        let file = folder.join(&self.file);
        let text = read_text(&file)?;
        let fault = |fault: String| self.fault(folder, fault);
        let mut cameras = if file.extension().is_some_and(|extension| extension == "txt") {
            colmap(&text)
        } else {
            yaml(&file, &text)?
        };
        let names = || cameras.iter().map(|found| format!("`{}`", found.name)).collect::<Vec<_>>().join(", ");
        let place = match &self.name {
            Some(wanted) => {
                let mut named = (0..cameras.len()).filter(|i| cameras[*i].name == *wanted);
                match (named.next(), named.next()) {
                    (Some(found), None) => Ok(found),
                    (Some(_), Some(_)) => Err(format!("there are several cameras `{wanted}`")),
                    (None, _) => Err(format!("there is no camera `{wanted}`; there are {}", names())),
                }
            }
            None => match cameras.len() {
                1 => Ok(0),
                0 => Err("expected the cameras of Kalibr, OpenCV, ROS or COLMAP, found none".into()),
                _ => Err(format!("there are several cameras: set `name` to one of {}", names())),
            },
        };
        let place = place.map_err(fault)?;
        Ok(cameras.swap_remove(place))
    }
}

/// Returns the cameras of Kalibr, OpenCV or ROS.
fn yaml(file: &Path, text: &str) -> Result<Vec<NamedCamera>, SourceError> {
    // OpenCV writes a directive and tags that are not in the standard
    let lines = text.lines().filter(|line| !line.starts_with("%YAML"));
    let plain = lines.map(|line| line.replace("!!opencv-matrix", "")).collect::<Vec<_>>().join("\n");
    let document = Document::parse(file.display().to_string(), plain, Format::Yaml)?;
    let root = document.root();
    let errors = Errors::new();
    if root.field("camera_matrix").is_some() {
        let read = root.read::<OpenCvCamera>(&errors);
        let camera = errors.finish(read)?;
        let name = root.field("camera_name").and_then(|name| name.try_read::<String>().ok());
        let (name, camera) = (name.unwrap_or_else(|| "camera".into()), opencv(&camera));
        return Ok(vec![NamedCamera { name, camera, mounting: Err(NO_POSE.into()) }]);
    }
    let Value::Table(table) = &root.value else { return Ok(vec![]) };
    let (mut cameras, mut last, mut has_poses) = (vec![], None, false);
    for (name, field) in table.iter().filter(|(_, field)| field.node.field("camera_model").is_some()) {
        if let Some(camera) = field.node.read::<KalibrCamera>(&errors) {
            let mounting = camera.mounting(last);
            has_poses |= camera.camera_from_imu.is_some() || camera.camera_from_last.is_some();
            cameras.push(NamedCamera {
                name: name.clone(),
                camera: kalibr(&camera),
                mounting: mounting.clone(),
            });
            last = Some(mounting);
        }
    }
    if !has_poses {
        cameras.iter_mut().for_each(|camera| camera.mounting = Err(NO_POSE.into()));
    }
    Ok(errors.finish(Some(cameras))?)
}

/// Fault of a file without poses.
const NO_POSE: &str = "expected its pose, `T_cam_imu` or `T_cn_cnm1` of Kalibr";

impl KalibrCamera {
    /// Returns the place on the body. `last` is the place of the camera before it. The body is the IMU or, without it, the first
    /// camera.
    fn mounting(&self, last: Option<Result<Mounting, String>>) -> Result<Mounting, String> {
        let pose = |name: &str, rows: &[[f64; 4]; 4]| {
            let matrix = Matrix4::from_fn(|row, column| rows[row][column]);
            Se3::try_from_matrix(&matrix).map_err(|error| format!("`{name}`: {error}"))
        };
        let camera_from_body = match (&self.camera_from_imu, &self.camera_from_last, last) {
            (Some(rows), ..) => pose("T_cam_imu", rows)?,
            (None, Some(rows), Some(last)) => pose("T_cn_cnm1", rows)?.compose(&last?.camera_from_body),
            (None, None, None) => Se3::identity(),
            (None, ..) => return Err(NO_POSE.into()),
        };
        Ok(Mounting { camera_from_body, time_offset: self.timeshift_cam_imu })
    }
}

fn opencv(camera: &OpenCvCamera) -> Result<Arc<dyn AnyCamera>, String> {
    let OpenCvCamera { image_width, image_height, camera_matrix, distortion_coefficients, distortion_model } =
        camera;
    let [fx, skew, cx, 0.0, fy, cy, 0.0, 0.0, 1.0] = camera_matrix.data[..] else {
        return Err(format!(
            "expected `camera_matrix` with the 9 numbers fx, skew, cx, 0, fy, cy, 0, 0, 1, row by row, got {:?}",
            camera_matrix.data
        ));
    };
    let pinhole =
        Camera::new([fx, fy, cx, cy], *image_width, *image_height).map_err(|error| error.to_string())?;
    let pinhole = Camera { skew, ..pinhole };
    let model = distortion_model.as_deref().unwrap_or("plumb_bob");
    with_distortion(pinhole, model, &distortion_coefficients.data)
}

fn kalibr(camera: &KalibrCamera) -> Result<Arc<dyn AnyCamera>, String> {
    let KalibrCamera { camera_model, intrinsics, distortion_model, distortion_coeffs, resolution, .. } =
        camera;
    let [width, height] = *resolution;
    let pinhole = |numbers: [f64; 4]| Camera::new(numbers, width, height).map_err(|error| error.to_string());
    let is_distorted = distortion_model.as_deref().is_some_and(|model| model != "none");
    let text = |error: &dyn std::fmt::Display| error.to_string();
    match (camera_model.as_str(), &intrinsics[..]) {
        ("pinhole", [fx, fy, cx, cy]) => {
            let model = distortion_model.as_deref().unwrap_or("none");
            with_distortion(pinhole([*fx, *fy, *cx, *cy])?, model, distortion_coeffs)
        }
        ("ds" | "eucm" | "omni", _) if is_distorted => {
            Err(format!("`{camera_model}` with a distortion is not supported: calibrate it with `none`"))
        }
        ("ds", [xi, alpha, fx, fy, cx, cy]) => {
            let alpha = Share::new(*alpha).map_err(|error| text(&error))?;
            let camera = DoubleSphere::new(pinhole([*fx, *fy, *cx, *cy])?, *xi, alpha);
            Ok(Arc::new(camera.map_err(|error| text(&error))?))
        }
        ("eucm", [alpha, beta, fx, fy, cx, cy]) => {
            let alpha = Share::new(*alpha).map_err(|error| text(&error))?;
            let beta = Positive::new(*beta).map_err(|error| text(&error))?;
            Ok(Arc::new(ExtendedUnified::new(pinhole([*fx, *fy, *cx, *cy])?, alpha, beta)))
        }
        // the focal lengths of the unified model refer to the sphere
        ("omni", [xi, fx, fy, cx, cy]) if *xi >= 0.0 => {
            let alpha = Share::new(xi / (1.0 + xi)).map_err(|error| text(&error))?;
            let camera = pinhole([fx / (1.0 + xi), fy / (1.0 + xi), *cx, *cy])?;
            Ok(Arc::new(ExtendedUnified::new(camera, alpha, Positive::literal(1.0))))
        }
        ("pinhole" | "ds" | "eucm" | "omni", numbers) => {
            Err(format!("unexpected number of `intrinsics` for `{camera_model}`: {}", numbers.len()))
        }
        (other, _) => Err(format!("expected the model `pinhole`, `omni`, `ds` or `eucm`, got `{other}`")),
    }
}

/// Returns the cameras of COLMAP's `cameras.txt`, each with the number as its name.
fn colmap(text: &str) -> Vec<NamedCamera> {
    let lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    let rows = lines.filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
    rows.map(|(number, line)| {
        let name = line.split_whitespace().next().unwrap_or_default().to_owned();
        let camera = manifactor_formats::colmap::camera(line);
        let camera = camera.map(|camera| camera.lens.camera());
        let camera = camera.map_err(|error| format!("line {number}: {error}"));
        NamedCamera { name, camera, mounting: Err(NO_POSE.into()) }
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector2, Vector3};

    fn read(name: &str, text: &str, camera: Option<&str>) -> Result<Arc<dyn AnyCamera>, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(name), text).unwrap();
        let file = CalibrationFile { file: name.into(), name: camera.map(str::to_owned) };
        file.read(folder.path()).map_err(|error| error.to_string())
    }

    const KALIBR: &str = "\
cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]
  distortion_model: radtan
  intrinsics: [458.7, 457.3, 367.2, 248.4]
  resolution: [752, 480]
  rostopic: /cam0/image_raw
cam1:
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.27, 0.57, 364.8, 364.7, 512.2, 514.1]
  resolution: [1024, 1024]
cam2:
  camera_model: omni
  distortion_model: none
  intrinsics: [1.4, 900.0, 900.0, 512.0, 512.0]
  resolution: [1024, 1024]
";

    #[test]
    fn cameras_of_kalibr_are_read_by_name() {
        let radtan = read("chain.yaml", KALIBR, Some("cam0")).unwrap();
        assert_eq!((radtan.pinhole().fx, radtan.pinhole().width), (458.7, 752));
        let moved = radtan.rectify(&Vector2::new(100.0, 100.0)).unwrap() - Vector2::new(100.0, 100.0);
        assert!((10.0..60.0).contains(&moved.norm()), "{moved}");
        assert!(
            format!("{:?}", read("chain.yaml", KALIBR, Some("cam1")).unwrap()).starts_with("DoubleSphere")
        );
        let omni = read("chain.yaml", KALIBR, Some("cam2")).unwrap();
        assert!((omni.pinhole().fx - 375.0).abs() < 1e-9);
        let error = read("chain.yaml", KALIBR, None).unwrap_err();
        assert!(error.contains("several cameras: set `name` to one of `cam0`, `cam1`, `cam2`"), "{error}");
        let error = read("chain.yaml", KALIBR, Some("cam3")).unwrap_err();
        assert!(error.contains("there is no camera `cam3`"), "{error}");
        let wrong = KALIBR.replace("camera_model: ds", "camera_model: fov");
        let error = read("chain.yaml", &wrong, Some("cam1")).unwrap_err();
        assert!(error.contains("`cam1`: expected the model `pinhole`"), "{error}");
        let error = read("chain.yaml", &KALIBR.replace("[752, 480]", "752"), Some("cam0")).unwrap_err();
        assert!(error.contains("resolution") || error.contains("chain.yaml"), "{error}");
    }

    #[test]
    fn cameras_of_opencv_and_ros_are_read() {
        let opencv = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 517.3, 0., 318.6, 0., 516.5, 255.3, 0., 0., 1. ]\ndistortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ 0.26, -0.95, -0.005, 0.003, 1.16 ]\n";
        let camera = read("left.yml", opencv, None).unwrap();
        assert_eq!((camera.pinhole().fy, camera.pinhole().cy), (516.5, 255.3));
        let ros = "image_width: 848\nimage_height: 800\ncamera_name: wide\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [285.7, 0, 425.5, 0, 286.9, 384.2, 0, 0, 1]\ndistortion_model: equidistant\ndistortion_coefficients:\n  rows: 1\n  cols: 4\n  data: [-0.005, 0.04, -0.04, 0.006]\n";
        assert!(format!("{:?}", read("wide.yaml", ros, None).unwrap()).starts_with("KannalaBrandt"));
        let skewed = opencv.replace("517.3, 0.,", "517.3, 0.5,");
        assert_eq!(read("left.yml", &skewed, None).unwrap().pinhole().skew, 0.5);
        let transposed = opencv.replace(
            "517.3, 0., 318.6, 0., 516.5, 255.3, 0., 0.",
            "517.3, 0., 0., 0., 516.5, 0., 318.6, 255.3",
        );
        let error = read("left.yml", &transposed, None).unwrap_err();
        assert!(error.contains("fx, skew, cx, 0, fy, cy, 0, 0, 1, row by row"), "{error}");
        let error = read("wide.yaml", &ros.replace("equidistant", "fov"), None).unwrap_err();
        assert!(error.contains("camera `wide`: expected the distortion model"), "{error}");
    }

    #[test]
    fn cameras_of_colmap_are_read_by_id() {
        let text = "# id model width height parameters\n1 SIMPLE_RADIAL 800 600 500 400 300 0.05\n7 OPENCV_FISHEYE 848 800 285 286 425 384 0.01 0.02 0 0\n";
        let radial = read("cameras.txt", text, Some("1")).unwrap();
        assert_eq!((radial.pinhole().fx, radial.pinhole().fy, radial.pinhole().cx), (500.0, 500.0, 400.0));
        assert!(format!("{:?}", read("cameras.txt", text, Some("7")).unwrap()).starts_with("KannalaBrandt"));
        let twice = "1 PINHOLE 800 600 5 5 4 3\n1 PINHOLE 800 600 6 6 4 3\n";
        let error = read("cameras.txt", twice, Some("1")).unwrap_err();
        assert!(error.contains("there are several cameras `1`"), "{error}");
        for (wrong, words) in [
            ("1 SIMPLE_RADIAL 800 600 500 400 300\n", "expected 4 parameters of SIMPLE_RADIAL, got 3"),
            ("1 FOV 800 600 500 500 400 300 0.9\n", "got FOV"),
            ("1 PINHOLE 800\n", "line 1: expected 5 fields (id model width height parameters), got 3"),
            ("1 PINHOLE 800 600 500 x 400 300\n", "line 1: expected a finite number, got `x`"),
            ("1 PINHOLE 800 600 -500 500 400 300\n", "expected fx"),
        ] {
            let error = read("cameras.txt", wrong, None).unwrap_err();
            assert!(error.contains(words) && error.contains("cameras.txt"), "{error}");
        }
    }

    /// Returns the pose of a camera of this text on the body.
    fn pose(text: &str, camera: &str) -> Result<Se3, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("chain.yaml"), text).unwrap();
        let file = CalibrationFile { file: "chain.yaml".into(), name: Some(camera.into()) };
        file.read_pose(folder.path()).map_err(|error| error.to_string())
    }

    /// Each camera is 0.1 m to the right of the one before.
    const FROM_LAST: &str = "  T_cn_cnm1:\n  - [1.0, 0.0, 0.0, -0.1]\n  - [0.0, 1.0, 0.0, 0.0]\n  - [0.0, 0.0, 1.0, 0.0]\n  - [0.0, 0.0, 0.0, 1.0]\n";

    #[test]
    fn poses_of_kalibr_are_read_along_the_chain() {
        let chain = KALIBR.replace("  camera_model: ds", &format!("{FROM_LAST}  camera_model: ds"));
        let chain = chain.replace("  camera_model: omni", &format!("{FROM_LAST}  camera_model: omni"));
        assert_eq!(pose(&chain, "cam0"), Ok(Se3::identity()));
        assert!((pose(&chain, "cam2").unwrap().translation - Vector3::new(0.2, 0.0, 0.0)).norm() < 1e-12);
        // x of the camera is -y of the IMU, y is -z, z is x
        let imu = "  T_cam_imu:\n  - [0.0, -1.0, 0.0, 0.3]\n  - [0.0, 0.0, -1.0, 0.0]\n  - [1.0, 0.0, 0.0, -0.5]\n  - [0.0, 0.0, 0.0, 1.0]\n";
        let chain = chain.replace("  camera_model: pinhole", &format!("{imu}  camera_model: pinhole"));
        assert!((pose(&chain, "cam0").unwrap().translation - Vector3::new(0.5, 0.3, 0.0)).norm() < 1e-12);
        assert!((pose(&chain, "cam1").unwrap().translation - Vector3::new(0.5, 0.2, 0.0)).norm() < 1e-12);
        let error = pose(KALIBR, "cam1").unwrap_err();
        assert!(error.contains("camera `cam1`: expected its pose, `T_cam_imu` or `T_cn_cnm1`"), "{error}");
        let wrong = chain.replace("[1.0, 0.0, 0.0, -0.5]", "[2.0, 0.0, 0.0, -0.5]");
        let error = pose(&wrong, "cam0").unwrap_err();
        assert!(error.contains("`T_cam_imu`"), "{error}");
    }
}
