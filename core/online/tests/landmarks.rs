//! Landmarks without names, in a world that is linear: a sighting is where the landmark is from the pose.
use crate::world::{Beyond, Near, Space};
use manifactor_graph::checked::OneOrMore;
use manifactor_graph::{FactorEntry, Graph, Key, Noise, Values};
use manifactor_online::{
    Given, InnovationError, LandmarkSettings, Landmarks, LoadError, Named, Session, Settings, Sighting,
    SightingError,
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
    let mut session = Session::new(Settings::default());
    let mut landmarks = Landmarks::new("l", settings);
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
    for (odds, expected) in [(OneOrMore::literal(3.0), None), (OneOrMore::literal(1.0), Some("l0"))] {
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
    for settings in [r#"{"density": 0}"#, r#"{"odds": 0.5}"#] {
        assert!(serde_json::from_str::<LandmarkSettings>(settings).is_err(), "{settings}");
    }
}

/// Walks along a row of landmarks and back, with the session and the landmarks as they are `kept` after each pose. Only so many poses stay.
fn walk(
    stay: usize,
    kept: impl Fn(Session, Landmarks) -> (Session, Landmarks),
) -> (Session, Landmarks, Vec<Named>) {
    let mut session = Session::new(Settings::default());
    let mut landmarks = Landmarks::new("l", LandmarkSettings::default());
    let mut all = vec![];
    for i in 0..60 {
        let x = 0.5 * i.min(60 - i) as f64;
        let key = format!("x{i}");
        // off by what a wheel slips
        put(&mut session, &key, [x + 0.05 * (i as f64).sin(), 0.0, 0.0], 0.2);
        let near = (0..15).map(|l| 2.0 * f64::from(l) - x).filter(|by| by.abs() < 3.0);
        let seen: Vec<Sighting> = near.map(|by| seen([x, 0.0, 0.0], [by, 1.0, 0.0])).collect();
        all.push(landmarks.see(&mut session, &key.as_str().into(), &seen).unwrap());
        session.update().unwrap();
        if i >= stay {
            session.marginalize(&[&Key::indexed("x", i - stay)]).unwrap();
            session.update().unwrap();
        }
        (session, landmarks) = kept(session, landmarks);
    }
    (session, landmarks, all)
}

#[test]
fn landmarks_go_on_after_a_restart_with_the_same_names_and_bits() {
    for stay in [60, 10] {
        let restart = |session: Session, landmarks: Landmarks| {
            let (text, of_landmarks) = (session.save().unwrap(), landmarks.save().unwrap());
            let session = Session::load(&text).unwrap();
            let landmarks = Landmarks::load(&of_landmarks, &session).unwrap();
            assert_eq!(landmarks.save().unwrap(), of_landmarks);
            (session, landmarks)
        };
        let (session, landmarks, names) = walk(stay, |session, landmarks| (session, landmarks));
        let (again, of_again, the_same) = walk(stay, restart);
        assert_eq!(names, the_same);
        assert!(session.save().unwrap() == again.save().unwrap());
        assert_eq!(landmarks.save().unwrap(), of_again.save().unwrap());
        assert_eq!(landmarks.keys().count(), 9);
    }
}

#[test]
fn landmarks_of_something_else_are_refused_with_a_reason() {
    let (session, landmarks) = two(LandmarkSettings::default());
    let text = landmarks.save().unwrap();
    let told = |text: &str, session: &Session| Landmarks::load(text, session).unwrap_err();
    assert_eq!(told("", &session), LoadError::Foreign { what: "landmarks", version: 1 });
    assert_eq!(
        told(&session.save().unwrap(), &session),
        LoadError::Foreign { what: "landmarks", version: 1 }
    );
    for end in 0..text.len() {
        assert!(Landmarks::load(&text[..end], &session).is_err());
    }
    assert_eq!(told(&text.replacen("\"born\":2", "\"born\":3", 1), &session), LoadError::Damaged);
    // of another session, and of a time before and after
    let empty = Session::new(Settings::default());
    assert_eq!(told(&text, &empty), LoadError::Landmarks("it has never had one of them"));
    let none = Landmarks::new("l", LandmarkSettings::default()).save().unwrap();
    assert_eq!(told(&none, &session), LoadError::Landmarks("it has more of them"));
    let (mut other, mut more) = two(LandmarkSettings::default());
    more.see(&mut other, &"x0".into(), &[seen([0.0; 3], [2.0, 0.0, 0.0])]).unwrap();
    let later = more.save().unwrap();
    assert_eq!(told(&later, &session), LoadError::Landmarks("its factors are not their sightings"));
    let resealed = |from: &str, to: &str| {
        let json = text.split_once('\n').unwrap().1.trim_end().replacen(from, to, 1);
        assert!(!text.contains(&json));
        let session = crate::saving::resealed(&json);
        session.replacen("session 3", "landmarks 1", 1)
    };
    let cases = [
        ("\"key\":\"l1\"", "\"key\":\"l0\"", "their names"),
        ("\"key\":\"l1\"", "\"key\":\"x0\"", "their names"),
        ("\"born\":2", "\"born\":18446744073709551615", "their names"),
        ("\"poses\":[\"x0\"]", "\"poses\":[]", "its factors are not their sightings"),
        ("\"covariance\":null", "\"covariance\":[0]", "a covariance"),
    ];
    for (from, to, what) in cases {
        assert_eq!(told(&resealed(from, to), &session), LoadError::Landmarks(what));
    }
}
