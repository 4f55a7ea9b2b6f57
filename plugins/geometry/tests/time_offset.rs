//! The offset between the clocks of a camera and of the odometry, as a variable that all factors share.
use manifactor_geometry::{
    Camera, CameraModel, Coordinates, Interpolated, Point1, Point3, Projection, Se3, TimeOffset,
};
use manifactor_graph::{Graph, Key, Noise, Values};
use manifactor_solve::{Auto, Silent, solve};
use nalgebra::{Vector3, Vector6};
use std::sync::Arc;

/// Time between two poses, in seconds.
const INTERVAL: f64 = 0.1;
/// Time between a pose and the next image, on the clock of the camera, in seconds.
const DELAY: f64 = 0.02;

/// Poses on a curve, along which speed and rotation change.
fn poses() -> Vec<Se3> {
    let step = |i: usize| {
        let t = i as f64 * INTERVAL;
        Vector6::new(0.05 * t.sin(), 0.1 * (3.0 * t).cos(), 0.03, 0.1 + 0.05 * t, -0.06 * t, 0.04)
    };
    let mut poses = vec![Se3::identity()];
    for i in 0..12 {
        poses.push(poses[i].compose(&Se3::exp(&step(i))));
    }
    poses
}

fn points() -> Vec<Point3> {
    let point = |i: usize| {
        let turn = 2.4 * i as f64;
        Point3::new([turn.cos() + 0.3, turn.sin(), 5.0 + 0.3 * i as f64])
    };
    (0..8).map(point).collect()
}

/// Returns the problem with images `offset` seconds later than their timestamps.
fn problem(offset: f64) -> (Graph, Values) {
    let camera = Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap();
    let (poses, points) = (poses(), points());
    let (mut graph, mut values) = (Graph::new(), Values::new());
    values.insert("offset", Point1::new([0.0]));
    for (i, pose) in poses.iter().enumerate() {
        values.insert(Key::indexed("x", i), *pose);
        graph.fix(Key::indexed("x", i));
    }
    for (i, point) in points.iter().enumerate() {
        values.insert(Key::indexed("l", i), Point3::new(point.0 + Vector3::new(0.1, -0.1, 0.5)));
    }
    for (i, pair) in poses.windows(2).enumerate() {
        let part = pair[0].between(&pair[1]).log() * ((DELAY + offset) / INTERVAL);
        let pose = pair[0].compose(&Se3::exp(&part));
        let start = i as f64 * INTERVAL;
        for (k, point) in points.iter().enumerate() {
            let pixel = Coordinates::new(camera.project(&pose.inverse_act(point))).unwrap();
            let seen = Arc::new(Projection::new(pixel, camera));
            let times = [start, start + INTERVAL];
            let factor = Interpolated::new(seen, times, start + DELAY, TimeOffset::Variable, None).unwrap();
            let keys =
                [Key::indexed("x", i), Key::indexed("x", i + 1), Key::indexed("l", k), "offset".into()];
            graph.add(keys, factor).noise(Noise::sigma(1.0).unwrap());
        }
    }
    (graph, values)
}

#[test]
fn the_offset_of_a_camera_on_a_curve_is_found() {
    // within the interval, before it and after it
    for offset in [0.03, -0.05, 0.11] {
        let (graph, values) = problem(offset);
        let solution = solve(&graph, &values, &Auto::default(), &mut Silent).unwrap();
        assert!(solution.outcome.termination.is_converged(), "{}", solution.outcome.termination);
        let found = solution.values.get::<Point1>("offset").unwrap().x;
        assert!((found - offset).abs() < 1e-9, "{found}");
        for (k, point) in points().iter().enumerate() {
            let error = solution.values.get::<Point3>(Key::indexed("l", k)).unwrap().0 - point.0;
            assert!(error.norm() < 1e-6, "{error}");
        }
    }
}
