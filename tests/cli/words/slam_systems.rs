//! `docs/slam-systems.md`: its document maps a recording, and its line is a frame with a closure.
use super::block;
use crate::{fed, folder, manifactor, path};
use manifactor::geometry::{Se3, So3};
use manifactor::nalgebra::Vector3;
use manifactor::slam::ros::testing::{
    CAMERA_INFO, DETECTIONS, FIX, MessageType, ODOMETRY, TRANSFORMS, camera_message, database,
    detections_message, fix_message, odometry_message, recording, transform_message,
};
use serde_json::Value;
use std::path::Path;

const CAMERA: &str = "camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }";

#[test]
fn a_trajectory_of_another_program_is_mapped() {
    let document = block("slam-systems.md", "toml", "CameraTrajectory.txt");
    let camera = document.lines().find(|line| line.starts_with("camera =")).unwrap();
    let folder = folder(&[("office.toml", &document.replace(camera, CAMERA))]);
    let (office, recording) = (path(&folder, "office.toml"), path(&folder, "office"));
    manifactor(&format!("simulate examples/desk/desk.toml --out {recording}")).ended(0);
    // a trajectory at half of the rate, as of a slower program
    let odometry = std::fs::read_to_string(format!("{recording}/odometry.txt")).unwrap();
    let slower: Vec<&str> = odometry.lines().filter(|line| !line.starts_with('#')).step_by(2).collect();
    std::fs::write(format!("{recording}/CameraTrajectory.txt"), slower.join("\n")).unwrap();
    let ran = manifactor(&format!("run {office} --out {} --json", path(&folder, "out"))).ended(0);
    let report: serde_json::Value = serde_json::from_str(&ran.stdout).unwrap();
    let counts = &report["variants"][0]["counts"];
    // the last image comes after the last pose
    assert_eq!(counts["frames"], 199, "{counts}");
    assert!(counts["objects"].as_u64().unwrap() >= 12, "{counts}");
}

#[test]
fn a_line_with_a_closure_is_a_frame() {
    let line = block("slam-systems.md", "json", "loop 3");
    let live = format!("source = {{ type = \"json_lines\", up = [0, -1, 0], {CAMERA} }}");
    let folder = folder(&[("live.toml", &live)]);
    let first =
        r#"{"timestamp": 2.0, "pose": {"translation": [0, 0, 0], "rotation": [0, 0, 0, 1]}, "boxes": []}"#;
    let (live, out) = (path(&folder, "live.toml"), path(&folder, "out"));
    let ran = fed(&format!("online {live} --out {out}"), &format!("{first}\n{line}"));
    assert!(!ran.stderr.contains("left out"), "{}", ran.stderr);
    let graph = std::fs::read_to_string(format!("{out}/estimate/graph.json")).unwrap();
    assert!(graph.contains("\"loop 3\""), "{graph}");
}

/// Frames of the simulated desk, one JSON object each.
fn frames() -> Vec<Value> {
    let lines = manifactor("simulate examples/desk/desk.toml --lines --set source.trajectory.frames=80")
        .ended(0)
        .stdout;
    lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

/// Writes frames as a robot records them: odometry of its base, and the boxes of a camera on it.
fn drive(frames: &[Value], base_from_camera: &Se3) -> Vec<u8> {
    drive_with(frames, base_from_camera, None)
}

/// Writes frames with a second camera, at a pose on the base.
fn drive_with(frames: &[Value], base_from_camera: &Se3, base_from_rear: Option<&Se3>) -> Vec<u8> {
    let (topics, messages) = messages(frames, base_from_camera, base_from_rear);
    recording(&topics, messages.into_iter())
}

type Topics = Vec<(&'static str, MessageType)>;
type Messages = Vec<(&'static str, f64, Vec<u8>)>;

/// Returns the topics and messages of such a recording.
fn messages(frames: &[Value], base_from_camera: &Se3, base_from_rear: Option<&Se3>) -> (Topics, Messages) {
    let camera_from_base = base_from_camera.inverse();
    let info =
        |frame| camera_message(frame, [320.0, 320.0, 320.0, 240.0], [640, 480], ("plumb_bob", &[0.0; 5]));
    let start = [
        ("/tf_static", 0.0, transform_message(0.0, "base_link", "camera", base_from_camera)),
        ("/camera_info", 0.0, info("camera")),
    ];
    let rear = base_from_rear.into_iter().flat_map(|pose| {
        let transform = transform_message(0.0, "base_link", "rear_camera", pose);
        [("/tf_static", 0.0, transform), ("/rear/camera_info", 0.0, info("rear_camera"))]
    });
    let messages = frames.iter().flat_map(|frame| {
        let time = frame["timestamp"].as_f64().unwrap();
        let pose: Se3 = serde_json::from_value(frame["pose"].clone()).unwrap();
        let seen = |name: Option<&str>| {
            let own = frame["boxes"].as_array().unwrap().iter();
            let own = own.filter(|seen| seen.get("camera").and_then(Value::as_str) == name);
            own.map(|seen| {
                let sides: [f64; 4] = serde_json::from_value(seen["box"].clone()).unwrap();
                (
                    sides,
                    seen["class"].as_str().unwrap(),
                    seen.get("score").map_or(1.0, |score| score.as_f64().unwrap()),
                )
            })
            .collect::<Vec<_>>()
        };
        let boxes = detections_message(time, "camera", &seen(None));
        let of_rear = base_from_rear.map(|_| detections_message(time, "rear_camera", &seen(Some("rear"))));
        let odometry = odometry_message(time, "odom", "base_link", &pose.compose(&camera_from_base));
        let rear = of_rear.map(|boxes| ("/rear/detections", time, boxes));
        [("/odom", time, odometry), ("/detections", time, boxes)].into_iter().chain(rear)
    });
    let topics = [
        ("/odom", ODOMETRY),
        ("/detections", DETECTIONS),
        ("/camera_info", CAMERA_INFO),
        ("/tf_static", TRANSFORMS),
        ("/rear/detections", DETECTIONS),
        ("/rear/camera_info", CAMERA_INFO),
    ];
    let topics = if base_from_rear.is_some() { &topics[..] } else { &topics[..4] };
    (topics.to_vec(), start.into_iter().chain(rear).chain(messages).collect())
}

/// Pose of a camera that looks ahead.
fn base_from_camera() -> Se3 {
    let ahead = So3::from_quaternion_xyzw([-0.5, 0.5, -0.5, 0.5]).unwrap();
    Se3::new(ahead, Vector3::new(0.2, 0.0, 1.1))
}

/// The simulated desk as a robot records it.
pub(super) fn recording_of_desk() -> Vec<u8> {
    drive(&frames(), &base_from_camera())
}

#[test]
fn a_recording_of_ros_gives_the_map_of_its_frames() {
    let source = block("slam-systems.md", "toml", "drive.mcap");
    let settings = "association = { type = \"likelihood\" }\nvariance_components = {}\n";
    let mut frames = frames();
    let boxes = frames.iter_mut().flat_map(|frame| frame["boxes"].as_array_mut().unwrap());
    boxes.for_each(|seen| {
        seen.as_object_mut().unwrap().remove("object");
    });
    let lines: String = frames.iter().map(|frame| format!("{frame}\n")).collect();
    let from_lines =
        format!("source = {{ type = \"json_lines\", file = \"f.jsonl\", up = [0, 0, 1], {CAMERA} }}");
    let folder = folder(&[
        ("ros.toml", &format!("{settings}{source}")),
        ("lines.toml", &format!("{settings}{from_lines}")),
        ("f.jsonl", &lines),
    ]);
    let base_from_camera = base_from_camera();
    let bag = path(&folder, "drive.mcap");
    std::fs::write(&bag, drive(&frames, &base_from_camera)).unwrap();

    let contents = manifactor(&format!("inspect {bag} --json")).ended(0).json();
    assert_eq!(contents["topics"]["/odom"]["messages"], frames.len());
    let found = contents["source"].as_str().unwrap();
    let topics = r#"odometry = "/odom", detections = "/detections", camera_info = "/camera_info", up = [0.0, 0.0, 1.0] }"#;
    assert!(found.ends_with(topics), "{found}");
    // the same in two files of SQLite, as ROS 2 Humble records them
    let split = path(&folder, "split");
    std::fs::create_dir(&split).unwrap();
    let (topics_of_drive, messages) = messages(&frames, &base_from_camera, None);
    for (i, part) in messages.chunks(messages.len() / 2 + 1).enumerate() {
        database(Path::new(&format!("{split}/split_{i}.db3")), &topics_of_drive, part, false);
    }
    let of_split = manifactor(&format!("inspect {split} --json")).ended(0).json();
    assert_eq!(of_split["topics"], contents["topics"]);
    let lines_of = |bag: &str| manifactor(&format!("simulate {bag} --lines")).ended(0).stdout;
    assert_eq!(lines_of(&split), lines_of(&bag));

    manifactor(&format!("solve {bag}")).ended(2).complains("`manifactor inspect");
    let guessed = manifactor(&format!("map {bag} --out {} --json", path(&folder, "guessed"))).ended(0);
    assert!(guessed.stderr.contains(topics), "{}", guessed.stderr);
    assert!(guessed.json()["variants"][0]["counts"]["objects"].as_u64().unwrap() >= 12);

    let poses = |document: &str, file: &str| {
        let out = path(&folder, document);
        manifactor(&format!("run {} --out {out} --json", path(&folder, &format!("{document}.toml"))))
            .ended(0);
        let trajectory = std::fs::read_to_string(format!("{out}/estimate/{file}")).unwrap();
        let objects = std::fs::read_to_string(format!("{out}/estimate/objects.json")).unwrap();
        let objects: Vec<Value> = serde_json::from_str(&objects).unwrap();
        let line = |line: &str| line.split(' ').map(|number| number.parse().unwrap()).collect::<Vec<f64>>();
        let poses = trajectory.lines().filter(|text| !text.starts_with('#')).map(line).collect::<Vec<_>>();
        (poses, objects.len())
    };
    let ((of_ros, objects), (of_lines, expected)) =
        (poses("ros", "trajectory.txt"), poses("lines", "trajectory.txt"));
    assert_eq!((of_ros.len(), objects), (of_lines.len(), expected));
    assert!(objects >= 12, "{objects}");
    let differences =
        of_ros.iter().zip(&of_lines).flat_map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()));
    assert!(differences.fold(0.0, f64::max) < 1e-5);
    let (of_body, _) = poses("ros", "body_trajectory.txt");
    let distance = (0..3).map(|i| (of_body[0][i + 1] - of_ros[0][i + 1]).powi(2)).sum::<f64>().sqrt();
    assert!((distance - base_from_camera.translation.norm()).abs() < 1e-6, "{distance}");
}

#[test]
fn a_jump_of_the_odometry_is_corrected() {
    let mut frames = frames();
    let off =
        Se3::new(So3::from_quaternion_xyzw([0.0, 0.0, 0.15, 0.9887]).unwrap(), Vector3::new(0.5, -0.3, 0.1));
    for (i, frame) in frames.iter_mut().enumerate() {
        for seen in frame["boxes"].as_array_mut().unwrap() {
            seen.as_object_mut().unwrap().remove("object");
        }
        let pose: Se3 = serde_json::from_value(frame["pose"].clone()).unwrap();
        if i >= 40 {
            frame["pose"] = serde_json::to_value(off.compose(&pose)).unwrap();
        }
    }
    let lines: String = frames.iter().map(|frame| format!("{frame}\n")).collect();
    let document = format!(
        "association = {{ type = \"likelihood\" }}\nsource = {{ type = \"json_lines\", file = \"f.jsonl\", up = [0, 0, 1], {CAMERA} }}\n"
    );
    let folder = folder(&[("jump.toml", &document), ("f.jsonl", &lines)]);
    for command in ["run", "online"] {
        let out = path(&folder, command);
        let ran = manifactor(&format!("{command} {} --out {out}", path(&folder, "jump.toml"))).ended(0);
        let report = std::fs::read_to_string(format!("{out}/report.json")).unwrap();
        let report: Value = serde_json::from_str(&report).unwrap();
        let variant = &report["variants"][0];
        let warnings = variant["warnings"].to_string();
        assert!(warnings.contains("corrected by objects that were seen before"), "{warnings}");
        assert_eq!(
            command == "online",
            ran.stderr.contains("after a jump of the odometry"),
            "{}",
            ran.stderr
        );
        // the desk has 18 objects; uncorrected, most are mapped twice
        let objects = variant["counts"]["objects"].as_u64().unwrap();
        assert!((12..=20).contains(&objects), "{command}: {objects} objects");
    }
}

#[test]
fn positions_by_satellites_correct_a_trajectory() {
    let folder = folder(&[]);
    let desk = path(&folder, "desk");
    manifactor(&format!("simulate examples/desk/desk.toml --out {desk} --set source.trajectory.frames=80"))
        .ended(0);
    let truth = std::fs::read_to_string(format!("{desk}/groundtruth.txt")).unwrap();
    let base_from_camera = base_from_camera();
    let antenna = Vector3::new(0.3, 0.2, 1.4);
    let (mut topics, mut messages) = messages(&frames(), &base_from_camera, None);
    topics.push(("/gps/fix", FIX));
    let enu_from_truth =
        Se3::new(So3::from_quaternion_xyzw([0.0, 0.0, 0.6, 0.8]).unwrap(), Vector3::new(4.0, -7.0, 1.0));
    let mut at_base = vec![];
    for (i, line) in truth.lines().filter(|line| !line.starts_with('#')).enumerate() {
        let numbers: Vec<f64> = line.split(' ').map(|number| number.parse().unwrap()).collect();
        let [time, x, y, z, q @ ..] = numbers[..].try_into().map(|all: [f64; 8]| all).unwrap();
        let camera = Se3::new(So3::from_quaternion_xyzw(q).unwrap(), Vector3::new(x, y, z));
        let base = camera.compose(&base_from_camera.inverse());
        let [x, y, z] = base.translation.into();
        let [qx, qy, qz, qw] = base.rotation.quaternion_xyzw();
        at_base.push(format!("{time} {x} {y} {z} {qx} {qy} {qz} {qw}"));
        // metres per degree at 48° north
        let place = enu_from_truth.act(&base.act(&antenna));
        let degrees = [48.0 + place.y / 111_199.1, 11.0 + place.x / 74_631.2, 500.0 + place.z];
        let noise = 0.005 * (12.9898 * i as f64).sin();
        let degrees = [degrees[0] + noise / 111_199.1, degrees[1] - noise / 74_631.2, degrees[2] + noise];
        messages.push(("/gps/fix", time, fix_message(time, "gps", 0, degrees, Some(0.01))));
    }
    let gps = Se3::new(So3::identity(), antenna);
    messages.push(("/tf_static", 0.0, transform_message(0.0, "base_link", "gps", &gps)));
    std::fs::write(path(&folder, "truth.txt"), at_base.join("\n")).unwrap();
    std::fs::write(path(&folder, "drive.mcap"), recording(&topics, messages.into_iter())).unwrap();
    let source = block("slam-systems.md", "toml", "drive.mcap");
    let fixes = block("slam-systems.md", "toml", "source.fixes").replace("antenna = [", "# antenna = [");
    let settings = "association = { type = \"likelihood\" }\nvariance_components = {}\n";
    let plain = format!("{settings}{source}ground_truth = \"truth.txt\"\n");
    for (name, document) in [("without", plain.clone()), ("with", format!("{plain}{fixes}"))] {
        std::fs::write(path(&folder, &format!("{name}.toml")), document).unwrap();
    }
    let report = |command: &str, name: &str| {
        let out = path(&folder, &format!("{command}_{name}"));
        manifactor(&format!("{command} {} --out {out}", path(&folder, &format!("{name}.toml")))).ended(0);
        let text = std::fs::read_to_string(format!("{out}/report.json")).unwrap();
        let report: Value = serde_json::from_str(&text).unwrap();
        report["variants"][0].clone()
    };
    let error = |report: &Value| report["trajectory"][0]["estimate"]["ate"]["rmse"].as_f64().unwrap();
    let without = error(&report("run", "without"));
    for command in ["run", "online"] {
        let with = report(command, "with");
        assert!(error(&with) < 0.01 && error(&with) < 0.5 * without, "{} {without}", error(&with));
        let place = &with["georeference"];
        assert!((place["origin"]["latitude"].as_f64().unwrap() - 48.0).abs() < 1e-3, "{place}");
        assert!(with["warnings"].as_array().unwrap().iter().all(|w| !w.to_string().contains("satellites")));
    }
}

/// Pose of a second camera in the frame of the first one, turned by 30°.
const REAR: &str =
    "{ translation = [0.1, 0.0, 0.0], rotation = [0.0, 0.25881904510252074, 0.0, 0.9659258262890683] }";

#[test]
fn cameras_of_a_recording_give_the_map_of_their_lines() {
    let camera = CAMERA.trim_start_matches("camera = ");
    let further = format!("{{ rear = {{ camera = {camera}, body_from_camera = {REAR} }} }}");
    let simulated =
        format!("source = {{ type = \"simulated\", trajectory = {{ frames = 80 }}, cameras = {further} }}");
    let settings = "association = { type = \"likelihood\" }\nvariance_components = {}\nsemantics = \"resting\"\n\
                    detections = { loss = { type = \"cauchy\", scale = 2.8 } }\n";
    let from_lines = format!(
        "source = {{ type = \"json_lines\", file = \"f.jsonl\", up = [0, 0, 1], {CAMERA}, cameras = {further} }}"
    );
    let folder = folder(&[("sim.toml", &simulated), ("lines.toml", &format!("{settings}{from_lines}"))]);
    let lines = manifactor(&format!("simulate {} --lines", path(&folder, "sim.toml"))).ended(0).stdout;
    let mut frames: Vec<Value> = lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let boxes = frames.iter_mut().flat_map(|frame| frame["boxes"].as_array_mut().unwrap());
    let removed = boxes.filter_map(|seen| {
        seen.as_object_mut().unwrap().remove("object");
        seen.get("camera").cloned()
    });
    assert!(removed.count() > 100);
    std::fs::write(path(&folder, "f.jsonl"), frames.iter().map(|f| format!("{f}\n")).collect::<String>())
        .unwrap();
    let second: Se3 = serde_json::from_value(serde_json::json!({
        "translation": [0.1, 0.0, 0.0], "rotation": [0.0, 0.258_819_045_102_520_74, 0.0, 0.965_925_826_289_068_3]
    }))
    .unwrap();
    let bag = path(&folder, "two.mcap");
    let base_from_rear = base_from_camera().compose(&second);
    std::fs::write(&bag, drive_with(&frames, &base_from_camera(), Some(&base_from_rear))).unwrap();

    let ran = manifactor(&format!("map {bag} --out {} --json", path(&folder, "two"))).ended(0);
    let cameras = "cameras = { rear_camera = { detections = \"/rear/detections\", camera_info = \"/rear/camera_info\" } }";
    assert!(ran.stderr.contains(cameras), "{}", ran.stderr);
    let document = path(&folder, "lines.toml");
    let expected = manifactor(&format!("run {document} --out {} --json", path(&folder, "lines"))).ended(0);
    let counts = |report: &Value| report["variants"][0]["counts"].clone();
    let (found, expected) = (counts(&ran.json()), counts(&expected.json()));
    assert_eq!(found["detections"], expected["detections"]);
    assert_eq!(found["objects"], expected["objects"]);
    assert!(found["objects"].as_u64().unwrap() >= 12, "{found}");
}
