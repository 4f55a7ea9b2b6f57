//! Factors with more rows than the specialized loops support give the results of several short factors.
use manifactor_expression::Expression;
use manifactor_geometry::{Point3, Prior, Se3};
use manifactor_graph::loss::{Cauchy, RobustLoss};
use manifactor_graph::{Graph, Noise, Values};
use manifactor_solve::{LevenbergMarquardt, Silent, Solution, solve};
use nalgebra::{DMatrix, Vector6};

const SHORT: [&[&str]; 3] =
    [&["log(x)"], &["inverse(x) * p - [0.5, -1, 2]"], &["norm(p) - 2", "dot(position(x), p)"]];

fn residual(parts: &[&[&str]]) -> Expression {
    Expression::new([("x", "se3"), ("p", "point3")], parts.concat()).unwrap()
}

fn values() -> Values {
    let mut values = Values::new();
    values.insert("x", Se3::exp(&Vector6::new(0.3, -0.2, 0.1, 1.0, 2.0, -1.0)));
    values.insert("p", Point3::new([0.4, 1.5, -0.7]));
    values
}

fn solved(factors: &[(Expression, Noise)], loss: bool) -> (Graph, Solution) {
    let mut graph = Graph::new();
    graph.add(["p"], Prior { value: Point3::new([1.0, 1.0, 1.0]) });
    for (factor, noise) in factors {
        let entry = graph.add(["x", "p"], factor.clone()).noise(noise.clone());
        if loss {
            entry.loss(Cauchy::default());
        }
    }
    let solution = solve(&graph, &values(), &LevenbergMarquardt::default(), &mut Silent).unwrap();
    (graph, solution)
}

fn position(solution: &Solution) -> nalgebra::Vector3<f64> {
    solution.values.get::<Se3>("x").unwrap().translation
}

#[test]
fn eleven_rows_weigh_as_those_of_shorter_ones() {
    let sigmas: Vec<f64> = (0..11).map(|i| 0.1 + 0.05 * f64::from(i)).collect();
    let noise = |rows: std::ops::Range<usize>| Noise::sigmas(&sigmas[rows]).unwrap();
    let (long_graph, long) = solved(&[(residual(&SHORT), noise(0..11))], false);
    // The first formula alone does not depend on p.
    let first =
        (residual(&[SHORT[0], SHORT[2]]), Noise::sigmas(&[&sigmas[..6], &sigmas[9..]].concat()).unwrap());
    let (_, short) = solved(&[first, (residual(&[SHORT[1]]), noise(6..9))], false);
    assert!(long.outcome.termination.is_converged());
    assert!((long.outcome.final_cost - short.outcome.final_cost).abs() < 1e-12 * long.outcome.final_cost);
    assert!((position(&long) - position(&short)).norm() < 1e-9);
    assert_eq!((long.factors[1].residual.len(), long.factors[1].whitened.len()), (11, 11));
    let leverages = long.leverages(&long_graph).unwrap();
    assert_eq!(leverages[1].len(), 11);
    let sum: f64 = leverages.iter().flatten().sum();
    assert!((sum - 9.0).abs() < 1e-9, "as many as there are unknowns: {sum}");
}

#[test]
fn a_whole_covariance_of_eleven_rows_is_that_of_its_inverse_root() {
    let root = DMatrix::from_fn(11, 11, |r, c| if r == c { 0.5 } else { 0.02 * (r as f64 - c as f64).cos() });
    let covariance = &root * root.transpose();
    let whole = solved(&[(residual(&SHORT), Noise::covariance(covariance.clone()).unwrap())], true).1;
    let inverse = covariance.try_inverse().unwrap();
    let information = (&inverse + inverse.transpose()) * 0.5;
    let same = solved(&[(residual(&SHORT), Noise::information(information).unwrap())], true).1;
    assert!((whole.outcome.final_cost - same.outcome.final_cost).abs() < 1e-9 * whole.outcome.final_cost);
    assert!((position(&whole) - position(&same)).norm() < 1e-7);
    let state = &whole.factors[1];
    let squared: f64 = state.whitened.iter().map(|x| x * x).sum();
    let (rho, _) = RobustLoss::rho(&Cauchy::default(), squared);
    assert!((state.cost - 0.5 * rho).abs() < 1e-12);
}
