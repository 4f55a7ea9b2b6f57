//! Every type registered by this crate has docs, a schema and an example, and obeys the laws.
use manifactor_graph::catalogue::{self, Entry};
use manifactor_quadric as _;
use manifactor_testing::catalogue::{documentation_law, factor_law, manifold_law};

fn ours() -> Vec<&'static Entry> {
    catalogue::all().into_iter().filter(|e| e.module.starts_with("manifactor_quadric")).collect()
}

#[test]
fn every_entry_is_documented() {
    let names: Vec<_> = ours().iter().map(|e| e.name).collect();
    assert_eq!(
        names,
        [
            "bounding_box",
            "centroid_depth",
            "horizontal_orientation",
            "horizontal_orientation_smooth",
            "prior_quadric",
            "shape_prior",
            "size_prior",
            "vertical_orientation",
            "vertical_orientation_smooth",
            "depth",
            "first_of",
            "rays",
            "svd",
            "dual_quadric",
        ]
    );
    for entry in ours() {
        documentation_law(entry).unwrap();
    }
}

#[test]
fn every_factor_and_manifold_keeps_its_laws() {
    for entry in ours() {
        match entry.kind {
            "factor" => {
                let defined = factor_law(entry, 256).unwrap().defined;
                println!("{}: defined at {defined} of 256 points", entry.name);
                assert!(defined >= 48);
            }
            "variable" => drop(manifold_law(entry, 256).unwrap()),
            _ => {}
        }
    }
}
