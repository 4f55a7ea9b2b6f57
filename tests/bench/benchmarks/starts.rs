//! Pose graphs from different initial values: cost and time of the start, the cost after a solve from it,
//! and whether that is the global minimum.
//!
//! `cargo run --release -p manifactor-bench -- measure starts FILE...`
use super::{Arguments, BenchmarkResult};
use manifactor_formats::pose_graph::{self, PoseGraphOptions};
use manifactor_geometry::{Chordal, SpanningTree, Tree, certify};
use manifactor_solve::{GaussNewton, GivenStart, LevenbergMarquardt, Optimizer, Silent, Start, solve};
use std::time::Instant;

pub(super) fn run(arguments: Arguments) -> BenchmarkResult {
    let starts: [(&str, Box<dyn Start>); 4] = [
        ("given", Box::new(GivenStart {})),
        ("chain", Box::new(SpanningTree { tree: Tree::Chain })),
        ("shallow", Box::new(SpanningTree { tree: Tree::Shallow })),
        ("chordal", Box::new(Chordal {})),
    ];
    let optimizers: [(&str, Box<dyn Optimizer>); 2] =
        [("lm", Box::new(LevenbergMarquardt::default())), ("gn", Box::new(GaussNewton::default()))];
    for path in arguments {
        let loaded = pose_graph::read(&path, &PoseGraphOptions::default()).unwrap();
        let name = std::path::Path::new(&path).file_stem().unwrap().to_string_lossy().into_owned();
        for (start, strategy) in &starts {
            let mut best = f64::INFINITY;
            let mut values = loaded.values.clone();
            for _ in 0..5 {
                let clock = Instant::now();
                values = strategy.start(&loaded.graph, &loaded.values).unwrap();
                best = best.min(clock.elapsed().as_secs_f64());
            }
            for (solver, optimizer) in &optimizers {
                let solution = solve(&loaded.graph, &values, &**optimizer, &mut Silent).unwrap();
                let solved = &solution.outcome;
                println!(
                    "{name:18} {start:8} {:8.2} ms  {solver} cost {:20.9} -> {:20.9} in {:3} iterations, {:7.1} ms: {}",
                    best * 1e3,
                    solved.initial_cost,
                    solved.final_cost,
                    solved.iterations,
                    solved.times.total * 1e3,
                    solved.termination
                );
                if (*start, *solver) == ("chordal", "gn") {
                    let clock = Instant::now();
                    match certify(&loaded.graph, &solution.values) {
                        Ok(certificate) => println!("{certificate}"),
                        Err(error) => println!("no certificate: {error}"),
                    }
                    println!("{:.1} ms", clock.elapsed().as_secs_f64() * 1e3);
                }
            }
        }
    }
    Ok(())
}
