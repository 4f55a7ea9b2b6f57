//! Solves with quadrics: objects are recovered from their boxes, and degenerate factors do no harm.
use manifactor_geometry::{Se3, So3};
use manifactor_graph::loss::Cauchy;
use manifactor_graph::{Factor, Graph, Manifold, Noise, Values};
use manifactor_quadric::initialise::{
    FirstOfInitialiser, Initialiser, ObjectView, RaysInitialiser, SvdInitialiser,
};
use manifactor_quadric::*;
use manifactor_solve::{LevenbergMarquardt, Silent, Solution, Stopping, solve};
use nalgebra::{Matrix3, SVector, Vector3};

fn camera() -> Camera {
    Camera::new([525.0, 520.0, 320.0, 240.0], 640, 480).unwrap()
}

fn object() -> DualQuadric {
    let pose = Se3::new(So3::exp(&Vector3::new(0.2, -0.3, 0.5)), Vector3::new(0.1, 0.0, -0.1));
    DualQuadric { pose, semi_axes: Vector3::new(0.12, 0.2, 0.33) }
}

/// Cameras on an arc around the origin that face the origin or a point above it.
fn cameras(count: usize, past: f64) -> Vec<Se3> {
    let one = |i: usize| {
        let a = i as f64 * 4.0 / count as f64;
        let eye = Vector3::new(a.cos(), a.sin(), 0.5 + 0.3 * (3.0 * a).sin()) * 2.0;
        let z = (Vector3::new(0.0, 0.0, past) - eye).normalize();
        let x = z.cross(&Vector3::z()).normalize();
        Se3::new(So3::from_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z])), eye)
    };
    (0..count).map(one).collect()
}

/// Fixed cameras that measure the object with exact boxes.
fn view_of(truth: &DualQuadric, poses: &[Se3], model: BoxModel) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for (i, pose) in poses.iter().enumerate() {
        let bounding_box = BoundingBox::new([0.0; 4]).unwrap();
        let mut factor = BoundingBoxFactor { bounding_box, camera: camera(), model };
        factor.bounding_box = factor.predict(pose, truth).unwrap();
        graph.add([format!("x{i}"), "q".into()], factor).noise(Noise::sigma(4.0).unwrap());
        graph.fix(format!("x{i}"));
        values.insert(format!("x{i}"), *pose);
    }
    (graph, values)
}

fn run(graph: &Graph, values: &Values) -> (Solution, DualQuadric) {
    let stop = Stopping { max_iterations: 200, ..Stopping::default() };
    let solution =
        solve(graph, values, &LevenbergMarquardt { stop, ..Default::default() }, &mut Silent).unwrap();
    let quadric = *solution.values.get::<DualQuadric>("q").unwrap();
    assert!(quadric.is_finite() && quadric.semi_axes.min() > 0.0);
    assert!(solution.outcome.final_cost <= solution.outcome.initial_cost);
    (solution, quadric)
}

#[test]
fn boxes_give_the_object_back() {
    for (model, past) in [(BoxModel::Standard, 0.0), (BoxModel::Standard, 0.9), (BoxModel::Truncated, 0.0)] {
        let poses = cameras(12, past);
        let (graph, mut values) = view_of(&object(), &poses, model);
        let off = SVector::from_fn(|i, _| 0.15 * (5.0 * i as f64 + 1.0).sin());
        values.insert("q", object().retract(&off));
        let (solution, found) = run(&graph, &values);
        assert!(solution.outcome.final_cost < 1e-12, "{:?}", solution.outcome);
        assert!((found.matrix() - object().matrix()).norm() < 1e-6);
    }
}

#[test]
fn boxes_that_the_border_cuts_give_it_back_by_the_truncated_model_only() {
    let poses = cameras(16, 0.85);
    let (graph, mut values) = view_of(&object(), &poses, BoxModel::Truncated);
    let boxes: Vec<_> = graph
        .factors()
        .iter()
        .filter_map(|e| e.factor.erased().as_any().downcast_ref::<BoundingBoxFactor>())
        .collect();
    let cut = boxes.iter().filter(|f| f.bounding_box.sides_inside(640, 480, 1.0) != [true; 4]).count();
    assert!(cut > 4, "{cut} boxes are cut");
    values.insert("q", object().retract(&SVector::repeat(0.05)));
    let (solution, found) = run(&graph, &values);
    assert!(solution.outcome.final_cost < 1e-10, "{:?}", solution.outcome);
    assert!((found.matrix() - object().matrix()).norm() < 1e-5);

    let mut standard = Graph::new();
    for (entry, factor) in graph.factors().iter().zip(boxes) {
        let keys = entry.keys.clone();
        standard
            .add(keys, BoundingBoxFactor { model: BoxModel::Standard, ..factor.clone() })
            .noise(entry.noise.clone());
        standard.fix(entry.keys[0].clone());
    }
    let (_, wrong) = run(&standard, &values);
    assert!((wrong.matrix() - object().matrix()).norm() > 0.01);
}

#[test]
fn sides_that_were_not_observed_do_not_count() {
    let poses = cameras(12, 0.0);
    let (mut graph, mut values) = view_of(&object(), &poses, BoxModel::Standard);
    for entry in graph.factors_mut().iter_mut().step_by(3) {
        let mut factor = entry.factor.erased().as_any().downcast_ref::<BoundingBoxFactor>().unwrap().clone();
        factor.bounding_box.xmax = 640.0;
        let observed = factor.bounding_box.sides_inside(640, 480, 5.0);
        assert_eq!(observed, [true, true, false, true]);
        entry.noise = entry.noise.clone().observing(&observed);
        entry.factor = std::sync::Arc::new(factor);
    }
    values.insert("q", object().retract(&SVector::repeat(0.1)));
    let (_, found) = run(&graph, &values);
    assert!((found.matrix() - object().matrix()).norm() < 1e-6);
}

#[test]
fn no_step_pushes_an_object_behind_a_camera() {
    // Inconsistent boxes: the cost would be lowest if all factors were inactive.
    let poses = cameras(8, 0.0);
    let (mut graph, mut values) = view_of(&object(), &poses, BoxModel::Standard);
    for (i, entry) in graph.factors_mut().iter_mut().enumerate() {
        let mut factor = entry.factor.erased().as_any().downcast_ref::<BoundingBoxFactor>().unwrap().clone();
        let [x, y] = [(i * 271) % 600, (i * 157) % 440].map(|n| n as f64);
        factor.bounding_box = BoundingBox::new([x, y, x + 600.0, y + 500.0]).unwrap();
        entry.factor = std::sync::Arc::new(factor);
    }
    values.insert("q", object());
    let (solution, found) = run(&graph, &values);
    assert_eq!(solution.outcome.inactive, 0);
    assert!(poses.iter().all(|pose| found.is_in_front_of(pose)));
}

#[test]
fn an_object_that_starts_behind_a_camera_is_reported() {
    let poses = cameras(6, 0.0);
    let (graph, mut values) = view_of(&object(), &poses, BoxModel::Standard);
    // Behind the first camera.
    let behind = poses[0].act(&Vector3::new(0.0, 0.0, -1.0));
    values.insert("q", DualQuadric { pose: Se3::new(So3::identity(), behind), ..object() });
    let (solution, _) = run(&graph, &values);
    let (first, rest) = solution.factors.split_first().unwrap();
    assert!(!first.defined || rest.iter().all(|f| f.defined));
    assert_eq!(solution.outcome.inactive, solution.factors.iter().filter(|f| !f.defined).count());
}

/// Solves for an object with a weak prior and an orientation factor.
fn turned(factor: impl Factor + 'static, start: DualQuadric) -> (Solution, DualQuadric) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    graph.add(["q"], QuadricPrior { value: start }).noise(Noise::sigma(10.0).unwrap());
    graph.add(["q"], factor).noise(Noise::sigma(1e-3).unwrap()).loss(Cauchy::new(1e4).unwrap());
    values.insert("q", start);
    run(&graph, &values)
}

#[test]
fn orientation_factors_turn_what_leans() {
    let tilt = |q: &DualQuadric| q.major_axis().z.abs();
    assert!(tilt(&turned(VerticalOrientation::default(), object()).1) > 1.0 - 1e-4);
    assert!(tilt(&turned(VerticalOrientationSmooth::default(), object()).1) > 1.0 - 1e-6);
    assert!(tilt(&turned(HorizontalOrientation::default(), object()).1) < 1e-3);
    assert!(tilt(&turned(HorizontalOrientationSmooth::default(), object()).1) < 1e-3);
}

#[test]
fn the_smooth_vertical_factor_needs_fewer_steps() {
    let paper = turned(VerticalOrientation::default(), object()).0.outcome;
    let smooth = turned(VerticalOrientationSmooth::default(), object()).0.outcome;
    println!("{} steps by the paper's residual, {} by the smooth one", paper.iterations, smooth.iterations);
    assert!(smooth.iterations < paper.iterations);
}

#[test]
fn orientation_factors_survive_where_they_degenerate() {
    let upright = DualQuadric { pose: Se3::identity(), ..object() };
    let lying = DualQuadric {
        pose: Se3::new(So3::exp(&(Vector3::x() * std::f64::consts::FRAC_PI_2)), Vector3::zeros()),
        ..object()
    };
    let ball = DualQuadric { semi_axes: Vector3::repeat(0.2), ..object() };
    let nearly = DualQuadric { semi_axes: Vector3::new(0.2, 0.2 + 1e-12, 0.2 - 1e-12), ..object() };
    for start in [upright, lying, ball, nearly] {
        turned(VerticalOrientation::default(), start);
        turned(VerticalOrientationSmooth::default(), start);
        turned(HorizontalOrientation::default(), start);
        turned(HorizontalOrientationSmooth::default(), start);
    }
}

#[test]
fn what_the_initialisers_find_is_where_a_solve_can_start() {
    for noise in [0.0, 3.0] {
        let poses = cameras(10, 0.0);
        let (mut graph, mut values) = view_of(&object(), &poses, BoxModel::Standard);
        let mut views = vec![];
        for (i, (entry, pose)) in graph.factors_mut().iter_mut().zip(&poses).enumerate() {
            let mut factor =
                entry.factor.erased().as_any().downcast_ref::<BoundingBoxFactor>().unwrap().clone();
            let mut bounds = factor.bounding_box.bounds();
            bounds.iter_mut().enumerate().for_each(|(k, b)| *b += noise * (13.0 * (4 * i + k) as f64).sin());
            factor.bounding_box = BoundingBox::new(bounds).unwrap();
            views.push(ObjectView::new(*pose, camera(), factor.bounding_box));
            entry.factor = std::sync::Arc::new(factor);
        }
        let both = FirstOfInitialiser {
            initialisers: vec![Box::new(SvdInitialiser::default()), Box::new(RaysInitialiser::default())],
        };
        let all: [&dyn Initialiser; 3] = [&SvdInitialiser::default(), &RaysInitialiser::default(), &both];
        let costs = all.map(|initialiser| {
            values.insert("q", initialiser.initialise(&views).unwrap());
            let (solution, found) = run(&graph, &values);
            let truth = object().axes_aligned_box();
            assert!(LandmarkError::of(&found, &truth, &(&truth).into()).quality < 0.02 + 0.06 * noise);
            solution.outcome.final_cost
        });
        println!("{noise} px: final costs {costs:?}");
        assert!(costs.iter().all(|c| (c - costs[0]).abs() < 1e-4 * (1.0 + costs[0])));
    }
}
