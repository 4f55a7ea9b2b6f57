//! `docs/tutorial.md`, followed by a user with different data: class names, camera, and labels as fractions
//! of the image.
use super::block;
use crate::manifactor;
use std::fmt::Write;
use std::path::Path;
use std::process::Command;

const CAMERA: &str = "{ fx = 500.0, fy = 510.0, cx = 400.0, cy = 310.0, width = 800, height = 600 }";

/// The simulated desk through a different camera.
fn simulated(folder: &Path) {
    let camera = "source.camera";
    let set = [
        ("fx", "500.0"),
        ("fy", "510.0"),
        ("cx", "400.0"),
        ("cy", "310.0"),
        ("width", "800"),
        ("height", "600"),
    ];
    let set = set.map(|(field, value)| format!("--set {camera}.{field}={value}")).join(" ");
    manifactor(&format!("simulate examples/desk/desk.toml {set} --out {}", folder.display())).ended(0);
}

/// Writes the boxes as YOLO's text labels, with class names that are in none of our tables.
fn write_labels(detections: &Path, labels: &Path) -> Vec<String> {
    std::fs::create_dir(labels).unwrap();
    let text = std::fs::read_to_string(detections).unwrap();
    let mut rows = text.lines();
    let header: Vec<&str> = rows.next().unwrap().split(',').collect();
    let column = |name: &str| header.iter().position(|title| *title == name).unwrap();
    let mut classes: Vec<String> = vec![];
    let mut files: std::collections::BTreeMap<String, String> = std::collections::BTreeMap::new();
    for row in rows {
        let cells: Vec<&str> = row.split(',').collect();
        let number = |name: &str| cells[column(name)].parse::<f64>().unwrap();
        let class = format!("thing-{}", cells[column("class_name")].replace(' ', "-"));
        let index = classes.iter().position(|known| *known == class).unwrap_or_else(|| {
            classes.push(class);
            classes.len() - 1
        });
        let (x, y) = ((number("xmin") + number("xmax")) / 1600.0, (number("ymin") + number("ymax")) / 1200.0);
        let (w, h) = ((number("xmax") - number("xmin")) / 800.0, (number("ymax") - number("ymin")) / 600.0);
        let line = files.entry(cells[column("timestamp")].to_owned()).or_default();
        writeln!(line, "{index} {x} {y} {w} {h} {}", number("score")).unwrap();
    }
    for (timestamp, lines) in files {
        std::fs::write(labels.join(format!("{timestamp}.txt")), lines).unwrap();
    }
    classes
}

#[test]
fn the_tutorial_maps_the_objects_of_another_camera() {
    let folder = tempfile::tempdir().unwrap();
    let simulation = folder.path().join("simulation");
    simulated(&simulation);
    let robot = folder.path().join("my_robot");
    let recording = robot.join("recording");
    std::fs::create_dir_all(&recording).unwrap();
    std::fs::copy(simulation.join("odometry.txt"), recording.join("odometry.txt")).unwrap();

    let classes = write_labels(&simulation.join("detections.csv"), &recording.join("labels"));
    std::fs::write(recording.join("classes.txt"), classes.join("\n")).unwrap();

    let settings = block("tutorial.md", "toml", "recording");
    let written = "{ fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }";
    assert!(settings.contains(written));
    let detections = block("tutorial.md", "text", "format = \"yolo\"");
    let settings = settings.replace(written, &format!("{CAMERA}\n{detections}"));
    std::fs::write(robot.join("robot.toml"), settings).unwrap();
    let steps = block("tutorial.md", "sh", "manifactor check");
    for command in steps.lines().filter_map(|line| line.strip_prefix("manifactor ")) {
        let mut binary = Command::new(env!("CARGO_BIN_EXE_manifactor"));
        let output = binary.args(command.split_whitespace()).current_dir(&robot).output().unwrap();
        assert!(output.status.success(), "{command}\n{}", String::from_utf8_lossy(&output.stderr));
    }
    let objects = std::fs::read_to_string(robot.join("out/robot/estimate/objects.json")).unwrap();
    let objects: serde_json::Value = serde_json::from_str(&objects).unwrap();
    let mapped = objects.as_array().unwrap().iter().filter(|object| !object["estimate"].is_null()).count();
    assert!((14..=22).contains(&mapped), "{mapped} objects of 18");
}
