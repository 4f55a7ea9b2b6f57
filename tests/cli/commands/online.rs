use crate::endings::interrupt::AtWork;
use crate::{folder, manifactor, path};
use serde_json::Value;

const DESK: &str = r#"
semantics = "table_one"
source = { type = "simulated", scene = { objects = 8 }, trajectory = { frames = 60 } }
odometry = { noise = { sigma = 0.01 } }
detections = { loss = { type = "cauchy", scale = 2.8 } }
"#;

/// Poses of a trajectory.
fn count(text: &str) -> usize {
    text.lines().filter(|line| !line.starts_with('#')).count()
}

#[test]
fn a_run_is_mapped_frame_by_frame() {
    let folder = folder(&[("desk.toml", DESK)]);
    let (desk, out) = (path(&folder, "desk.toml"), path(&folder, "out"));
    let ran = manifactor(&format!("online {desk} --out {out} --every 20")).ended(0);
    assert!(ran.stdout.contains("60 frames as they came, p50"), "{}", ran.stdout);
    ran.complains("20 frames: ");
    let poses = |name: &str| std::fs::read_to_string(format!("{out}/estimate/{name}")).unwrap();
    let (live, end) = (poses("live.txt"), poses("trajectory.txt"));
    assert_eq!((count(&live), count(&end)), (60, 60));
    assert!(live != end, "what was known at the time is not what is known in the end");
    assert!(std::fs::read_to_string(format!("{out}/estimate/latency.svg")).unwrap().contains("p99"));
    let metrics: Value = serde_json::from_str(&poses("metrics.json")).unwrap();
    assert!(metrics["online"]["latencies"]["p99"].as_f64().unwrap() > 0.0);
    // the folder is that of this command: another's results would mix with it
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
