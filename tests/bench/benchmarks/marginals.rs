//! Time of covariances: of all variables, of one after them, and of one that is requested first.
//!
//! `cargo run --release -p manifactor-bench -- measure marginals GRAPH.g2o…`: milliseconds, medians of nine.
use super::{Arguments, BenchmarkResult};
use manifactor_formats::pose_graph::{self, PoseGraphOptions};
use manifactor_solve::{Auto, Problem, Silent, solve};
use std::time::Instant;

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

pub(super) fn run(arguments: Arguments) -> BenchmarkResult {
    println!("| graph | factorize | all | one, first | one, after |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    for path in arguments {
        let loaded = pose_graph::read(&path, &PoseGraphOptions::default())?;
        let (graph, values) = (loaded.graph, loaded.values);
        let solution = solve(&graph, &values, &Auto::default(), &mut Silent)?;
        let key = values.iter().nth(values.len() / 2).ok_or("no variables")?.0.to_string();
        let timed = |question: &mut dyn FnMut(&mut Problem), prepare: &mut dyn FnMut(&mut Problem)| {
            let times = (0..9).map(|_| {
                let mut problem = solution.problem(&graph).unwrap();
                prepare(&mut problem);
                let clock = Instant::now();
                question(&mut problem);
                1e3 * clock.elapsed().as_secs_f64()
            });
            median(times.collect())
        };
        let mut factorized = |problem: &mut Problem| drop(problem.factorized().map(drop));
        let mut linearized = |problem: &mut Problem| {
            problem.linearize();
        };
        let mut one = |problem: &mut Problem| drop(problem.factorized().and_then(|mut f| f.marginal(&key)));
        let mut all = |problem: &mut Problem| drop(problem.marginals());
        let name = std::path::Path::new(&path).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        println!(
            "| {name} | {:.2} | {:.2} | {:.2} | {:.2} |",
            timed(&mut factorized, &mut linearized),
            timed(&mut all, &mut linearized),
            timed(&mut one, &mut linearized),
            timed(&mut one, &mut factorized),
        );
    }
    Ok(())
}
