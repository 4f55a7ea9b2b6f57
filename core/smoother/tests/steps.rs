//! Steps that are too long, and steps out of a domain.
use crate::history::bits;
use crate::toy::{At, Logarithm, Plane, Valley};
use crate::world::Space;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::loss::Cauchy;
use manifactor_graph::{Fixed, Graph, Key, Noise, Values};
use manifactor_smoother::{ChangeError, Smoother, SmootherSettings};
use manifactor_solve::{LevenbergMarquardt, Silent};
use std::num::NonZeroUsize;

#[test]
fn a_step_that_raises_the_cost_is_damped() {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.2, y: 1.0 });
    graph.add(["p"], Valley {});
    smoother.push(&graph, &values).unwrap();
    // Gauss-Newton goes to (1, −3.84) at once, and the cost there is a hundred times as large
    let report = smoother.update().unwrap();
    assert!(report.damped > 0 && !report.solved_batch, "{report:?}");
    assert!(smoother.cost() < 12.1, "{}", smoother.cost());
    for _ in 0..60 {
        smoother.update().unwrap();
    }
    assert!(smoother.cost() < 1e-6, "{}", smoother.cost());
    // damping disappears when it is no longer needed: covariances are those without damping
    let one = smoother.covariance(&["p"]).unwrap();
    let mut fresh = Smoother::new(SmootherSettings::default());
    fresh.push(&smoother.graph().0, &smoother.estimates()).unwrap();
    assert_eq!(fresh.update().unwrap().damped, 0);
    // except for slightly different linearization points
    assert!((&one - fresh.covariance(&["p"]).unwrap()).amax() < 0.05 * one.amax());
}

#[test]
fn an_update_starts_at_the_estimate_that_a_caller_sets() {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.2, y: 1.0 });
    graph.add(["p"], Valley {});
    smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    assert!(smoother.cost() > 1.0);
    smoother.move_to("p", &Plane { x: 1.01, y: 1.02 }).unwrap();
    assert_eq!(smoother.update().unwrap().relinearized, 1);
    assert!(smoother.cost() < 1e-3, "{}", smoother.cost());
    // errors change nothing
    let before = bits(&smoother);
    let none = smoother.move_to("q", &Plane { x: 0.0, y: 0.0 }).unwrap_err();
    let other = smoother.move_to("p", &Space { at: [0.0; 3] }).unwrap_err();
    let infinite = smoother.move_to("p", &Plane { x: f64::INFINITY, y: 0.0 }).unwrap_err();
    assert!(matches!(none, ChangeError::NoVariable { .. }) && matches!(other, ChangeError::Type { .. }));
    assert!(infinite.to_string().contains("finite"), "{infinite}");
    assert_eq!(bits(&smoother), before);
}

#[test]
fn a_linearization_stays_in_the_domain_of_its_factors() {
    let mut smoother = Smoother::new(SmootherSettings {
        relinearize_every: NonZeroUsize::MIN,
        ..SmootherSettings::default()
    });
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 9.0, y: 0.0 });
    graph.add(["p"], Logarithm { to: 0.5 }).noise(Noise::sigma(0.01).unwrap());
    graph.add(["p"], At { at: [0.0, 0.0] }).noise(Noise::sigma(100.0).unwrap());
    smoother.push(&graph, &values).unwrap();
    for _ in 0..30 {
        // from x = 9, a full step leads to x < 0, outside of the domain of the logarithm
        assert_eq!(smoother.update().unwrap().inactive, 0);
    }
    assert!((smoother.get::<Plane>("p").unwrap().x - 0.5).abs() < 1e-3);
}

#[test]
fn a_pushed_graph_holds_in_addition_to_what_is_held() {
    for in_two_updates in [false, true] {
        let mut smoother = Smoother::new(SmootherSettings::default());
        let (mut graph, mut values) = (Graph::new(), Values::new());
        values.insert("p", Plane { x: 2.0, y: 1.0 });
        graph.add(["p"], At { at: [2.0, 1.0] });
        graph.fix("p");
        smoother.push(&graph, &values).unwrap();
        if in_two_updates {
            smoother.update().unwrap();
        }
        let mut more = Graph::new();
        more.add(["p"], At { at: [9.0, 9.0] }).noise(Noise::sigma(1e-3).unwrap());
        more.fix_directions("p", &["x"]);
        smoother.push(&more, &Values::new()).unwrap();
        smoother.update().unwrap();
        let p = smoother.get::<Plane>("p").unwrap();
        assert_eq!((p.x, p.y), (2.0, 1.0));
        assert_eq!(smoother.graph().0.fixed().get(&Key::from("p")), Some(&Fixed::Whole(true)));
    }
}

#[test]
fn what_is_held_stays_at_the_estimate_and_moves_when_it_is_freed() {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 0.0, y: 0.0 });
    graph.add(["p"], At { at: [1.0, 1.0] });
    smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    smoother.fix(&"p".into(), &Fixed::Directions(vec!["x".into()])).unwrap();
    let mut graph = Graph::new();
    graph.add(["p"], At { at: [3.0, 3.0] });
    smoother.push(&graph, &Values::new()).unwrap();
    smoother.update().unwrap();
    let p: Plane = smoother.get("p").unwrap();
    assert!((p.x - 1.0).abs() < 1e-12 && (p.y - 2.0).abs() < 1e-12, "{p:?}");
    assert_eq!(smoother.covariance(&["p"]).unwrap()[(0, 0)], 0.0);
    smoother.fix(&"p".into(), &Fixed::Whole(true)).unwrap();
    smoother.update().unwrap();
    assert_eq!(smoother.covariance(&["p"]).unwrap().amax(), 0.0);
    smoother.fix(&"p".into(), &Fixed::Whole(false)).unwrap();
    smoother.update().unwrap();
    assert!((smoother.get::<Plane>("p").unwrap().x - 2.0).abs() < 1e-12);
}

#[test]
fn losses_and_weights_end_where_a_batch_does() {
    let mut smoother = Smoother::new(SmootherSettings {
        relinearize_every: NonZeroUsize::MIN,
        relinearization_threshold: NotNegative::literal(0.0),
        wildfire_threshold: NotNegative::literal(0.0),
        ..SmootherSettings::default()
    });
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: 0.0, y: 0.0 });
    for x in [0.0, 0.2, 0.1, 9.0] {
        graph.add(["p"], At { at: [x, -x] }).loss(Cauchy::default());
    }
    let ids = smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    smoother.set_weight(ids[1], 2.5).unwrap();
    for _ in 0..80 {
        smoother.update().unwrap();
    }
    let finished = smoother.finish(&LevenbergMarquardt::default(), &mut Silent).unwrap();
    let (p, batch): (Plane, &Plane) = (smoother.get("p").unwrap(), finished.values.get("p").unwrap());
    assert!((p.x - batch.x).abs() < 1e-4 && (smoother.cost() - finished.outcome.final_cost).abs() < 1e-8);
}

#[test]
fn damped_steps_lead_along_a_narrow_valley() {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.2, y: 1.0 });
    // so narrow that Gauss-Newton steps leave it repeatedly
    graph.add(["p"], Valley {}).noise(Noise::sigmas(&[1e-2, 1.0]).unwrap());
    let ids = smoother.push(&graph, &values).unwrap();
    let mut updates = 0;
    while updates == 0 || smoother.cost() > 0.1 {
        // an update without changes would solve a batch
        smoother.set_weight(ids[0], 1.0).unwrap();
        assert!(!smoother.update().unwrap().solved_batch && updates < 600, "{}", smoother.cost());
        updates += 1;
    }
}

#[test]
fn a_factor_that_would_leave_its_domain_does_not_stop_others() {
    let patient = SmootherSettings {
        relinearize_every: NonZeroUsize::MIN,
        relinearization_threshold: NotNegative::literal(1e-4),
        immediate_relinearization_factor: NotNegative::literal(1e9),
        ..SmootherSettings::default()
    };
    let mut smoother = Smoother::new(patient);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    // the first step leads to x ≈ −8000, and even an eighth of it is too long
    values.insert("out", Plane { x: 1000.0, y: 0.0 });
    graph.add(["out"], Logarithm { to: 0.1 }).noise(Noise::sigma(1e-3).unwrap());
    graph.add(["out"], At { at: [-1e5, 0.0] }).noise(Noise::sigma(1e3).unwrap());
    values.insert("in", Plane { x: 9.0, y: 0.0 });
    graph.add(["in"], Logarithm { to: 5.0 });
    graph.add(["in"], At { at: [9.0, 0.0] }).noise(Noise::sigma(100.0).unwrap());
    smoother.push(&graph, &values).unwrap();
    let report = smoother.update().unwrap();
    assert_eq!(report.relinearized, 0, "the first update has nothing to linearize anew");
    let report = smoother.update().unwrap();
    assert!(report.relinearized >= 1 && report.inactive == 0, "{report:?}");
    for _ in 0..20 {
        assert_eq!(smoother.update().unwrap().inactive, 0);
    }
    assert!((smoother.get::<Plane>("in").unwrap().x - 5.0).abs() < 0.1);
}
