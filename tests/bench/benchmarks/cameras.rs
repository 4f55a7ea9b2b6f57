//! Time to linearize the projection of a point, with known and with unknown intrinsics, for each camera model:
//! `cargo run --release -p manifactor-bench -- measure cameras`. `tests/peers/adapters/ceres/cameras.cpp` is the same with
//! automatic differentiation in Ceres.
use super::BenchmarkResult;
use manifactor_geometry::{
    Camera, CameraModel, Coordinates, Distortion, DoubleSphere, ExtendedUnified, Intrinsics, KannalaBrandt,
    Point3, Projection, Radial, RadialTangential, Se3, So3, UncalibratedModel, UncalibratedProjection,
};
use manifactor_graph::checked::{Positive, Share};
use manifactor_graph::{Residual, Variables};
use nalgebra::{U2, Vector2, Vector3};
use std::hint::black_box;
use std::time::Instant;

const POINTS: usize = 10_000;
const ROUNDS: usize = 15;

/// Poses, with a point in front of each.
fn views() -> Vec<(Se3, Point3)> {
    let view = |i: usize| {
        let a = i as f64;
        let turn = So3::exp(&Vector3::new(0.3 * a.sin(), 0.2 * (1.7 * a).cos(), 0.1 * (2.3 * a).sin()));
        let pose = Se3::new(turn, Vector3::new((0.3 * a).sin(), (0.7 * a).cos(), 0.2 * (1.1 * a).sin()));
        let local = Vector3::new(0.4 * (3.1 * a).sin(), 0.4 * (4.3 * a).cos(), 1.0) * (3.0 + (0.9 * a).sin());
        (pose, Point3::new(pose.act(&local)))
    };
    (0..POINTS).map(view).collect()
}

/// Time for one view, the best of the rounds. Unit: nanoseconds.
fn time(views: &[(Se3, Point3)], mut run: impl FnMut(&Se3, &Point3)) -> f64 {
    let mut best = f64::INFINITY;
    for _ in 0..ROUNDS {
        let start = Instant::now();
        views.iter().for_each(|(pose, point)| run(pose, point));
        best = best.min(start.elapsed().as_secs_f64() * 1e9 / views.len() as f64);
    }
    best
}

fn calibrated<M: CameraModel>(views: &[(Se3, Point3)], camera: M) -> f64 {
    let factor = Projection::new(Coordinates::new(Vector2::new(300.0, 200.0)).unwrap(), camera);
    let mut blocks = <Projection<M> as Residual>::Variables::blocks::<U2>(2);
    time(views, |pose, point| {
        black_box(factor.linearize((black_box(pose), black_box(point)), &[true; 2], &mut blocks));
        black_box(&blocks);
    })
}

fn uncalibrated<M: UncalibratedModel>(views: &[(Se3, Point3)], camera: M) -> f64 {
    let factor = UncalibratedProjection::<M>::new(Coordinates::new(Vector2::new(300.0, 200.0)).unwrap());
    let intrinsics = Intrinsics(camera);
    let mut blocks = <UncalibratedProjection<M> as Residual>::Variables::blocks::<U2>(3);
    time(views, |pose, point| {
        let variables = (black_box(pose), black_box(point), black_box(&intrinsics));
        black_box(factor.linearize(variables, &[true; 3], &mut blocks));
        black_box(&blocks);
    })
}

fn row<M: UncalibratedModel>(name: &str, views: &[(Se3, Point3)], camera: M) {
    let known = calibrated(views, camera.clone());
    println!("{name:<20} {known:>10.0} {:>12.0}", uncalibrated(views, camera));
}

pub(super) fn run() -> BenchmarkResult {
    let views = views();
    let pinhole = Camera::new([500.0, 510.0, 320.0, 240.0], 640, 480)?;
    println!("{POINTS} points, ns each");
    println!("{:<20} {:>10} {:>12}", "model", "calibrated", "uncalibrated");
    row("pinhole", &views, pinhole);
    row("radial", &views, Radial::new([500.0, 320.0, 240.0, -0.05, 0.01], 640, 480)?);
    let four = Distortion::try_from(vec![-0.05, 0.01, 0.001, -0.002])?;
    row("radial_tangential", &views, RadialTangential::new(pinhole, four));
    row("kannala_brandt", &views, KannalaBrandt::new(pinhole, [-0.01, 0.02, -0.01, 0.002]));
    let spheres = DoubleSphere::new(pinhole, -0.25, Share::literal(0.5))?;
    println!("{:<20} {:>10.0}", "double_sphere", calibrated(&views, spheres));
    let unified = ExtendedUnified::new(pinhole, Share::literal(0.5), Positive::literal(1.1));
    println!("{:<20} {:>10.0}", "extended_unified", calibrated(&views, unified));
    Ok(())
}
