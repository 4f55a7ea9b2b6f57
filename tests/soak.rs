//! Ten thousand solves in one process leave no more behind than a hundred.
#![allow(missing_docs, clippy::unwrap_used)]
use manifactor::geometry::{Between, Prior, Se2};
use manifactor::prelude::*;
use manifactor::solve::Auto;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use std::alloc::System;

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

fn solve_one(seed: usize) -> f64 {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    graph.add(["x0"], Prior { value: Se2::identity() });
    for i in 0..10 {
        let step = Se2::exp(&Vector3::new(1.0, 0.1 * (seed % 7) as f64, 0.3));
        values.insert(Key::indexed("x", i), Se2::exp(&Vector3::new(i as f64, 0.0, 0.1 * i as f64)));
        if i > 0 {
            graph.add([Key::indexed("x", i - 1), Key::indexed("x", i)], Between { relative: step });
        }
    }
    let solution = solve(&graph, &values, &Auto::default(), &mut Silent).unwrap();
    let marginals = solution.marginals(&graph, &[]).unwrap();
    assert_eq!(marginals.len(), 10);
    solution.outcome.final_cost
}

#[test]
fn memory_is_flat() {
    let left_by = |solves: usize| {
        let region = Region::new(ALLOCATOR);
        let cost: f64 = (0..solves).map(solve_one).sum();
        assert!(cost < 1e-6, "{cost}");
        let change = region.change();
        change.bytes_allocated as i64 - change.bytes_deallocated as i64
    };
    // what is made once and kept: registries, threads
    left_by(100);
    let left = left_by(10_000);
    assert!(left.abs() < 100_000, "{left} bytes are left");
}
