use crate::endings::interrupt::AtWork;
use crate::{fed, folder, manifactor, path, root};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::Duration;

pub(crate) const DESK: &str = r#"
semantics = "table_one"
source = { type = "simulated", scene = { objects = 8 }, trajectory = { frames = 60 } }
odometry = { noise = { sigma = 0.01 } }
detections = { loss = { type = "cauchy", scale = 2.8 } }
"#;

/// Returns the number of poses in a trajectory.
fn count(text: &str) -> usize {
    text.lines().filter(|line| !line.starts_with('#')).count()
}

#[test]
fn a_run_is_mapped_frame_by_frame() {
    let folder = folder(&[("desk.toml", DESK)]);
    let (desk, out) = (path(&folder, "desk.toml"), path(&folder, "out"));
    let ran = manifactor(&format!("online {desk} --out {out} --every 20")).ended(0);
    assert!(ran.stdout.contains("60 frames processed as they arrived, latency p50"), "{}", ran.stdout);
    ran.complains("20 frames: ");
    let poses = |name: &str| std::fs::read_to_string(format!("{out}/estimate/{name}")).unwrap();
    let (live, end) = (poses("live.txt"), poses("trajectory.txt"));
    assert_eq!((count(&live), count(&end)), (60, 60));
    assert!(live != end, "what was known at the time is not what is known in the end");
    assert!(std::fs::read_to_string(format!("{out}/estimate/latency.svg")).unwrap().contains("p99"));
    let metrics: Value = serde_json::from_str(&poses("metrics.json")).unwrap();
    assert!(metrics["online"]["latencies"]["p99"].as_f64().unwrap() > 0.0);
    // the folder belongs to this command; results of a different command would mix with them
    manifactor(&format!("run {desk} --out {out}"))
        .ended(2)
        .complains("holds the results of `manifactor online");
}

#[test]
fn frames_are_told_in_lines_of_json() {
    let folder = folder(&[("desk.toml", DESK)]);
    let (desk, out) = (path(&folder, "desk.toml"), path(&folder, "out"));
    let ran = manifactor(&format!("online {desk} --out {out} --every 30 --json")).ended(0);
    let lines: Vec<Value> = ran.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (end, told) = lines.split_last().unwrap();
    let frames: Vec<u64> = told.iter().map(|line| line["report"]["frame"].as_u64().unwrap()).collect();
    assert_eq!(frames, [29, 59]);
    assert_eq!(end["variants"][0]["online"]["objects"], told[1]["objects"]);
}

#[test]
fn lines_with_a_map_have_all_changes_of_objects() {
    let folder = folder(&[("desk.toml", DESK)]);
    let (desk, out) = (path(&folder, "desk.toml"), path(&folder, "out"));
    manifactor(&format!("online {desk} --out {out} --map")).ended(2).complains("--json");
    let ran = manifactor(&format!("online {desk} --out {out} --every 1 --json --map")).ended(0);
    let lines: Vec<Value> = ran.stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let mut objects: BTreeMap<u64, Value> = BTreeMap::new();
    let is_mapped = |object: &&Value| object["state"] == "mapped";
    for line in lines.iter().filter(|line| line["report"].is_object()) {
        for object in line["map"].as_array().unwrap() {
            objects.insert(object["id"].as_u64().unwrap(), object.clone());
        }
        let mapped = objects.values().filter(is_mapped).count() as u64;
        assert_eq!(line["objects"].as_u64(), Some(mapped));
    }
    let one = objects.values().find(is_mapped).unwrap();
    let rows = one["covariance"].as_array().unwrap();
    assert!(rows.len() == 9 && rows[8].as_array().unwrap().len() == 9 && rows[4][4].as_f64().unwrap() > 0.0);
    assert!(one["class"].is_string() && one["quadric"]["semi_axes"][0].as_f64().unwrap() > 0.0, "{one}");
    let first = lines[0]["map"].as_array().unwrap();
    assert!(!first.is_empty() && first.iter().all(|object| object["state"] == "tentative"), "{first:?}");
}

#[test]
fn a_rate_has_to_be_a_number_above_zero() {
    for rate in ["0", "-1", "nan", "fast"] {
        let ran = manifactor(&format!("online examples/desk/desk.toml --rate={rate}")).ended(2);
        ran.complains("expected a number above 0");
    }
}

#[test]
#[cfg(unix)]
fn a_stream_that_waits_is_interrupted_and_written() {
    let folder = folder(&[("desk.toml", DESK)]);
    let (desk, out) = (path(&folder, "desk.toml"), path(&folder, "out"));
    // so slow that it would take hours
    let work = AtWork::begin(&format!("online {desk} --out {out} --rate 1e-5 --every 1"));
    let ran = work.until("1 frame: ", 0).ended_by("-INT");
    assert_eq!(ran.code, 130, "{}", ran.stderr);
    assert_eq!(count(&std::fs::read_to_string(format!("{out}/estimate/live.txt")).unwrap()), 1);
}

/// The desk's frames from standard input.
pub(crate) const LIVE: &str = r#"
semantics = "table_one"
association = { type = "likelihood" }
odometry = { noise = { sigma = 0.01 } }
detections = { loss = { type = "cauchy", scale = 2.8 } }

[source]
type = "json_lines"
camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }
up = [0.0, 0.0, 1.0]
"#;

#[test]
fn frames_that_come_as_lines_are_mapped_without_names() {
    let folder = folder(&[("desk.toml", DESK), ("live.toml", LIVE)]);
    let (desk, live, out) = (path(&folder, "desk.toml"), path(&folder, "live.toml"), path(&folder, "out"));
    let lines = manifactor(&format!("simulate {desk} --lines")).ended(0).stdout;
    assert_eq!(lines.lines().count(), 60);
    // a frame twice, and an invalid line
    let second = lines.lines().nth(1).unwrap();
    let broken = lines.replacen(second, &format!("{second}\n{{\n{second}"), 1);
    let ran = fed(&format!("online {live} --out {out}"), &broken).ended(0);
    ran.complains("standard input, line 3: EOF while parsing");
    ran.complains("does not come after the one before");
    assert!(ran.stdout.contains("data association by likelihood"), "{}", ran.stdout);
    assert!(!ran.stdout.contains("full weight"), "{}", ran.stdout);
    let plain = LIVE.replace("detections = { loss = { type = \"cauchy\", scale = 2.8 } }", "");
    std::fs::write(path(&folder, "plain.toml"), plain).unwrap();
    let ran = fed(&format!("online {} --out {out}_plain", path(&folder, "plain.toml")), &lines).ended(0);
    assert!(ran.stdout.contains("full weight"), "{}", ran.stdout);
    let metrics = std::fs::read_to_string(format!("{out}/estimate/metrics.json")).unwrap();
    let metrics: Value = serde_json::from_str(&metrics).unwrap();
    assert_eq!((&metrics["counts"]["frames"], &metrics["online"]["refusals"]), (&60.into(), &2.into()));
    assert!(
        metrics["association"]["in_the_end"]["f1"].as_f64().unwrap() > 0.97,
        "{}",
        metrics["association"]
    );
    // the associations are a file of detections, which scores as in the report
    let truth = path(&folder, "truth");
    manifactor(&format!("simulate {desk} --out {truth}")).ended(0);
    let files = format!("{truth}/detections.csv {out}/estimate/detections.csv");
    let scored = manifactor(&format!("evaluate --boxes {files} --json")).ended(0).json();
    assert_eq!(scored["scores"], metrics["association"]["in_the_end"]);
}

#[test]
fn boxes_that_nobody_names_are_told_of_what_would_name_them() {
    let nobody = LIVE.replace("association = { type = \"likelihood\" }", "");
    let folder = folder(&[("desk.toml", DESK), ("live.toml", &nobody)]);
    let lines = manifactor(&format!("simulate {} --lines", path(&folder, "desk.toml"))).ended(0).stdout;
    let nameless: Vec<String> = lines.lines().map(nameless).collect();
    let (live, out) = (path(&folder, "live.toml"), path(&folder, "out"));
    for command in ["run", "online"] {
        let ran = fed(&format!("{command} {live} --out {out} --force"), &nameless.join("\n")).ended(1);
        assert!(ran.stdout.contains("no box says which object it shows"), "{}", ran.stdout);
    }
}

/// Returns a frame whose boxes have no names.
fn nameless(line: &str) -> String {
    let mut frame: Value = serde_json::from_str(line).unwrap();
    for seen in frame["boxes"].as_array_mut().unwrap() {
        seen.as_object_mut().unwrap().remove("object");
    }
    frame.to_string()
}

#[test]
fn standard_input_is_read_once() {
    let two = format!("{LIVE}\n[[variants]]\nname = \"one\"\n[[variants]]\nname = \"two\"\n");
    let folder = folder(&[("desk.toml", DESK), ("live.toml", &two)]);
    let lines = manifactor(&format!("simulate {} --lines", path(&folder, "desk.toml"))).ended(0).stdout;
    let (live, out) = (path(&folder, "live.toml"), path(&folder, "out"));
    let ran = fed(&format!("online {live} --out {out}"), &lines).ended(2);
    ran.complains("standard input can be read once");
    // a batch run keeps the frames in memory for the second variant
    fed(&format!("run {live} --out {out}_of_run"), &lines).ended(0);
}

/// Returns the number of complete lines in a file.
fn lines_of(file: &str) -> usize {
    std::fs::read(file).unwrap_or_default().iter().filter(|byte| **byte == b'\n').count()
}

/// Starts the binary with the first `count` lines; no more come, and the stream stays open.
fn waiting(command: &str, stderr: Stdio, lines: &str, count: usize) -> (Child, ChildStdin) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_manifactor"))
        .current_dir(root())
        .args(command.split_whitespace())
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(stderr)
        .spawn()
        .unwrap();
    let mut input = child.stdin.take().unwrap();
    let known: Vec<&str> = lines.lines().take(count).collect();
    writeln!(input, "{}", known.join("\n")).unwrap();
    (child, input)
}

/// Adds a loop closure at frame 20, replaces it at frame 28, and corrects the poses of two frames at frame 36.
fn with_closures(frames: &str) -> String {
    let mut lines: Vec<Value> = frames.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let closure = |lines: &[Value], to: usize| {
        let identity = json!({ "translation": [0.5, 0.0, 0.1], "rotation": [0.0, 0.1, 0.0, 0.995] });
        let factor = json!({ "type": "between_se3", "relative": identity });
        let keys = [&lines[0]["timestamp"], &lines[to]["timestamp"]];
        json!([{ "id": "loop", "keys": keys, "factor": factor, "noise": { "sigma": 0.5 } }])
    };
    for frame in [20, 28] {
        lines[frame]["factors"] = closure(&lines, frame - 5);
    }
    let corrected = |frame: &Value| {
        let mut pose = frame["pose"].clone();
        pose["translation"][0] = json!(pose["translation"][0].as_f64().unwrap() + 0.03);
        json!({ "timestamp": frame["timestamp"], "pose": pose })
    };
    lines[36]["corrected"] = json!([corrected(&lines[10]), corrected(&lines[30])]);
    lines.iter().map(|line| format!("{line}\n")).collect()
}

#[test]
fn a_stream_that_is_killed_at_any_moment_goes_on_with_the_same_map() {
    let folder = folder(&[("desk.toml", DESK), ("live.toml", LIVE)]);
    let (live, whole, out) = (path(&folder, "live.toml"), path(&folder, "whole"), path(&folder, "out"));
    let journal = path(&folder, "frames.jsonl");
    let frames = manifactor(&format!("simulate {} --lines", path(&folder, "desk.toml"))).ended(0).stdout;
    let frames = with_closures(&frames);
    fed(&format!("online {live} --out {whole} --journal {whole}.jsonl"), &frames).ended(0);
    let command = format!("online {live} --out {out} --journal {journal} --force");
    let mut rng = StdRng::seed_from_u64(5);
    let mut kept = 0;
    while kept < 50 {
        kept += rng.random_range(1..9);
        let (mut child, _input) = waiting(&command, Stdio::null(), &frames, kept);
        // the first line is not a frame
        while lines_of(&journal) < kept + 1 {
            assert!(child.try_wait().unwrap().is_none(), "it ended before its frames");
            std::thread::sleep(Duration::from_millis(1));
        }
        child.kill().unwrap();
        assert!(!child.wait().unwrap().success());
    }
    fed(&command, &frames).ended(0);
    for file in ["live.txt", "trajectory.txt", "objects.json", "detections.csv"] {
        let read = |out: &str| std::fs::read_to_string(format!("{out}/estimate/{file}")).unwrap();
        assert!(read(&whole) == read(&out), "{file}");
    }
    // different settings make a different map
    let ran = fed(&format!("{command} --set online.relinearization_threshold=0.2"), &frames);
    ran.ended(2).complains("is the journal of other settings");
    // so does another stream with the same times
    let (first, rest) = frames.split_once('\n').unwrap();
    let mut first: Value = serde_json::from_str(first).unwrap();
    first["pose"]["translation"][0] = json!(0.5);
    let other = format!("{first}\n{rest}");
    fed(&command, &other).ended(2).complains("the journal is that of another stream");
}

/// The noise is estimated in threads of its own, while the thread of the stream waits.
#[test]
fn a_stream_on_one_thread_ends_with_the_same_map() {
    let folder = folder(&[(
        "desk.toml",
        &format!("variance_components = {{}}\nassociation = {{ type = \"likelihood\" }}\n{DESK}"),
    )]);
    let mapped = |command: &str, threads: usize| {
        let out = path(&folder, &format!("{command}{threads}"));
        let ran =
            manifactor(&format!("{command} {} --out {out} --threads {threads}", path(&folder, "desk.toml")));
        assert!(ran.code < 2, "{}", ran.stderr);
        std::fs::read_to_string(format!("{out}/estimate/objects.json")).unwrap()
    };
    for command in ["run", "online"] {
        assert!(mapped(command, 1) == mapped(command, 2), "{command}");
    }
}

#[test]
fn a_signal_while_no_frame_comes_ends_the_stream_with_its_map() {
    let folder = folder(&[("desk.toml", DESK), ("live.toml", LIVE)]);
    let (live, out) = (path(&folder, "live.toml"), path(&folder, "out"));
    let frames = manifactor(&format!("simulate {} --lines", path(&folder, "desk.toml"))).ended(0).stdout;
    let command = format!("online {live} --out {out} --every 1");
    let (mut child, input) = waiting(&command, Stdio::piped(), &frames, 20);
    let mut said = BufReader::new(child.stderr.take().unwrap()).lines().map(Result::unwrap);
    assert!(said.any(|line| line.contains("20 frames")), "it ended before its frames");
    // standard input stays open and silent
    Command::new("kill").args(["-INT", &child.id().to_string()]).output().unwrap();
    let rest: Vec<String> = said.collect();
    assert_eq!(child.wait().unwrap().code(), Some(130), "{rest:?}");
    drop(input);
    let poses = std::fs::read_to_string(format!("{out}/estimate/trajectory.txt")).unwrap();
    assert_eq!(count(&poses), 20, "{rest:?}");
}
