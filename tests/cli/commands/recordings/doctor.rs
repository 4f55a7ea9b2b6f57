//! Diagnosis of recordings with an IMU.
use crate::{folder, manifactor, path, root};

/// Runs `doctor` on the example with a changed file of readings.
fn with_readings(change: impl Fn([f64; 7]) -> [f64; 7]) -> crate::Ran {
    let read = |name: &str| std::fs::read_to_string(root().join("examples/flight").join(name)).unwrap();
    let imu = read("imu.csv");
    let mut lines = imu.lines();
    let mut changed = format!("{}\n", lines.next().unwrap());
    for line in lines {
        let numbers: Vec<f64> = line.split(',').map(|x| x.parse().unwrap()).collect();
        let row = change(numbers.try_into().unwrap()).map(|x| x.to_string());
        changed += &format!("{}\n", row.join(","));
    }
    let files = [
        ("imu.csv", &*changed),
        ("tracks.csv", &read("tracks.csv")),
        ("truth.csv", &read("truth.csv")),
        ("vio.toml", &read("vio.toml")),
    ];
    let folder = folder(&files);
    manifactor(&format!("doctor {}", path(&folder, "vio.toml")))
}

#[test]
fn the_example_has_no_fault() {
    let ran = manifactor("doctor examples/flight/vio.toml").ended(0);
    assert!(ran.stdout.starts_with("no fault found\n"), "{}", ran.stdout);
    let json = manifactor("doctor examples/flight/vio.toml --json").ended(0).json();
    assert_eq!(json["findings"].as_array().unwrap().len(), 0, "{json}");
}

#[test]
fn units_that_other_commands_refuse_are_named() {
    let degrees = with_readings(|[t, wx, wy, wz, ax, ay, az]| {
        let [wx, wy, wz] = [wx, wy, wz].map(f64::to_degrees);
        [t, wx, wy, wz, ax, ay, az]
    });
    assert!(degrees.ended(1).stdout.starts_with("1. the gyroscope is in degrees per second"));
    let g = with_readings(|[t, wx, wy, wz, ax, ay, az]| [t, wx, wy, wz, ax / 9.81, ay / 9.81, az / 9.81]);
    assert!(g.ended(1).stdout.starts_with("1. the accelerometer is in g: multiply"));
}

#[test]
fn faults_of_the_calibration_are_named() {
    let fault = |set: &str| {
        let command = format!("doctor examples/flight/vio.toml --json --set {set}");
        let json = manifactor(&command).ended(1).json();
        json["findings"][0]["fault"].as_str().unwrap().to_owned()
    };
    assert_eq!(fault("camera.fx=585 --set camera.fy=585"), "focal_length");
    assert_eq!(fault("camera.cx=240 --set camera.cy=376"), "exchanged_centre");
    assert_eq!(fault("body_from_camera.translation=[50,100,0]"), "mounting_in_millimetres");
    assert_eq!(fault("settings.gravity=1.62"), "gravity");
}
