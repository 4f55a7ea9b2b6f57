use crate::{folder, manifactor, path};
use serde_json::Value;
use std::path::Path;

/// The desk with fewer frames and objects.
const SMALL: &str = "--set source.trajectory.frames=40 --set source.scene.objects=5";

#[test]
fn a_run_leaves_its_files() {
    let folder = folder(&[]);
    let out = path(&folder, "desk");
    let ran =
        manifactor(&format!("run examples/desk/desk.toml --out {out} {SMALL} --set report.covariances=true"));
    assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
    for text in
        ["ATE", "position", "shape", "quality", "QuadricSLAM", "before the solve", "over 40 of 40 poses"]
    {
        assert!(ran.stdout.contains(text), "{text} is missing:\n{}", ran.stdout);
    }
    for text in ["condition number", "largest cost", "σ"] {
        assert!(!ran.stdout.contains(text), "{text} is for -v:\n{}", ran.stdout);
    }
    let out = Path::new(&out);
    assert!(out.join("report.json").is_file());
    for file in
        ["config.toml", "trajectory.txt", "objects.json", "graph.json", "iterations.csv", "metrics.json"]
    {
        assert!(out.join("quadricslam").join(file).is_file(), "{file}");
    }
    let read = |file: &str| {
        let text = std::fs::read_to_string(out.join("quadricslam").join(file)).unwrap();
        serde_json::from_str::<Value>(&text).unwrap()
    };
    let covariances = read("covariances.json");
    assert_eq!(covariances[0]["covariance"].as_array().unwrap().len(), 6);
    assert_eq!(read("metrics.json")["solve"]["diagnosis"]["worst"].as_array().unwrap().len(), 10);
    for view in ["map_top.svg", "map_side.svg"] {
        let picture = std::fs::read_to_string(out.join("quadricslam").join(view)).unwrap();
        assert!(picture.contains("</svg>") && picture.contains("odometry"), "{view}");
    }
}

#[test]
fn held_out_boxes_of_objects_that_are_not_mapped_count_as_zero() {
    let folder = folder(&[]);
    let out = path(&folder, "desk");
    // the box limit keeps some of the objects out of the map
    let ran = manifactor(&format!(
        "run examples/desk/desk.toml --out {out} --set evaluation.holdout.first=0.3 --set objects.max_box_deviation_px=4 --json"
    ));
    let report = ran.json();
    let held_out = &report["variants"][0]["held_out"];
    let (mapped, unmapped) =
        (held_out["all"]["boxes"].as_f64().unwrap(), held_out["unmapped"].as_f64().unwrap());
    assert!(mapped > 0.0 && unmapped > 0.0, "{held_out}");
    let of_all = held_out["iou_unmapped_as_zero"]["mean"].as_f64().unwrap();
    let of_mapped = held_out["all"]["iou"]["mean"].as_f64().unwrap();
    assert!((of_all - of_mapped * mapped / (mapped + unmapped)).abs() < 1e-9, "{held_out}");
}

#[test]
fn the_condition_the_largest_cost_and_the_noise_are_printed_on_request() {
    let folder = folder(&[]);
    let out = path(&folder, "desk");
    let ran = manifactor(&format!("run examples/desk/desk.toml --out {out} {SMALL} -v"));
    for text in ["condition number", "largest cost", "σ"] {
        assert!(ran.stdout.contains(text), "{text} is missing:\n{}", ran.stdout);
    }
}

#[test]
fn a_run_is_reproduced_by_the_config_it_wrote() {
    let folder = folder(&[]);
    let (first, second) = (path(&folder, "a"), path(&folder, "b"));
    let report = |ran: crate::Ran| {
        let report: Value = ran.json();
        let variant = &report["variants"][0];
        (variant["solve"]["final_cost"].clone(), variant["trajectory"].clone(), variant["landmarks"].clone())
    };
    let a =
        report(manifactor(&format!("run examples/desk/desk.toml --json --out {first} {SMALL} --threads 2")));
    let config = format!("{first}/quadricslam/config.toml");
    let b = report(manifactor(&format!("run {config} --json --out {second} --threads 1")));
    assert_eq!(a, b);
    let trajectory = |out: &str| std::fs::read(format!("{out}/quadricslam/trajectory.txt")).unwrap();
    assert!(trajectory(&first) == trajectory(&second));
}

#[test]
fn the_graph_that_a_run_wrote_is_at_its_minimum() {
    let folder = folder(&[]);
    let out = path(&folder, "desk");
    let report = manifactor(&format!("run examples/desk/desk.toml --json --out {out} {SMALL}")).json();
    let cost = report["variants"][0]["solve"]["final_cost"].as_f64().unwrap();
    let solved = manifactor(&format!("solve {out}/quadricslam/graph.json --json")).json();
    let initial = solved["initial_cost"].as_f64().unwrap();
    assert!((initial - cost).abs() <= 1e-9 * cost, "{initial} {cost}");
}

#[test]
fn a_simulated_sequence_is_written_as_files() {
    let folder = folder(&[]);
    let out = path(&folder, "recording");
    let ran = manifactor(&format!("simulate examples/desk/desk.toml --out {out} {SMALL}")).ended(0);
    assert!(ran.stdout.contains("40 frames") && ran.stdout.contains("5 true objects"), "{}", ran.stdout);
    for file in ["odometry.txt", "detections.csv", "groundtruth.txt", "objects.json"] {
        assert!(Path::new(&out).join(file).is_file(), "{file}");
    }
    // the odometry of a simulation can be evaluated like any other trajectory
    let json =
        manifactor(&format!("evaluate {out}/groundtruth.txt {out}/odometry.txt --json")).ended(0).json();
    assert_eq!(json["pairs"], 40);
}

#[test]
fn what_rules_applied_to_which_object_and_why_is_told() {
    let folder = folder(&[]);
    let out = path(&folder, "rules");
    let small = "--set source.trajectory.frames=60";
    let ran = manifactor(&format!("run examples/04_rules/desk.toml --out {out} {small}"));
    assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
    let read = |file: &str| std::fs::read_to_string(format!("{out}/with-rules/{file}")).unwrap();
    let objects: Value = serde_json::from_str(&read("objects.json")).unwrap();
    let of = |field: &str| -> Vec<Value> {
        let lists = objects.as_array().unwrap().iter().filter_map(|object| object[field].as_array());
        lists.flatten().cloned().collect()
    };
    let (applied, left_out) = (of("semantic_factors"), of("left_out"));
    let because = |all: &[Value], factor: &str, text: &str| {
        let mut of_factor = all.iter().filter(|a| a["factor"] == factor);
        assert!(
            of_factor.any(|a| a["because"].as_str().unwrap().contains(text)),
            "{factor}: {text}: {all:?}"
        );
    };
    because(&applied, "supporting_plane", "");
    because(&applied, "vertical_orientation_smooth", "% of its scores, most for");
    because(&applied, "upright", "(at least 0.5), 0.");
    because(&applied, "parallel", " m from q");
    because(&left_out, "parallel", "the rule connects it with q");
    let plane = applied.iter().find(|a| a["factor"] == "supporting_plane").unwrap();
    assert_eq!((plane["rule"].as_u64(), &plane["keys"][1]), (Some(1), &Value::from("table")));
    // the plane is a variable of the graph, and the written config has it too
    assert!(read("graph.json").contains(r#""key":"table""#));
    let config = format!("{out}/with-rules/config.toml");
    manifactor(&format!("check {config}")).ended(0);
    let again = manifactor(&format!("run {config} --json --out {}", path(&folder, "again"))).json();
    let first: Value = serde_json::from_str(&read("metrics.json")).unwrap();
    assert_eq!(again["variants"][0]["solve"]["final_cost"], first["solve"]["final_cost"]);
    let page = std::fs::read_to_string(format!("{out}/report.html")).unwrap();
    assert!(page.contains("supporting_plane with table: ") && page.contains("not parallel: "));
}

#[test]
fn a_variable_of_a_run_is_no_pose_and_no_object() {
    let run = |key: &str| {
        let variable =
            format!("variables=[{{ key = \"{key}\", value = {{ type = \"point1\", position = [0.5] }} }}]");
        crate::run(["check", "examples/desk/desk.toml", "--set", &variable], &[])
    };
    run("table").ended(0);
    run("quarter").ended(0);
    run("q1").ended(2).complains("`q1` is the key of a pose or an object");
}

#[test]
fn a_cost_that_overflows_is_told_in_a_report() {
    let folder = folder(&[]);
    let out = path(&folder, "desk");
    let ran = manifactor(&format!(
        "run examples/desk/desk.toml --json --out {out} {SMALL} --set detections.noise.sigma=1e-170"
    ));
    assert_eq!(ran.code, 1, "{}", ran.stderr);
    let solve = &ran.json()["variants"][0]["solve"];
    assert!(solve["initial_cost"].is_null() && solve["termination"]["status"] != "converged", "{solve}");
    assert!(Path::new(&out).join("report.html").is_file());
    manifactor(&format!("plot {out}")).ended(0);
}

#[test]
fn a_name_that_is_too_long_for_a_folder_is_refused_before_the_run() {
    let long = "n".repeat(300);
    let text = format!("source = {{ type = \"simulated\" }}\n[[variants]]\nname = \"{long}\"\n");
    let folder = folder(&[("long.toml", &text)]);
    manifactor(&format!("check {}", path(&folder, "long.toml")))
        .ended(2)
        .complains("names a folder, and is longer than 200 letters");
}

#[test]
fn initial_values_are_those_before_the_solve() {
    let run = "source = { type = 'simulated', scene = { objects = 5 }, trajectory = { frames = 40 } }\n";
    let folder = folder(&[("run.toml", run)]);
    let error = |name: &str, more: &str| {
        let (document, out) = (path(&folder, "run.toml"), path(&folder, name));
        let json = manifactor(&format!("run {document} --out {out} {more} --json")).json();
        let landmarks = &json["variants"][0]["landmarks"];
        ["initial", "estimate"].map(|when| landmarks[when]["rmse"]["position"].as_f64().unwrap())
    };
    let [initial, estimate] = error("with", "");
    let [without, _] = error("without", "--set completion.enabled=false");
    // the second stage can map more objects
    assert!(
        (initial / without - 1.0).abs() < 0.2 && initial > 1.5 * estimate,
        "{initial} {estimate} {without}"
    );
}

#[test]
fn what_files_cannot_hold_is_said_when_they_are_written() {
    let folder = folder(&[]);
    let out = path(&folder, "recording");
    let ran = manifactor(&format!(
        "simulate examples/desk/desk.toml --out {out} {SMALL} --set source.accelerometer={{}}"
    ));
    ran.ended(0).complains("the files do not hold");
    let names =
        manifactor("simulate examples/desk/desk.toml --lines --set source.trajectory.frames=2").ended(0);
    names.complains("written is the source of the first variant");
}

const CAMERA: &str = "camera = { fx = 320.0, fy = 320.0, cx = 320.0, cy = 240.0, width = 640, height = 480 }";

#[test]
fn errors_of_objects_do_not_depend_on_the_frame_of_the_odometry() {
    let run = "source = { type = 'simulated', scene = { objects = 5 }, trajectory = { frames = 40 } }\n";
    let recorded = format!("source = {{ type = \"recorded\", folder = \"recording\", {CAMERA} }}\n");
    let folder = folder(&[("run.toml", run), ("recorded.toml", &recorded)]);
    let recording = path(&folder, "recording");
    manifactor(&format!("simulate {} --out {recording}", path(&folder, "run.toml"))).ended(0);
    let error = |name: &str| {
        let (document, out) = (path(&folder, "recorded.toml"), path(&folder, name));
        let json = manifactor(&format!("run {document} --out {out} --json")).json();
        json["variants"][0]["landmarks"]["estimate"]["rmse"]["position"].as_f64().unwrap()
    };
    let before = error("before");
    let odometry = std::fs::read_to_string(format!("{recording}/odometry.txt")).unwrap();
    let moved = odometry.lines().map(|line| {
        let mut words: Vec<String> = line.split_whitespace().map(str::to_owned).collect();
        if let Some(x) = words.get_mut(1).filter(|_| !line.starts_with('#')) {
            *x = (x.parse::<f64>().unwrap() + 5.0).to_string();
        }
        words.join(" ") + "\n"
    });
    std::fs::write(format!("{recording}/odometry.txt"), moved.collect::<String>()).unwrap();
    let after = error("after");
    assert!(before < 0.5 && after < 2.0 * before + 0.05, "{before} {after}");
}

#[test]
fn frames_out_of_order_are_left_out_and_images_of_one_time_are_one_frame() {
    let line = |time: f64, x: f64, left: f64| {
        format!(
            "{{\"timestamp\": {time}, \"pose\": {{\"translation\": [{x}, 0, 0], \"rotation\": [0, 0, 0, 1]}}, \"boxes\": \
             [{{\"class\": \"cup\", \"score\": 0.9, \"box\": [{left}, 10, {}, 60]}}]}}\n",
            left + 50.0
        )
    };
    let text = [
        (0.0, 0.0, 10.0),
        (0.1, 0.1, 10.0),
        (0.1, 0.1, 200.0),
        (0.3, 0.3, 10.0),
        (0.2, 0.2, 10.0),
        (0.4, 0.4, 10.0),
    ]
    .map(|(time, x, left)| line(time, x, left))
    .concat();
    let source =
        format!("source = {{ type = \"json_lines\", file = \"f.jsonl\", up = [0, -1, 0], {CAMERA} }}\n");
    let folder = folder(&[("run.toml", &source), ("f.jsonl", &text)]);
    let out = path(&folder, "out");
    let ran = manifactor(&format!("run {} --out {out} --json", path(&folder, "run.toml")));
    let warnings = ran.json()["variants"][0]["warnings"].to_string();
    assert!(
        warnings.contains("the frame at 0.2 s does not come after the one before, at 0.3 s"),
        "{warnings}"
    );
    let trajectory = std::fs::read_to_string(format!("{out}/estimate/trajectory.txt")).unwrap();
    let times = trajectory.lines().filter(|line| !line.starts_with('#'));
    let times: Vec<f64> =
        times.map(|line| line.split_whitespace().next().unwrap().parse().unwrap()).collect();
    assert_eq!(times, [0.0, 0.1, 0.3, 0.4]);
}

#[test]
fn a_fit_that_takes_many_iterations_maps_its_object() {
    let folder = folder(&[]);
    let seeds = "--set source.seed=1 --set source.scene.seed=1 --set source.trajectory.seed=1";
    let out = path(&folder, "out");
    let json = manifactor(&format!("run examples/figures/short_arc.toml --out {out} {seeds} --json")).json();
    let variants = json["variants"].as_array().unwrap();
    assert!(
        variants.iter().all(|variant| variant["counts"]["objects"] == 9),
        "{}",
        json["variants"][0]["counts"]
    );
}
