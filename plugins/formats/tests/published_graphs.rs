//! Published pose graphs in `MANIFACTOR_DATA/g2o`: their size, and their cost at the initial values.
use manifactor_formats::pose_graph::{self, PoseGraph, PoseGraphOptions};
use std::path::PathBuf;

/// The folder of pose graphs; prints a note and returns `None` if the variable is not set.
fn folder() -> Option<PathBuf> {
    let folder = std::env::var_os("MANIFACTOR_DATA").map(|root| PathBuf::from(root).join("g2o"));
    if folder.is_none() {
        eprintln!("skipped: MANIFACTOR_DATA does not name a folder with published data");
    }
    folder
}

/// Cost F = ½ Σ rᵀΩr.
fn cost(PoseGraph { graph, values, .. }: &PoseGraph) -> f64 {
    let one = |entry: &manifactor_graph::FactorEntry| {
        let variables: Vec<_> = entry.keys.iter().map(|key| values.variable(key.as_str()).unwrap()).collect();
        let residual = nalgebra::DVector::from_vec(entry.factor.erased().residual(&variables).unwrap());
        let whitener = entry.noise.whitener(residual.len()).unwrap().matrix(residual.len());
        0.5 * (whitener * residual).norm_squared()
    };
    graph.factors().iter().map(one).sum()
}

/// File, number of vertex lines, edges and variables, and the initial cost that other programs compute.
/// Initial values come from the file or, if it has none, from the odometry.
const GRAPHS: [(&str, usize, usize, usize, Option<f64>); 17] = [
    ("CSAIL.g2o", 0, 1172, 1045, Some(1_072_150.125)),
    ("Klaus3.g2o", 3, 3, 3, None),
    ("MIT.g2o", 808, 827, 808, Some(3_548_660_355.5)),
    ("gtsam_sphere2500.txt", 0, 4949, 2500, None),
    ("input_INTEL_g2o.g2o", 1228, 1483, 1228, Some(3_350_168.41)),
    ("input_M3500_g2o.g2o", 3500, 5453, 3500, Some(1_317_356.272_5)),
    ("intel.g2o", 1728, 2512, 1728, Some(276.997_90)),
    ("kitti_00.g2o", 0, 4677, 4541, Some(37_308_573.875)),
    ("manhattan.g2o", 0, 5453, 3500, Some(13_515_460_719.77)),
    ("parking-garage.g2o", 1661, 6275, 1661, Some(8_363.601_948_12)),
    ("smallGrid3D.g2o", 125, 297, 125, Some(83_894.333_435_53)),
    ("sphere2500.g2o", 2500, 4949, 2500, Some(1_305_657.711_8)),
    ("sphere_smallnoise.graph", 2200, 8647, 2200, None),
    ("tinyGrid3D.g2o", 9, 11, 9, None),
    ("torus3D.g2o", 5000, 9048, 5000, Some(2_400_615.174)),
    ("toyExample.g2o", 5, 6, 5, None),
    ("w100.graph", 100, 300, 100, None),
];

#[test]
fn every_published_graph_loads_and_costs_what_it_should() {
    let Some(folder) = folder() else { return };
    let mut failures = vec![];
    for (file, vertices, edges, variables, known_cost) in GRAPHS {
        let loaded = pose_graph::read(folder.join(file), &PoseGraphOptions::default()).unwrap();
        let found = (loaded.report.vertices, loaded.report.edges, loaded.values.len());
        let cost = cost(&loaded);
        println!("{file}: {found:?} {} factors, cost {cost:?}", loaded.graph.factors().len());
        if found != (vertices, edges, variables) {
            failures.push(format!("{file}: {found:?}, expected {:?}", (vertices, edges, variables)));
        }
        if known_cost.is_some_and(|known| (cost - known).abs() > 1e-7 * known) {
            failures.push(format!("{file}: cost {cost}, expected {known_cost:?}"));
        }
        if !loaded.graph.check(&loaded.values).is_empty() {
            failures.push(format!("{file}: {:?}", loaded.graph.check(&loaded.values)));
        }
        if !loaded.report.unknown.is_empty() || loaded.report.anchored != ["x0".into()] {
            failures.push(format!("{file}: {:?}", loaded.report));
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}
