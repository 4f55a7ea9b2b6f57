//! Checks with a counting allocator that no iteration after the first allocates memory.
#![allow(missing_docs, clippy::unwrap_used)]
mod scene;
use manifactor_graph::checked::NotNegative;
use manifactor_graph::{Graph, Values};
use manifactor_solve::{GaussNewton, IterationRecord, LevenbergMarquardt, Optimizer, Problem, Stopping};
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};
use std::alloc::System;
use std::ops::ControlFlow;

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// Number of allocations between consecutive steps, from the second step on.
fn allocations((graph, values): &(Graph, Values), solver: &dyn Optimizer) -> Vec<usize> {
    let mut problem = Problem::compile(graph, values).unwrap();
    let mut counts = Vec::with_capacity(100);
    let mut region = Region::new(ALLOCATOR);
    let mut observer = |_: &IterationRecord| {
        let change = region.change();
        counts.push(change.allocations + change.reallocations);
        region.reset();
        ControlFlow::Continue(())
    };
    let outcome = solver.descend(&mut problem, &mut observer);
    assert!(outcome.final_cost < outcome.initial_cost && counts.len() > 3, "{solver:?}: {outcome:?}");
    assert!(counts[0] > 0, "the allocator counts");
    counts.split_off(1)
}

// A single test, because a parallel test on another thread would be counted too.
#[test]
fn no_iteration_after_the_first_allocates() {
    let stop = Stopping { relative_cost: Some(NotNegative::literal(1e-14)), ..Stopping::default() };
    let solvers: [Box<dyn Optimizer>; 2] = [
        Box::new(GaussNewton { stop: stop.clone(), ..GaussNewton::default() }),
        Box::new(LevenbergMarquardt { stop, ..LevenbergMarquardt::default() }),
    ];
    // A thread pool allocates memory to distribute tasks, so one thread is used.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    for problem in [scene::sphere(20, 25), scene::desk(60, 12)] {
        for solver in &solvers {
            let counts = one.install(|| allocations(&problem, &**solver));
            assert!(counts.iter().all(|n| *n == 0), "{solver:?}: {counts:?}");
        }
    }
}
