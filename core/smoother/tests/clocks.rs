//! Windows by seconds.
use crate::history::bits;
use crate::toy::{At, Careless, Plane};
use crate::windows::step;
use manifactor_graph::checked::Positive;
use manifactor_graph::{Graph, Values};
use manifactor_smoother::{ChangeError, LoadError, Smoother, SmootherSettings, Span, UpdateError, Window};
use std::num::NonZeroUsize;

fn seconds(seconds: f64) -> Span {
    Span::Seconds(Positive::new(seconds).unwrap())
}

fn smoother(span: Span) -> Smoother {
    Smoother::new(SmootherSettings { window: Some(span.into()), ..SmootherSettings::default() })
}

/// Adds a pose at this time. Returns the marginalized poses.
fn pose(smoother: &mut Smoother, i: usize, time: f64) -> Vec<String> {
    smoother.set_time(time).unwrap();
    let (graph, values) = step(i);
    smoother.push(&graph, &values).unwrap();
    let report = smoother.update().unwrap();
    report.marginalized.iter().map(ToString::to_string).collect()
}

#[test]
fn a_pose_each_second_is_as_in_a_window_by_poses() {
    let (mut by_seconds, mut by_poses) =
        (smoother(seconds(4.4)), smoother(Span::Poses(NonZeroUsize::new(5).unwrap())));
    for i in 0..40 {
        let leaving = pose(&mut by_seconds, i, 1e9 + i as f64);
        assert_eq!(leaving, pose(&mut by_poses, i, i as f64));
        assert_eq!(bits(&by_seconds), bits(&by_poses));
    }
    assert_eq!(by_seconds.variables(), 5);
    assert_eq!(by_seconds.covariance(&["x39", "x37"]), by_poses.covariance(&["x39", "x37"]));
}

#[test]
fn stamps_may_be_uneven() {
    let mut smoother = smoother(seconds(2.0));
    let none: [&str; 0] = [];
    assert_eq!(pose(&mut smoother, 0, -1.0), none);
    assert_eq!(pose(&mut smoother, 1, 0.5), none);
    // two poses at one time; a pose exactly as old as the window stays
    assert_eq!(pose(&mut smoother, 2, 0.5), none);
    assert_eq!(pose(&mut smoother, 3, 2.5), ["x0"]);
    // no pose for a while: the newest stays, however old
    smoother.set_time(100.0).unwrap();
    let report = smoother.update().unwrap();
    assert_eq!((report.marginalized.len(), smoother.variables()), (2, 1));
    smoother.set_time(200.0).unwrap();
    assert!(smoother.update().unwrap().marginalized.is_empty());
    assert_eq!(pose(&mut smoother, 4, 200.0), ["x3"]);
    assert!((smoother.get::<Plane>("x4").unwrap().x - 4.0).abs() < 1e-9);
}

#[test]
fn a_variable_comes_when_it_is_pushed_not_when_it_is_taken_in() {
    let mut smoother = smoother(seconds(2.0));
    for i in 0..4 {
        smoother.set_time(2.0 * i as f64).unwrap();
        let (graph, values) = step(i);
        smoother.push(&graph, &values).unwrap();
    }
    let report = smoother.update().unwrap();
    assert_eq!(report.marginalized, ["x0".into(), "x1".into()]);
}

#[test]
fn time_does_not_go_back() {
    let mut smoother = smoother(seconds(2.0));
    let (graph, values) = step(0);
    let error = smoother.push(&graph, &values).unwrap_err();
    assert_eq!(error, ChangeError::NoTime);
    assert!(error.to_string().contains("`set_time`") && error.to_string().contains("`window.poses`"));
    assert!(smoother.set_time(f64::NAN).unwrap_err().to_string().contains("expected a finite number"));
    assert!(smoother.set_time(f64::INFINITY).is_err());
    pose(&mut smoother, 0, 10.5);
    let error = smoother.set_time(9.25).unwrap_err();
    assert_eq!(error, ChangeError::Time { time: 9.25, last: Some(10.5) });
    assert_eq!(
        error.to_string(),
        "time 9.25 s: expected a finite number, 10.5 s or later: the time that was set before"
    );
    smoother.set_time(11.0).unwrap();
    assert!(smoother.set_time(10.75).is_err(), "one that no update has seen yet counts too");
    smoother.set_time(11.0).unwrap();
    // without a window, or with a window by poses, no time is needed
    let mut other = Smoother::new(SmootherSettings::default());
    other.push(&graph, &values).unwrap();
}

#[test]
fn an_update_that_fails_takes_the_time_back() {
    let [mut one, mut other] = [(); 2].map(|()| smoother(seconds(3.0)));
    for smoother in [&mut one, &mut other] {
        (0..6).for_each(|i| drop(pose(smoother, i, f64::from(i as u32))));
    }
    one.set_time(50.0).unwrap();
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("new", Plane { x: -4.0, y: 1.0 });
    graph.add(["new"], Careless {});
    one.push(&graph, &values).unwrap();
    assert!(matches!(one.update(), Err(UpdateError::NonFinite { .. })));
    assert_eq!((one.variables(), bits(&one)), (4, bits(&other)));
    // the update at 50 s failed, so time continues from 5 s
    assert_eq!(pose(&mut one, 6, 6.0), pose(&mut other, 6, 6.0));
    assert_eq!(bits(&one), bits(&other));
}

#[test]
fn a_restart_keeps_the_times() {
    let mut smoother = smoother(seconds(3.5));
    let mut other: Option<Smoother> = None;
    for i in 0..40 {
        let time = 1e9 + 0.37 * i as f64 + 0.2 * f64::sin(i as f64);
        let leaving = pose(&mut smoother, i, time);
        if let Some(other) = &mut other {
            assert_eq!(pose(other, i, time), leaving);
            assert_eq!(bits(&smoother), bits(other));
        }
        if i == 17 {
            let text = smoother.save().unwrap();
            let mut loaded = Smoother::load(&text).unwrap();
            assert_eq!(loaded.save().unwrap(), text);
            assert!(matches!(loaded.set_time(0.0), Err(ChangeError::Time { last: Some(_), .. })));
            other = Some(loaded);
        }
    }
    assert_eq!(other.unwrap().save().unwrap(), smoother.save().unwrap());
    smoother.set_time(2e9).unwrap();
    assert!(smoother.save().is_err(), "a time that no update has seen is a change");
}

#[test]
fn times_that_cannot_be_are_refused() {
    let mut smoother = smoother(seconds(3.0));
    (0..4).for_each(|i| drop(pose(&mut smoother, i, f64::from(i as u32))));
    let text = smoother.save().unwrap();
    let json = text.split_once('\n').unwrap().1.trim_end();
    let bits = |times: &[f64]| times.iter().map(|t| t.to_bits().to_string()).collect::<Vec<_>>().join(",");
    let now = bits(&[3.0]);
    let right = format!("\"time\":{now},\"times\":[{}]", bits(&[0.0, 1.0, 2.0, 3.0]));
    assert!(json.contains(&right), "{json}");
    for wrong in [
        format!("\"time\":{now},\"times\":[{}]", bits(&[0.0, 2.0, 1.0, 3.0])),
        format!("\"time\":{now},\"times\":[{}]", bits(&[0.0, 1.0, 2.0, 3.5])),
        format!("\"time\":{now},\"times\":[{}]", bits(&[0.0, 1.0, 2.0])),
        format!("\"time\":{now},\"times\":[{}]", bits(&[f64::NEG_INFINITY, 1.0, 2.0, 3.0])),
        format!("\"time\":null,\"times\":[{}]", bits(&[0.0, 1.0, 2.0, 3.0])),
        format!("\"time\":{},\"times\":[]", bits(&[f64::NAN])),
    ] {
        let other = crate::saving::with_checksum(&json.replacen(&right, &wrong, 1));
        assert_eq!(Smoother::load(&other).unwrap_err(), LoadError::Inconsistent("times"), "{wrong}");
    }
}

#[test]
fn a_window_is_either_by_poses_or_by_seconds() {
    let read = |text: &str| serde_json::from_str::<Window>(text).map_err(|e| e.to_string());
    assert_eq!(read("{\"poses\": 7}").unwrap(), Span::Poses(NonZeroUsize::new(7).unwrap()).into());
    let window = read("{\"seconds\": 60, \"keep\": [\"toy_space\"]}").unwrap();
    assert_eq!((window.span, window.keep[0].as_str()), (seconds(60.0), "toy_space"));
    let text = serde_json::to_string(&window).unwrap();
    assert_eq!(read(&text).unwrap(), window);
    let complains = |text: &str, words: &str| {
        let error = read(text).unwrap_err();
        assert!(error.contains(words), "{error}");
    };
    complains("{\"poses\": 7, \"seconds\": 1}", "expected either `poses` or `seconds`, found both");
    complains("{\"keep\": []}", "expected either `poses` or `seconds`, found neither");
    complains("{\"seconds\": 0}", "above zero");
    complains("{\"seconds\": -1}", "above zero");
    complains("{\"minutes\": 1}", "unknown field `minutes`");
    complains(
        "{\"poses\": 7, \"keep\": [\"toy_spice\"]}",
        "there is no variable `toy_spice`: did you mean `toy_space`?",
    );
}

#[test]
fn factors_alone_need_no_new_time() {
    let mut smoother = smoother(seconds(3.0));
    pose(&mut smoother, 0, 1.0);
    let mut graph = Graph::new();
    graph.add(["x0"], At { at: [0.5, 0.0] });
    smoother.push(&graph, &Values::new()).unwrap();
    smoother.update().unwrap();
}
