//! Marginalized variables, and the linear priors that replace their factors.
use crate::history::{Change, History, change};
use crate::toy::{Apart, At, Distance, Logarithm, Plane};
use crate::world::Ahead;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Fixed, Graph, Key, TypeName, Values, Variable};
use manifactor_smoother::{ChangeError, Smoother, SmootherSettings, Span, Window};
use manifactor_solve::{LevenbergMarquardt, Problem, Silent};
use proptest::prelude::*;
use std::num::NonZeroUsize;

/// No relinearization, and every change is propagated: the solution is that of one linear system.
fn linear() -> SmootherSettings {
    SmootherSettings {
        relinearize_every: NonZeroUsize::MAX,
        relinearization_threshold: NotNegative::literal(1e30),
        wildfire_threshold: NotNegative::literal(0.0),
        passes: 0,
        ..SmootherSettings::default()
    }
}

fn numbers(smoother: &Smoother, keys: &[&str]) -> Vec<f64> {
    let origin = |key: &str| smoother.estimate(key).unwrap();
    let plane = |key: &str| origin(key).erased().as_any().downcast_ref::<Plane>().map(|p| vec![p.x, p.y]);
    let space = |key: &str| crate::world::Space { at: [0.0; 3] }.erased().local(&*origin(key)).unwrap();
    keys.iter().flat_map(|key| plane(key).unwrap_or_else(|| space(key))).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { max_global_rejects: 1 << 16, ..ProptestConfig::default() })]
    #[test]
    fn what_stays_is_where_it_was_and_as_sure(
        changes in prop::collection::vec(change(), 1..60),
        leaving in prop::collection::vec(any::<prop::sample::Index>(), 1..5),
    ) {
        let mut history = History::new(linear());
        history.apply_all(&changes);
        let before = history.apply(&Change::Update).unwrap();
        prop_assume!(before.undetermined_directions.is_empty() && before.undetermined_variables.is_empty() && !history.keys.is_empty());
        let gone: Vec<&str> = leaving.iter().map(|i| i.get(&history.keys).as_str()).collect();
        let stay: Vec<&str> = history.keys.iter().map(Key::as_str).filter(|key| !gone.contains(key)).collect();
        let smoother = &mut history.smoother;
        let (estimate, covariance) = (numbers(smoother, &stay), smoother.covariance(&stay).unwrap());
        let cost = smoother.cost();
        smoother.marginalize(&gone).unwrap();
        let report = smoother.update().unwrap();
        prop_assert!(report.undetermined_directions.is_empty() && report.undetermined_variables.is_empty(), "{report:?}");
        prop_assert!(gone.iter().all(|key| smoother.estimate(key).is_none()));
        prop_assert_eq!(smoother.variables(), stay.len());
        let scale = 1.0 + estimate.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        for (one, other) in numbers(smoother, &stay).iter().zip(&estimate) {
            prop_assert!((one - other).abs() < 1e-9 * scale, "{one} {other}");
        }
        let after = smoother.covariance(&stay).unwrap();
        prop_assert!((&after - &covariance).amax() <= 1e-9 * covariance.amax().max(1.0), "{after} {covariance}");
        // the cost of a prior is the minimum over the marginalized variables; the remaining cost is linear,
        // or nearly
        prop_assert!(smoother.cost().is_finite() && cost.is_finite());
    }
}

/// Returns pose `i` of a chain that starts at the origin with steps of one.
pub(crate) fn step(i: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let key = Key::indexed("x", i);
    values.insert(key.clone(), Plane { x: i as f64 + 0.1, y: 0.0 });
    match i {
        0 => graph.add([key], At { at: [0.0, 0.0] }),
        _ => graph.add([Key::indexed("x", i - 1), key], Apart { by: [1.0, 0.0] }),
    };
    (graph, values)
}

fn windowed(poses: usize, keep: &[&str]) -> Smoother {
    let keep = keep.iter().map(|name| TypeName::new(name).unwrap()).collect();
    let window =
        Some(Window { span: Span::Poses(NonZeroUsize::new(poses).unwrap()), keep, keep_keys: vec![] });
    Smoother::new(SmootherSettings { window, ..SmootherSettings::default() })
}

#[test]
fn the_newest_pose_is_as_sure_as_in_a_batch_of_all() {
    let mut smoother = windowed(5, &[]);
    let (mut all, mut values) = (Graph::new(), Values::new());
    for i in 0..40 {
        let (graph, new) = step(i);
        smoother.push(&graph, &new).unwrap();
        let report = smoother.update().unwrap();
        assert_eq!(report.marginalized.len(), usize::from(i >= 5), "{report:?}");
        for entry in graph.factors() {
            all.push(entry.clone());
        }
        values.insert(Key::indexed("x", i), *new.get::<Plane>(format!("x{i}")).unwrap());
    }
    assert_eq!(smoother.variables(), 5);
    let mut batch = Problem::compile(&all, &values).unwrap();
    let keys = ["x39", "x37"];
    let (expected, found) = (batch.joint_covariance(&keys).unwrap(), smoother.covariance(&keys).unwrap());
    assert!((&found - &expected).amax() < 1e-9 * expected.amax(), "{found} {expected}");
    assert!((smoother.get::<Plane>("x39").unwrap().x - 39.0).abs() < 1e-9);
}

#[test]
fn what_is_marginalized_is_named_and_nothing_can_be_added_to_it() {
    let mut smoother = windowed(2, &[]);
    let mut ids = vec![];
    for i in 0..5 {
        let (graph, values) = step(i);
        ids.extend(smoother.push(&graph, &values).unwrap());
        smoother.update().unwrap();
    }
    let removed = |key: &str| ChangeError::Marginalized { key: key.into() };
    let (mut graph, mut values) = (Graph::new(), Values::new());
    graph.add(["x0", "x4"], Apart { by: [4.0, 0.0] });
    assert_eq!(smoother.push(&graph, &values).unwrap_err(), removed("x0"));
    values.insert("x1", Plane { x: 0.0, y: 0.0 });
    assert_eq!(smoother.push(&Graph::new(), &values).unwrap_err(), removed("x1"));
    assert_eq!(smoother.fix(&"x0".into(), &Fixed::Whole(true)).unwrap_err(), removed("x0"));
    assert_eq!(smoother.marginalize(&["x0"]).unwrap_err(), removed("x0"));
    assert_eq!(smoother.remove(&[ids[1]]).unwrap_err(), ChangeError::MarginalizedFactor { factor: ids[1] });
    assert!(smoother.entry(ids[0]).is_none() && smoother.estimate("x0").is_none());
    let held = smoother.fix(&"x3".into(), &Fixed::Whole(true)).unwrap_err();
    assert_eq!(held, ChangeError::FixedLinearization { key: "x3".into() });
    // a variable without factors is removed as well, but its key can be used again
    let bare = |at: f64| {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        graph.add(["b7"], At { at: [at, 0.0] });
        values.insert("b7", Plane { x: 0.0, y: 0.0 });
        (graph, values)
    };
    let (graph, values) = bare(3.0);
    let of_bare = smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    smoother.remove(&of_bare).unwrap();
    smoother.marginalize(&["b7"]).unwrap();
    smoother.update().unwrap();
    let (graph, values) = bare(5.0);
    assert_eq!(smoother.push(&graph, &Values::new()).unwrap_err(), removed("b7"));
    smoother = Smoother::load(&smoother.save().unwrap()).unwrap();
    smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    smoother = Smoother::load(&smoother.save().unwrap()).unwrap();
    assert!((smoother.get::<Plane>("b7").unwrap().x - 5.0).abs() < 1e-9);
    smoother.marginalize(&["b7"]).unwrap();
    smoother.update().unwrap();
    assert_eq!(smoother.push(&graph, &values).unwrap_err(), removed("b7"));
    smoother.update().unwrap();
}

#[test]
fn what_is_kept_never_leaves() {
    let by_key =
        Window { keep_keys: vec!["lamp".into()], ..Window::from(Span::Poses(NonZeroUsize::new(3).unwrap())) };
    let by_key = SmootherSettings { window: Some(by_key), ..SmootherSettings::default() };
    for smoother in [windowed(3, &["toy_space"]), Smoother::new(by_key)] {
        the_lamp_stays(smoother);
    }
}

fn the_lamp_stays(mut smoother: Smoother) {
    let mut values = Values::new();
    values.insert("lamp", crate::world::Space { at: [0.0; 3] });
    let mut graph = Graph::new();
    graph.add(["lamp"], crate::world::Near { at: [1.0, 2.0, 3.0] });
    smoother.push(&graph, &values).unwrap();
    for i in 0..20 {
        let (mut graph, values) = step(i);
        graph.add([Key::indexed("x", i), "lamp".into()], crate::world::Shadow { by: [i as f64, 0.0] });
        smoother.push(&graph, &values).unwrap();
        smoother.update().unwrap();
    }
    assert_eq!(smoother.variables(), 4);
    assert!(smoother.estimate("lamp").is_some());
}

#[test]
fn a_factor_that_takes_no_part_is_dropped_and_named() {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for (key, x) in [("a", 2.0), ("b", 1.0), ("c", 4.0)] {
        values.insert(key, Plane { x, y: 0.0 });
        graph.add([key], At { at: [x, 0.0] });
    }
    // `b` is not ahead of `a`, and `d` would need the logarithm of a negative number
    graph.add(["a", "b"], Ahead { by: [1.0, 0.0] });
    graph.add(["a", "c"], Distance { by: 2.0 });
    values.insert("d", Plane { x: -1.0, y: 0.0 });
    graph.add(["d"], Logarithm { to: 1.0 });
    graph.add(["a", "d"], Distance { by: 3.0 });
    let ids = smoother.push(&graph, &values).unwrap();
    assert_eq!(smoother.update().unwrap().undetermined_variables[..], [Key::from("d")]);
    smoother.marginalize(&["a"]).unwrap();
    let report = smoother.update().unwrap();
    assert_eq!(
        (&report.marginalized[..], &report.dropped[..]),
        (&[Key::from("a")][..], &[ids[3], ids[6]][..])
    );
    assert_eq!(report.inactive, 1);
}

#[test]
fn memory_stays_and_a_window_goes_on_after_a_restart() {
    let mut smoother = windowed(10, &[]);
    let mut bytes = vec![];
    for i in 0..600 {
        let (graph, values) = step(i);
        smoother.push(&graph, &values).unwrap();
        smoother.update().unwrap();
        if i % 100 == 99 {
            bytes.push((smoother.bytes(), smoother.save().unwrap().len()));
            smoother = Smoother::load(&smoother.save().unwrap()).unwrap();
        }
    }
    let (first, last) = (bytes[1], bytes[5]);
    assert!(last.0 <= first.0 + first.0 / 10 && last.1 <= first.1 + first.1 / 10, "{bytes:?}");
}

#[test]
fn a_batch_solve_knows_what_has_left() {
    let mut smoother = windowed(4, &[]);
    for i in 0..20 {
        let (mut graph, mut values) = step(i);
        values.insert(Key::indexed("x", i), Plane { x: 1.1 * i as f64 + 0.05, y: 0.0 });
        if i > 0 {
            graph.add([Key::indexed("x", i - 1), Key::indexed("x", i)], Distance { by: 1.2 });
        }
        smoother.push(&graph, &values).unwrap();
        smoother.update().unwrap();
    }
    for _ in 0..20 {
        smoother.update().unwrap();
    }
    let finished = smoother.finish(&LevenbergMarquardt::default(), &mut Silent).unwrap();
    let (cost, best) = (smoother.cost(), finished.outcome.final_cost);
    assert!((cost - best).abs() < 1e-6 * best, "{cost} {best}");
    let (x, batch): (Plane, &Plane) = (smoother.get("x19").unwrap(), finished.values.get("x19").unwrap());
    assert!((x.x - batch.x).abs() < 1e-6, "{x:?} {batch:?}");
    // 19 distances of 1.2 and 19 steps of 1 along a line, and the origin
    assert!((x.x - 19.0 * 1.1).abs() < 1e-6, "{x:?}");
}

#[test]
fn a_name_that_is_used_again_is_saved_once() {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let push = |smoother: &mut Smoother, key: &str| {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        graph.add([key], At { at: [1.0, 2.0] });
        values.insert(key, Plane { x: 0.0, y: 0.0 });
        let ids = smoother.push(&graph, &values).unwrap();
        smoother.update().unwrap();
        ids
    };
    let ids = ["b1", "b2", "stays"].map(|key| push(&mut smoother, key));
    for (key, ids) in ["b1", "b2"].into_iter().zip(&ids) {
        smoother.remove(ids).unwrap();
        smoother.marginalize(&[key]).unwrap();
        smoother.update().unwrap();
    }
    for key in ["b1", "b3", "b2"] {
        push(&mut smoother, key);
        let mut loaded = Smoother::load(&smoother.save().unwrap()).unwrap();
        assert_eq!(loaded.variables(), smoother.variables());
        assert_eq!(loaded.cost().to_bits(), smoother.cost().to_bits());
    }
}
