//! A robot drives a square in the plane; a loop closure corrects its odometry.
//! `cargo run --release --example pose_graph`
#![allow(clippy::print_stdout, reason = "an example prints")]
use manifactor::geometry::{Between, Prior, Se2, So2};
use manifactor::prelude::*;
use std::error::Error;
use std::f64::consts::FRAC_PI_2;

fn main() -> Result<(), Box<dyn Error>> {
    let pose = |x, y, angle| Se2::new(So2::exp(angle), Vector2::new(x, y));
    let noise = Noise::sigmas(&[0.2, 0.2, 0.1])?;
    let mut graph = Graph::new();
    graph.add(["x1"], Prior { value: Se2::identity() }).noise(Noise::sigmas(&[0.3, 0.3, 0.1])?);
    for (from, to, angle) in
        [(1, 2, 0.0), (2, 3, FRAC_PI_2), (3, 4, FRAC_PI_2), (4, 5, FRAC_PI_2), (5, 2, FRAC_PI_2)]
    {
        let keys = [Key::indexed("x", from), Key::indexed("x", to)];
        graph.add(keys, Between { relative: pose(2.0, 0.0, angle) }).noise(noise.clone());
    }

    let mut values = Values::new();
    let guesses = [(0.5, 0.0, 0.2), (2.3, 0.1, -0.2), (4.1, 0.1, 1.6), (4.0, 2.0, 3.1), (2.1, 2.1, -1.6)];
    for (i, (x, y, angle)) in guesses.into_iter().enumerate() {
        values.insert(Key::indexed("x", i + 1), pose(x, y, angle));
    }

    let solution = solve(&graph, &values, &Auto::default(), &mut Silent)?;
    println!("{}, cost {:.1e}", solution.outcome.termination, solution.outcome.final_cost);
    for marginal in solution.marginals(&graph, &["x1", "x3", "x5"])? {
        let x = solution.values.get::<Se2>(marginal.key.as_str())?;
        let sigma = marginal.covariance[(0, 0)].sqrt();
        println!("{}: ({:.3}, {:.3}), σ {sigma:.3} m", marginal.key, x.translation.x, x.translation.y);
    }
    Ok(())
}
