use super::*;
use manifactor_slam::online::ObjectUpdates;
use manifactor_slam::run::{MappedFrame, StreamEvent, online};
use manifactor_slam::settings::RunSettings;
use manifactor_slam::source::InputFolders;
use mcap::MessageStream;
use serde_json::{Value, json};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Maps a simulated stream, writes it, and returns the estimate and the file.
fn written() -> (Estimate, Vec<u8>) {
    let settings: RunSettings = serde_json::from_value(json!({
        "odometry": { "noise": { "sigma": 0.005 } },
        "source": { "type": "simulated", "scene": { "objects": 6 }, "trajectory": { "frames": 60 } },
    }))
    .unwrap();
    let sequence = Arc::new(settings.source.load(&InputFolders::default()).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("map.mcap");
    let mut scene = SceneRecording::create(&file, false).unwrap();
    assert_eq!(SceneRecording::create(&file, false).unwrap_err().kind(), io::ErrorKind::AlreadyExists);
    let mut objects = ObjectUpdates::default();
    let mut watch = |event: StreamEvent<'_>| {
        if let StreamEvent::Frame(MappedFrame { report: Ok(report), mapper, .. }) = event {
            scene.add_frame("desk/live", (report.timestamp, &report.pose), &objects.take(mapper));
        }
        ControlFlow::Continue(())
    };
    let (estimate, _) = online("desk", sequence.into(), &settings, &mut watch).unwrap();
    scene.add_estimate("desk", &estimate);
    scene.finish().unwrap();
    (estimate, std::fs::read(&file).unwrap())
}

#[test]
fn a_viewer_gets_the_growing_map_and_the_final_one() {
    let (estimate, bytes) = written();
    let mut messages: HashMap<String, Vec<Value>> = HashMap::new();
    for message in MessageStream::new(&bytes).unwrap() {
        let message = message.unwrap();
        let schema = message.channel.schema.as_ref().unwrap();
        assert!(schema.name.starts_with("foxglove.") && schema.encoding == "jsonschema");
        let definition: Value = serde_json::from_slice(&schema.data).unwrap();
        assert!(definition["properties"].get("timestamp").is_none_or(|t| t["title"] == "time"));
        messages
            .entry(message.channel.topic.clone())
            .or_default()
            .push(serde_json::from_slice(&message.data).unwrap());
    }
    let trajectory = estimate.trajectory();
    assert_eq!((messages["/desk/tf"].len(), messages["/desk/live/tf"].len()), (60, 60));
    assert_eq!(messages["/desk/path"][0]["poses"].as_array().unwrap().len(), 60);
    let last = &messages["/desk/tf"][59];
    assert_eq!((&last["parent_frame_id"], &last["child_frame_id"]), (&json!("map"), &json!("desk/camera")));
    assert_eq!(last["translation"]["x"], trajectory[59].pose.translation.x);
    let seconds =
        last["timestamp"]["sec"].as_f64().unwrap() + 1e-9 * last["timestamp"]["nsec"].as_f64().unwrap();
    assert!((seconds - trajectory[59].timestamp).abs() < 1e-8);

    let landmarks = estimate.landmarks();
    let entities = messages["/desk/objects"][0]["entities"].as_array().unwrap().clone();
    assert_eq!(entities.len(), landmarks.len());
    for (entity, landmark) in entities.iter().zip(landmarks) {
        let sphere = &entity["spheres"][0];
        assert_eq!(sphere["size"]["z"], 2.0 * landmark.quadric.semi_axes.z);
        assert_eq!(sphere["pose"]["position"]["y"], landmark.quadric.pose.translation.y);
        let class = landmark.object.class.as_ref().unwrap().name.clone();
        assert_eq!(entity["texts"][0]["text"], format!("{class} {}", landmark.object.id));
    }
    // each object of the growing map was added at some time
    let live = messages["/desk/live/objects"].iter().flat_map(|scene| scene["entities"].as_array().unwrap());
    let ids: std::collections::BTreeSet<&str> = live.map(|entity| entity["id"].as_str().unwrap()).collect();
    assert!(ids.len() >= entities.len(), "{ids:?}");
}

#[test]
fn only_a_map_is_overwritten() {
    let folder = tempfile::tempdir().unwrap();
    let recording = folder.path().join("drive.mcap");
    let other = WriteOptions::new().library("recorder").create(File::create(&recording).unwrap()).unwrap();
    drop(other);
    let before = std::fs::read(&recording).unwrap();
    let error = SceneRecording::create(&recording, true).unwrap_err().to_string();
    assert!(error.contains("not a map"), "{error}");
    assert_eq!(std::fs::read(&recording).unwrap(), before);
    let map = folder.path().join("map.mcap");
    for overwrite in [false, true, true] {
        SceneRecording::create(&map, overwrite).unwrap().finish().unwrap();
    }
}

#[test]
fn a_time_that_the_format_does_not_have_is_an_error() {
    assert_eq!(Time::nanoseconds(1.5), Some(1_500_000_000));
    assert_eq!(Time::of(1.25).nsec, 250_000_000);
    let folder = tempfile::tempdir().unwrap();
    for (i, time) in [-1.0, 1e12, f64::NAN].into_iter().enumerate() {
        let mut map = SceneRecording::create(&folder.path().join(format!("{i}.mcap")), false).unwrap();
        map.add_pose("ours", time, &Se3::identity());
        let error = map.finish().unwrap_err().to_string();
        assert!(error.contains("expected timestamps from 0 to 18000000000 s"), "{error}");
    }
}
