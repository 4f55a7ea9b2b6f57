//! Larger problems without data files: poses on a sphere, and poses that measure quadrics.
#![allow(dead_code, missing_docs, unreachable_pub, clippy::unwrap_used)]
use manifactor_geometry::{Between, Prior, Se3, So3};
use manifactor_graph::loss::Huber;
use manifactor_graph::{Graph, Key, Manifold, Noise, Values};
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric, QuadricPrior};
use nalgebra::{Matrix3, SVector, Vector3};

/// A nonzero offset, different for each place.
pub fn jitter<const N: usize>(place: usize, size: f64) -> SVector<f64, N> {
    SVector::from_fn(|row, _| size * ((place * N + row) as f64 * 7.13 + 1.0).sin())
}

pub fn camera() -> Camera {
    Camera::new([525.0, 520.0, 320.0, 240.0], 640, 480).unwrap()
}

/// A camera at `eye`, facing `target`.
pub fn looking(eye: Vector3<f64>, target: Vector3<f64>) -> Se3 {
    let z = (target - eye).normalize();
    let x = z.cross(&Vector3::z()).normalize();
    Se3::new(So3::from_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z])), eye)
}

/// Rings of poses on a sphere, each connected to the next pose and the one a ring above, with errors in
/// measurements and initial values.
pub fn sphere(rings: usize, around: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let n = rings * around;
    let pose = |i: usize| {
        let (up, turn) = (i as f64 / n as f64 - 0.5, i as f64 * std::f64::consts::TAU / around as f64);
        let out =
            Vector3::new(turn.cos() * (2.5 * up).cos(), turn.sin() * (2.5 * up).cos(), (2.5 * up).sin());
        looking(10.0 * out, Vector3::new(0.0, 0.1, 0.2))
    };
    for i in 0..n {
        values.insert(Key::indexed("x", i), pose(i).retract(&jitter(i, 0.02)));
        for j in [i + 1, i + around].into_iter().filter(|j| *j < n) {
            let relative = pose(i).between(&pose(j)).retract(&jitter(i + 3 * j, 0.005));
            let keys = [Key::indexed("x", i), Key::indexed("x", j)];
            graph.add(keys, Between { relative }).noise(Noise::sigma(0.01).unwrap());
        }
    }
    graph.fix("x0");
    (graph, values)
}

/// Poses on a circle around quadrics, with odometry, boxes with errors of a few pixels, and weak priors on
/// the quadrics.
pub fn desk(poses: usize, quadrics: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let things: Vec<DualQuadric> = (0..quadrics)
        .map(|i| DualQuadric {
            pose: Se3::new(So3::exp(&jitter(i, 0.5)), jitter(i + 50, 0.8)),
            semi_axes: Vector3::new(0.08, 0.12, 0.17) + jitter(i, 0.01),
        })
        .collect();
    let eyes: Vec<Se3> = (0..poses)
        .map(|i| {
            let turn = i as f64 * std::f64::consts::TAU / poses as f64;
            looking(
                Vector3::new(4.0 * turn.cos(), 4.0 * turn.sin(), 1.0 + (3.0 * turn).sin()),
                Vector3::zeros(),
            )
        })
        .collect();
    for (i, pose) in eyes.iter().enumerate() {
        let key = Key::indexed("x", i);
        values.insert(key.clone(), pose.retract(&jitter(i, 0.005)));
        if i == 0 {
            graph.add([&key], Prior { value: *pose }).noise(Noise::sigma(1e-3).unwrap());
        } else {
            let relative = eyes[i - 1].between(pose).retract(&jitter(i, 0.002));
            graph
                .add([Key::indexed("x", i - 1), key.clone()], Between { relative })
                .noise(Noise::sigma(0.01).unwrap());
        }
        for (k, thing) in things.iter().enumerate().filter(|(_, thing)| thing.is_in_front_of(pose)) {
            let bounding_box = BoundingBox::new([0.0; 4]).unwrap();
            let mut factor = BoundingBoxFactor { bounding_box, camera: camera(), model: BoxModel::Standard };
            let Some(seen) = factor.predict(pose, thing) else { continue };
            let off: SVector<f64, 4> = jitter(i * quadrics + k, 1.0);
            let bounds = seen.bounds();
            factor.bounding_box =
                BoundingBox::new(std::array::from_fn(|side| bounds[side] + off[side])).unwrap();
            let entry = graph.add([key.clone(), Key::indexed("q", k)], factor);
            entry.noise(Noise::sigma(3.0).unwrap()).loss(Huber::default());
        }
    }
    for (k, thing) in things.iter().enumerate() {
        values.insert(Key::indexed("q", k), thing.retract(&jitter(k, 0.02)));
        graph.add([Key::indexed("q", k)], QuadricPrior { value: *thing }).noise(Noise::sigma(1.0).unwrap());
    }
    (graph, values)
}
