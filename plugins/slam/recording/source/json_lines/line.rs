//! A frame as a line of JSON.
use super::super::interpolation::PoseOrImage;
use crate::camera::Cameras;
use crate::ellipse::ImageEllipse;
use crate::measurement::{Quantities, measurement_schemas};
use crate::sequence::pose_graph::{PoseFactor, PoseGraphChanges};
use crate::sequence::{
    Acceleration, ClassScores, Detection, Frame, ObjectId, Observation, UnusedInput, remove_repeated,
};
use indexmap::IndexMap;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::{CameraView, Se3};
use manifactor_graph::checked::Share;
use manifactor_graph::{Manifold, Noise};
use manifactor_quadric::BoundingBox;
use nalgebra::Vector3;
use schemars::{JsonSchema, Schema};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::collections::BTreeMap;
use std::sync::Arc;

/// A frame in the form of a line.
// items that cannot be read are reported one by one, so lists of them are read as values first
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Frame")]
pub struct FrameLine {
    /// Timestamp. Unit: seconds.
    timestamp: f64,
    /// Pose of the camera in the frame of the odometry; of the body, with `source.body_from_camera`. Required unless
    /// `source.max_pose_gap` is set. Unit: metres; the rotation is a unit quaternion (x, y, z, w).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pose: Option<Se3>,
    /// Boxes in the images of the frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Vec<LineBox>>")]
    boxes: Option<Vec<Value>>,
    /// Readings of the accelerometer since the previous frame.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    accelerometer: Vec<AccelerometerReading>,
    /// Noise of the step from the previous frame, rotation before translation. Default: `odometry.noise`, or its
    /// estimate. Unit: radians, metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<Noise>")]
    odometry_noise: Option<Value>,
    /// New factors on poses.
    #[serde(default, skip_serializing_if = "is_empty")]
    #[schemars(with = "Vec<PoseFactor>")]
    factors: Value,
    /// Ids of factors to remove.
    #[serde(default, skip_serializing_if = "is_empty")]
    #[schemars(with = "Vec<String>")]
    removed: Value,
    /// Corrected poses of earlier frames.
    #[serde(default, skip_serializing_if = "is_empty")]
    #[schemars(with = "Vec<CorrectedPose>")]
    corrected: Value,
}

/// A corrected pose of an earlier frame.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct CorrectedPose {
    /// Timestamp of the frame. Unit: seconds.
    timestamp: f64,
    /// The corrected pose, like `pose` of a frame.
    pose: Se3,
}

/// A box in the form of a line; `quantities` collects all further fields.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = add_measurements)]
struct LineBox {
    /// Sides xmin, ymin, xmax, ymax. Unit: pixels.
    #[serde(rename = "box")]
    bounding_box: BoundingBox,
    /// Class.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    class: Option<String>,
    /// Score of the class, from 0 to 1.
    #[serde(default = "certain_score", skip_serializing_if = "is_certain")]
    score: Share,
    /// Scores of several classes, each from 0 to 1, in place of `class` and `score`.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    #[schemars(with = "BTreeMap<String, f64>")]
    scores: IndexMap<String, f64>,
    /// Id of the object that the box shows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "Option<u32>")]
    object: Option<ObjectId>,
    /// Name of a further camera in `source.cameras`. Default: the first camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    camera: Option<String>,
    /// Outline of the object in place of the box, for example from a mask. The box is still needed, for data association.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    ellipse: Option<ImageEllipse>,
    /// Pinhole camera of the box, if it is given in the view of a wide lens. The program writes it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    view: Option<CameraView>,
    #[serde(flatten)]
    #[schemars(skip)]
    quantities: IndexMap<String, Value>,
}

/// Adds the registered measurements to the fields of a box.
fn add_measurements(schema: &mut Schema) {
    if let Some(fields) = schema.ensure_object().get_mut("properties").and_then(Value::as_object_mut) {
        fields.extend(measurement_schemas());
    }
    schema.insert("additionalProperties".into(), false.into());
}

/// Fields of a box besides its measurements.
const FIELDS: [&str; 8] = ["box", "class", "score", "scores", "object", "camera", "ellipse", "view"];

/// A reading of the accelerometer.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
struct AccelerometerReading {
    /// Timestamp. Unit: seconds.
    timestamp: f64,
    /// Acceleration in the frame of the sensor; at rest it points up. Unit: m/s².
    #[schemars(with = "[f64; 3]")]
    acceleration: Vector3<f64>,
}

fn is_empty(list: &Value) -> bool {
    list.as_array().is_none_or(Vec::is_empty)
}

fn certain_score() -> Share {
    Share::literal(1.0)
}
#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_certain(score: &Share) -> bool {
    **score >= 1.0
}

/// Returns a frame as a line for this source, without the line end.
pub fn format_line(observation: &Observation) -> String {
    let of_box = |detection: &Detection| {
        let scores: IndexMap<String, f64> = detection.scores.iter().map(|(c, s)| (c.to_owned(), s)).collect();
        let first = scores.first().filter(|_| scores.len() == 1);
        let single = first.and_then(|(class, score)| Some((class.clone(), Share::new(*score).ok()?)));
        LineBox {
            bounding_box: detection.bounding_box,
            scores: if single.is_some() { IndexMap::new() } else { scores },
            score: single.as_ref().map_or_else(certain_score, |(_, score)| *score),
            class: single.map(|(class, _)| class),
            object: detection.object,
            camera: Some(detection.camera.name.clone()).filter(|_| detection.camera.index > 0),
            ellipse: detection.ellipse,
            view: detection.camera.view(),
            quantities: detection.quantities.to_fields().collect(),
        }
    };
    let of_reading =
        |r: &Acceleration| AccelerometerReading { timestamp: r.timestamp, acceleration: r.acceleration };
    let of_pose = |p: &StampedPose| CorrectedPose { timestamp: p.timestamp, pose: p.pose };
    let line = FrameLine {
        timestamp: observation.frame.timestamp,
        pose: Some(observation.frame.world_from_camera),
        boxes: Some(values_of(observation.detections.iter().map(of_box))),
        accelerometer: observation.accelerometer.iter().map(of_reading).collect(),
        odometry_noise: observation
            .frame
            .odometry_noise
            .as_deref()
            .and_then(|n| serde_json::to_value(n).ok()),
        factors: values_of(&observation.pose_graph.factors).into(),
        removed: values_of(&observation.pose_graph.removed).into(),
        corrected: values_of(observation.pose_graph.corrected.iter().map(of_pose)).into(),
    };
    serde_json::to_string(&line).unwrap_or_default()
}

fn values_of(items: impl IntoIterator<Item = impl Serialize>) -> Vec<Value> {
    items.into_iter().filter_map(|item| serde_json::to_value(item).ok()).collect()
}

/// Reads the items of a list. Items that cannot be read are left out and reported; so is a value that is no list.
fn read_items<T: DeserializeOwned>(
    list: Value,
    field: &str,
    timestamp: f64,
    unused: &mut Vec<UnusedInput>,
) -> Vec<T> {
    let mut report = |field: String, fault: String| {
        unused.push(UnusedInput::PoseGraph { timestamp, field, fault });
    };
    let items = match list {
        Value::Null => vec![],
        Value::Array(items) => items,
        other => {
            report(field.to_owned(), format!("expected a list, got {other}"));
            vec![]
        }
    };
    let read = |(place, item): (usize, Value)| {
        let read = serde_json::from_value(item);
        read.map_err(|error| report(format!("{field} {}", place + 1), error.to_string())).ok()
    };
    items.into_iter().enumerate().filter_map(read).collect()
}

/// Reads the noise of a step.
fn read_noise(noise: Value) -> Result<Arc<Noise>, String> {
    let noise: Noise = serde_json::from_value(noise).map_err(|error| error.to_string())?;
    noise.whitener(Se3::TANGENT.len()).map_err(|error| error.to_string())?;
    Ok(Arc::new(noise))
}

/// Reads a frame of these cameras from such a line.
///
/// # Errors
/// If the line is not a frame, or has no pose.
pub fn parse(line: &[u8], cameras: &Cameras) -> Result<Observation, String> {
    let PoseOrImage { observation, has_pose, .. } = parse_line(line, cameras)?;
    has_pose.then_some(observation).ok_or_else(|| "missing field `pose`".into())
}

/// Reads a pose, an image or both from a line.
pub(super) fn parse_line(line: &[u8], cameras: &Cameras) -> Result<PoseOrImage, String> {
    let read = serde_json::from_slice(line).or_else(|error| match without_infinities(line) {
        Some(text) => serde_json::from_str(&text),
        None => Err(error),
    });
    let FrameLine { timestamp, pose, boxes, accelerometer, odometry_noise, factors, removed, corrected } =
        read.map_err(|error: serde_json::Error| error.to_string())?;
    let (mut detections, mut unused) = (vec![], vec![]);
    let (has_pose, is_image) = (pose.is_some(), boxes.is_some());
    for (place, value) in boxes.unwrap_or_default().into_iter().enumerate() {
        match LineBox::read(value, cameras) {
            Ok(seen) => detections.push(seen),
            Err(fault) => unused.push(UnusedInput::Box { timestamp, place: place + 1, fault }),
        }
    }
    let repeated = remove_repeated(&mut detections).into_iter();
    unused.extend(repeated.map(|places| UnusedInput::repeated(timestamp, places)));
    let mut frame = Frame::new(timestamp, pose.unwrap_or_else(Se3::identity));
    match odometry_noise.map(read_noise).transpose() {
        Ok(noise) => frame.odometry_noise = noise,
        Err(fault) => {
            unused.push(UnusedInput::PoseGraph { timestamp, field: "odometry_noise".into(), fault });
        }
    }
    let corrected = read_items(corrected, "corrected", timestamp, &mut unused).into_iter();
    let pose_graph = PoseGraphChanges {
        factors: read_items::<PoseFactor>(factors, "factors", timestamp, &mut unused),
        removed: read_items(removed, "removed", timestamp, &mut unused),
        corrected: corrected
            .map(|CorrectedPose { timestamp, pose }| StampedPose { timestamp, pose })
            .collect(),
    };
    let of_reading =
        |r: AccelerometerReading| Acceleration { timestamp: r.timestamp, acceleration: r.acceleration };
    let observation = Observation {
        frame,
        detections,
        accelerometer: accelerometer.into_iter().map(of_reading).collect(),
        pose_graph,
        unused,
    };
    Ok(PoseOrImage { observation, has_pose, is_image })
}

/// Returns the line with `null` in place of each non-finite number; `None` if all numbers are finite. JSON
/// has no such numbers, but programs in several languages write them. A field that needs a number rejects
/// `null`; in a box this rejects only the box.
fn without_infinities(line: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(line).ok()?;
    let (mut out, mut word, mut found) = (String::with_capacity(text.len()), String::new(), false);
    let (mut is_text, mut is_escaped) = (false, false);
    for c in text.chars().chain(['\n']) {
        if !is_text && (c.is_ascii_alphanumeric() || ['+', '-', '.'].contains(&c)) {
            word.push(c);
            continue;
        }
        if !word.is_empty() {
            let is_infinite = word.parse::<f64>().is_ok_and(|number| !number.is_finite());
            found |= is_infinite;
            out += if is_infinite { "null" } else { &word };
            word.clear();
        }
        match c {
            '"' if !is_escaped => is_text = !is_text,
            _ => {}
        }
        is_escaped = is_text && c == '\\' && !is_escaped;
        out.push(c);
    }
    found.then_some(out)
}

impl LineBox {
    fn read(value: Value, cameras: &Cameras) -> Result<Detection, String> {
        let seen: Self = serde_json::from_value(value).map_err(|error| error.to_string())?;
        if let Some((class, score)) = seen.scores.iter().find(|(_, score)| !(0.0..=1.0).contains(*score)) {
            return Err(format!("the score of `{class}` must be a number from 0 to 1, got {score}"));
        }
        match &seen.class {
            Some(class) if !seen.scores.is_empty() => {
                Err(format!("a box has `class` and `score`, or `scores`, and not both: `{class}`"))
            }
            _ => seen.into_detection(cameras),
        }
    }

    fn into_detection(self, cameras: &Cameras) -> Result<Detection, String> {
        let named = cameras.named(self.camera.as_deref())?;
        let camera = self.view.map_or_else(|| named.clone(), |view| Arc::new(named.viewed(&view)));
        let single = self.class.map(|class| (class, self.score.get()));
        let scores: ClassScores = self.scores.into_iter().chain(single).collect();
        let quantities = Quantities::read(self.quantities, &FIELDS)?;
        let Self { object, bounding_box, ellipse, .. } = self;
        ellipse.map_or(Ok(()), |ellipse| ellipse.check(&bounding_box))?;
        Ok(Detection { frame: 0, object, scores, camera, bounding_box, quantities, ellipse })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::So3;
    use manifactor_quadric::Camera;

    fn cameras() -> Cameras {
        let model = Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap();
        let mut cameras = Cameras::new(model);
        cameras.add("left", model, Se3::identity()).unwrap();
        cameras
    }

    fn parse(line: &[u8]) -> Result<Observation, String> {
        super::parse(line, &cameras())
    }

    #[test]
    fn an_ellipse_is_read_back_as_written_and_has_to_fit_its_box() {
        let line = |ellipse: &str| {
            let seen = format!(r#"{{"box": [60.0, 70.0, 140.0, 90.0], "ellipse": {ellipse}}}"#);
            format!(
                r#"{{"timestamp": 1.0, "pose": {{"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}}, "boxes": [{seen}]}}"#
            )
        };
        let read =
            parse(line(r#"{"centre": [100, 80], "semi_axes": [39, 11], "angle": 0.05}"#).as_bytes()).unwrap();
        let again = parse(format_line(&read).as_bytes()).unwrap();
        assert!(read.detections[0].ellipse.is_some() && again.detections == read.detections);
        let faults = [
            (r#"{"centre": [100, 80], "semi_axes": [78, 22]}"#, "half of the diameters"),
            (r#"{"centre": [100, 80], "semi_axes": [39, -1]}"#, "number above zero"),
            (r#"{"center": [100, 80], "semi_axes": [39, 11]}"#, "unknown field `center`"),
        ];
        for (ellipse, words) in faults {
            let read = parse(line(ellipse).as_bytes()).unwrap();
            let UnusedInput::Box { fault, .. } = &read.unused[0] else { panic!() };
            assert!(fault.contains(words), "{fault}");
        }
    }

    #[test]
    fn scores_are_from_0_to_1_and_given_once() {
        let line = |seen: &str| {
            format!(
                r#"{{"timestamp": 1.0, "pose": {{"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}}, "boxes": [{seen}]}}"#
            )
        };
        let wrong = [
            (r#"{"box": [1, 1, 5, 5], "class": "cup", "score": 1.7}"#, "0"),
            (
                r#"{"box": [1, 1, 5, 5], "scores": {"cup": 1.7}}"#,
                "the score of `cup` must be a number from 0 to 1",
            ),
            (r#"{"box": [1, 1, 5, 5], "class": "cup", "scores": {"cup": 0.7}}"#, "and not both: `cup`"),
            (r#"{"box": [1, 1, 5, NaN], "class": "Infinity \" NaN"}"#, "null"),
            (r#"{"box": [1, -Infinity, 5, 5], "class": "cup"}"#, "null"),
            (r#"{"box": [1, 1, 1e999, 5], "class": "cup"}"#, "null"),
        ];
        for (seen, words) in wrong {
            let good = r#"{"box": [1, 1, 5, 5], "class": "cup"}"#;
            let read = parse(line(&format!("{seen}, {good}")).as_bytes()).unwrap();
            let UnusedInput::Box { place, fault, .. } = &read.unused[0] else { panic!() };
            assert!(*place == 1 && fault.contains(words) && read.detections.len() == 1, "{fault}");
        }
        let two =
            parse(line(r#"{"box": [1, 1, 5, 5], "scores": {"cup": 0.7, "bowl": 0.2}}"#).as_bytes()).unwrap();
        assert_eq!(two.detections[0].scores.iter().count(), 2);
    }

    #[test]
    fn a_box_names_its_camera() {
        let seen = |camera: &str| format!(r#"{{"box": [1, 1, 5, 5], "class": "cup"{camera}}}"#);
        let boxes = [seen(""), seen(r#", "camera": "left""#), seen(r#", "camera": "right""#)].join(", ");
        let read = line_with(&format!(r#""boxes": [{boxes}]"#));
        assert_eq!(read.detections.iter().map(|seen| seen.camera.index).collect::<Vec<_>>(), [0, 1]);
        let UnusedInput::Box { place, fault, .. } = &read.unused[0] else { panic!() };
        assert!(*place == 3 && fault.contains("unknown camera `right`, expected one of `left`"), "{fault}");
        let again = parse(format_line(&read).as_bytes()).unwrap();
        assert_eq!(again.detections, read.detections);
    }

    const CLOSURE: &str = r#"{"id": "loop 1", "keys": [1.0, 7.5], "factor": {"type": "between_se3", "relative": {"translation": [1, 0, 0], "rotation": [0, 0, 0, 1]}}, "noise": {"sigma": 0.01}}"#;

    fn line_with(fields: &str) -> Observation {
        let pose = r#""timestamp": 9.0, "pose": {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}"#;
        parse(format!("{{{pose}, {fields}}}").as_bytes()).unwrap()
    }

    #[test]
    fn changes_of_the_pose_graph_are_read_back_as_written() {
        let sigmas = r#""odometry_noise": {"sigmas": [0.01, 0.01, 0.01, 0.02, 0.02, 0.02]}"#;
        let corrected = r#""corrected": [{"timestamp": 7.5, "pose": {"translation": [0, 1, 0], "rotation": [0, 0, 0, 1]}}]"#;
        let read =
            line_with(&format!(r#"{sigmas}, "factors": [{CLOSURE}], "removed": ["loop 0"], {corrected}"#));
        assert!(read.unused.is_empty() && read.frame.odometry_noise.is_some(), "{:?}", read.unused);
        let PoseGraphChanges { factors, removed, corrected } = &read.pose_graph;
        assert_eq!((factors[0].id.as_deref(), removed[0].as_str()), (Some("loop 1"), "loop 0"));
        assert_eq!((corrected[0].timestamp, corrected[0].pose.translation.y), (7.5, 1.0));
        assert_eq!(parse(format_line(&read).as_bytes()).unwrap(), read);
    }

    #[test]
    fn a_faulty_change_of_the_pose_graph_is_left_out_alone() {
        let faulty = [
            (CLOSURE.replace("0.01", "-1"), "a standard deviation must be a finite number above zero"),
            (CLOSURE.replace("between_se3", "betwen_se3"), "between_se3"),
            (CLOSURE.replace("7.5", "null"), "the timestamp of a frame"),
            (CLOSURE.replace("\"id\"", "\"ids\""), "ids"),
            (CLOSURE.replace(r#", "noise": {"sigma": 0.01}"#, ""), "noise"),
            ("7".to_owned(), "PoseFactor"),
        ];
        for (factor, words) in faulty {
            let read = line_with(&format!(r#""factors": [{factor}, {CLOSURE}]"#));
            let UnusedInput::PoseGraph { field, fault, .. } = &read.unused[0] else { panic!() };
            assert!(field == "factors 1" && fault.contains(words), "{field}: {fault}");
            assert_eq!((read.pose_graph.factors.len(), read.unused.len()), (1, 1));
        }
        let skewed =
            r#""odometry_noise": {"sigmas": [1, 1]}, "removed": [3], "corrected": [{"timestamp": 1}]"#;
        let read = line_with(skewed);
        assert!(read.unused.len() == 3 && read.frame.odometry_noise.is_none());
        assert_eq!(read.pose_graph, PoseGraphChanges::default());
    }

    #[test]
    fn the_view_of_a_wide_lens_is_kept() {
        let lens_from_view = So3::exp(&Vector3::new(0.1, -1.2, 0.3));
        let camera = Camera::new([300.0, 310.0, 600.0, 200.0], 640, 480).unwrap();
        let cameras = cameras();
        for name in [None, Some("left")] {
            let viewed = cameras.named(name).unwrap().viewed(&CameraView { lens_from_view, camera });
            let seen = BoundingBox::new([10.0, 20.0, 30.0, 50.0]).unwrap();
            let scores = ClassScores::single("cup", 0.5);
            let detections = vec![Detection::new(Arc::new(viewed), seen, scores)];
            let before = Observation { detections, ..Observation::new(Frame::new(1.0, Se3::identity())) };
            let after = super::parse(format_line(&before).as_bytes(), &cameras).unwrap();
            assert_eq!(after.detections[0].camera.view().unwrap().camera, camera);
            let [before, after] =
                [before, after].map(|seen| seen.detections[0].camera.pose(&Se3::identity()));
            assert!(before.local(&after).norm() < 1e-12);
        }
    }
}
