//! Time to linearize a bounding-box factor, analytically and by automatic differentiation:
//! `cargo run --release -p manifactor-bench -- measure linearise_boxes`
use super::BenchmarkResult;
use manifactor_geometry::{Se3, So3};
use manifactor_graph::{Residual, Variables};
use manifactor_quadric::{BoundingBox, BoundingBoxFactor, BoxModel, Camera, DualQuadric};
use nalgebra::{U4, Vector3};
use std::hint::black_box;
use std::time::Instant;

type Views = <BoundingBoxFactor as Residual>::Variables;

/// 200 cameras on a circle that look at its centre, and 50 objects around it; returns the visible pairs.
fn scene() -> Vec<(Se3, DualQuadric)> {
    let mut seen = vec![];
    for i in 0..200 {
        let angle = f64::from(i) * 0.0314;
        let turn = So3::exp(&Vector3::new(0.0, angle, 0.0));
        let camera = Se3::new(turn, turn.act(&Vector3::new(0.0, 0.1, -4.0)));
        for k in 0..50 {
            let a = f64::from(k);
            let at = Vector3::new((2.1 * a).sin(), 0.5 * (3.3 * a).sin(), (4.7 * a).cos());
            let pose = Se3::new(So3::exp(&Vector3::new(a, 0.3 * a, -0.1)), at);
            seen.push((camera, DualQuadric { pose, semi_axes: Vector3::new(0.1, 0.2, 0.15) }));
        }
    }
    seen
}

/// Time for one view, the best of seven rounds. Unit: nanoseconds.
fn time(views: &[(Se3, DualQuadric)], mut run: impl FnMut(&Se3, &DualQuadric)) -> f64 {
    let round = |run: &mut dyn FnMut(&Se3, &DualQuadric)| {
        let start = Instant::now();
        for (pose, quadric) in views {
            run(pose, quadric);
        }
        start.elapsed().as_secs_f64() * 1e9 / views.len() as f64
    };
    (0..7).map(|_| round(&mut run)).fold(f64::INFINITY, f64::min)
}

pub(super) fn run() -> BenchmarkResult {
    let views = scene();
    println!("{} boxes, ns each", views.len());
    println!("{:<10} {:>10} {:>10} {:>10} {:>10}", "model", "defined?", "residual", "analytic", "autodiff");
    for (name, model) in [("standard", BoxModel::Standard), ("truncated", BoxModel::Truncated)] {
        let factor = BoundingBoxFactor {
            bounding_box: BoundingBox::new([100.0, 100.0, 300.0, 200.0])?,
            camera: Camera::new([525.0, 525.0, 320.0, 240.0], 640, 480)?,
            model,
        };
        let mut blocks = Views::blocks::<U4>(2);
        let defined = time(&views, |x, q| {
            black_box(factor.is_defined((black_box(x), black_box(q))));
        });
        let residual = time(&views, |x, q| {
            black_box(factor.residual::<f64>((*black_box(x), *black_box(q))));
        });
        let analytic = time(&views, |x, q| {
            black_box(factor.linearize((black_box(x), black_box(q)), &[true; 2], &mut blocks));
            black_box(&blocks);
        });
        let autodiff = time(&views, |x, q| {
            black_box(Views::autodiff(&factor, (black_box(x), black_box(q)), &[true; 2], &mut blocks));
            black_box(&blocks);
        });
        println!("{name:<10} {defined:>10.0} {residual:>10.0} {analytic:>10.0} {autodiff:>10.0}");
    }
    Ok(())
}
