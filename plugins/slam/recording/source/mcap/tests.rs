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
    let fault = camera_of(&info("equidistant", &[0.1; 4]), false).unwrap_err();
    assert!(fault.contains("`equidistant` with 4") && fault.contains("source.rectified"), "{fault}");
    let uncalibrated = CameraInfo { k: vec![0.0; 9], ..info("", &[]) };
    assert!(camera_of(&uncalibrated, false).unwrap_err().contains("not calibrated"));
}

#[test]
fn classes_by_number_get_their_names_and_faulty_boxes_are_reported() {
    let source: Mcap =
        serde_json::from_value(json!({"file": "a.mcap", "classes": ["person", "cup"]})).unwrap();
    let image = |boxes: Vec<recorded_messages::BoxOrFault>| BoxesOfImage::new(2.0, boxes);
    let good = [10.0, 10.0, 50.0, 60.0];
    let boxes = vec![
        Ok((good, vec![("1".to_owned(), 0.7), ("7".to_owned(), 0.1), ("vase".to_owned(), 0.2)])),
        Ok(([50.0, 10.0, 10.0, 60.0], vec![])),
        Ok((good, vec![("1".to_owned(), 70.0)])),
        Err("no centre".to_owned()),
    ];
    let (images, rows, unused) = source.detections(&[image(boxes), image(vec![])]);
    assert_eq!((images.len(), rows.len(), unused.len()), (2, 1, 3));
    let classes: Vec<&str> = rows[0].1.scores.iter().map(|(class, _)| class).collect();
    assert_eq!(classes, ["cup", "7", "vase"]);
}
