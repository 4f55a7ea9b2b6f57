//! Ten cameras on a circle see the corners of a cube; their poses and the corners are estimated.
//! `cargo run --release --example bundle_adjustment`
#![allow(clippy::print_stdout, reason = "an example prints")]
use manifactor::geometry::{Camera, Coordinates, Point3, Projection, Se3, So3};
use manifactor::prelude::*;
use std::error::Error;
use std::f64::consts::TAU;

/// Returns the pose of a camera at `position` that looks at the origin: z forward, y down.
fn looking_at_origin(position: Vector3<f64>) -> Se3 {
    let z = -position.normalize();
    let x = z.cross(&Vector3::z()).normalize();
    Se3::new(So3::from_matrix(&Matrix3::from_columns(&[x, z.cross(&x), z])), position)
}

fn main() -> Result<(), Box<dyn Error>> {
    let camera = Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480)?;
    let corners: Vec<Vector3<f64>> = (0..8)
        .map(|i| {
            Vector3::new(f64::from(i & 1), f64::from(i >> 1 & 1), f64::from(i >> 2)) * 20.0
                - Vector3::repeat(10.0)
        })
        .collect();
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for i in 0..10 {
        let angle = TAU * f64::from(i) / 10.0;
        let pose = looking_at_origin(Vector3::new(40.0 * angle.cos(), 40.0 * angle.sin(), 10.0));
        for (j, corner) in corners.iter().enumerate() {
            let seen = pose.inverse().act(corner);
            let pixel = seen.xy() * (500.0 / seen.z) + Vector2::new(320.0, 240.0);
            let keys = [Key::indexed("x", i), Key::indexed("p", j)];
            graph.add(keys, Projection::new(Coordinates::new(pixel)?, camera));
        }
        // the first two cameras fix position, orientation and scale
        if i < 2 {
            graph.fix(Key::indexed("x", i));
        }
        let shift = if i < 2 { 0.0 } else { 0.3 };
        values.insert(Key::indexed("x", i), Se3::new(pose.rotation, pose.translation.add_scalar(shift)));
    }
    for (j, corner) in corners.iter().enumerate() {
        let shift = Vector3::new(0.5, -0.3, 0.4) * (-1.0_f64).powi(j as i32);
        values.insert(Key::indexed("p", j), Point3::new(corner + shift));
    }

    let solution = solve(&graph, &values, &Auto::default(), &mut Silent)?;
    println!("{}, cost {:.1e}", solution.outcome.termination, solution.outcome.final_cost);
    for (j, corner) in corners.iter().enumerate() {
        let point = solution.values.get::<Point3>(&format!("p{j}"))?;
        println!("p{j}: {:.1e} m from the truth", (point.0 - corner).norm());
    }
    Ok(())
}
