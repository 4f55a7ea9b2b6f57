//! A session that refuses something is as it was.
use crate::toy::{Apart, At, Careless, Plane};
use manifactor_graph::{Fixed, Graph, Noise, Values};
use manifactor_online::{ChangeError, Session, Settings, UpdateError};

fn chain(n: usize) -> Session {
    let mut session = Session::new(Settings::default()).unwrap();
    for i in 0..n {
        let (mut graph, mut values) = (Graph::new(), Values::new());
        let key = format!("x{i}");
        values.insert(key.as_str(), Plane { x: 0.9 * i as f64, y: 0.0 });
        match i {
            0 => graph.add([key], At { at: [0.0, 0.0] }),
            _ => graph.add([format!("x{}", i - 1), key], Apart { by: [1.0, 0.0] }),
        };
        session.push(&graph, &values).unwrap();
        session.update().unwrap();
    }
    session
}

fn bits(session: &Session) -> Vec<u64> {
    let numbers = |v: &Plane| [v.x.to_bits(), v.y.to_bits()];
    session.estimates().all::<Plane>().flat_map(|(_, v)| numbers(v)).collect()
}

#[test]
fn a_factor_that_is_not_finite_takes_all_changes_back() {
    let mut session = chain(6);
    let before = bits(&session);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("new", Plane { x: -4.0, y: 1.0 });
    graph.add(["x5", "new"], Apart { by: [1.0, 0.0] });
    graph.add(["new"], Careless {});
    let failed = session.push(&graph, &values).unwrap();
    session.fix(&"x2".into(), &Fixed::Whole(true)).unwrap();
    let error = session.update().unwrap_err();
    assert!(matches!(&error, UpdateError::NonFinite { factor, .. } if *factor == failed[1]), "{error}");
    assert!(error.to_string().contains("(new)"), "{error}");
    assert!(session.estimate("new").is_none() && session.entry(failed[1]).is_none());
    assert_eq!(bits(&session), before);
    // and goes on as if nothing had been
    let mut graph = Graph::new();
    graph.add(["x5"], At { at: [6.0, 0.0] });
    session.push(&graph, &Values::new()).unwrap();
    session.update().unwrap();
    let mut other = chain(6);
    other.push(&graph, &Values::new()).unwrap();
    other.update().unwrap();
    assert_eq!(bits(&session), bits(&other));
}

#[test]
fn what_does_not_fit_is_refused_with_its_name() {
    let mut session = chain(3);
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("x1", Plane { x: 0.0, y: 0.0 });
    assert!(matches!(session.push(&graph, &values), Err(ChangeError::Known { key }) if key.as_str() == "x1"));
    graph.add(["x1", "nowhere"], Apart { by: [0.0, 0.0] });
    let error = session.push(&graph, &Values::new()).unwrap_err();
    assert!(error.to_string().contains("there is no variable `nowhere`"), "{error}");
    let mut graph = Graph::new();
    graph.add(["x1"], At { at: [0.0, 0.0] });
    let ids = session.push(&graph, &Values::new()).unwrap();
    assert!(session.set_weight(ids[0], f64::NAN).is_err());
    session.remove(&ids).unwrap();
    assert_eq!(session.remove(&ids), Err(ChangeError::NoFactor { factor: ids[0] }));
    assert_eq!(session.set_weight(ids[0], 1.0), Err(ChangeError::NoFactor { factor: ids[0] }));
    let wrong = Fixed::Directions(vec!["roll".into()]);
    assert!(session.fix(&"x1".into(), &wrong).unwrap_err().to_string().contains("roll"));
    session.update().unwrap();
}

#[test]
fn sums_that_overflow_are_refused_and_taken_back() {
    let mut session = chain(4);
    // what the last update has left
    (0..3).for_each(|_| _ = session.update().unwrap());
    let before = bits(&session);
    let mut graph = Graph::new();
    for _ in 0..3 {
        graph.add(["x3"], At { at: [3.0, 0.0] }).noise(Noise::sigma(1e-154).unwrap());
    }
    let ids = session.push(&graph, &Values::new()).unwrap();
    let error = session.update().unwrap_err();
    assert!(matches!(&error, UpdateError::Overflow { key } if key.as_str() == "x3"), "{error}");
    assert!(session.entry(ids[0]).is_none());
    assert_eq!(bits(&session), before);
    assert_eq!(session.update().unwrap().redone, 0);
}

#[test]
fn settings_outside_their_domain_are_named() {
    let error = Session::new(Settings { bend: f64::NAN, ..Settings::default() }).unwrap_err().to_string();
    assert!(error.contains("`bend`") && error.contains("0 or more"), "{error}");
}
