//! A saved and loaded smoother continues like the original.
use crate::history::{Change, History, bits, change, outliers, window};
use crate::toy::{Plane, Valley};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Graph, Values};
use manifactor_smoother::{LoadError, Outliers, SaveError, Smoother, SmootherSettings, Window};
use proptest::prelude::*;
use std::num::NonZeroUsize;

proptest! {
    #[test]
    fn a_smoother_goes_on_after_a_restart_bit_for_bit(
        before in prop::collection::vec(change(), 1..60),
        after in prop::collection::vec(change(), 1..40),
        every in (1..4usize).prop_filter_map("zero", NonZeroUsize::new),
        threshold in prop_oneof![Just(NotNegative::literal(0.1)), Just(NotNegative::literal(0.001))],
        budget in prop_oneof![Just(None), Just(Some(NotNegative::literal(300.0)))],
        window in prop_oneof![Just(None), window().prop_map(Some)],
        outliers in outliers(),
    ) {
        let settings = SmootherSettings { relinearize_every: every, relinearization_threshold: threshold, budget, window, outliers, ..SmootherSettings::default() };
        let mut history = History::new(settings);
        history.apply_all(&before);
        history.apply(&Change::Update);
        let text = history.smoother.save().unwrap();
        let mut other = history.with(Smoother::load(&text).unwrap());
        prop_assert_eq!(&other.smoother.save().unwrap(), &text);
        prop_assert_eq!(bits(&history.smoother), bits(&other.smoother));
        prop_assert_eq!(history.apply_all(&after), other.apply_all(&after));
        prop_assert_eq!(history.apply(&Change::Update), other.apply(&Change::Update));
        prop_assert_eq!(bits(&history.smoother), bits(&other.smoother));
        prop_assert_eq!(history.smoother.cost().to_bits(), other.smoother.cost().to_bits());
        let keys = history.present();
        prop_assert_eq!(history.smoother.covariance(&keys), other.smoother.covariance(&keys));
    }
}

fn smoother(window: Option<Window>) -> Smoother {
    let mut history = History::new(SmootherSettings { window, ..SmootherSettings::default() });
    let pairs = (0..12).map(|i| Change::Pair(i, i + 1));
    let changes: Vec<Change> =
        [Change::Plane, Change::Space].into_iter().cycle().take(12).chain(pairs).collect();
    history.apply_all(&changes);
    history.apply(&Change::Update);
    history.smoother
}

#[test]
fn what_is_no_saved_smoother_is_refused_with_a_reason() {
    let text = smoother(None).save().unwrap();
    let foreign = LoadError::Foreign { version: 3 };
    assert_eq!(Smoother::load("").unwrap_err(), foreign);
    assert_eq!(Smoother::load("{\"factors\": []}").unwrap_err(), foreign);
    let later = text.replacen("session 3 ", "session 4 ", 1);
    assert_eq!(Smoother::load(&later).unwrap_err(), LoadError::Version { found: "4".to_owned(), version: 3 });
    for end in (0..text.len()).step_by(97) {
        assert!(Smoother::load(&text[..end]).is_err());
    }
    let other = text.replacen("toy_near", "toy_neat", 1);
    assert_eq!(Smoother::load(&other).unwrap_err(), LoadError::Damaged);
}

#[test]
fn changes_that_no_update_has_made_are_not_lost_silently() {
    let mut smoother = smoother(None);
    let mut values = Values::new();
    values.insert("late", Plane { x: 0.0, y: 0.0 });
    smoother.push(&Graph::new(), &values).unwrap();
    assert_eq!(smoother.save().unwrap_err(), SaveError::Pending);
    smoother.update().unwrap();
    smoother.save().unwrap();
}

/// Returns a saved text with a different document and a matching checksum.
pub(crate) fn with_checksum(json: &str) -> String {
    let fnv = |hash: u64, byte: u8| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3);
    let checksum = json.bytes().fold(0xcbf2_9ce4_8422_2325, fnv);
    format!("manifactor session 3 {checksum:016x}\n{json}\n")
}

proptest! {
    #[test]
    fn a_document_that_contradicts_itself_is_no_panic(place in any::<prop::sample::Index>(), digit in 0..10u8, other in any::<prop::sample::Index>(), window in prop_oneof![Just(None), window().prop_map(Some)]) {
        let text = smoother(window).save().unwrap();
        let json = text.split_once('\n').unwrap().1.trim_end();
        // structure and numbers consist of digits: change one in the fronts, and one anywhere
        let digits = |from: usize| -> Vec<usize> {
            json.bytes().enumerate().skip(from).filter(|(_, b)| b.is_ascii_digit()).map(|(i, _)| i).collect()
        };
        let (all, fronts) = (digits(0), digits(json.find("\"fronts\"").unwrap()));
        let mut bytes = json.as_bytes().to_vec();
        bytes[*place.get(&fronts)] = b'0' + digit;
        if let Ok(mut smoother) = Smoother::load(&with_checksum(std::str::from_utf8(&bytes).unwrap())) {
            let _ = smoother.update();
        }
        bytes[*other.get(&all)] = b'0' + digit;
        if let Ok(mut smoother) = Smoother::load(&with_checksum(std::str::from_utf8(&bytes).unwrap())) {
            let _ = smoother.update();
        }
    }
}

#[test]
fn counters_that_would_wrap_around_are_refused() {
    let text = smoother(None).save().unwrap();
    let json = text.split_once('\n').unwrap().1.trim_end();
    let other = json.replacen("\"ordinals\":[6,6]", "\"ordinals\":[6,18446744073709551615]", 1);
    assert_ne!(other, json);
    assert_eq!(Smoother::load(&with_checksum(&other)).unwrap_err(), LoadError::Inconsistent("its counters"));
}

#[test]
fn steps_that_lead_to_no_finite_estimate_are_refused() {
    let text = smoother(None).save().unwrap();
    let json = text.split_once('\n').unwrap().1.trim_end();
    let (before, after) = json.split_once("\"step\":[").unwrap();
    let after = after.split_once(',').unwrap().1;
    for step in [f64::NAN, f64::INFINITY] {
        let other = format!("{before}\"step\":[{},{after}", step.to_bits());
        let error = Smoother::load(&with_checksum(&other)).unwrap_err();
        assert_eq!(error, LoadError::Inconsistent("a variable's key, point or step"));
    }
}

#[test]
fn a_smoother_that_is_damped_goes_on_with_the_same_bits() {
    let mut smoother = Smoother::new(SmootherSettings::default());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("p", Plane { x: -1.2, y: 1.0 });
    graph.add(["p"], Valley {});
    smoother.push(&graph, &values).unwrap();
    assert!(smoother.update().unwrap().damped > 0);
    let mut other = Smoother::load(&smoother.save().unwrap()).unwrap();
    for _ in 0..30 {
        assert_eq!(smoother.update().unwrap(), other.update().unwrap());
        assert!(smoother.save().unwrap() == other.save().unwrap());
    }
}

#[test]
fn settings_with_their_old_names_are_read() {
    let outliers = Some(Outliers::default());
    let text = Smoother::new(SmootherSettings { outliers, ..SmootherSettings::default() }).save().unwrap();
    let mut json = text.split_once('\n').unwrap().1.trim_end().to_owned();
    for (new, old) in [
        ("relinearization_threshold", "bend"),
        ("wildfire_threshold", "deviation"),
        ("immediate_relinearization_factor", "urgent"),
        ("max_information_gain", "gain"),
    ] {
        assert_eq!(json.matches(&format!("\"{new}\":")).count(), 1, "{new}");
        json = json.replace(&format!("\"{new}\":"), &format!("\"{old}\":"));
    }
    assert_eq!(Smoother::load(&with_checksum(&json)).unwrap().save().unwrap(), text);
    let both = json.replace("\"bend\":", "\"relinearization_threshold\":1.0,\"bend\":");
    assert!(
        matches!(Smoother::load(&with_checksum(&both)), Err(LoadError::Read(error)) if error.contains("old name"))
    );
}
