//! Landmarks without names, in a world that is linear: a sighting is where the landmark is from the pose.
use crate::world::{Beyond, Near, Space};
use manifactor_graph::{FactorEntry, Graph, Key, Noise, Values};
use manifactor_online::{
    Given, InnovationError, LandmarkSettings, Landmarks, Session, Settings, Sighting, SightingError,
};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;
use std::sync::Arc;

const SIGMA: f64 = 0.1;

/// A pose, known this well.
fn put(session: &mut Session, key: &str, at: [f64; 3], sigma: f64) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert(key, Space { at });
    graph.add([key], Near { at }).noise(Noise::sigma(sigma).unwrap());
    session.push(&graph, &values).unwrap();
    session.update().unwrap();
}

/// What a pose that is believed to be at `from` sees.
fn seen(from: [f64; 3], by: [f64; 3]) -> Sighting {
    Sighting {
        factor: Arc::new(Beyond { by }),
        noise: Noise::sigma(SIGMA).unwrap(),
        loss: None,
        landmark: Box::new(Space { at: std::array::from_fn(|i| from[i] + by[i]) }),
    }
}

fn entry(from: &str, to: &str, by: [f64; 3]) -> FactorEntry {
    let Sighting { factor, noise, loss, .. } = seen([0.0; 3], by);
    FactorEntry { keys: vec![from.into(), to.into()], name: None, factor, noise, loss }
}

/// Two landmarks, a metre apart along x, that a pose at 0 has seen.
fn two(settings: LandmarkSettings) -> (Session, Landmarks) {
    let mut session = Session::new(Settings::default()).unwrap();
    let mut landmarks = Landmarks::new("l", settings).unwrap();
    put(&mut session, "x0", [0.0; 3], 0.01);
    let both = [[2.0, 0.0, 0.0], [3.0, 0.0, 0.0]].map(|by| seen([0.0; 3], by));
    let named = landmarks.see(&mut session, &"x0".into(), &both).unwrap();
    session.update().unwrap();
    assert_eq!(named.names, [Some(Key::from("l0")), Some("l1".into())]);
    (session, landmarks)
}

#[test]
fn an_innovation_has_the_joint_covariance_and_the_noise() {
    let (mut session, _) = two(LandmarkSettings::default());
    put(&mut session, "x1", [0.5, 0.0, 0.0], 0.3);
    let factors = [entry("x1", "l0", [1.6, 0.1, 0.0]), entry("x1", "l1", [2.5, 0.0, -0.2])];
    let innovation = session.innovation(&factors).unwrap();
    let mut given = Given::nothing(&innovation);
    let [first, second] = [given.push(0), given.push(1)];
    // r = l - x - by of both
    let sigma = session.covariance(&["x1", "l0", "l1"]).unwrap();
    let j = DMatrix::from_fn(6, 9, |r, c| match c {
        0..3 if r % 3 == c => -1.0,
        3.. if c == r + 3 => 1.0,
        _ => 0.0,
    });
    let s = &j * sigma * j.transpose() + DMatrix::identity(6, 6) * SIGMA * SIGMA;
    let r = DVector::from_vec(vec![-0.1, -0.1, 0.0, 0.0, 0.0, 0.2]);
    let squared = r.dot(&s.clone().lu().solve(&r).unwrap());
    let volume = s.determinant().ln() + 6.0 * TAU.ln();
    assert!((first.squared + second.squared - squared).abs() < 1e-9, "{first:?} {second:?} {squared}");
    assert!((first.volume + second.volume - volume).abs() < 1e-9, "{first:?} {second:?} {volume}");
    // given the first, the second is less of a surprise than alone
    given.pop();
    given.pop();
    let alone = given.push(1);
    assert!(second.volume < alone.volume - 1.0, "{second:?} {alone:?}");
}

#[test]
fn sightings_of_a_pose_are_put_to_landmarks_together() {
    let (mut session, mut landmarks) = two(LandmarkSettings::default());
    // the pose is truly at 0.9, so that alone the first would be of what is not there, and the second of the first
    put(&mut session, "x1", [0.0; 3], 0.5);
    let both = [[1.1, 0.0, 0.0], [2.1, 0.0, 0.0]].map(|by| seen([0.0; 3], by));
    let named = landmarks.see(&mut session, &"x1".into(), &both).unwrap();
    assert_eq!(named.names, [Some(Key::from("l0")), Some("l1".into())]);
    session.update().unwrap();
    let pose: Space = session.get("x1").unwrap();
    assert!((pose.at[0] - 0.9).abs() < 0.1, "{pose:?}");
}

#[test]
fn what_is_far_is_new_and_what_is_between_is_left_out() {
    for (odds, expected) in [(3.0, None), (1.0, Some("l0"))] {
        let (mut session, mut landmarks) = two(LandmarkSettings { odds, ..LandmarkSettings::default() });
        put(&mut session, "x1", [0.0; 3], 0.5);
        let seen = [seen([0.0; 3], [2.49, 0.0, 0.0]), seen([0.0; 3], [9.0, 4.0, 0.0])];
        let named = landmarks.see(&mut session, &"x1".into(), &seen).unwrap();
        assert_eq!(named.names, [expected.map(Key::from), Some("l2".into())]);
        session.update().unwrap();
        assert_eq!(landmarks.keys().count(), 3);
    }
}

#[test]
fn landmarks_that_turn_out_to_be_one_are_merged() {
    let (mut session, mut landmarks) = two(LandmarkSettings::default());
    // a pose that is sure of being elsewhere sees the first anew; then it is known where it was
    put(&mut session, "x1", [0.0, 5.0, 0.0], 0.5);
    let named = landmarks.see(&mut session, &"x1".into(), &[seen([0.0, 5.0, 0.0], [2.0, 0.0, 0.0])]).unwrap();
    assert_eq!(named.names, [Some(Key::from("l2"))]);
    let mut graph = Graph::new();
    graph.add(["x0", "x1"], Beyond { by: [0.0; 3] }).noise(Noise::sigma(0.01).unwrap());
    session.push(&graph, &Values::new()).unwrap();
    session.update().unwrap();
    put(&mut session, "x2", [0.0; 3], 0.05);
    let named = landmarks.see(&mut session, &"x2".into(), &[seen([0.0; 3], [2.0, 0.0, 0.0])]).unwrap();
    assert_eq!(named.merged, [(Key::from("l2"), "l0".into())]);
    let report = session.update().unwrap();
    assert!(report.parked.is_empty() && session.estimate("l2").is_none(), "{report:?}");
    assert_eq!(landmarks.keys().count(), 2);
}

#[test]
fn what_does_not_fit_changes_nothing() {
    let (mut session, mut landmarks) = two(LandmarkSettings::default());
    let alone = Sighting { factor: Arc::new(Near { at: [0.0; 3] }), ..seen([0.0; 3], [1.0; 3]) };
    let error = landmarks.see(&mut session, &"x0".into(), &[alone]).unwrap_err();
    assert!(error.to_string().starts_with("sighting 0: the factors do not fit the session"), "{error}");
    let error = landmarks.see(&mut session, &"x7".into(), &[seen([0.0; 3], [1.0; 3])]).unwrap_err();
    assert!(matches!(error, SightingError::Covariance(_)), "{error}");
    let error = session.innovation(&[entry("x0", "l9", [0.0; 3])]).unwrap_err();
    assert!(matches!(error, InnovationError::Graph(_)), "{error}");
    assert_eq!((landmarks.keys().count(), session.variables()), (2, 3));
    for settings in [
        LandmarkSettings { density: 0.0, ..LandmarkSettings::default() },
        LandmarkSettings { odds: 0.5, ..LandmarkSettings::default() },
    ] {
        assert!(Landmarks::new("l", settings).is_err());
    }
}
