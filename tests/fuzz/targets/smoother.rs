//! Saved sessions and landmarks, with a checksum that fits the damaged document.
use super::is_finite;
use manifactor::geometry::{BearingRange2, Between, Point2, Prior, Se2, So2};
use manifactor::graph::checked::Positive;
use manifactor::online::{LandmarkSettings, Landmarks, Session, Settings, Sighting};
use manifactor::prelude::*;
use std::sync::{Arc, LazyLock};

/// Loads saved sessions, unchanged and with a checksum that fits. A session that is loaded is finite, and goes on with equal bits after
/// a second restart.
pub fn session(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    for text in [text.to_string(), resealed(&text)] {
        let Ok(mut session) = Session::load(&text) else { continue };
        is_finite(&session.estimates());
        let saved = save(&session);
        let mut again = load(&saved);
        assert_eq!(save(&again), saved);
        assert_eq!(session.update().is_ok(), again.update().is_ok());
        is_finite(&session.estimates());
        assert_eq!(save(&session), save(&again), "a session does not go on as before its restart");
        let (graph, _) = session.graph();
        assert!(graph.factors().iter().all(|entry| !entry.keys.is_empty()));
    }
}

/// Loads saved landmarks for a session with two landmarks, unchanged and with a checksum that fits.
pub fn landmarks(data: &[u8]) {
    let text = String::from_utf8_lossy(data);
    for text in [text.to_string(), resealed(&text)] {
        let mut session = load(&TWO.0);
        let Ok(mut landmarks) = Landmarks::load(&text, &session) else { continue };
        let saved = landmarks.save().unwrap_or_else(|e| panic!("{e}"));
        let again = Landmarks::load(&saved, &session).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(again.save().unwrap_or_else(|e| panic!("{e}")), saved);
        let seen = [sighting(0.1, 2.0), sighting(1.5, 4.0)];
        if landmarks.see(&mut session, &"x1".into(), &seen).is_ok() && session.update().is_ok() {
            is_finite(&session.estimates());
            let saved = landmarks.save().unwrap_or_else(|e| panic!("{e}"));
            Landmarks::load(&saved, &load(&save(&session))).unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

/// A session with two poses and two landmarks, and its landmarks, as text.
pub(super) static TWO: LazyLock<(String, String)> = LazyLock::new(|| {
    let mut session = Session::new(Settings::default());
    let mut landmarks = Landmarks::new("l", LandmarkSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let sigma = |sigma| Noise::sigma(sigma).unwrap_or_else(|_| Noise::unit());
    let at = |x: f64| Se2::new(So2::identity(), [x, 0.0].into());
    values.insert("x0", at(0.0));
    values.insert("x1", at(0.5));
    graph.add(["x0"], Prior { value: at(0.0) }).noise(sigma(0.01));
    graph.add(["x0", "x1"], Between { relative: at(0.5) }).noise(sigma(0.05));
    session.push(&graph, &values).unwrap_or_else(|e| panic!("{e}"));
    session.update().unwrap_or_else(|e| panic!("{e}"));
    let seen = [sighting(0.0, 2.0), sighting(1.2, 3.0)];
    landmarks.see(&mut session, &"x0".into(), &seen).unwrap_or_else(|e| panic!("{e}"));
    session.update().unwrap_or_else(|e| panic!("{e}"));
    (save(&session), landmarks.save().unwrap_or_else(|e| panic!("{e}")))
});

fn sighting(bearing: f64, range: f64) -> Sighting {
    let bearing = So2::exp(bearing);
    let at = bearing.act(&[range, 0.0].into());
    Sighting {
        factor: Arc::new(BearingRange2::new(bearing, Positive::new(range).unwrap_or_else(|e| panic!("{e}")))),
        noise: Noise::sigma(0.05).unwrap_or_else(|_| Noise::unit()),
        loss: None,
        landmark: Box::new(Point2::new([at.x, at.y])),
    }
}

fn load(text: &str) -> Session {
    Session::load(text).unwrap_or_else(|e| panic!("{e}"))
}

fn save(session: &Session) -> String {
    session.save().unwrap_or_else(|e| panic!("{e}"))
}

/// Writes the checksum of the document into the first line.
fn resealed(text: &str) -> String {
    let Some((head, json)) = text.split_once('\n') else { return text.to_owned() };
    let json = json.trim_end();
    let fnv = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let checksum = json.bytes().fold(0xcbf2_9ce4_8422_2325, fnv);
    let words: Vec<&str> = head.split_whitespace().take(3).collect();
    format!("{} {checksum:016x}\n{json}\n", words.join(" "))
}
