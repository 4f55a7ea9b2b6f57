use super::*;
use crate::georeference::Geodetic;
use serde_json::json;

#[test]
fn classes_by_number_get_their_names_and_faulty_boxes_are_reported() {
    let source: Mcap =
        serde_json::from_value(json!({"file": "a.mcap", "classes": ["person", "cup"]})).unwrap();
    let image = |boxes: Vec<recorded_messages::BoxOrFault>| BoxesOfImage::new(2.0, boxes);
    let good = [10.0, 10.0, 50.0, 60.0];
    let boxes = vec![
        Ok((good, vec![("1".to_owned(), 0.7), ("7".to_owned(), 0.1), ("vase".to_owned(), 0.2)])),
        Ok(([50.0, 10.0, 10.0, 60.0], vec![])),
        Ok((good, vec![("1".to_owned(), 70.0)])),
        Err("no centre".to_owned()),
    ];
    let camera = manifactor_quadric::Camera::new([500.0, 510.0, 320.0, 240.0], 640, 480).unwrap();
    let cameras = crate::camera::Cameras::new(camera);
    let (images, rows, unused) = source.detections(&[image(boxes), image(vec![])], &cameras);
    assert_eq!((images.len(), rows.len(), unused.len()), (2, 1, 3));
    let classes: Vec<&str> = rows[0].1.scores.iter().map(|(class, _)| class).collect();
    assert_eq!(classes, ["cup", "7", "vase"]);
}

mod recordings {
    use super::*;
    use manifactor_geometry::So3;
    use manifactor_graph::Manifold;
    use manifactor_ros::testing::*;
    use nalgebra::{Vector3, Vector6};

    type Message = (&'static str, f64, Vec<u8>);

    const TOPICS: [(&str, MessageType); 10] = [
        ("/fix", FIX),
        ("/imu", IMU),
        ("/rear/detections", DETECTIONS),
        ("/rear/camera_info", CAMERA_INFO),
        ("/odom", ODOMETRY),
        ("/tf", TRANSFORMS),
        ("/tf_static", TRANSFORMS),
        ("/detections", DETECTIONS),
        ("/camera_info", CAMERA_INFO),
        ("/chatter", STRING),
    ];
    const CUP: ([f64; 4], &str, f64) = ([100.0, 120.0, 180.0, 260.0], "cup", 0.8);

    /// Pose of the body.
    fn body(t: f64) -> Se3 {
        Se3::exp(&(t * Vector6::new(0.0, 0.0, 0.2, 0.5, 0.1, 0.0)))
    }

    fn mast() -> Se3 {
        Se3::new(So3::identity(), Vector3::new(0.2, 0.0, 0.8))
    }

    /// Pose of the camera, which looks ahead, on the mast.
    fn optical() -> Se3 {
        Se3::new(So3::from_quaternion_xyzw([-0.5, 0.5, -0.5, 0.5]).unwrap(), Vector3::new(0.05, 0.0, 0.0))
    }

    fn camera_info(frame: &str) -> Message {
        let distortion: (&str, &[f64]) = ("plumb_bob", &[0.0; 5]);
        ("/camera_info", 0.0, camera_message(frame, [500.0, 510.0, 320.0, 240.0], [640, 480], distortion))
    }

    /// Odometry at 10 Hz, images at 7.5 Hz with other times.
    fn messages() -> Vec<Message> {
        let mut all: Vec<Message> = vec![
            ("/tf_static", 0.0, transform_message(0.0, "base_link", "mast", &mast())),
            ("/tf_static", 0.0, transform_message(0.0, "mast", "camera", &optical())),
            camera_info("camera"),
        ];
        for i in 0..30 {
            let t = 0.1 * f64::from(i);
            all.push(("/odom", t, odometry_message(100.0 + t, "odom", "base_link", &body(t))));
            let t = 0.13 * f64::from(i) + 0.05;
            all.push(("/detections", t, detections_message(100.0 + t, "camera", &[CUP])));
        }
        all
    }

    fn load(
        settings: serde_json::Value,
        messages: impl IntoIterator<Item = Message>,
    ) -> Result<Sequence, SourceError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.mcap"), recording(&TOPICS, messages.into_iter())).unwrap();
        let mut settings = settings;
        settings["file"] = "a.mcap".into();
        let source: Mcap = serde_json::from_value(settings).unwrap();
        source.load(&InputFolders { data: None, document: folder.path().into() })
    }

    fn without(topic: &str) -> impl Iterator<Item = Message> {
        messages().into_iter().filter(move |(name, ..)| *name != topic)
    }

    #[test]
    fn frames_are_images_with_the_interpolated_pose_of_the_camera() {
        let found = load(json!({}), messages()).unwrap();
        // the last images come after the last pose
        assert_eq!(found.frames.len(), 22);
        let UnusedInput::WithoutPose(without) = &found.unused[0] else { panic!() };
        assert_eq!((without.rows, without.of), (8, 30));
        for frame in &found.frames {
            let expected = body(frame.timestamp - 100.0).compose(&mast()).compose(&optical());
            assert!(frame.world_from_camera.local(&expected).norm() < 1e-6, "{}", frame.timestamp);
        }
        assert!(found.body_from_camera.unwrap().local(&mast().compose(&optical())).norm() < 1e-12);
        let seen = &found.detections[0];
        assert_eq!((seen.bounding_box.bounds(), seen.scores.best()), (CUP.0, Some(("cup", 0.8))));
        assert_eq!((found.cameras.first().model.fy, found.cameras.first().model.width), (510.0, 640));
    }

    #[test]
    fn readings_of_an_imu_are_turned_to_the_camera() {
        // the sensor is mounted upside down
        let mount = Se3::new(So3::from_quaternion_xyzw([1.0, 0.0, 0.0, 0.0]).unwrap(), Vector3::zeros());
        let transform: Message = ("/tf_static", 0.0, transform_message(0.0, "base_link", "imu", &mount));
        let readings = || {
            (0..40).map(|i| {
                let t = 0.05 * f64::from(i);
                ("/imu", t, imu_message(100.0 + t, "imu", [0.0, 0.0, -9.8]))
            })
        };
        let found = load(json!({}), messages().into_iter().chain([transform]).chain(readings())).unwrap();
        assert_eq!(found.accelerometer.len(), 40);
        // y of the camera points down
        let up = Vector3::new(0.0, -9.8, 0.0);
        assert!(found.accelerometer.iter().all(|reading| (reading.acceleration - up).norm() < 1e-9));

        let unknown = || messages().into_iter().chain(readings());
        let found = load(json!({}), unknown()).unwrap();
        assert!(found.accelerometer.is_empty());
        let left_out = |unused: &UnusedInput| matches!(unused, UnusedInput::Recording(what) if what.contains("40 readings") && what.contains("imu"));
        assert!(found.unused.iter().any(left_out), "{:?}", found.unused);
        let error = load(json!({"imu": "/imu"}), unknown()).unwrap_err().to_string();
        assert!(error.contains("the orientation of the IMU is not known"), "{error}");
    }

    #[test]
    fn messages_without_stamps_are_an_error_or_reported() {
        let odometry = (0..5).map(|i| {
            let t = f64::from(i);
            ("/odom", t, odometry_message(0.0, "odom", "base_link", &body(t)))
        });
        let error = load(json!({}), without("/odom").chain(odometry)).unwrap_err().to_string();
        assert!(error.contains("all 5 messages have the time 0 s"), "{error}");
        let again: Message = ("/detections", 0.1, detections_message(100.05, "camera", &[CUP]));
        let found = load(json!({}), messages().into_iter().chain([again])).unwrap();
        let reported = |unused: &UnusedInput| matches!(unused, UnusedInput::Recording(what) if what.contains("1 of 31 images have the time of another"));
        assert!(found.unused.iter().any(reported), "{:?}", found.unused);
    }

    /// A camera that looks back, with images at other times, on its own topics or on the topic of the first camera.
    fn rear(topic: &'static str) -> Vec<Message> {
        let distortion: (&str, &[f64]) = ("plumb_bob", &[0.0; 5]);
        let info = camera_message("rear", [300.0, 300.0, 200.0, 150.0], [400, 300], distortion);
        let mut all: Vec<Message> = vec![
            ("/tf_static", 0.0, transform_message(0.0, "base_link", "rear", &looks_back())),
            ("/rear/camera_info", 0.0, info),
        ];
        for i in 0..20 {
            let t = 0.11 * f64::from(i) + 0.02;
            all.push((topic, t, detections_message(100.0 + t, "rear", &[CUP])));
        }
        all
    }

    fn looks_back() -> Se3 {
        let rotation = So3::from_quaternion_xyzw([-0.5, -0.5, 0.5, 0.5]).unwrap();
        Se3::new(rotation, Vector3::new(-0.2, 0.0, 0.6))
    }

    #[test]
    fn further_cameras_have_topics_or_frames_of_their_own() {
        let own =
            json!({"cameras": {"rear": {"detections": "/rear/detections"}}, "camera_info": "/camera_info"});
        let shared = json!({"cameras": {"rear": {"detections": "/detections", "camera_frame": "rear"}},
            "camera_frame": "camera", "detections": "/detections"});
        for (settings, topic) in [(own, "/rear/detections"), (shared, "/detections")] {
            let found = load(settings, messages().into_iter().chain(rear(topic))).unwrap();
            let camera = found.cameras.named(Some("rear")).unwrap();
            assert_eq!((camera.model.fx, camera.model.width), (300.0, 400));
            let expected = mast().compose(&optical()).inverse().compose(&looks_back());
            assert!(camera.first_from_camera.unwrap().local(&expected).norm() < 1e-12);
            // all 20 images of this camera lie between two poses, two of them at the times of images of the first camera
            let seen = found.detections.iter().filter(|detection| detection.camera.index == 1);
            assert_eq!((found.frames.len(), seen.count()), (40, 20));
        }
    }

    #[test]
    fn a_further_camera_that_moves_or_has_no_topic_is_an_error() {
        let rear_moves = (0..20).map(|i| {
            let t = 0.1 * f64::from(i);
            ("/tf", t, transform_message(100.0 + t, "base_link", "rear", &body(t)))
        });
        let still = rear("/rear/detections").into_iter().filter(|(name, ..)| *name != "/tf_static");
        let settings =
            |topic: &str| json!({"cameras": {"rear": {"detections": topic}}, "camera_info": "/camera_info"});
        let moving = messages().into_iter().chain(still).chain(rear_moves);
        let error = load(settings("/rear/detections"), moving).unwrap_err().to_string();
        assert!(error.contains("the frame `rear` moves in `base_link`"), "{error}");
        // a constant pose of the further camera does not help if the first one moves
        let pose = json!({"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0]});
        let mut given = settings("/rear/detections");
        given["cameras"]["rear"]["body_from_camera"] = pose;
        let first_moves = (0..20).map(|i| {
            let t = 0.1 * f64::from(i);
            ("/tf", t, transform_message(100.0 + t, "base_link", "camera", &body(t)))
        });
        let moving = without("/tf_static").chain(rear("/rear/detections")).chain(first_moves);
        let error = load(given, moving).unwrap_err().to_string();
        assert!(error.contains("the frame `camera` moves in `base_link`"), "{error}");
        let mut shared = settings("/detections");
        shared["detections"] = "/detections".into();
        let error = load(shared, messages().into_iter().chain(rear("/detections"))).unwrap_err().to_string();
        assert!(error.contains("`source.cameras.rear` shares the topic `/detections`"), "{error}");
        let error = load(settings("/left"), messages()).unwrap_err().to_string();
        assert!(error.contains("`source.cameras.rear.detections` names `/left`"), "{error}");
    }

    #[test]
    fn poses_can_come_from_transforms_and_the_camera_can_turn() {
        let turn = |t: f64| Se3::exp(&Vector6::new(0.0, 0.0, 0.3 * t, 0.0, 0.0, 0.0));
        let moving = (0..30).flat_map(|i| {
            let t = 0.1 * f64::from(i);
            let odometry = transform_message(100.0 + t, "odom", "base_link", &body(t));
            let camera = transform_message(100.0 + t, "base_link", "camera", &turn(t));
            [("/tf", t, odometry), ("/tf", t, camera)]
        });
        let images = without("/odom").filter(|(name, ..)| *name != "/tf_static");
        let settings = json!({"odometry": "/tf", "odometry_frame": "odom", "body_frame": "base_link"});
        let found = load(settings, images.chain(moving)).unwrap();
        assert_eq!((found.frames.len(), found.body_from_camera), (22, None));
        for frame in &found.frames {
            let t = frame.timestamp - 100.0;
            let expected = body(t).compose(&turn(t));
            assert!(frame.world_from_camera.local(&expected).norm() < 1e-3, "{t}");
        }
    }

    #[test]
    fn what_a_recording_lacks_is_named_with_the_remedy() {
        let faults: Vec<(serde_json::Value, Vec<Message>, &str)> = vec![
            (json!({}), without("/odom").collect(), "`source.odometry` can name a topic of transforms"),
            (json!({}), without("/detections").collect(), "`source.detections_file` can name a CSV file"),
            (json!({}), without("/camera_info").collect(), "`source.camera` can give the camera"),
            (json!({}), without("/tf_static").collect(), "no transform has the frame `base_link`"),
            (
                json!({"odometry": "/odo"}),
                messages(),
                "`source.odometry` names `/odo`, which is not in the recording",
            ),
            (json!({"detections": "/odom"}), messages(), "not of vision_msgs/msg/Detection2DArray"),
            (
                json!({"odometry": "/odom", "odometry_frame": "odom", "body_frame": "base_link"}),
                messages(),
                "`source.odometry_frame` is for a topic of transforms",
            ),
            (json!({"camera_frame": "cam"}), messages(), "no transform has the frame `cam`; there are"),
            (
                json!({"odometry": "/tf"}),
                messages()
                    .into_iter()
                    .chain([("/tf", 0.0, transform_message(0.0, "a", "b", &mast()))])
                    .collect(),
                "`source.odometry_frame` and `source.body_frame`",
            ),
            (
                json!({}),
                messages()
                    .into_iter()
                    .chain([("/detections", 9.0, detections_message(109.0, "rear", &[CUP]))])
                    .collect(),
                "several cameras, `camera`, `rear`",
            ),
        ];
        for (settings, messages, words) in faults {
            let error = load(settings, messages).unwrap_err().to_string();
            assert!(error.contains(words) && error.contains("a.mcap"), "{error}");
        }
    }

    #[test]
    fn damaged_messages_are_left_out_alone() {
        let mut damaged = messages();
        let odometry: Vec<usize> = (0..damaged.len()).filter(|i| damaged[*i].0 == "/odom").collect();
        damaged[odometry[3]].2.truncate(40);
        damaged[odometry[5]].2 = odometry_message(
            100.5,
            "odom",
            "base_link",
            &Se3::new(So3::identity(), Vector3::new(f64::NAN, 0.0, 0.0)),
        );
        let last = damaged.len();
        damaged.swap(odometry[7], odometry[8]);
        damaged[last - 1].2.truncate(9);
        let found = load(json!({}), damaged).unwrap();
        assert_eq!(found.frames.len(), 22);
        let worst = found.frames.iter().map(|frame| {
            let expected = body(frame.timestamp - 100.0).compose(&mast()).compose(&optical());
            frame.world_from_camera.local(&expected).norm()
        });
        assert!(worst.fold(0.0, f64::max) < 1e-6);
    }

    fn antenna() -> Vector3<f64> {
        Vector3::new(0.1, -0.3, 1.2)
    }

    const ORIGIN: Geodetic = Geodetic { latitude: 48.137, longitude: 11.575, altitude: 519.0 };

    fn enu_from_odometry() -> Se3 {
        Se3::exp(&Vector6::new(0.0, 0.0, 2.0, 0.0, 0.0, 0.0))
    }

    /// Position of the antenna to the east, to the north and upwards of its first one.
    fn east_north_up(t: f64) -> Vector3<f64> {
        let at = |t: f64| enu_from_odometry().act(&body(t).act(&antenna()));
        at(t) - at(0.0)
    }

    fn geodetic(east_north_up: &Vector3<f64>) -> [f64; 3] {
        let [degree, mut at] = [111_000.0, 0.0].map(|x| Vector3::new(x, x, x));
        let shape = Vector3::new(degree.x * ORIGIN.latitude.to_radians().cos(), degree.y, 1.0);
        let place = |at: &Vector3<f64>| Geodetic {
            latitude: ORIGIN.latitude + at.y,
            longitude: ORIGIN.longitude + at.x,
            altitude: ORIGIN.altitude + at.z,
        };
        for _ in 0..20 {
            at += (east_north_up - ORIGIN.east_north_up(&place(&at))).component_div(&shape);
        }
        let Geodetic { latitude, longitude, altitude } = place(&at);
        [latitude, longitude, altitude]
    }

    /// Positions at 5 Hz, between the times of the poses.
    fn fixes(sigma: Option<f64>) -> Vec<Message> {
        let fix = |i: i32| {
            let t = 0.2 * f64::from(i);
            ("/fix", t, fix_message(100.0 + t, "gps", 0, geodetic(&east_north_up(t)), sigma))
        };
        (0..14).map(fix).collect()
    }

    fn antenna_transform() -> Message {
        let place = Se3::new(So3::identity(), antenna());
        ("/tf_static", 0.0, transform_message(0.0, "base_link", "gps", &place))
    }

    #[test]
    fn positions_by_satellites_are_factors_on_the_nearest_images() {
        let settings = [
            json!({"fixes": {}, "up": [0.0, 0.0, 1.0]}),
            json!({"fixes": {"topic": "/fix", "antenna": [0.1, -0.3, 1.2], "sigma": 0.02}}),
        ];
        for (settings, sigma) in settings.into_iter().zip([Some(0.02), None]) {
            let all = messages().into_iter().chain([antenna_transform()]).chain(fixes(sigma));
            let found = load(settings, all).unwrap();
            let place = found.georeference.unwrap();
            assert!((place.origin.latitude - ORIGIN.latitude).abs() < 1e-9);
            let expected = Se3 { translation: -enu_from_odometry().act(&antenna()), ..enu_from_odometry() };
            let away = place.enu_from_odometry.local(&expected).norm();
            assert!(away < 1e-6, "{away}");
            assert_eq!(found.pose_factors.len(), 14);
            assert!(found.pose_factors.is_sorted_by_key(|(arrived, _)| *arrived));
            for (arrived, factor) in &found.pose_factors {
                let frame = &found.frames[*arrived];
                let entry = factor.entry(&found.frames, None).unwrap();
                let variables: [&dyn manifactor_graph::Variable; 2] = [&expected, &frame.world_from_camera];
                let residual = entry.factor.erased().residual(&variables).unwrap();
                assert!(residual.iter().all(|x| x.abs() < 1e-6), "{residual:?}");
            }
        }
    }

    #[test]
    fn positions_that_cannot_be_used_are_counted_with_the_remedy() {
        let with = |settings: serde_json::Value, fixes: Vec<Message>| {
            load(settings, messages().into_iter().chain([antenna_transform()]).chain(fixes)).unwrap()
        };
        let says = |found: &Sequence, words: &str| {
            let has =
                |unused: &UnusedInput| matches!(unused, UnusedInput::Recording(what) if what.contains(words));
            assert!(found.unused.iter().any(has), "{words}: {:?}", found.unused);
        };
        let level = || json!({"fixes": {}, "up": [0.0, 0.0, 1.0]});
        let mut mixed = fixes(Some(0.02));
        let at = geodetic(&Vector3::zeros());
        mixed.push(("/fix", 3.0, fix_message(100.5, "gps", -1, at, Some(0.02))));
        mixed.push(("/fix", 3.0, fix_message(100.6, "gps", 0, [95.0, at[1], at[2]], Some(0.02))));
        mixed.push(("/fix", 3.0, fix_message(300.0, "gps", 0, at, Some(0.02))));
        mixed.push(("/fix", 3.0, fix_message(100.7, "gps", 0, at, None)));
        let found = with(level(), mixed);
        assert_eq!(found.pose_factors.len(), 14);
        says(&found, "2 messages of `/fix` are left out: the receiver has no position");
        says(
            &found,
            "1 of 16 positions by satellites are left out, the first: the receiver does not know its covariance",
        );
        says(&found, "1 of 16 positions by satellites are left out: they are not between two poses");
        // one position is off by kilometres
        let mut reflected = fixes(Some(0.02));
        reflected[6].2 = fix_message(101.2, "gps", 0, [at[0] + 0.1, at[1], at[2]], Some(0.02));
        let place = with(level(), reflected).georeference.unwrap();
        assert!(place.enu_from_odometry.rotation.local(&enu_from_odometry().rotation).norm() < 1e-3);
        for (settings, fixes, words) in [
            (level(), fixes(None), "set `source.fixes.sigma`"),
            (level(), fixes(Some(5.0)), "does not show the direction of a path"),
            (json!({"fixes": {}}), fixes(Some(0.5)), "set `source.up`"),
        ] {
            let found = with(settings, fixes);
            assert!(found.georeference.is_none() && found.pose_factors.is_empty());
            says(&found, words);
        }
        let error = load(level(), messages().into_iter().chain(fixes(Some(0.1)))).unwrap_err().to_string();
        assert!(error.contains("`source.fixes.antenna` can give it"), "{error}");
        let error = load(level(), messages()).unwrap_err().to_string();
        assert!(error.contains("sensor_msgs/msg/NavSatFix"), "{error}");
    }

    #[test]
    fn a_position_without_altitude_has_two_rows() {
        let flat = |message: Message| {
            let t = message.1;
            let [latitude, longitude, _] = geodetic(&east_north_up(t));
            let at = [latitude, longitude, f64::NAN];
            ("/fix", t, fix_message(100.0 + t, "gps", 0, at, Some(0.02)))
        };
        let all = fixes(None).into_iter().map(flat);
        let settings = json!({"fixes": {}, "up": [0.0, 0.0, 1.0]});
        let found = load(settings, messages().into_iter().chain([antenna_transform()]).chain(all)).unwrap();
        let observed = |(_, factor): &(usize, crate::pose_graph::PoseFactor)| {
            factor.noise.observed() == Some(&[true, true, false][..])
        };
        assert!(found.pose_factors.len() == 14 && found.pose_factors.iter().all(observed));
    }
}
