use crate::{folder, manifactor, path};
use serde_json::Value;

/// A square that is walked twice, with loop closures; edges out of order, and no vertices.
fn square() -> String {
    let mut edges: Vec<String> = (0..15)
        .map(|i| {
            let turn = if i % 2 == 1 { std::f64::consts::FRAC_PI_2 } else { 0.0 };
            format!("EDGE_SE2 {i} {} 1.0{i} 0.0{i} {turn} 100 0 0 100 0 400", i + 1)
        })
        .collect();
    edges.extend((8..16).map(|i| format!("EDGE_SE2 {} {i} 0 0 0.01 100 0 0 100 0 400", i - 8)));
    edges.reverse();
    edges.join("\n") + "\n"
}

fn lines(stdout: &str) -> Vec<Value> {
    stdout.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

#[test]
fn a_pose_graph_is_replayed_pose_by_pose() {
    let folder = folder(&[("square.g2o", &square())]);
    let (graph, out) = (path(&folder, "square.g2o"), path(&folder, "out.g2o"));
    let ran = manifactor(&format!("replay {graph} --json --every 4 --gap --out {out}")).ended(0);
    let lines = lines(&ran.stdout);
    let (summary, told) = lines.split_last().unwrap();
    let poses: Vec<u64> = told.iter().map(|line| line["poses"].as_u64().unwrap()).collect();
    assert_eq!(poses, [4, 8, 12, 16]);
    assert!(told.iter().all(|line| line["gap"].as_f64().unwrap() < 0.01), "{}", ran.stdout);
    assert_eq!(summary["variables"], 16);
    assert_eq!(summary["termination"]["status"], "converged");
    assert!(summary["latencies"]["max"].as_f64().unwrap() >= summary["latencies"]["p50"].as_f64().unwrap());
    // the same minimum as a batch solve
    let batch = manifactor(&format!("solve {graph} --json")).ended(0).json();
    let (found, expected) = (summary["final_cost"].as_f64().unwrap(), batch["final_cost"].as_f64().unwrap());
    assert!((found - expected).abs() <= 1e-6 * expected, "{found} {expected}");
    let again = manifactor(&format!("solve {out} --json")).ended(0).json();
    assert!((again["initial_cost"].as_f64().unwrap() - expected).abs() <= 1e-3 * expected);
}

#[test]
fn a_replay_without_json_ends_in_a_table() {
    let folder = folder(&[("square.g2o", &square())]);
    let ran = manifactor(&format!("replay {}", path(&folder, "square.g2o"))).ended(0);
    assert!(ran.stdout.contains("p99") && ran.stdout.contains("after a batch solve of"), "{}", ran.stdout);
    ran.complains("16 poses: cost");
}

#[test]
fn a_false_closure_is_rejected_and_named() {
    let graph = square() + "EDGE_SE2 15 3 4.0 -2.0 1.0 100 0 0 100 0 400\n";
    let folder = folder(&[("square.g2o", &graph)]);
    let replay = format!("replay {} --set online.outliers.probability=0.99", path(&folder, "square.g2o"));
    let ran = manifactor(&replay).ended(0);
    assert!(ran.stdout.contains("1 factor rejected as outliers: x15-x3 (update 16)"), "{}", ran.stdout);
    let ran = manifactor(&format!("{replay} --json")).ended(0);
    let summary = lines(&ran.stdout).pop().unwrap();
    assert_eq!(summary["rejected"][0]["keys"], serde_json::json!(["x15", "x3"]));
    assert!(
        summary["rejected"][0]["cost"].as_f64().unwrap() > 100.0
            && summary["final_cost"].as_f64().unwrap() < 10.0
    );
}

#[test]
fn a_graph_without_poses_is_refused() {
    let graph = "[[variables]]\nkey = \"p\"\nvalue = { type = \"point1\", position = [0.0] }\n\n[[factors]]\nkeys = [\"p\"]\nfactor = { type = \"prior_point1\", value = { position = [0.0] } }\n";
    let folder = folder(&[("graph.toml", graph)]);
    manifactor(&format!("replay {}", path(&folder, "graph.toml")))
        .ended(2)
        .complains("there are no poses to replay");
}

#[test]
fn settings_come_from_the_document_and_the_command_line() {
    let folder = folder(&[("square.g2o", &square())]);
    let graph = path(&folder, "square.g2o");
    let gap = |options: &str| {
        let ran = manifactor(&format!("replay {graph} --json --gap {options}")).ended(0);
        let relinearized = lines(&ran.stdout)[0]["report"]["relinearized"].as_u64().unwrap();
        (lines(&ran.stdout)[0]["gap"].as_f64().unwrap(), relinearized)
    };
    // every update relinearizes all moving variables, so the last update is a Gauss-Newton step
    let exact = "--set online.relinearize_every=1 --set online.relinearization_threshold=0 --set online.wildfire_threshold=0";
    assert!(gap(exact).0 < 1e-9 && gap(exact).1 > gap("").1);
    // the same settings from a document
    let literal = path(&folder, "square.toml");
    manifactor(&format!("solve {graph} --out {literal}")).ended(0);
    let text = std::fs::read_to_string(&literal).unwrap();
    let settings = "[online]\nrelinearize_every = 1\nbend = 0.0\ndeviation = 0.0\n";
    std::fs::write(&literal, text + "\n" + settings).unwrap();
    let ran = manifactor(&format!("replay {literal} --json --gap")).ended(0);
    assert!(lines(&ran.stdout)[0]["gap"].as_f64().unwrap() < 1e-9);
    manifactor(&format!("solve {literal}")).ended(0);
    manifactor(&format!("replay {graph} --set online.relinearization_threshold=-1"))
        .ended(2)
        .complains("0 or more");
    manifactor(&format!("replay {graph} --set online.wildfire_treshold=1"))
        .ended(2)
        .complains("did you mean `wildfire_threshold`?");
}

#[test]
fn a_start_is_refused() {
    let folder = folder(&[("square.g2o", &square())]);
    let graph = path(&folder, "square.g2o");
    manifactor(&format!("replay {graph} --start chordal"))
        .ended(2)
        .complains("--start has no effect in a replay");
}

#[test]
fn all_parts_of_a_graph_are_replayed() {
    let parts = "EDGE_SE2 0 1 1 0 0 1 0 0 1 0 1\nEDGE_SE2 1 2 1 0 0 1 0 0 1 0 1\n\
                 EDGE_SE2 10 11 1 0 0 1 0 0 1 0 1\nEDGE_SE2 11 12 1 0 0 1 0 0 1 0 1\nVERTEX_SE2 20 0 0 0\n";
    let folder = folder(&[("parts.g2o", parts)]);
    let ran = manifactor(&format!("replay {} --json", path(&folder, "parts.g2o"))).ended(0);
    assert_eq!(lines(&ran.stdout).last().unwrap()["variables"], 6);
    ran.complains("1 variable without factors: left out");
}

#[test]
fn a_window_leaves_old_poses_behind() {
    let folder = folder(&[("square.g2o", &square())]);
    let graph = path(&folder, "square.g2o");
    let ran = manifactor(&format!("replay {graph} --json --set online.window.poses=5")).ended(0);
    let summary = lines(&ran.stdout).pop().unwrap();
    // each closure connects to the eighth previous pose
    assert_eq!((summary["variables"].clone(), summary["left_out"].clone()), (5.into(), 8.into()));
    manifactor(&format!("replay {graph} --set online.window.keep=1")).ended(2);
    let by_time = manifactor(&format!("replay {graph} --set online.window.seconds=5")).ended(2);
    by_time.complains("use `window.poses`");
    let both = format!("replay {graph} --set online.window.poses=5 --set online.window.seconds=5");
    manifactor(&both).ended(2).complains("found both");
    let keeps =
        format!("replay {graph} --set online.window.poses=5 --set online.window.keep=[\"dual_quadrik\"]");
    manifactor(&keeps).ended(2).complains("did you mean `dual_quadric`?");
    let out = path(&folder, "end.toml");
    let written = manifactor(&format!("replay {graph} --set online.window.poses=5 --out {out}"));
    written.ended(2).complains("a linear prior, which a graph cannot express");
    let text = manifactor(&format!("replay {graph} --set online.window.poses=5")).ended(0).stdout;
    assert!(text.contains("with the linear prior of the window"), "{text}");
}

#[test]
fn latencies_are_drawn_into_a_folder() {
    let folder = folder(&[("graph.g2o", &square())]);
    let (graph, pictures) = (path(&folder, "graph.g2o"), path(&folder, "pictures"));
    manifactor(&format!("replay {graph} --plot {pictures}")).ended(0);
    let svg = std::fs::read_to_string(format!("{pictures}/latency.svg")).unwrap();
    assert!(svg.contains("p99: "), "{svg}");
    assert_eq!(&std::fs::read(format!("{pictures}/latency.png")).unwrap()[..4], b"\x89PNG");
}
