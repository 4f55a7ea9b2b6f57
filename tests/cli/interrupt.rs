//! Ctrl-C and SIGTERM, while a solve is under way.
use crate::{folder, path};
use serde_json::Value;
use std::fmt::Write as _;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Poses with edges all over that contradict each other: some seconds of steps, none of which is the last.
fn contradictions() -> String {
    let (mut text, mut state) = (String::new(), 1_u64);
    let mut random = |below: u64| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) % below
    };
    const POSES: u64 = 700;
    for i in 0..POSES {
        let [x, y, z] = [random(100), random(100), random(100)];
        let _ = writeln!(text, "VERTEX_SE3:QUAT {i} {x} {y} {z} 0 0 0 1");
    }
    for i in 0..3 * POSES {
        let (a, b) = (i % POSES, (i + 1 + random(POSES - 1)) % POSES);
        if a != b {
            let turn = ["0.6 0 0 0.8", "0 0.8 0 0.6", "0 0 -0.6 0.8"][random(3) as usize];
            let [x, y, z] = [random(100), random(100), random(100)];
            let _ = writeln!(
                text,
                "EDGE_SE3:QUAT {a} {b} {x} {y} {z} {turn} 1 0 0 0 0 0 1 0 0 0 0 1 0 0 0 1 0 0 1 0 1"
            );
        }
    }
    text
}

#[test]
#[cfg(unix)]
fn a_signal_ends_a_solve_with_the_best_values_written() {
    let folder = folder(&[("graph.g2o", &contradictions())]);
    for signal in ["-INT", "-TERM"] {
        let out = path(&folder, &format!("solved{signal}.g2o"));
        let child = Command::new(env!("CARGO_BIN_EXE_manifactor"))
            .args(["solve", &path(&folder, "graph.g2o"), "--out", &out, "--solver", "levenberg_marquardt"])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(1500));
        let killed = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
        assert!(killed.success());
        let asked = Instant::now();
        let ended = child.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(130), "{}", String::from_utf8_lossy(&ended.stderr));
        assert!(String::from_utf8_lossy(&ended.stderr).contains("interrupted"));
        assert!(String::from_utf8_lossy(&ended.stdout).contains("interrupted"), "{ended:?}");
        assert!(asked.elapsed() < Duration::from_secs(60));
        // whole, and to be read again
        let written = std::fs::read_to_string(&out).unwrap();
        assert_eq!(written.lines().filter(|line| line.starts_with("VERTEX")).count(), 700);
        let left = std::fs::read_dir(folder.path())
            .unwrap()
            .filter(|f| f.as_ref().unwrap().file_name().to_string_lossy().starts_with('.'));
        assert_eq!(left.count(), 0, "a half-written file is left");
    }
}

/// A run of two variants that takes many seconds.
const LONG: &str = r#"
semantics = "table_one"
source = { type = "simulated", scene = { objects = 16 }, trajectory = { frames = 900 } }
objects = { refinements = 1 }
solver = { type = "levenberg_marquardt", stop = { max_iterations = 10000, relative_cost = 0.0, gradient = 0.0, step = 0.0 } }
[[variants]]
name = "first"
[[variants]]
name = "second"
"#;

#[test]
#[cfg(unix)]
fn a_signal_at_any_time_leaves_a_folder_that_says_it_is_partial() {
    let folder = folder(&[("run.toml", LONG)]);
    for (signal, milliseconds) in [("-TERM", 150), ("-INT", 700), ("-INT", 1700)] {
        let out = path(&folder, &format!("out{milliseconds}"));
        let child = Command::new(env!("CARGO_BIN_EXE_manifactor"))
            .args(["run", &path(&folder, "run.toml"), "--out", &out])
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis(milliseconds));
        assert!(Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap().success());
        let ended = child.wait_with_output().unwrap();
        assert_eq!(ended.status.code(), Some(130), "{}", String::from_utf8_lossy(&ended.stderr));
        let report: Value =
            serde_json::from_slice(&std::fs::read(format!("{out}/report.json")).unwrap()).unwrap();
        assert_eq!(report["complete"], false);
        assert_eq!(report["variants"].as_array().unwrap().len(), 1);
        assert_eq!(report["variants"][0]["solve"]["termination"]["status"], "interrupted");
        let files = std::fs::read_dir(format!("{out}/first")).unwrap();
        let names: Vec<_> = files.map(|f| f.unwrap().file_name().to_string_lossy().into_owned()).collect();
        assert!(names.len() >= 8 && names.iter().all(|name| !name.starts_with('.')), "{names:?}");
    }
}
