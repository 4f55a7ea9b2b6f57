//! The camera of a calibration in a recording.
use crate::source::camera::with_distortion;
use crate::source::rectification::Rectification;
use manifactor_quadric::Camera;
use manifactor_ros::messages::CameraInfo;

/// Returns the camera of a calibration, and its distortion unless the images are rectified.
pub(super) fn camera_of(info: &CameraInfo, is_rectified: bool) -> Result<Rectification, String> {
    let CameraInfo { height, width, distortion_model, d, k, p, .. } = info;
    let (name, matrix) = if is_rectified { ("p", p) } else { ("k", k) };
    let row = if is_rectified { 4 } else { 3 };
    if matrix.len() != 3 * row {
        return Err(format!("expected {} numbers in `{name}`, got {}", 3 * row, matrix.len()));
    }
    let numbers = [matrix[0], matrix[row + 1], matrix[2], matrix[row + 2]];
    if numbers[0] == 0.0 {
        return Err("the camera is not calibrated: its focal length is 0".into());
    }
    let camera = Camera::new(numbers, *width, *height).map_err(|error| error.to_string())?;
    if is_rectified || d.iter().all(|coefficient| *coefficient == 0.0) {
        return Ok(Rectification::of_pinhole(camera, None));
    }
    let hint = "for boxes in the rectified image set `source.rectified = true`";
    with_distortion(camera, distortion_model, d)
        .map(Rectification::of_model)
        .map_err(|fault| format!("{fault}; {hint}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn info(model: &str, d: &[f64]) -> CameraInfo {
        serde_json::from_value(json!({
            "header": {"stamp": {"sec": 1, "nanosec": 0}, "frame_id": "camera"},
            "height": 480, "width": 640, "distortion_model": model, "d": d,
            "k": [500.0, 0.0, 320.0, 0.0, 510.0, 240.0, 0.0, 0.0, 1.0],
            "p": [480.0, 0.0, 310.0, 0.0, 0.0, 490.0, 230.0, 0.0, 0.0, 0.0, 1.0, 0.0],
        }))
        .unwrap()
    }

    #[test]
    fn a_calibration_gives_the_camera_of_the_image() {
        let lens = camera_of(&info("plumb_bob", &[0.1, 0.0, 0.0, 0.0]), false).unwrap();
        assert_eq!((lens.camera.fx, lens.camera.cy), (500.0, 240.0));
        let rectified = camera_of(&info("equidistant", &[0.1; 4]), true).unwrap().camera;
        assert_eq!((rectified.fx, rectified.fy, rectified.cx, rectified.cy), (480.0, 490.0, 310.0, 230.0));
        assert!(camera_of(&info("equidistant", &[0.0; 4]), false).is_ok());
        assert!(camera_of(&info("equidistant", &[0.1; 4]), false).is_ok());
        assert!(camera_of(&info("rational_polynomial", &[0.01; 8]), false).is_ok());
        let fault = camera_of(&info("fov", &[0.9]), false).unwrap_err();
        assert!(fault.contains("got `fov`") && fault.contains("source.rectified"), "{fault}");
        let fault = camera_of(&info("plumb_bob", &[0.1; 3]), false).unwrap_err();
        assert!(fault.contains("expected 4, 5 or 8"), "{fault}");
        let uncalibrated = CameraInfo { k: vec![0.0; 9], ..info("", &[]) };
        assert!(camera_of(&uncalibrated, false).unwrap_err().contains("not calibrated"));
    }
}
