//! Graduated non-convexity on published pose graphs with added false loop closures.
use manifactor_formats::pose_graph::{PoseGraph, PoseGraphOptions, read};
use manifactor_geometry::{Between, Se2, Se3};
use manifactor_graph::Key;
use manifactor_solve::{Optimizer, Silent, Solution, solve};
use nalgebra::{Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::path::PathBuf;

/// A published graph; prints a note and returns `None` without data.
fn published(file: &str) -> Option<PoseGraph> {
    let Some(root) = std::env::var_os("MANIFACTOR_DATA").map(PathBuf::from) else {
        eprintln!("skipped: MANIFACTOR_DATA does not name a folder with published data");
        return None;
    };
    Some(read(root.join("g2o").join(file), &PoseGraphOptions::default()).unwrap())
}

/// Adds loop closures between random poses with random measurements of a few metres. Returns the original
/// number of factors.
fn add_false_loops(loaded: &mut PoseGraph, n: usize, seed: u64) -> usize {
    let factors = loaded.graph.factors().len();
    let noise = loaded.graph.factors()[0].noise.clone();
    let keys: Vec<Key> = loaded.values.iter().map(|(key, _)| key.clone()).collect();
    let mut rng = Pcg64::seed_from_u64(seed);
    while loaded.graph.factors().len() < factors + n {
        let (a, b) = (rng.random_range(0..keys.len()), rng.random_range(0..keys.len()));
        if a.abs_diff(b) < 10 {
            continue;
        }
        let mut within = |bound: f64| rng.random_range(-bound..bound);
        let pair = [&keys[a], &keys[b]];
        if loaded.values.get::<Se2>(&keys[a]).is_ok() {
            let relative = Se2::exp(&Vector3::new(within(10.0), within(10.0), within(3.1)));
            loaded.graph.add(pair, Between { relative }).noise(noise.clone());
        } else {
            let relative = Se3::exp(&Vector6::from_fn(|row, _| within(if row < 3 { 10.0 } else { 1.8 })));
            loaded.graph.add(pair, Between { relative }).noise(noise.clone());
        }
    }
    factors
}

/// ½ Σ ‖r‖² of the first `factors`, ignoring weights.
fn cost(solution: &Solution, factors: usize) -> f64 {
    let one = |whitened: &Vec<f64>| 0.5 * whitened.iter().map(|x| x * x).sum::<f64>();
    solution.factors[..factors].iter().map(|f| one(&f.whitened)).sum()
}

/// Rejected factors, the original number of factors, and the cost of the true ones; `None` without data.
fn solved(file: &str, outliers: usize, seed: u64, solver: &str) -> Option<(Vec<usize>, usize, f64)> {
    let mut loaded = published(file)?;
    let factors = add_false_loops(&mut loaded, outliers, seed);
    let solver: Box<dyn Optimizer> = serde_json::from_str(solver).unwrap();
    let solution = solve(&loaded.graph, &loaded.values, &*solver, &mut Silent).unwrap();
    let outcome = &solution.outcome;
    let cost = cost(&solution, factors);
    println!(
        "{file} with {outliers} outliers: {cost}, {} rejected in {} iterations, {} s, {}",
        outcome.rejected.len(),
        outcome.iterations,
        outcome.times.total,
        outcome.termination
    );
    assert!(outcome.termination.is_converged(), "{}", outcome.termination);
    let kept: f64 = solution.factors.iter().map(|f| f.cost).sum();
    assert!((kept - outcome.final_cost).abs() < 1e-9 * kept, "the factors are those of the outcome");
    Some((outcome.rejected.iter().map(|r| r.factor).collect(), factors, cost))
}

#[test]
fn m3500_with_false_closures_ends_at_the_optimum_of_the_true_ones() {
    for seed in 1..=3 {
        let Some((rejected, factors, cost)) = solved("input_M3500_g2o.g2o", 99, seed, r#"{"type": "gnc"}"#)
        else {
            return;
        };
        assert!(rejected.into_iter().eq(factors..factors + 99), "it rejects what was added");
        assert!((cost - 68.957_439_123).abs() < 1e-6, "{cost}");
    }
}

#[test]
fn geman_mcclure_ends_close_to_the_optimum_too() {
    let solver = r#"{"type": "gnc", "cost": "geman_mcclure"}"#;
    let Some((rejected, factors, cost)) = solved("input_M3500_g2o.g2o", 99, 2, solver) else { return };
    assert!(rejected.into_iter().eq(factors..factors + 99));
    // Other implementations report 69.21 at the best known minimum of this cost.
    assert!(cost < 69.0, "{cost}");
}

#[test]
fn a_3d_graph_with_more_false_than_a_third_is_solved() {
    // With a threshold that one inlier in ten thousand exceeds, all true closures are below it.
    let solver = r#"{"type": "gnc", "probability": 0.9999}"#;
    let Some((rejected, factors, cost)) = solved("smallGrid3D.g2o", 120, 1, solver) else { return };
    assert!(rejected.into_iter().eq(factors..factors + 120));
    assert!((cost - 517.925_332_36).abs() < 1e-4, "{cost}");
}

#[test]
fn sphere2500_with_false_closures_ends_at_the_optimum_of_the_true_ones() {
    let Some((rejected, factors, cost)) = solved("sphere2500.g2o", 40, 1, r#"{"type": "gnc"}"#) else {
        return;
    };
    assert!(rejected.into_iter().eq(factors..factors + 40));
    assert!((cost - 675.700_962_927).abs() < 1e-4, "{cost}");
}

#[test]
fn a_graph_without_outliers_keeps_its_optimum() {
    let Some((rejected, _, cost)) = solved("intel.g2o", 0, 1, r#"{"type": "gnc"}"#) else { return };
    assert!(rejected.is_empty() && (cost - 22.50212).abs() < 1e-5, "{cost}");
}
