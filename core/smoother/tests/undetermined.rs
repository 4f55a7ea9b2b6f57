//! Undetermined variables.
use crate::toy::{At, Distance, Logarithm, Plane};
use crate::world::Ahead;
use manifactor_graph::{Graph, Key, Noise, Values};
use manifactor_smoother::{Smoother, SmootherCovarianceError, SmootherSettings};
use std::num::NonZeroUsize;

fn smoother(priors: &[&str]) -> Smoother {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for (i, key) in priors.iter().enumerate() {
        let x = i as f64;
        values.insert(*key, Plane { x: x + 0.1, y: x * x });
        graph.add([*key], At { at: [x, x * x] });
    }
    smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    smoother
}

#[test]
fn a_point_that_ranges_do_not_determine_waits_for_another() {
    let mut smoother = smoother(&["a", "b", "c"]);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("point", Plane { x: 3.0, y: 0.5 });
    graph.add(["a", "point"], Distance { by: 3.0 });
    smoother.push(&graph, &values).unwrap();
    let report = smoother.update().unwrap();
    assert_eq!(report.undetermined_variables[..], [Key::from("point")]);
    assert!(report.undetermined_directions.is_empty());
    assert!(matches!(
        smoother.covariance(&["point"]),
        Err(SmootherCovarianceError::UndeterminedVariable { .. })
    ));
    // its range carries no information on `a`
    assert!(smoother.get::<Plane>("a").unwrap().x.abs() < 1e-12);
    let mut graph = Graph::new();
    graph.add(["b", "point"], Distance { by: 2.0 });
    let ids = smoother.push(&graph, &Values::new()).unwrap();
    assert!(smoother.update().unwrap().undetermined_variables.is_empty());
    assert!(smoother.covariance(&["point", "a"]).is_ok());
    smoother.remove(&ids).unwrap();
    assert_eq!(smoother.update().unwrap().undetermined_variables[..], [Key::from("point")]);
}

#[test]
fn a_covariance_that_is_too_large_for_a_number_is_an_error() {
    let mut smoother = smoother(&["a"]);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for i in 0..6usize {
        let (key, before) =
            (Key::indexed("p", i), i.checked_sub(1).map_or("a".into(), |i| Key::indexed("p", i)));
        values.insert(key.clone(), Plane { x: 0.0, y: 0.0 });
        // information just above the smallest normal f64
        graph.add([before, key], crate::toy::Apart { by: [0.0, 0.0] }).noise(Noise::sigma(6.5e153).unwrap());
    }
    smoother.push(&graph, &values).unwrap();
    assert!(smoother.update().unwrap().undetermined_variables.is_empty());
    assert!(smoother.covariance(&["a", "p1"]).is_ok());
    let error = smoother.covariance(&["a", "p5"]).unwrap_err();
    assert_eq!(error, SmootherCovarianceError::Overflow { key: "p5".into() });
}

#[test]
fn what_is_tied_to_itself_alone_is_undetermined_and_named() {
    let mut smoother = smoother(&["a"]);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 0.0, y: 0.0 });
    values.insert("q", Plane { x: 0.0, y: 0.0 });
    graph.add(["p", "q"], crate::toy::Apart { by: [1.0, 2.0] });
    smoother.push(&graph, &values).unwrap();
    let report = smoother.update().unwrap();
    assert!(report.undetermined_variables.is_empty());
    let names: Vec<&str> = report.undetermined_directions.iter().map(|(_, name)| *name).collect();
    assert_eq!(names, ["x", "y"]);
    let (p, q) = (smoother.get::<Plane>("p").unwrap(), smoother.get::<Plane>("q").unwrap());
    assert!((q.x - p.x - 1.0).abs() < 1e-12 && (q.y - p.y - 2.0).abs() < 1e-12);
    assert!(matches!(
        smoother.covariance(&["p"]),
        Err(SmootherCovarianceError::UndeterminedDirection { .. })
    ));
    let mut graph = Graph::new();
    graph.add(["p"], At { at: [5.0, 5.0] });
    smoother.push(&graph, &Values::new()).unwrap();
    assert!(smoother.update().unwrap().undetermined_directions.is_empty());
    assert!((smoother.get::<Plane>("q").unwrap().y - 7.0).abs() < 1e-9);
}

#[test]
fn two_points_that_turn_about_a_third_are_named_at_every_angle() {
    let update = |angle: f64, sigma: Option<f64>| {
        let mut smoother = smoother(&["a"]);
        let (mut graph, mut values) = (Graph::new(), Values::new());
        let at = |distance: f64| Plane { x: 0.1 + distance * angle.cos(), y: distance * angle.sin() };
        values.insert("p", Plane { x: 1.0, ..at(2.0) });
        values.insert("q", at(2.0));
        graph.add(["p", "q"], crate::toy::Apart { by: [0.7, 1.0] });
        graph.add(["p", "q"], Distance { by: 1.0 });
        graph.add(["a", "q"], Distance { by: 2.0 });
        if let Some(sigma) = sigma {
            graph.add(["p"], At { at: [1.0, 1.0] }).noise(Noise::sigma(sigma).unwrap());
        }
        smoother.push(&graph, &values).unwrap();
        smoother.update().unwrap().undetermined_directions.len()
    };
    for i in 0..360 {
        let angle = f64::from(i).to_radians() + 1e-3;
        assert_eq!(update(angle, None), 1, "{i}°");
        assert_eq!(update(angle, Some(1e4)), 0, "{i}°");
    }
}

#[test]
fn a_factor_that_is_not_defined_leaves_what_hangs_on_it_alone_undetermined() {
    let mut smoother = smoother(&["a"]);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.0, y: 0.0 });
    graph.add(["p"], Logarithm { to: 2.0 });
    smoother.push(&graph, &values).unwrap();
    let report = smoother.update().unwrap();
    assert_eq!((&report.undetermined_variables[..], report.inactive), (&[Key::from("p")][..], 1));
}

#[test]
fn an_undetermined_variable_enters_when_its_factors_become_defined_elsewhere() {
    let mut smoother = Smoother::new(SmootherSettings {
        relinearize_every: NonZeroUsize::MIN,
        passes: 0,
        ..SmootherSettings::default()
    });
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("a", Plane { x: 3.0, y: 0.0 });
    values.insert("b", Plane { x: 1.0, y: 0.0 });
    graph.add(["a"], At { at: [0.0, 0.0] });
    graph.add(["a", "b"], Ahead { by: [1.0, 0.0] });
    smoother.push(&graph, &values).unwrap();
    // b − a has no logarithm until `a` is linearized at its estimate
    let report = smoother.update().unwrap();
    assert_eq!((&report.undetermined_variables[..], report.inactive), (&[Key::from("b")][..], 1));
    smoother.update().unwrap();
    let report = smoother.update().unwrap();
    assert!(report.undetermined_variables.is_empty() && report.inactive == 0, "{report:?}");
}
