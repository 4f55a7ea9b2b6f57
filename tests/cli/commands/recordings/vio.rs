//! Visual-inertial estimation of a simulated flight.
use crate::{folder, manifactor, path, root};
use manifactor::inertial::testing::SimulatedFlight;

/// Returns the files of a flight: readings, tracks and true poses, and the document of the example.
fn files() -> [String; 4] {
    let flight = SimulatedFlight::new(8.0, 1);
    let mut imu =
        String::from("#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y,w_RS_S_z,a_RS_S_x,a_RS_S_y,a_RS_S_z\n");
    for reading in &flight.readings {
        let [wx, wy, wz] = reading.gyroscope.into();
        let [ax, ay, az] = reading.accelerometer.into();
        let nanoseconds = (reading.timestamp * 1e9).round();
        imu += &format!("{nanoseconds},{wx:.5},{wy:.5},{wz:.5},{ax:.4},{ay:.4},{az:.4}\n");
    }
    let mut tracks = String::from("timestamp,landmark,u,v\n");
    for (timestamp, points) in &flight.images {
        for (landmark, pixel) in points {
            tracks += &format!("{timestamp},{landmark},{:.2},{:.2}\n", pixel.x, pixel.y);
        }
    }
    let mut truth = String::from("#timestamp,px,py,pz,qw,qx,qy,qz\n");
    for ((timestamp, _), pose) in flight.images.iter().zip(&flight.poses) {
        let [x, y, z] = pose.translation.into();
        let [qx, qy, qz, qw] = pose.rotation.quaternion_xyzw();
        truth += &format!("{timestamp},{x:.6},{y:.6},{z:.6},{qw:.6},{qx:.6},{qy:.6},{qz:.6}\n");
    }
    [imu, tracks, truth, std::fs::read_to_string(root().join("examples/flight/vio.toml")).unwrap()]
}

#[test]
fn the_example_is_the_simulated_flight() {
    let expected = files();
    for (name, expected) in ["imu.csv", "tracks.csv", "truth.csv"].into_iter().zip(expected) {
        let found = std::fs::read_to_string(root().join("examples/flight").join(name)).unwrap_or_default();
        assert!(found == expected, "examples/flight/{name} differs from the simulation");
    }
}

#[test]
fn a_flight_is_estimated_from_its_files() {
    let [imu, tracks, truth, document] = files();
    let files = [("imu.csv", &*imu), ("tracks.csv", &tracks), ("truth.csv", &truth), ("vio.toml", &document)];
    let folder = folder(&files);
    let (document, out) = (path(&folder, "vio.toml"), path(&folder, "out"));
    let json = manifactor(&format!("vio {document} --out {out} --json")).ended(0).json();
    assert!(json["ate"].as_f64().unwrap() < 0.02, "{json}");
    assert!(json["online_ate"].as_f64().unwrap() < 0.05, "{json}");
    assert_eq!(json["keyframes"], 54);
    let states = std::fs::read_to_string(path(&folder, "out/states.csv")).unwrap();
    assert_eq!(states.lines().count(), 55);
    // the trajectory is one that `evaluate` reads
    let truth: String = SimulatedFlight::new(8.0, 1)
        .images
        .iter()
        .zip(SimulatedFlight::new(8.0, 1).poses)
        .map(|((timestamp, _), pose)| {
            let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation.into(), pose.rotation.quaternion_xyzw());
            format!("{timestamp} {x} {y} {z} {qx} {qy} {qz} {qw}\n")
        })
        .collect();
    std::fs::write(path(&folder, "truth.txt"), truth).unwrap();
    let evaluate = format!("evaluate {} {out}/trajectory.txt --json", path(&folder, "truth.txt"));
    let evaluated = manifactor(&evaluate).ended(0).json();
    let difference = evaluated["ate"]["rmse"].as_f64().unwrap() - json["ate"].as_f64().unwrap();
    assert!(difference.abs() < 1e-6, "{evaluated}");
    // the command for a document of a different kind
    manifactor(&format!("run {document}"))
        .ended(2)
        .complains("is the document of a visual-inertial recording");
}

#[test]
fn mistakes_of_a_recording_are_named() {
    let [imu, tracks, truth, document] = files();
    let complaint = |imu: &str, tracks: &str, document: &str, text: &str| {
        let files = [("imu.csv", imu), ("tracks.csv", tracks), ("truth.csv", &truth), ("vio.toml", document)];
        let folder = folder(&files);
        let (document, out) = (path(&folder, "vio.toml"), path(&folder, "out"));
        let ran = manifactor(&format!("vio {document} --out {out}"));
        assert!([2, 3].contains(&ran.code), "{}", ran.stderr);
        ran.complains(text);
    };
    let without = imu.replace("a_RS_S_z", "vertical");
    complaint(&without, &tracks, &document, "the header has no column az");
    let late: String =
        tracks.lines().take(1).chain(tracks.lines().skip(4000)).map(|l| format!("{l}\n")).collect();
    let late = late.replacen("\n", "\n1000,1,3,4\n", 1);
    complaint(&imu, &late, &document, "time stamps have to increase");
    let both = tracks.replacen("u,v", "x,px,v", 1);
    complaint(&imu, &both, &document, "the columns x, px can all be `u`");
    let many = tracks.replacen("\n", "\n0.1,9007199254740993,3,4\n", 1);
    complaint(&imu, &many, &document, "from 0 to 9007199254740991");
    let window =
        document.replace("output =", "settings = { smoother = { window = { poses = 30 } } }\noutput =");
    complaint(&imu, &tracks, &window, "remove `settings.smoother.window`");
    let moving = imu.lines().take(1).chain(imu.lines().skip(600)).collect::<Vec<_>>().join("\n");
    complaint(&moving, &tracks, &document, "begin where it is at rest");
    complaint(&imu, &tracks, &document.replace("ground_truth", "groundtruth"), "ground_truth");
    complaint(
        &imu,
        &tracks,
        &document.replace("output =", "settings = { sigma = -1.0 }\noutput ="),
        "expected a finite number above zero",
    );
}

#[test]
fn an_error_of_a_part_and_unused_images_are_said_to_be_so() {
    let [imu, tracks, truth, document] = files();
    let part = truth.lines().take(100).map(|line| format!("{line}\n")).collect::<String>();
    // the header and the first readings, up to after the first image
    let later: String =
        imu.lines().take(1).chain(imu.lines().skip(30)).map(|line| format!("{line}\n")).collect();
    // a column with another name of `u` does not replace it
    let named: String = tracks
        .lines()
        .map(|line| match line.split(',').collect::<Vec<_>>()[..] {
            ["timestamp", ..] => "timestamp,landmark,x,u,v\n".to_owned(),
            [time, landmark, u, v] => format!("{time},{landmark},7,{u},{v}\n"),
            _ => panic!("{line}"),
        })
        .collect();
    let files = [("imu.csv", &*later), ("tracks.csv", &named), ("truth.csv", &part), ("vio.toml", &document)];
    let folder = folder(&files);
    let ran =
        manifactor(&format!("vio {} --out {}", path(&folder, "vio.toml"), path(&folder, "out"))).ended(0);
    ran.complains("before the first reading of the IMU: not used");
    assert!(ran.stdout.contains("keyframes with a true pose"), "{}", ran.stdout);
}

#[test]
fn the_noise_of_the_imu_comes_from_a_file_of_kalibr() {
    let [imu, tracks, truth, document] = files();
    let densities = "gyroscope_noise_density: 0.0003\ngyroscope_random_walk: 4e-5\naccelerometer_noise_density: 0.004\naccelerometer_random_walk: 0.005\n";
    let kalibr = format!("rostopic: /imu0\nupdate_rate: 200.0\n{densities}");
    let named = document.replace("output =", "imu_noise = \"imu.yaml\"\noutput =");
    let files = [
        ("imu.csv", &*imu),
        ("tracks.csv", &tracks),
        ("truth.csv", &truth),
        ("imu.yaml", &kalibr),
        ("given.toml", &document),
        ("vio.toml", &named),
    ];
    let folder = folder(&files);
    let cost = |document: &str, set: &[&str]| {
        let out = path(&folder, &format!("out_{document}"));
        let mut command =
            vec!["vio".to_owned(), path(&folder, document), "--out".into(), out, "--json".into()];
        command.extend(set.iter().flat_map(|set| ["--set".to_owned(), (*set).to_owned()]));
        manifactor(&command.join(" ")).ended(0).json()["final_cost"].as_f64().unwrap()
    };
    let given =
        "settings.noise={gyroscope=0.0003,gyroscope_walk=4e-5,accelerometer=0.004,accelerometer_walk=0.005}";
    assert_eq!(cost("vio.toml", &[]), cost("given.toml", &[given]));
    assert_ne!(cost("vio.toml", &[]), cost("given.toml", &[]));
    let vio = path(&folder, "vio.toml");
    manifactor(&format!("vio {vio} --set settings.noise.gyroscope=0.1"))
        .ended(2)
        .complains("both give the noise of the IMU");
    std::fs::write(path(&folder, "imu.yaml"), kalibr.replace("gyroscope_random_walk", "walk")).unwrap();
    manifactor(&format!("vio {vio}")).ended(2).complains("gyroscope_random_walk");
}
