//! A failed call leaves the smoother unchanged.
use crate::toy::{Apart, At, Careless, Plane};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Fixed, Graph, Noise, Values};
use manifactor_smoother::{ChangeError, FactorId, Smoother, SmootherSettings, Span, UpdateError, Window};
use std::num::NonZeroUsize;

fn chain(n: usize) -> Smoother {
    let mut smoother = Smoother::new(SmootherSettings::default());
    for i in 0..n {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        let key = format!("x{i}");
        values.insert(key.as_str(), Plane { x: 0.9 * i as f64, y: 0.0 });
        match i {
            0 => graph.add([key], At { at: [0.0, 0.0] }),
            _ => graph.add([format!("x{}", i - 1), key], Apart { by: [1.0, 0.0] }),
        };
        smoother.push(&graph, &values).unwrap();
        smoother.update().unwrap();
    }
    smoother
}

fn bits(smoother: &Smoother) -> Vec<u64> {
    let numbers = |v: &Plane| [v.x.to_bits(), v.y.to_bits()];
    smoother.estimates().all::<Plane>().flat_map(|(_, v)| numbers(v)).collect()
}

#[test]
fn a_factor_that_is_not_finite_takes_all_changes_back() {
    let mut smoother = chain(6);
    let before = bits(&smoother);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("new", Plane { x: -4.0, y: 1.0 });
    graph.add(["x5", "new"], Apart { by: [1.0, 0.0] });
    graph.add(["new"], Careless {});
    let failed = smoother.push(&graph, &values).unwrap();
    smoother.fix(&"x2".into(), &Fixed::Whole(true)).unwrap();
    let error = smoother.update().unwrap_err();
    assert!(matches!(&error, UpdateError::NonFinite { factor, .. } if *factor == failed[1]), "{error}");
    assert!(error.to_string().contains("(new)"), "{error}");
    assert!(smoother.estimate("new").is_none() && smoother.entry(failed[1]).is_none());
    assert_eq!(bits(&smoother), before);
    // it continues like a smoother without the failed update
    let mut graph = Graph::new();
    graph.add(["x5"], At { at: [6.0, 0.0] });
    smoother.push(&graph, &Values::new()).unwrap();
    smoother.update().unwrap();
    let mut other = chain(6);
    other.push(&graph, &Values::new()).unwrap();
    other.update().unwrap();
    assert_eq!(bits(&smoother), bits(&other));
}

#[test]
fn what_does_not_fit_is_refused_with_its_name() {
    let mut smoother = chain(3);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("x1", Plane { x: 0.0, y: 0.0 });
    assert!(
        matches!(smoother.push(&graph, &values), Err(ChangeError::Known { key }) if key.as_str() == "x1")
    );
    graph.add(["x1", "nowhere"], Apart { by: [0.0, 0.0] });
    let error = smoother.push(&graph, &Values::new()).unwrap_err();
    assert!(error.to_string().contains("there is no variable `nowhere`"), "{error}");
    let mut graph = Graph::new();
    graph.add(["x1"], At { at: [0.0, 0.0] });
    let ids = smoother.push(&graph, &Values::new()).unwrap();
    assert!(smoother.set_weight(ids[0], f64::NAN).is_err());
    smoother.remove(&ids).unwrap();
    assert_eq!(smoother.remove(&ids), Err(ChangeError::NoFactor { factor: ids[0] }));
    assert_eq!(smoother.set_weight(ids[0], 1.0), Err(ChangeError::NoFactor { factor: ids[0] }));
    let wrong = Fixed::Directions(vec!["roll".into()]);
    assert!(smoother.fix(&"x1".into(), &wrong).unwrap_err().to_string().contains("roll"));
    smoother.update().unwrap();
}

#[test]
fn sums_that_overflow_are_refused_and_taken_back() {
    let mut smoother = chain(4);
    // finish the work that the last update has left
    (0..3).for_each(|_| _ = smoother.update().unwrap());
    let before = bits(&smoother);
    let mut graph = Graph::new();
    for _ in 0..3 {
        graph.add(["x3"], At { at: [3.0, 0.0] }).noise(Noise::sigma(1e-154).unwrap());
    }
    let ids = smoother.push(&graph, &Values::new()).unwrap();
    let error = smoother.update().unwrap_err();
    assert!(matches!(&error, UpdateError::Overflow { key } if key.as_str() == "x3"), "{error}");
    assert!(smoother.entry(ids[0]).is_none());
    assert_eq!(bits(&smoother), before);
    assert_eq!(smoother.update().unwrap().refactorized, 0);
}

#[test]
fn settings_outside_their_domain_are_refused() {
    for settings in [
        r#"{"relinearization_threshold": -1}"#,
        r#"{"relinearize_every": 0}"#,
        r#"{"budget": -1}"#,
        r#"{"window": {"poses": 0}}"#,
    ] {
        assert!(serde_json::from_str::<SmootherSettings>(settings).is_err(), "{settings}");
    }
}

/// Creates two variables whose entries of H and g are close to the largest f64. Their sums are only finite as
/// long as both are present.
fn close_to_overflow() -> (Smoother, Vec<FactorId>) {
    let (mut smoother, ids) = pushed_close_to_overflow(never_linearized_anew());
    smoother.update().unwrap();
    (smoother, ids)
}

fn never_linearized_anew() -> SmootherSettings {
    SmootherSettings {
        relinearize_every: NonZeroUsize::MAX,
        relinearization_threshold: NotNegative::literal(1e300),
        wildfire_threshold: NotNegative::literal(0.0),
        passes: 0,
        ..SmootherSettings::default()
    }
}

/// Creates this smoother before the first update.
fn pushed_close_to_overflow(settings: SmootherSettings) -> (Smoother, Vec<FactorId>) {
    let mut smoother = Smoother::new(settings);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    // H is 5e307 for each factor
    let strong = || Noise::sigma(2.0_f64.sqrt() * 1e-154).unwrap();
    values.insert("a", Plane { x: 0.0, y: 0.0 });
    values.insert("b", Plane { x: 0.0, y: 0.0 });
    values.insert("c", Plane { x: 0.0, y: 0.0 });
    graph.add(["a"], At { at: [0.0, 0.0] }).noise(strong());
    graph.add(["b"], At { at: [-1.8, 0.0] }).noise(strong());
    graph.add(["a", "b"], Apart { by: [1.8, 0.0] }).noise(strong());
    graph.add(["b"], At { at: [-1.8, 0.0] }).noise(strong());
    graph.add(["c"], At { at: [1.0, 0.0] });
    graph.add(["a", "c"], Apart { by: [1.0, 0.0] });
    let ids = smoother.push(&graph, &values).unwrap();
    (smoother, ids)
}

#[test]
fn variables_stay_if_their_linear_prior_overflows() {
    let (mut smoother, ids) = close_to_overflow();
    let (before, cost) = (bits(&smoother), smoother.cost());
    let saved = |smoother: &Smoother| Smoother::load(&smoother.save().unwrap()).unwrap();
    smoother.marginalize(&["c", "a"]).unwrap();
    let report = smoother.update().unwrap();
    assert_eq!(report.not_marginalized[..], ["c".into(), "a".into()]);
    assert!(report.marginalized.is_empty() && report.dropped.is_empty());
    assert!(ids.iter().all(|id| smoother.entry(*id).is_some()));
    assert_eq!((bits(&smoother), smoother.cost().to_bits()), (before, cost.to_bits()));
    assert_eq!(bits(&saved(&smoother)), bits(&smoother));
    // it continues as if the marginalization had not been requested
    let mut graph = Graph::new();
    graph.add(["c"], At { at: [3.0, 0.0] });
    let (mut other, _) = close_to_overflow();
    for smoother in [&mut smoother, &mut other] {
        smoother.update().unwrap();
        smoother.push(&graph, &Values::new()).unwrap();
        smoother.update().unwrap();
    }
    assert_eq!(bits(&smoother), bits(&other));
    // `c` alone does not overflow
    smoother.marginalize(&["c"]).unwrap();
    assert_eq!(smoother.update().unwrap().marginalized[..], ["c".into()]);
}

#[test]
fn a_window_tries_again_what_could_not_leave() {
    let window = Some(Window { span: Span::Poses(NonZeroUsize::MIN), keep: vec![], keep_keys: vec![] });
    let (mut smoother, ids) =
        pushed_close_to_overflow(SmootherSettings { window, ..never_linearized_anew() });
    assert_eq!(smoother.update().unwrap().not_marginalized[..], ["a".into(), "b".into()]);
    assert!(smoother.update().unwrap().marginalized.is_empty());
    // without the strong factors, nothing overflows
    smoother.remove(&ids[..4]).unwrap();
    let report = smoother.update().unwrap();
    assert_eq!((report.marginalized.len(), report.not_marginalized.len()), (2, 0), "{report:?}");
}

#[test]
fn variables_stay_if_the_sums_without_them_overflow() {
    let mut smoother = Smoother::new(never_linearized_anew());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let strong = || Noise::sigma(2.0_f64.sqrt() * 1e-154).unwrap();
    values.insert("a", Plane { x: 0.0, y: 0.0 });
    values.insert("b", Plane { x: 0.0, y: 0.0 });
    // the gradient of `b` is only finite together with the term of `a`; no other factor holds `a`, so no
    // prior remains
    graph.add(["b"], At { at: [-1.8, 0.0] }).noise(strong());
    graph.add(["a", "b"], Apart { by: [1.8, 0.0] }).noise(strong());
    graph.add(["b"], At { at: [-1.8, 0.0] }).noise(strong());
    // many neighbours, so that `a` is eliminated after b
    for key in ["d", "e", "f", "g"] {
        values.insert(key, Plane { x: 0.0, y: 0.0 });
        graph.add(["a", key], Apart { by: [1.0, 0.0] });
        graph.add([key], At { at: [1.0, 0.0] });
    }
    let ids = smoother.push(&graph, &values).unwrap();
    smoother.update().unwrap();
    let (before, cost) = (bits(&smoother), smoother.cost());
    smoother.marginalize(&["a"]).unwrap();
    let report = smoother.update().unwrap();
    assert_eq!(report.not_marginalized[..], ["a".into()], "{report:?}");
    assert!(ids.iter().all(|id| smoother.entry(*id).is_some()));
    assert_eq!((bits(&smoother), smoother.cost().to_bits()), (before, cost.to_bits()));
    let loaded = Smoother::load(&smoother.save().unwrap()).unwrap();
    assert_eq!(bits(&loaded), bits(&smoother));
}
