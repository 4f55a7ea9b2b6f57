//! Cost of the default solver compared with plain Gauss-Newton from the same initial values, for any unit
//! of the noise. Prints a table in Markdown.
//!
//! `RAYON_NUM_THREADS=1 cargo run --release -p manifactor-bench -- measure auto FILE...`
//!
//! Each pose graph is solved with its information times 1, 2, 4 and 100, by `gauss_newton`, by `auto`, and
//! by Gauss-Newton from a chordal start, in turns. Each solve is complete, including compilation. Times are
//! CPU times, the least of at least nine turns, and of as many turns as fit into three seconds, at most a
//! hundred. The last graph does not come from a file: a sphere of poses with so much rotational noise that
//! its odometry is useless as an initial guess.
use super::{Arguments, BenchmarkResult, cpu_seconds};
use manifactor_formats::pose_graph::{self, PoseGraphOptions};
use manifactor_geometry::{Between, Chordal, Se3};
use manifactor_graph::{Graph, Key, Noise, Values};
use manifactor_solve::{Auto, GaussNewton, Outcome, Silent, Start, solve};
use nalgebra::Vector6;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::path::Path;
use std::time::Instant;

const TIMES: [f64; 4] = [1.0, 2.0, 4.0, 100.0];
/// Largest relative difference of the costs of two solves at the same minimum.
const SAME: f64 = 1e-6;

pub(super) fn run(arguments: Arguments) -> BenchmarkResult {
    println!(
        "| graph | Ω times | gauss_newton, ms | iterations | cost | auto, ms | iterations | cost | ratio | chordal + gauss_newton, ms |"
    );
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    let mut worst: f64 = 0.0;
    for path in arguments {
        let loaded = pose_graph::read(&path, &PoseGraphOptions::default()).unwrap();
        let name = Path::new(&path).file_stem().unwrap().to_string_lossy().into_owned();
        for times in TIMES {
            worst = worst.max(row(&name, times, &scaled(&loaded.graph, times), &loaded.values));
        }
    }
    let (graph, values) = noisy_sphere(40, 40);
    for times in TIMES {
        worst = worst.max(row("sphere, σ of rotations 0.3", times, &scaled(&graph, times), &values));
    }
    println!("\nThe largest ratio where both end at the same minimum: {worst:.2}");
    Ok(())
}

/// Returns the graph with its information multiplied.
fn scaled(graph: &Graph, times: f64) -> Graph {
    let mut graph = graph.clone();
    for entry in graph.factors_mut() {
        entry.noise = entry.noise.weighted(times).unwrap();
    }
    graph
}

/// Prints the results of each method. Returns the ratio if both solvers end at the same minimum.
fn row(name: &str, times: f64, graph: &Graph, values: &Values) -> f64 {
    let plain = || solve(graph, values, &GaussNewton::default(), &mut Silent).unwrap().outcome;
    let auto = || solve(graph, values, &Auto::default(), &mut Silent).unwrap().outcome;
    let chordal = || {
        let started = Chordal {}.start(graph, values).unwrap();
        solve(graph, &started, &GaussNewton::default(), &mut Silent).unwrap().outcome
    };
    let methods: [&dyn Fn() -> Outcome; 3] = [&plain, &auto, &chordal];
    let mut least = [f64::INFINITY; 3];
    let (clock, mut turns) = (Instant::now(), 0);
    while turns < 9 || (turns < 100 && clock.elapsed().as_secs_f64() < 3.0) {
        for (method, least) in methods.iter().zip(&mut least) {
            let begin = cpu_seconds();
            method();
            *least = least.min(cpu_seconds() - begin);
        }
        turns += 1;
        // a solve of several seconds needs no repetition
        if clock.elapsed().as_secs_f64() > 20.0 {
            break;
        }
    }
    let [gn, own, _] = [plain(), auto(), chordal()];
    let same = (gn.final_cost - own.final_cost).abs() <= SAME * own.final_cost;
    let ratio = if same { least[1] / least[0] } else { 0.0 };
    let cost = |outcome: &Outcome| format!("{:.7}", outcome.final_cost / times);
    let shown = if same { format!("{ratio:.2}") } else { "other minimum".to_owned() };
    let ms = least.map(|seconds| format!("{:.2}", 1e3 * seconds));
    println!(
        "| {name} | {times} | {} | {} | {} | {} | {} | {} | {shown} | {} |",
        ms[0],
        gn.iterations,
        cost(&gn),
        ms[1],
        own.iterations,
        cost(&own),
        ms[2]
    );
    ratio
}

/// Rings of poses on a sphere, each measured from the previous one and from the one below. Rotations have σ
/// = 0.3 rad about each axis, but the graph claims 0.05. The initial values follow the odometry.
fn noisy_sphere(rings: usize, each: usize) -> (Graph, Values) {
    let mut rng = Pcg64::seed_from_u64(12);
    let mut normal = move |sigma: f64| {
        let sum: f64 = (0..12).map(|_| rng.random_range(-0.5..0.5)).sum();
        sigma * sum
    };
    let n = rings * each;
    let pose = |i: usize| {
        let (latitude, longitude) = (
            std::f64::consts::PI * ((i / each) as f64 + 1.0) / (rings as f64 + 1.0),
            std::f64::consts::TAU * i as f64 / each as f64,
        );
        let turned = Se3::exp(&Vector6::new(0.0, 0.0, longitude, 0.0, 0.0, 0.0));
        let tilted = Se3::exp(&Vector6::new(0.0, latitude, 0.0, 0.0, 0.0, 0.0));
        turned.compose(&tilted).compose(&Se3::exp(&Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, 10.0)))
    };
    let (mut graph, mut values) = (Graph::new(), Values::new());
    let noise = Noise::sigmas(&[0.05, 0.05, 0.05, 0.1, 0.1, 0.1]).unwrap();
    let mut along = pose(0);
    values.insert(Key::indexed("x", 0), along);
    for i in 1..n {
        for from in [Some(i - 1), i.checked_sub(each)].into_iter().flatten() {
            let error = Vector6::from_fn(|r, _| normal(if r < 3 { 0.3 } else { 0.1 }));
            let relative = pose(from).between(&pose(i)).compose(&Se3::exp(&error));
            if from == i - 1 {
                along = along.compose(&relative);
            }
            let keys = [Key::indexed("x", from), Key::indexed("x", i)];
            graph.add(keys, Between { relative }).noise(noise.clone());
        }
        values.insert(Key::indexed("x", i), along);
    }
    graph.fix("x0");
    (graph, values)
}
