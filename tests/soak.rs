//! Ten thousand solves in one process leave no more memory allocated than a hundred, and the steps of a
//! large solve need no increasing memory.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stderr)]
use manifactor::geometry::{Between, Prior, Se2};
use manifactor::prelude::*;
use manifactor::solve::{Auto, IterationRecord};
use manifactor_graph::checked::NotNegative;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use std::alloc::System;
use std::ops::ControlFlow;

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

/// Returns the bytes allocated since the beginning of a region and not freed.
fn held(region: &Region<'_, System>) -> i64 {
    let change = region.change();
    change.bytes_allocated as i64 - change.bytes_deallocated as i64
}

/// Poses on a square grid with an edge to each neighbour. Each measurement has a different error.
fn square(side: usize) -> (Graph, Values) {
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let (key, at) = (|x, y| Key::indexed("x", x + y * side), |x: usize, y: usize| (x as f64, y as f64));
    let wrong = |n: usize| 0.1 * ((n * 7919 % 101) as f64 / 50.0 - 1.0);
    graph.add([key(0, 0)], Prior { value: Se2::identity() });
    for (x, y) in (0..side * side).map(|n| (n % side, n / side)) {
        let (px, py) = at(x, y);
        let pose = |n| Se2::exp(&Vector3::new(px + wrong(n), py + wrong(n + 1), wrong(n + 2)));
        values.insert(key(x, y), if (x, y) == (0, 0) { Se2::identity() } else { pose(x + y * side) });
        let mut tie = |to: (usize, usize), step: [f64; 2]| {
            let n = x * 31 + y * 17;
            let relative = Se2::exp(&Vector3::new(step[0] + wrong(n), step[1] + wrong(n + 3), wrong(n + 5)));
            graph.add([key(x, y), key(to.0, to.1)], Between { relative });
        };
        if x + 1 < side {
            tie((x + 1, y), [1.0, 0.0]);
        }
        if y + 1 < side {
            tie((x, y + 1), [0.0, 1.0]);
        }
    }
    (graph, values)
}

#[test]
fn memory_is_flat() {
    small_solves_leave_nothing();
    steps_take_no_more_than_the_second();
}

/// `MANIFACTOR_SOAK=320` solves 102,400 poses.
fn steps_take_no_more_than_the_second() {
    let side = std::env::var("MANIFACTOR_SOAK").map_or(40, |side| side.parse().unwrap());
    let region = Region::new(ALLOCATOR);
    let (graph, values) = square(side);
    let solve_it = || {
        let mut steps = vec![];
        let mut watch = |_: &IterationRecord| {
            steps.push(held(&region));
            ControlFlow::Continue(())
        };
        let stop = Stopping {
            relative_cost: Some(NotNegative::literal(0.0)),
            max_iterations: 8,
            ..Stopping::default()
        };
        let solver = LevenbergMarquardt { stop, ..LevenbergMarquardt::default() };
        let outcome = solve(&graph, &values, &solver, &mut watch).unwrap().outcome;
        assert!(outcome.final_cost < 0.5 * outcome.initial_cost, "{outcome:?}");
        steps
    };
    let steps = solve_it();
    // threads allocate memory after the first pass, once it is known to be long
    let (second, last) = (steps[1], steps[steps.len() - 1]);
    eprintln!(
        "{} poses, {} steps: {second} bytes at the second, {last} at the last",
        values.len(),
        steps.len()
    );
    assert!(steps.len() >= 3 && last - second < 10_000, "{steps:?}");
    // by now, the per-thread memory of large products is allocated
    let before = held(&region);
    solve_it();
    let left = held(&region) - before;
    assert!(left.abs() < 100_000, "{left} bytes are left");
}

fn small_solves_leave_nothing() {
    let left_by = |solves: usize| {
        let region = Region::new(ALLOCATOR);
        let cost: f64 = (0..solves).map(solve_one).sum();
        assert!(cost < 1e-6, "{cost}");
        held(&region)
    };
    // permanent allocations: registries, threads
    left_by(100);
    let left = left_by(10_000);
    assert!(left.abs() < 100_000, "{left} bytes are left");
}
