//! `docs/slam-systems.md`: its document maps a recording, and its line is a frame with a closure.
use super::block;
use crate::{fed, folder, manifactor, path};

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
