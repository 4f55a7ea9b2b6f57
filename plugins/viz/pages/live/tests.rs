use super::*;
use manifactor_geometry::Se3;
use manifactor_slam::output::map_of;
use manifactor_slam::run::{StreamEvent, StreamWatcher, estimate, online};
use manifactor_slam::settings::RunSettings;
use manifactor_slam::source::InputFolders;
use manifactor_solve::Silent;
use std::ops::ControlFlow;
use std::sync::Arc;

#[test]
fn before_the_first_frame_there_is_a_map_of_nothing() {
    let state = LiveMap::new("desk", "only").to_json();
    assert_eq!((&state["phase"], &state["frames"]), (&"waiting".into(), &0.into()));
    let scene = &state["run"]["variants"][0];
    assert_eq!((&scene["name"], &scene["frames"]), (&"only".into(), &json!([])));
    assert!(state["cost"].is_null());
}

#[test]
fn a_phase_keeps_the_cost_that_is_known() {
    let mut map = LiveMap::new("desk", "only");
    map.set_phase(Phase::Solving { iteration: 3 }, Some(2.5));
    map.set_phase(Phase::Ended("all is written".to_owned()), None);
    let state = map.to_json();
    assert_eq!((&state["phase"], &state["words"]), (&"ended".into(), &"all is written".into()));
    assert_eq!(state["cost"], 2.5);
}

#[test]
fn a_box_has_its_label_behind_what_is_drawn() {
    let measured = BoundingBox::new([1.0, 2.0, 3.0, 4.5]).unwrap();
    let nameless = LiveBox::Nameless(measured, "<script>".to_owned());
    assert_eq!(nameless.to_json(), json!([null, [1, 2, 3, 4.5], null, "<script>"]));
    let seen = BoxRecord::new(ObjectId(7), measured, None, &NO_CAMERA);
    assert_eq!(LiveBox::Named(seen, "cup 7".to_owned()).to_json(), json!([7, [1, 2, 3, 4.5], null, "cup 7"]));
}

/// Shows a stream that is located in a prior map, and checks the state at the frame that locates it.
struct Shown {
    live: LiveMap,
    located: usize,
}

impl StreamWatcher for Shown {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        let StreamEvent::Frame(frame) = event else { return ControlFlow::Continue(()) };
        let (report, mapper) = (frame.report, &*frame.mapper);
        let before: Vec<Se3> = self.live.path.frames().map(|frame| frame.odometry.pose).collect();
        self.live.add_frame(&frame);
        let Some(located) = report.ok().and_then(|report| report.located.as_ref()) else {
            return ControlFlow::Continue(());
        };
        self.located += 1;
        let odometry: Vec<Se3> = self.live.path.frames().map(|frame| frame.odometry.pose).collect();
        assert!(odometry[0].between(&located.start).log().norm() < 1e-9);
        assert!(before[0].between(&located.start).log().norm() > 0.1, "it began elsewhere");
        for (before, after) in before.windows(2).zip(odometry.windows(2)) {
            let change = before[0].between(&before[1]).between(&after[0].between(&after[1]));
            assert!(change.log().norm() < 1e-9, "odometry is moved and not bent");
        }
        for (i, frame) in self.live.path.frames().enumerate() {
            assert_eq!(Some(frame.estimate.pose), mapper.pose_of(i));
        }
        let notes = self.live.notes.to_json();
        assert!(notes["newest"].to_string().contains("relocalized in the prior map"), "{notes}");
        // objects that were added to the discarded map are not counted
        assert_eq!(notes["counts"]["initialized"], report.map_or(0, |report| report.initialized.len()));
        ControlFlow::Continue(())
    }
}

#[test]
fn what_was_shown_moves_into_the_map_that_is_found() {
    let settings = |seed: u32| -> RunSettings {
        serde_json::from_value(json!({
            "association": { "type": "likelihood" },
            "odometry": { "noise": { "sigma": 0.005 } },
            "detections": { "noise": { "sigma": 6.0 }, "loss": { "type": "cauchy", "scale": 1.0 } },
            "source": {
                "type": "simulated",
                "seed": seed,
                "scene": { "objects": 12, "seed": 6, "classes": ["bottle", "book", "cup"], "gap": 0.05, "area": [1.6, 1.2] },
                "trajectory": { "frames": 240, "seed": seed },
            },
            "prior_map": { "file": "map.json" },
        }))
        .unwrap()
    };
    let mut first = settings(1);
    first.prior_map = None;
    let sequence = |settings: &RunSettings| Arc::new(settings.source.load(&InputFolders::default()).unwrap());
    let (made, _) = estimate("first", sequence(&first), &first, &mut Silent).unwrap();
    let mut second = settings(2);
    second.prior_map.as_mut().unwrap().map = Arc::new(map_of(&made, &first).unwrap());
    // the odometry of the second stream begins elsewhere
    let (mut stream, all) = (sequence(&second).header().into_sequence(), sequence(&second));
    let begin = all.frames[0].world_from_camera;
    stream.up = all.up.and_then(|up| Direction::new(begin.rotation.inverse().act(&up)).ok());
    for mut observation in all.observations() {
        observation.frame.world_from_camera = begin.between(&observation.frame.world_from_camera);
        stream.push(observation);
    }
    let mut shown = Shown { live: LiveMap::new("table", "only"), located: 0 };
    online("second", Arc::new(stream).into(), &second, &mut shown).unwrap();
    assert_eq!(shown.located, 1);
}
