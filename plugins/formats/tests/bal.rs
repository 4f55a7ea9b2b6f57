//! BAL files: reading, writing, and solving.
use manifactor_formats::{FormatError, bal};
use manifactor_geometry::{BalCamera, Coordinates, Point3, ProjectionBal, Se3, So3};
use manifactor_graph::loss::Huber;
use manifactor_graph::{Fixed, Graph, Key, Manifold, Noise, Values};
use manifactor_solve::{
    Auto, GaussNewton, LevenbergMarquardt, Optimizer, Problem, Silent, Termination, solve,
};
use nalgebra::{Vector2, Vector3};

/// Two cameras that observe one point; the second is one metre to the right of the first.
const TWO: &str = "2 1 2\n0 0 10.0 -20.0\n1 0 -90.0 -20.0\n\
    0 0 0 0 0 0 100 0 0\n0 0 0\n-1 0 0 100 0.0 0.0\n0.1 -0.2 -1.0\n";

fn parse(text: &str) -> bal::BalProblem {
    bal::parse(text, "b", true).unwrap()
}

fn mistakes(text: &str) -> String {
    match bal::parse(text, "b", true).unwrap_err() {
        FormatError::Malformed(malformed) => malformed.to_string(),
        other => panic!("{other}"),
    }
}

/// Six cameras on an arc that observe points on a bowl, with initial values perturbed by `error`.
fn bundle(error: f64) -> (Graph, Values) {
    let wave = |i: usize, k: usize| ((i * 37 + k * 61) as f64).sin();
    let any = |i: usize| Vector3::new(wave(i, 1), wave(i, 2), wave(i, 3));
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let cameras: Vec<BalCamera> = (0..6)
        .map(|i| {
            let turn = So3::exp(&Vector3::new(0.02 * wave(i, 4), 0.2 * i as f64 - 0.5, 0.1 * wave(i, 5)));
            let distortion = Vector2::new(-0.05, 0.01);
            let world_from_camera = Se3::new(turn, turn.act(&Vector3::new(0.0, 0.0, 8.0)));
            BalCamera { world_from_camera, focal_length: 700.0 + i as f64, distortion }
        })
        .collect();
    let points: Vec<Vector3<f64>> =
        (0..60).map(|i| any(i).component_mul(&Vector3::new(2.0, 2.0, 1.0))).collect();
    for (i, camera) in cameras.iter().enumerate() {
        for (j, point) in points.iter().enumerate().filter(|(j, _)| (i + j) % 4 != 0) {
            let pixel = camera.project(&camera.world_from_camera.inverse_act(point));
            let pixel = Coordinates::new(pixel + any(i * 100 + j).xy() * 0.5).unwrap();
            graph.add([Key::indexed("c", i), Key::indexed("p", j)], ProjectionBal { pixel });
        }
    }
    for (i, camera) in cameras.iter().enumerate() {
        let off = nalgebra::SVector::<f64, 9>::from_fn(|k, _| match k {
            0..6 => error * wave(i, k),
            6 => 100.0 * error * wave(i, k),
            _ => 0.0,
        });
        values.insert(Key::indexed("c", i), camera.retract(&off));
    }
    for (j, point) in points.iter().enumerate() {
        values.insert(Key::indexed("p", j), Point3::new(point + any(j + 1000) * error));
    }
    (graph, values)
}

#[test]
fn cameras_points_and_observations_are_read_whatever_the_line_breaks() {
    let bundle = parse(TWO);
    assert_eq!((bundle.graph.factors().len(), bundle.values.len()), (2, 3));
    let second = bundle.values.get::<BalCamera>("c1").unwrap();
    assert_eq!(second.world_from_camera.translation, Vector3::new(1.0, 0.0, 0.0));
    assert_eq!(second.focal_length, 100.0);
    assert_eq!(bundle.values.get::<Point3>("p0").unwrap().0, Vector3::new(0.1, -0.2, -1.0));
    // Both observations match the point exactly.
    let problem = Problem::compile(&bundle.graph, &bundle.values).unwrap();
    assert!(problem.inspect().iter().all(|f| f.cost < 1e-20));
}

#[test]
fn the_first_pose_and_one_direction_of_the_farthest_are_held() {
    let bundle = parse(TWO);
    let held: Vec<_> =
        bundle.graph.fixed().iter().map(|(key, fixed)| (key.as_str(), fixed.clone())).collect();
    let directions = |names: &[&str]| Fixed::Directions(names.iter().map(|n| (*n).to_owned()).collect());
    assert_eq!(held, [("c0", directions(&["rx", "ry", "rz", "x", "y", "z"])), ("c1", directions(&["x"]))]);
    assert_eq!(bundle.report.anchored, [Key::from("c0"), Key::from("c1")]);
    assert!(bal::parse(TWO, "b", false).unwrap().graph.fixed().is_empty());
}

#[test]
fn what_nobody_observes_is_held_and_reported() {
    let text = TWO.replace("2 1 2", "2 2 2") + "5 5 5\n";
    let bundle = parse(&text);
    assert_eq!(bundle.report.unobserved, [Key::from("p1")]);
    assert_eq!(bundle.graph.fixed().get("p1"), Some(&Fixed::Whole(true)));
}

#[test]
fn mistakes_are_named_with_their_lines() {
    assert_eq!(mistakes("2 1"), "b:1: expected 3 fields (cameras points observations), got 2");
    assert_eq!(mistakes(""), "b: expected 3 fields (cameras points observations), got 0");
    let told = mistakes(&TWO.replace("0 0 10.0", "2 1 10.0").replace("1 0 -90.0 -20.0", "1 0 NaN -20.0"));
    let camera = "b:2: there is no camera 2: the first line says that there are 2, counted from 0";
    assert_eq!(told, format!("{camera}\nb:3: expected a finite number, got `NaN`"));
    let told = mistakes(&TWO.replace("0.1 -0.2 -1.0", "0.1 -0.2"));
    assert!(told.starts_with("b: the first line asks for 21 numbers after the observations"), "{told}");
    assert!(told.ends_with("found 20"), "{told}");
    assert!(mistakes(&(TWO.to_owned() + "7")).ends_with("found 22"));
    assert_eq!(mistakes("1 1 3\n0 0 1 1"), "b: the first line asks for 3 lines of observations, found 1");
    assert!(
        mistakes(&TWO.replace("100 0.0", "100 zero")).contains("b:6: expected a finite number, got `zero`")
    );
    // Counts that exceed any memory.
    assert!(mistakes("18446744073709551615 9223372036854775807 0\n1 2 3").contains("found 3"));
}

#[test]
fn a_file_is_known_by_its_first_line() {
    assert!(bal::looks_like_bal("# made by hand\n 2 1 2 \n"));
    assert!(
        !bal::looks_like_bal("VERTEX_SE2 0 0 0 0\n")
            && !bal::looks_like_bal("1 2 3 4")
            && !bal::looks_like_bal("")
    );
}

#[test]
fn what_is_written_reads_back() {
    let (graph, values) = bundle(0.1);
    let (text, omitted) = bal::format(&graph, &values);
    assert_eq!(omitted, bal::BalOmissions::default());
    let back = bal::parse(&text, "b", false).unwrap();
    assert_eq!(back.graph.factors().len(), graph.factors().len());
    for (a, b) in graph.factors().iter().zip(back.graph.factors()) {
        assert_eq!(serde_json::to_string(a).unwrap(), serde_json::to_string(b).unwrap());
    }
    for (key, value) in values.iter() {
        let local = value.erased().local(back.values.variable(key.as_str()).unwrap()).unwrap();
        assert!(local.iter().all(|d| d.abs() < 1e-12), "{key}: {local:?}");
    }
}

#[test]
fn what_bal_has_no_word_for_is_reported() {
    let (mut graph, mut values) = bundle(0.0);
    graph.factors_mut()[0].noise = Noise::sigma(2.0).unwrap();
    graph.factors_mut()[1].loss(Huber::default());
    graph.fix("c0");
    values.insert("x0", Se3::identity());
    let (_, omitted) = bal::format(&graph, &values);
    assert_eq!((omitted.noise, omitted.losses, omitted.held), (1, 1, 1));
    assert_eq!(omitted.variables.get("se3"), Some(&1));
}

#[test]
fn every_solver_finds_the_minimum_that_others_find() {
    let (graph, values) = bundle(0.05);
    let read = parse(&bal::format(&graph, &values).0);
    let optimizers: [&dyn Optimizer; 3] =
        [&Auto::default(), &GaussNewton::default(), &LevenbergMarquardt::default()];
    let costs = optimizers.map(|optimizer| {
        let solution = solve(&read.graph, &read.values, optimizer, &mut Silent).unwrap();
        let outcome = solution.outcome;
        assert!(matches!(outcome.termination, Termination::Converged { .. }), "{outcome:?}");
        assert_eq!((outcome.undetermined, outcome.inactive), (None, 0));
        assert!(outcome.final_cost < 1e-3 * outcome.initial_cost);
        outcome.final_cost
    });
    assert!(costs.iter().all(|c| (c - costs[0]).abs() < 1e-6 * costs[0]), "{costs:?}");
}

#[test]
fn without_an_anchor_the_minimum_is_as_deep_and_seven_directions_are_open() {
    let (graph, values) = bundle(0.05);
    let text = bal::format(&graph, &values).0;
    let cost = |anchor| {
        let read = bal::parse(&text, "b", anchor).unwrap();
        let outcome =
            solve(&read.graph, &read.values, &LevenbergMarquardt::default(), &mut Silent).unwrap().outcome;
        assert_eq!(outcome.undetermined.is_some(), !anchor);
        outcome.final_cost
    };
    let (held, free) = (cost(true), cost(false));
    assert!((held - free).abs() < 1e-6 * held, "{held} {free}");
}
