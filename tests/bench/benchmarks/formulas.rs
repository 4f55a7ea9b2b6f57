//! Time to linearize a factor given as a formula, compared with the same factor in Rust:
//! `cargo run --release -p manifactor-bench -- measure formulas`
use super::BenchmarkResult;
use manifactor_expression::{Constant, Expression};
use manifactor_geometry::{Between, Coordinates, Landmark, Point3, Se3, So3};
use manifactor_graph::{Factor, Graph, Values};
use manifactor_quadric::{
    DualQuadric, HorizontalOrientation, VerticalOrientation, VerticalOrientationSmooth,
};
use manifactor_solve::Problem;
use nalgebra::{Vector3, Vector6};
use std::error::Error;
use std::time::Instant;

const COUNT: usize = 2000;

fn pose(i: usize) -> Se3 {
    let a = i as f64;
    Se3::new(So3::exp(&Vector3::new(a.sin(), 0.3, 0.2 * a.cos())), Vector3::new(a.cos(), a.sin(), 0.01 * a))
}

/// Objects q, poses x and y, points p: `n` of each.
fn values() -> Values {
    let mut values = Values::new();
    for i in 0..COUNT {
        values.insert(format!("q{i}"), DualQuadric { pose: pose(i), semi_axes: Vector3::new(0.1, 0.2, 0.3) });
        values.insert(format!("x{i}"), pose(i));
        values.insert(format!("y{i}"), pose(i + 1));
        values.insert(format!("p{i}"), Point3::new(pose(i + 2).translation));
    }
    values
}

/// Time to linearize one factor, including whitening and normal equations, the best of fifteen rounds.
/// Unit: nanoseconds.
fn time(
    keys: &[&str],
    factor: &(impl Factor + Clone + 'static),
    values: &Values,
) -> Result<f64, Box<dyn Error>> {
    let mut graph = Graph::new();
    for i in 0..COUNT {
        graph.add(keys.iter().map(|key| format!("{key}{i}")), factor.clone());
    }
    let mut problem = Problem::compile(&graph, values)?;
    let mut best = f64::INFINITY;
    for _ in 0..15 {
        let clock = Instant::now();
        std::hint::black_box(problem.linearize());
        best = best.min(clock.elapsed().as_secs_f64());
    }
    Ok(best * 1e9 / COUNT as f64)
}

pub(super) fn run() -> BenchmarkResult {
    let values = values();
    let row = |name: &str, rust: f64, formula: f64| {
        println!("{name:<28} {rust:>8.0} {formula:>8.0} {:>6.1}", formula / rust);
    };
    println!("{:<28} {:>8} {:>8} {:>6}", "ns each", "Rust", "formula", "ratio");
    let object = |formula| Expression::new([("q", "dual_quadric")], [formula]);
    let vertical = object("1 - abs(dot(major_axis(q), up))")?;
    row(
        "vertical_orientation",
        time(&["q"], &VerticalOrientation::default(), &values)?,
        time(&["q"], &vertical, &values)?,
    );
    let horizontal = object("0 - abs(dot(major_axis(q), up))")?;
    row(
        "horizontal_orientation",
        time(&["q"], &HorizontalOrientation::default(), &values)?,
        time(&["q"], &horizontal, &values)?,
    );
    let smooth = object("cross(major_axis(q), up)")?;
    row(
        "vertical_orientation_smooth",
        time(&["q"], &VerticalOrientationSmooth::default(), &values)?,
        time(&["q"], &smooth, &values)?,
    );
    let seen = Landmark::<3> { position: Coordinates::new(Vector3::x())? };
    let landmark = Expression::new([("x", "se3"), ("p", "point3")], ["inverse(x) * p - [1, 0, 0]"])?;
    row(
        "landmark_se3 (analytic)",
        time(&["x", "p"], &seen, &values)?,
        time(&["x", "p"], &landmark, &values)?,
    );
    let relative = Se3::exp(&Vector6::new(0.1, 0.2, 0.3, 1.0, 0.0, 0.0));
    let between = Expression::with_constants(
        [("x", "se3"), ("y", "se3")],
        [("z", Constant::Value(Box::new(relative)))],
        ["log(between(z, between(x, y)))"],
    )?;
    row(
        "between_se3 (analytic)",
        time(&["x", "y"], &Between { relative }, &values)?,
        time(&["x", "y"], &between, &values)?,
    );
    Ok(())
}
