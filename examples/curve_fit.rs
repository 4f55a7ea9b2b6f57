//! A curve through measurements, with a robust loss, and with the uncertainty of its parameters. The residual needs no name.
//! `cargo run --release --example curve_fit`
#![allow(clippy::print_stdout, reason = "an example prints")]
use manifactor::geometry::Point2;
use manifactor::graph::loss::Huber;
use manifactor::prelude::*;
use std::error::Error;

/// y = a exp(b t), with (a, b) as a point.
#[derive(Debug, Clone)]
struct Growth {
    t: f64,
    y: f64,
}

impl Residual for Growth {
    type Variables = (Point2,);
    type Dim = U1;

    fn residual<T: Scalar>(&self, (ab,): Lifted<Self::Variables, T>) -> Vector1<T> {
        Vector1::new(ab.x * (ab.y * self.t).exp() - self.y)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    for i in 0..40 {
        let t = 0.1 * f64::from(i);
        let noise = 0.1 * (12.9898 * f64::from(i)).sin();
        let outlier = if i % 13 == 6 { 5.0 } else { 0.0 };
        let y = 2.0 * (0.5 * t).exp() + noise + outlier;
        graph.add(["ab"], Unnamed(Growth { t, y })).noise(Noise::sigma(0.1)?).loss(Huber::default());
    }
    values.insert("ab", Point2::new([1.0, 0.0]));

    let solution = solve(&graph, &values, &Auto::default(), &mut Silent)?;
    let ab = solution.values.get::<Point2>("ab")?;
    let covariance = &solution.marginals(&graph, &["ab"])?[0].covariance;
    println!("{}", solution.outcome.termination);
    println!(
        "a = {:.3} ± {:.3}, b = {:.4} ± {:.4}",
        ab.0.x,
        covariance[(0, 0)].sqrt(),
        ab.0.y,
        covariance[(1, 1)].sqrt()
    );
    Ok(())
}
