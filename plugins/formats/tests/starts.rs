//! Published pose graphs in `MANIFACTOR_DATA/g2o` reach the best known cost from a chordal start.
use manifactor_formats::pose_graph::{self, PoseGraphOptions};
use manifactor_geometry::{Chordal, SpanningTree, Tree, certify};
use manifactor_graph::Graph;
use manifactor_solve::{
    GaussNewton, GivenStart, LevenbergMarquardt, Optimizer, Silent, Solution, Start, solve,
};

/// Graph and solution; prints a note and returns `None` without data.
fn solved(file: &str, start: &dyn Start, optimizer: &dyn Optimizer) -> Option<(Graph, Solution)> {
    let Some(root) = std::env::var_os("MANIFACTOR_DATA") else {
        eprintln!("skipped: MANIFACTOR_DATA does not name a folder with published data");
        return None;
    };
    let path = std::path::Path::new(&root).join("g2o").join(file);
    let loaded = pose_graph::read(path, &PoseGraphOptions::default()).unwrap();
    let values = start.start(&loaded.graph, &loaded.values).unwrap();
    let solution = solve(&loaded.graph, &values, optimizer, &mut Silent).unwrap();
    let outcome = &solution.outcome;
    println!(
        "{file}: {} -> {} in {} iterations",
        outcome.initial_cost, outcome.final_cost, outcome.iterations
    );
    Some((loaded.graph, solution))
}

/// Initial and final cost.
fn costs(file: &str, start: &dyn Start, optimizer: &dyn Optimizer) -> Option<(f64, f64)> {
    let outcome = solved(file, start, optimizer)?.1.outcome;
    Some((outcome.initial_cost, outcome.final_cost))
}

/// File, best known cost, and the largest ratio of the chordal start's cost to it.
const GRAPHS: [(&str, f64, f64); 11] = [
    ("torus3D.g2o", 12_117.636_879, 1.02),
    ("MIT.g2o", 20.603_473_521, 2.0),
    ("input_INTEL_g2o.g2o", 107.919_060_6, 1.03),
    ("intel.g2o", 22.502_116_5, 1.1),
    ("CSAIL.g2o", 20.275_441_672, 1.02),
    ("kitti_00.g2o", 49.161_069_116, 1.5),
    ("manhattan.g2o", 1_774.520_535, 1.02),
    ("input_M3500_g2o.g2o", 68.957_439_123, 1.3),
    ("sphere2500.g2o", 675.700_962_927, 1.3),
    ("parking-garage.g2o", 0.634_192_399_632, 1.2),
    ("smallGrid3D.g2o", 517.925_332_36, 1.6),
];

#[test]
fn from_a_chordal_start_gauss_newton_reaches_the_best_known_cost() {
    let mut failures = vec![];
    for (file, best, times) in GRAPHS {
        let Some((first, last)) = costs(file, &Chordal {}, &GaussNewton::default()) else { return };
        if (last - best).abs() > 1e-6 * best || first > times * best {
            failures.push(format!("{file}: {first} -> {last}, expected {best}"));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn levenberg_marquardt_gets_there_too_where_it_is_hard() {
    for (file, best, _) in &GRAPHS[..2] {
        let Some((_, last)) = costs(file, &Chordal {}, &LevenbergMarquardt::default()) else { return };
        assert!((last - best).abs() < 1e-6 * best, "{file}: {last}, expected {best}");
    }
}

#[test]
fn a_shallow_spanning_tree_is_a_start_that_torus3d_is_solved_from() {
    let tree = SpanningTree { tree: Tree::Shallow };
    let Some((_, last)) = costs("torus3D.g2o", &tree, &GaussNewton::default()) else { return };
    assert!((last - GRAPHS[0].1).abs() < 1e-6 * GRAPHS[0].1, "{last}");
}

#[test]
fn the_best_known_costs_are_certified_and_where_noise_is_isotropic_bounded() {
    // Largest gap between the bound on the graph's cost and the reached cost.
    let graphs = [
        ("MIT.g2o", None),
        ("intel.g2o", None),
        ("input_M3500_g2o.g2o", Some(1e-4)),
        ("smallGrid3D.g2o", Some(0.02)),
    ];
    for (file, gap) in graphs {
        let Some((graph, solution)) = solved(file, &Chordal {}, &GaussNewton::default()) else { return };
        let certificate = certify(&graph, &solution.values).unwrap();
        println!("{certificate}");
        assert!(certificate.certified, "{file}: {certificate:?}");
        assert!(certificate.suboptimality < 1e-5 * certificate.chordal_cost, "{file}: {certificate:?}");
        let reached = solution.outcome.final_cost;
        let below = certificate.cost_bound.map(|bound| (reached - bound) / reached);
        assert_eq!(below.is_some(), gap.is_some(), "{file}");
        assert!(below.is_none_or(|below| below >= 0.0 && Some(below) < gap), "{file}: {below:?}");
    }
}

#[test]
fn a_minimum_that_is_not_the_best_is_not_certified() {
    // From the values in the file, other programs end at 385.12.
    let Some((graph, solution)) = solved("MIT.g2o", &GivenStart {}, &GaussNewton::default()) else {
        return;
    };
    let (reached, best) = (solution.outcome.final_cost, GRAPHS[1].1);
    let certificate = certify(&graph, &solution.values).unwrap();
    println!("{certificate}");
    assert_eq!(certificate.certified, reached < 1.0001 * best, "{reached}: {certificate:?}");
    // The bound holds at any values.
    assert!(certificate.lower_bound < 20.120_366);
}
