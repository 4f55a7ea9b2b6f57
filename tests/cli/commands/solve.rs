use crate::{folder, manifactor, path, run};

/// Two poses a metre apart; the second has a wrong initial value.
const GRAPH: &str = r#"
[[variables]]
key = "x0"
value = { type = "se2", translation = [0.0, 0.0], angle = 0.0 }
fixed = true

[[variables]]
key = "x1"
value = { type = "se2", translation = [3.0, 1.0], angle = 0.4 }

[[factors]]
keys = ["x0", "x1"]
factor = { type = "between_se2", relative = { translation = [1.0, 0.0], angle = 0.0 } }
noise = { sigma = 0.1 }
"#;

const G2O: &str = "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1.1 0 0\nEDGE_SE2 0 1 1 0 0 100 0 0 100 0 100\n";

#[test]
fn a_literal_graph_is_solved_and_written() {
    let folder = folder(&[("graph.toml", GRAPH)]);
    let solved = path(&folder, "solved.json");
    let ran = manifactor(&format!("solve {} --out {solved} --json", path(&folder, "graph.toml"))).ended(0);
    let json = ran.json();
    assert!(json["initial_cost"].as_f64().unwrap() > 100.0);
    assert!(json["final_cost"].as_f64().unwrap() < 1e-12);
    assert!(json["iterations"].as_u64().unwrap() > 0);
    assert_eq!(json["termination"]["status"], "converged");
    for stage in ["compile", "linearize", "factorize", "solve", "other", "total"] {
        assert!(json["seconds"][stage].as_f64().unwrap() >= 0.0, "{stage}");
    }
    // the output is a solved graph
    let again = manifactor(&format!("solve {solved} --json")).ended(0).json();
    assert!(again["initial_cost"].as_f64().unwrap() < 1e-12);
}

#[test]
fn a_pose_graph_is_solved_and_its_gauge_is_said_to_be_held() {
    let folder = folder(&[("graph.g2o", G2O)]);
    let ran = manifactor(&format!("solve {}", path(&folder, "graph.g2o"))).ended(0);
    assert!(ran.stdout.contains("2 variables (2 se2)") && ran.stdout.contains("converged"), "{}", ran.stdout);
    ran.complains("nothing fixes the gauge: held x0");
}

#[test]
fn a_bundle_adjustment_is_known_by_its_extension_or_its_first_line() {
    let camera = |x: f64| format!("0 0 0 {} 0 0 100 0 0\n", -x);
    let pixel = |camera: i32, x: f64, [px, py, pz]: [f64; 3]| {
        let [u, v] = [100.0 * (px - x) / -pz, 100.0 * py / -pz];
        (camera, u, v)
    };
    let points: Vec<[f64; 3]> =
        (0..8).map(|i| [f64::from(i % 3) - 1.0, f64::from(i % 2), -3.0 - f64::from(i % 5)]).collect();
    let mut text = format!("2 {} {}\n", points.len(), 2 * points.len());
    for (i, point) in points.iter().enumerate() {
        for (camera, u, v) in [pixel(0, 0.0, *point), pixel(1, 1.0, *point)] {
            text += &format!("{camera} {i} {u} {v}\n");
        }
    }
    text += &(camera(0.0) + &camera(1.0));
    points.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {}\n", z - 0.1));
    let folder = folder(&[("problem.bal", &text), ("problem.txt", &text), ("short.bal", "2 1 1\n0 5 1 1\n")]);
    let solved = path(&folder, "solved.bal");
    for file in ["problem.bal", "problem.txt"] {
        let ran = manifactor(&format!("solve {} --out {solved} --force --json", path(&folder, file)));
        ran.complains("nothing fixes the gauge: held pose and scale by c0, c1");
        ran.complains("BAL cannot express what is held: 2 left out");
        let json = ran.json();
        assert!(json["initial_cost"].as_f64().unwrap() > 1.0);
        assert!(json["final_cost"].as_f64().unwrap() < 1e-6, "{json}");
    }
    let again = manifactor(&format!("solve {solved} --json")).json();
    assert!(again["initial_cost"].as_f64().unwrap() < 1e-6);
    let ran = manifactor(&format!("solve {}", path(&folder, "short.bal"))).ended(2);
    ran.complains("there is no point 5: the first line says that there are 1, counted from 0");
}

#[test]
fn solver_and_settings_come_from_the_command_line() {
    let folder =
        folder(&[("graph.g2o", G2O), ("graph.toml", &format!("{GRAPH}\n[solver]\ntype = \"dogleg\"\n"))]);
    for file in ["graph.g2o", "graph.toml"] {
        let file = path(&folder, file);
        let ran = manifactor(&format!(
            "solve {file} --solver gauss_newton --set solver.stop.max_iterations=0 --json"
        ));
        let json = ran.ended(1).json();
        assert_eq!(
            (&json["termination"]["status"], &json["iterations"]),
            (&"max_iterations".into(), &0.into())
        );
        let ran = manifactor(&format!("solve {file} --solver gaus_newton")).ended(2);
        ran.complains("did you mean `gauss_newton`?");
        let ran = manifactor(&format!("solve {file} --set solver.stop.max_iteration=3")).ended(2);
        ran.complains("did you mean `max_iterations`?");
    }
}

#[test]
fn what_nothing_constrains_is_named() {
    let folder = folder(&[("graph.toml", &GRAPH.replace("fixed = true", ""))]);
    let file = path(&folder, "graph.toml");
    for solver in ["gauss_newton", "auto"] {
        let json = manifactor(&format!("solve {file} --solver {solver} --json")).ended(0).json();
        assert_eq!(json["termination"]["status"], "converged");
        assert_eq!(json["undetermined"]["free"], serde_json::json!(["position", "orientation"]), "{json}");
    }
}

#[test]
fn what_no_factor_touches_is_not_converged() {
    let loose = r#"
[[variables]]
key = "loose"
value = { type = "se2", translation = [3.0, 1.0], angle = 0.4 }
"#;
    let folder = folder(&[("graph.toml", &format!("{GRAPH}{loose}"))]);
    let json = manifactor(&format!("solve {} --json", path(&folder, "graph.toml"))).ended(1).json();
    assert_eq!(json["termination"]["status"], "indeterminate");
    assert_eq!(json["untouched"]["keys"][0], "loose");
}

#[test]
fn results_are_the_same_for_any_number_of_threads() {
    // more factors than a single thread gets
    let mut text = String::new();
    for i in 0..400 {
        let (x, y) = (f64::from(i) * 0.1, f64::from(i * i % 7) * 0.01);
        text += &format!("VERTEX_SE2 {i} {x} {y} 0.01\n");
        if i > 0 {
            text += &format!("EDGE_SE2 {} {i} 0.1 0.001 0.002 100 0 0 100 0 100\n", i - 1);
        }
        if i > 20 {
            text += &format!("EDGE_SE2 {} {i} 2.0 0.02 0.03 50 0 0 50 0 50\n", i - 20);
        }
    }
    let folder = folder(&[("graph.g2o", &text)]);
    let solved = [1, 2, 3].map(|threads| {
        let out = path(&folder, &format!("{threads}.json"));
        let graph = path(&folder, "graph.g2o");
        run(["solve", &graph, "--threads", &threads.to_string(), "--out", &out], &[]).ended(0);
        std::fs::read_to_string(out).unwrap()
    });
    assert!(solved[0] == solved[1] && solved[1] == solved[2]);
}

#[test]
fn every_malformed_line_is_shown() {
    let folder = folder(&[("graph.g2o", "VERTEX_SE2 0 0 0 0\nVERTEX_SE2 1 1 zero 0\nEDGE_SE2 0 1 1 0\n")]);
    let ran = manifactor(&format!("solve {} --json", path(&folder, "graph.g2o"))).ended(2);
    ran.complains("expected a finite number, got `zero`");
    let errors = ran.json()["errors"].as_array().unwrap().clone();
    let lines: Vec<_> = errors.iter().map(|e| e["line"].as_u64().unwrap()).collect();
    assert_eq!(lines, [2, 3]);
}

#[test]
fn information_that_is_not_positive_definite_is_repaired_on_request() {
    let text = G2O.replace("100 0 0 100 0 100", "100 0 0 -1 0 100");
    let folder = folder(&[("graph.g2o", &text)]);
    let file = path(&folder, "graph.g2o");
    manifactor(&format!("solve {file}")).ended(2).complains("positive definite");
    manifactor(&format!("solve {file} --repair clamp"))
        .ended(0)
        .complains("information made positive definite");
}

#[test]
fn files_that_are_not_there_are_named() {
    manifactor("solve nowhere.g2o").ended(3).complains("nowhere.g2o");
    manifactor("solve nowhere.toml").ended(3).complains("nowhere.toml");
    let folder = folder(&[("graph.toml", GRAPH)]);
    let ran = manifactor(&format!("solve {} --out {}", path(&folder, "graph.toml"), path(&folder, "a.txt")));
    ran.ended(2).complains("use .toml, .json, .yaml, .bal or .g2o");
}

#[test]
fn the_start_is_chosen_by_name() {
    let folder = folder(&[("graph.toml", GRAPH), ("graph.g2o", G2O)]);
    for file in ["graph.toml", "graph.g2o"] {
        let file = path(&folder, file);
        let given = manifactor(&format!("solve {file} --json")).ended(0).json();
        assert_eq!(given["start"]["type"], "given");
        for start in ["chordal", "spanning_tree"] {
            let json = manifactor(&format!("solve {file} --start {start} --json")).ended(0).json();
            assert_eq!(json["start"]["type"], start);
            assert!(json["initial_cost"].as_f64().unwrap() < 1e-12, "{json}");
            assert!(given["initial_cost"].as_f64().unwrap() > 0.1);
        }
        let set = "--set start.type=spanning_tree --set start.tree=shallow";
        let ran = manifactor(&format!("solve {file} {set}")).ended(0);
        assert!(ran.stdout.contains("start spanning_tree in"), "{}", ran.stdout);
        manifactor(&format!("solve {file} --start cordal")).ended(2).complains("did you mean `chordal`?");
    }
}

#[test]
fn a_start_that_does_not_apply_says_what_it_needs() {
    let text = r#"
variables = [{ key = "p", value = { type = "point2", position = [1.0, 2.0] } }]
factors = [{ keys = ["p"], factor = { type = "prior_point2", value = { position = [0.0, 0.0] } } }]
"#;
    let folder = folder(&[("graph.toml", text)]);
    let ran = manifactor(&format!("solve {} --start chordal", path(&folder, "graph.toml"))).ended(2);
    ran.complains("it needs between factors of rotations or poses");
}

#[test]
fn a_solved_pose_graph_is_certified_on_request() {
    let folder = folder(&[("graph.toml", GRAPH), ("graph.g2o", G2O)]);
    for file in ["graph.toml", "graph.g2o"] {
        let file = path(&folder, file);
        let json = manifactor(&format!("solve {file} --certify --json")).ended(0).json();
        assert_eq!(json["certificate"]["certified"], true, "{json}");
        assert!(json["certificate"]["suboptimality"].as_f64().unwrap() < 1e-6);
        let ran = manifactor(&format!("solve {file} --certify")).ended(0);
        assert!(ran.stdout.contains("\ncertified: "), "{}", ran.stdout);
    }
    let robust = GRAPH.replace("noise = { sigma = 0.1 }", "loss = { type = \"cauchy\" }");
    let folder = crate::folder(&[("graph.toml", &robust)]);
    let ran = manifactor(&format!("solve {} --certify", path(&folder, "graph.toml"))).ended(2);
    ran.complains("factor 0 has a robust loss");
}

/// A straight chain of poses, and a wrong edge between its ends.
fn with_an_outlier(length: usize) -> String {
    let mut text = String::new();
    for i in 0..12 {
        text += &format!("VERTEX_SE2 {i} {i} 0 0\n");
    }
    let mut edge = |a: usize, b: usize, x: usize| {
        text += &format!("EDGE_SE2 {a} {b} {x} 0 0 100 0 0 100 0 100\n");
    };
    (1..12).for_each(|i| edge(i - 1, i, 1));
    (4..12).for_each(|i| edge(i - 4, i, 4));
    edge(0, 11, length);
    text
}

#[test]
fn an_outlier_is_rejected_and_named() {
    let folder = folder(&[("graph.g2o", &with_an_outlier(3))]);
    let file = path(&folder, "graph.g2o");
    let json = manifactor(&format!("solve {file} --solver gnc --json")).ended(0).json();
    assert_eq!(json["rejected"].as_array().unwrap().len(), 1);
    assert_eq!(
        (&json["rejected"][0]["factor"], &json["rejected"][0]["keys"][1]),
        (&19.into(), &"x11".into())
    );
    assert!(json["final_cost"].as_f64().unwrap() < 1e-12);
    let ran = manifactor(&format!("solve {file} --solver gnc")).ended(0);
    assert!(ran.stdout.contains("1 of 20 factors rejected as outliers: 19 (x0, x11)"), "{}", ran.stdout);
    let set =
        "--set solver.cost=geman_mcclure --set solver.solver.type=dogleg --set solver.probability=0.999";
    let json = manifactor(&format!("solve {file} --solver gnc {set} --json")).ended(0).json();
    assert_eq!(json["rejected"][0]["factor"], 19);
    manifactor(&format!("solve {file} --solver gnc --set solver.probability=2")).ended(2).complains("got 2");
    manifactor(&format!("solve {file} --solver gnc --set solver.inliers=[99]"))
        .ended(2)
        .complains("no factor 99");
}

#[test]
fn what_costs_the_most_is_shown_with_the_condition() {
    // too long: an edge that is too short bends the chain, and steps never end
    let folder = folder(&[("graph.g2o", &with_an_outlier(20))]);
    let file = path(&folder, "graph.g2o");
    let ran = manifactor(&format!("solve {file}")).ended(0);
    assert!(
        !ran.stdout.contains("between_se2 (x0, x11)") && !ran.stdout.contains("condition"),
        "{}",
        ran.stdout
    );
    let ran = manifactor(&format!("solve {file} -v")).ended(0);
    assert!(
        ran.stdout.contains("19 between_se2 (x0, x11)") && ran.stdout.contains("condition number"),
        "{}",
        ran.stdout
    );
    let diagnosis = &manifactor(&format!("solve {file} --json")).ended(0).json()["diagnosis"];
    let worst = diagnosis["worst"].as_array().unwrap();
    assert!(
        worst.len() == 10 && worst[0]["factor"] == 19 && worst[0]["residual"].as_array().unwrap().len() == 3
    );
    assert!(worst[0]["cost"].as_f64() >= worst[9]["cost"].as_f64());
    assert!(diagnosis["condition"].as_f64().unwrap() > 10.0);
}

#[test]
fn solvers_have_short_names() {
    let folder = folder(&[("graph.g2o", G2O)]);
    let file = path(&folder, "graph.g2o");
    for (short, full) in [("lm", "levenberg_marquardt"), ("gn", "gauss_newton"), ("dl", "dogleg")] {
        let cost = |name: &str| {
            let json = manifactor(&format!("solve {file} --solver {name} --json")).ended(0).json();
            (json["final_cost"].clone(), json["iterations"].clone())
        };
        assert_eq!(cost(short), cost(full));
    }
    // a setting that only one solver has
    manifactor(&format!("solve {file} --solver lm --set solver.initial_lambda=1e-3")).ended(0);
    manifactor(&format!("solve {file} --solver gn --set solver.initial_lambda=1e-3")).ended(2);
    let help = manifactor("solve --help").ended(0).stdout;
    let words = help.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(words.contains("`lm` for levenberg_marquardt, `gn` for gauss_newton, `dl` for dogleg"), "{help}");
}

#[test]
fn covariances_are_given_on_request() {
    let folder = folder(&[("graph.g2o", G2O)]);
    let file = path(&folder, "graph.g2o");
    let json = manifactor(&format!("solve {file} --covariances --json")).ended(0).json();
    let [held, free] = json["covariances"].as_array().unwrap().as_slice() else { panic!("{json}") };
    assert_eq!((&held["key"], &held["covariance"][0][0]), (&"x0".into(), &0.0.into()));
    assert_eq!(free["tangent"].as_array().unwrap().len(), 3);
    assert!((free["covariance"][2][2].as_f64().unwrap() - 0.01).abs() < 1e-9);
    let ran = manifactor(&format!("solve {file} --covariances=x1")).ended(0);
    assert!(ran.stdout.contains("x1") && ran.stdout.contains("1.000e-1"), "{}", ran.stdout);
    let json = manifactor(&format!("solve {file} --covariances=x1 --json")).ended(0).json();
    assert_eq!(json["covariances"].as_array().unwrap().len(), 1);
    manifactor(&format!("solve {file} --covariances=x7")).ended(2).complains("no variable `x7`");
}

#[test]
fn things_on_a_desk_come_to_where_their_relations_put_them() {
    let folder = folder(&[]);
    let out = path(&folder, "solved.json");
    let arguments = format!("solve examples/03_relations/graph.toml --out {out} --json");
    let solved = manifactor(&arguments).ended(0).json();
    assert!(solved["final_cost"].as_f64().unwrap() < 3.0, "{solved}");
    let graph: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(out).unwrap()).unwrap();
    let value = |key: &str| {
        let all = graph["variables"].as_array().unwrap();
        all.iter().find(|v| v["key"] == key).unwrap()["value"].clone()
    };
    let height = |key: &str| value(key)["translation"][2].as_f64().unwrap();
    // a book and a cup on a desk at 0.72 m: the half height of the book above it, then the half height of
    // the cup
    assert!((height("book") - 0.74).abs() < 0.02, "{}", height("book"));
    assert!((height("cup") - 0.82).abs() < 0.03, "{}", height("cup"));
    assert!(value("up")["direction"][2].as_f64().unwrap() > 0.999);
}
