//! Every method for the linear system of a step leads to the same estimate.
use manifactor_geometry::{Between, Coordinates, Landmark, Prior, Rn, Se3};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Graph, Key, Manifold, Noise, Values};
use manifactor_solve::{
    CompileError, ConjugateGradients, GaussNewton, LevenbergMarquardt, LinearSolver, Method, Optimizer,
    Ordering, Preconditioner, Silent, solve,
};
use nalgebra::{Vector3, Vector6};

/// A walk around a room: poses and points on the walls that each of them sees, with perturbed initial values.
fn room() -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let step = Se3::exp(&Vector6::new(0.3, 0.02, -0.01, 0.0, 0.03, 0.21));
    let off = |i: usize, by: f64| (i as f64 * 12.9898).sin() * by;
    let (mut pose, mut poses) = (Se3::identity(), vec![]);
    for i in 0..30 {
        poses.push(pose);
        let error = Vector6::from_fn(|d, _| off(7 * i + d, 0.02));
        values.insert(Key::indexed("x", i), pose.retract(&error));
        pose = pose.compose(&step);
    }
    graph.add(["x0"], Prior { value: poses[0] }).noise(Noise::sigma(0.01).unwrap());
    for i in 1..poses.len() {
        let keys = [Key::indexed("x", i - 1), Key::indexed("x", i)];
        graph.add(keys, Between { relative: step }).noise(Noise::sigma(0.05).unwrap());
    }
    for l in 0..80 {
        let at = Vector3::new(off(3 * l, 4.0), off(3 * l + 1, 4.0), off(3 * l + 2, 1.0));
        values.insert(Key::indexed("l", l), Rn(at.map(|x| x + off(l, 0.1))));
        for (i, pose) in poses.iter().enumerate().filter(|(i, _)| (i + l) % 4 == 0) {
            let seen = pose.inverse().act(&at) + Vector3::from_fn(|d, _| off(100 * l + 3 * i + d, 0.01));
            let keys = [Key::indexed("x", i), Key::indexed("l", l)];
            let factor = Landmark::<3> { position: Coordinates::new(seen).unwrap() };
            graph.add(keys, factor).noise(Noise::sigma(0.02).unwrap());
        }
    }
    (graph, values)
}

fn agrees(linear: &LinearSolver, tolerance: f64) {
    let (graph, values) = room();
    let reference = solve(&graph, &values, &GaussNewton::default(), &mut Silent).unwrap();
    let solvers: [Box<dyn Optimizer>; 2] = [
        Box::new(GaussNewton { linear: linear.clone(), ..Default::default() }),
        Box::new(LevenbergMarquardt { linear: linear.clone(), ..Default::default() }),
    ];
    for solver in solvers {
        let solution = solve(&graph, &values, &*solver, &mut Silent).unwrap();
        let (ended, expected) = (&solution.outcome, &reference.outcome);
        assert!(ended.termination.is_converged(), "{linear:?}: {}", ended.termination);
        let error = (ended.final_cost - expected.final_cost).abs() / expected.final_cost;
        assert!(error < tolerance, "{linear:?}: {} beside {}", ended.final_cost, expected.final_cost);
    }
}

#[test]
fn every_ordering_leads_to_the_same_estimate() {
    let types = |name: &str| Ordering::First(vec![name.to_owned()]);
    let given = Ordering::Given((0..30).rev().map(|i| Key::indexed("x", i)).collect());
    let orderings = [
        Ordering::Auto,
        Ordering::Natural,
        Ordering::Amd,
        Ordering::Colamd,
        Ordering::NestedDissection,
        types("point3"),
        types("se3"),
        given,
    ];
    for ordering in orderings {
        agrees(&LinearSolver { ordering, method: Method::Cholesky, ..Default::default() }, 1e-11);
    }
}

#[test]
fn every_method_leads_to_the_same_estimate() {
    for method in [Method::Auto, Method::Dense, Method::Qr] {
        agrees(&LinearSolver { method, ..Default::default() }, 1e-11);
    }
    agrees(&LinearSolver { refinements: 2, ..Default::default() }, 1e-11);
    for preconditioner in [Preconditioner::BlockJacobi, Preconditioner::SchurJacobi] {
        let conjugate_gradients = ConjugateGradients { preconditioner, ..Default::default() };
        let method = Method::ConjugateGradients;
        agrees(
            &LinearSolver { method, conjugate_gradients: conjugate_gradients.clone(), ..Default::default() },
            1e-8,
        );
        let ordering = Ordering::First(vec!["point3".to_owned()]);
        agrees(&LinearSolver { method, conjugate_gradients, ordering, ..Default::default() }, 1e-8);
    }
}

fn refused(linear: LinearSolver) -> String {
    let (graph, values) = room();
    let solver = GaussNewton { linear, ..Default::default() };
    solve(&graph, &values, &solver, &mut Silent).unwrap_err().to_string()
}

#[test]
fn what_does_not_fit_into_memory_says_how_much_it_takes() {
    let (graph, values) = room();
    let linear = LinearSolver {
        method: Method::Cholesky,
        memory_gib: Some(NotNegative::literal(1e-5)),
        ..Default::default()
    };
    let solver = GaussNewton { linear, ..Default::default() };
    let error = solve(&graph, &values, &solver, &mut Silent).unwrap_err();
    assert!(
        matches!(error, CompileError::OutOfMemory { unknowns: 420, needed: Some(n), available } if n > available),
        "{error}"
    );
    assert!(error.to_string().contains("conjugate_gradients"), "{error}");
    // Without a given method, the solver switches to an iterative one.
    agrees(&LinearSolver { memory_gib: Some(NotNegative::literal(1e-5)), ..Default::default() }, 1e-8);
}

#[test]
fn orderings_that_do_not_fit_the_graph_say_what_does() {
    let named = |ordering| refused(LinearSolver { ordering, ..Default::default() });
    let unknown = named(Ordering::First(vec!["dual_quadric".to_owned()]));
    assert!(unknown.contains("`dual_quadric`") && unknown.contains("se3, point3"), "{unknown}");
    let key = named(Ordering::Given(vec![Key::indexed("x", 99)]));
    assert!(key.contains("`x99` is no variable"), "{key}");
    let twice = named(Ordering::Given(vec![Key::indexed("x", 1), Key::indexed("x", 1)]));
    assert!(twice.contains("`x1` is listed twice"), "{twice}");
    let ordering = Ordering::First(vec!["se3".to_owned()]);
    let method = Method::ConjugateGradients;
    let coupled = refused(LinearSolver { ordering, method, ..Default::default() });
    assert!(coupled.contains("are coupled"), "{coupled}");
}
