//! Replays pose graphs with false loop closures among the true ones, and compares the rejections of a
//! session with batch graduated non-convexity.
//!
//! `cargo run --release -p manifactor-bench -- measure outliers [--share PERCENT]… [--seeds N] [--first
//! SEED] [--clusters N] [--batch] GRAPH.g2o…`. `--share` is the number of false closures per hundred true
//! ones. They connect random poses, with a relative pose of up to 10 m and 3.1 rad. With `--clusters N`
//! they come in runs of N consistent ones, like two places that look alike. Precision is the share of false
//! closures among the rejected ones, recall the share of rejected closures among the false ones. Times are
//! CPU times of one thread in milliseconds. The cost is ½ Σ ‖r‖² of the true factors at the end, including
//! rejected ones, divided by that of their optimum.
use super::{Arguments, BenchmarkResult, cpu_seconds};
use manifactor_formats::pose_graph::{self, PoseGraphOptions};
use manifactor_formats::replay::{GraphReplay, Latencies};
use manifactor_geometry::{Between, Se2, Se3};
use manifactor_graph::{FactorEntry, Graph, Key, Values};
use manifactor_smoother::{FactorId, Outliers, Smoother, SmootherSettings};
use manifactor_solve::{Gnc, LevenbergMarquardt, Problem, Silent, solve};
use nalgebra::{Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::collections::HashSet;

fn number(key: &Key) -> usize {
    key.as_str()[1..].parse().unwrap()
}

/// Returns whether a factor is a loop closure.
fn closes(entry: &FactorEntry) -> bool {
    entry.keys.len() == 2 && number(&entry.keys[0]).abs_diff(number(&entry.keys[1])) != 1
}

/// A graph with false closures before or after the true ones of their latest pose, and the flags that mark
/// the false ones.
struct Misled {
    graph: Graph,
    is_false: Vec<bool>,
}

fn mislead(truth: &Graph, values: &Values, share: usize, cluster: usize, seed: u64) -> Misled {
    let (n, noise) = (values.len(), truth.factors()[0].noise.clone());
    let wanted = truth.factors().iter().filter(|entry| closes(entry)).count() * share / 100;
    let mut rng = Pcg64::seed_from_u64(seed);
    let (mut graph, mut is_false) = (Graph::new(), vec![]);
    truth.factors().iter().for_each(|entry| {
        graph.push(entry.clone());
        is_false.push(false);
    });
    truth.fixed().iter().for_each(|(key, held)| graph.set_fixed(key, held.clone()));
    let key = |i: usize| Key::indexed("x", i);
    let mut made = 0;
    while made < wanted {
        let (a, b) = (rng.random_range(0..n - cluster), rng.random_range(0..n - cluster));
        if a.abs_diff(b) < 10 + cluster {
            continue;
        }
        let mut within = |bound: f64| rng.random_range(-bound..bound);
        if values.get::<Se2>(key(a).as_str()).is_ok() {
            let place = |i: usize| *values.get::<Se2>(key(i).as_str()).unwrap();
            let first = Se2::exp(&Vector3::new(within(10.0), within(10.0), within(3.1)));
            for i in 0..cluster.min(wanted - made) {
                // the same pair of places, observed from further poses
                let from_a = Se2::compose(&Se2::inverse(&place(a + i)), &place(a));
                let from_b = Se2::compose(&Se2::inverse(&place(b)), &place(b + i));
                let relative = Se2::compose(&Se2::compose(&from_a, &first), &from_b);
                graph.add([key(a + i), key(b + i)], Between { relative }).noise(noise.clone());
            }
        } else {
            let place = |i: usize| *values.get::<Se3>(key(i).as_str()).unwrap();
            let first = Se3::exp(&Vector6::from_fn(|row, _| within(if row < 3 { 10.0 } else { 1.8 })));
            for i in 0..cluster.min(wanted - made) {
                let from_a = Se3::compose(&Se3::inverse(&place(a + i)), &place(a));
                let from_b = Se3::compose(&Se3::inverse(&place(b)), &place(b + i));
                let relative = Se3::compose(&Se3::compose(&from_a, &first), &from_b);
                graph.add([key(a + i), key(b + i)], Between { relative }).noise(noise.clone());
            }
        }
        let new = cluster.min(wanted - made);
        is_false.extend(std::iter::repeat_n(true, new));
        made += new;
    }
    Misled { graph, is_false }
}

/// Returns ½ Σ ‖r‖² of the true factors.
fn cost(truth: &Graph, values: &Values) -> f64 {
    Problem::compile(truth, values).unwrap().cost().cost
}

struct Line {
    name: String,
    precision: f64,
    recall: f64,
    /// Share of the true closures that were rejected.
    lost: f64,
    latencies: Latencies,
    cost: f64,
}

fn judge(rejected: &HashSet<usize>, misled: &Misled) -> (f64, f64, f64) {
    let of = |is_false: bool| rejected.iter().filter(|i| misled.is_false[**i] == is_false).count() as f64;
    let wrong = misled.is_false.iter().filter(|x| **x).count() as f64;
    let closures = misled.graph.factors().iter().filter(|entry| closes(entry)).count() as f64 - wrong;
    (of(true) / f64::max(rejected.len() as f64, 1.0), of(true) / f64::max(wrong, 1.0), of(false) / closures)
}

fn online(truth: &Graph, misled: &Misled) -> Line {
    let settings = SmootherSettings { outliers: Some(Outliers::default()), ..SmootherSettings::default() };
    let mut session = Smoother::new(settings);
    let mut places: std::collections::HashMap<String, Vec<usize>> = std::collections::HashMap::new();
    let text = |entry: &FactorEntry| serde_json::to_string(entry).unwrap();
    for (i, entry) in misled.graph.factors().iter().enumerate() {
        places.entry(text(entry)).or_default().push(i);
    }
    let (mut times, mut ids): (Vec<f64>, Vec<(FactorId, usize)>) = (vec![], vec![]);
    let mut replay = GraphReplay::of(&misled.graph, &Values::new());
    let (mut batches, mut trials) = (0, 0);
    while let Some(step) = replay.step(|key| session.estimate(key)).unwrap() {
        let begin = cpu_seconds();
        let new = session.push(&step.factors, &step.values).unwrap();
        let report = session.update().unwrap();
        times.push(cpu_seconds() - begin);
        batches += usize::from(report.solved_batch);
        trials += report.trials;
        for (id, entry) in new.into_iter().zip(step.factors.factors()) {
            let place = places.get_mut(&text(entry)).and_then(Vec::pop).unwrap();
            ids.push((id, place));
        }
    }
    let place = |id: FactorId| ids.iter().find(|(other, _)| *other == id).unwrap().1;
    let rejected: HashSet<usize> = session.rejections().iter().map(|r| place(r.factor)).collect();
    let values = session.finish(&LevenbergMarquardt::default(), &mut Silent).unwrap().values;
    let (precision, recall, lost) = judge(&rejected, misled);
    let name = format!("session, {trials} trials, {batches} batches");
    Line { name, precision, recall, lost, latencies: Latencies::of(&times), cost: cost(truth, &values) }
}

fn batch(truth: &Graph, misled: &Misled, from: &Values) -> Line {
    let begin = cpu_seconds();
    let solution = solve(&misled.graph, from, &Gnc::default(), &mut Silent).unwrap();
    let time = cpu_seconds() - begin;
    let rejected = solution.outcome.rejected.iter().map(|r| r.factor).collect();
    let (precision, recall, lost) = judge(&rejected, misled);
    let latencies = Latencies::of(&[time]);
    Line { name: "gnc".into(), precision, recall, lost, latencies, cost: cost(truth, &solution.values) }
}

pub(super) fn run(mut arguments: Arguments) -> BenchmarkResult {
    let (mut shares, mut first, mut seeds, mut cluster, mut with_batch, mut files) =
        (vec![], 1, 1, 1, false, vec![]);
    while let Some(argument) = arguments.next() {
        let mut next = || arguments.next().ok_or(format!("{argument} takes a number"));
        match argument.as_str() {
            "--share" => shares.push(next()?.parse::<usize>()?),
            "--first" => first = next()?.parse()?,
            "--seeds" => seeds = next()?.parse()?,
            "--clusters" => cluster = next()?.parse()?,
            "--batch" => with_batch = true,
            _ => files.push(argument),
        }
    }
    println!(
        "| graph | false | seed | | precision | recall | true lost | total s | p50 | p99 | max | cost |"
    );
    println!("| --- | ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for path in files {
        let loaded = pose_graph::read(&path, &PoseGraphOptions::default())?;
        let best = solve(&loaded.graph, &loaded.values, &manifactor_solve::Auto::default(), &mut Silent)?;
        let name = std::path::Path::new(&path).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        for share in &shares {
            for seed in first..first + seeds {
                let misled = mislead(&loaded.graph, &best.values, *share, cluster, seed);
                let mut lines = vec![online(&loaded.graph, &misled)];
                if with_batch {
                    lines.push(batch(&loaded.graph, &misled, &loaded.values));
                }
                for line in lines {
                    println!(
                        "| {name} | {share} % | {seed} | {} | {:.4} | {:.4} | {:.4} | {:.2} | {:.3} | {:.2} | {:.1} | {:.4} |",
                        line.name,
                        line.precision,
                        line.recall,
                        line.lost,
                        line.latencies.total,
                        1e3 * line.latencies.p50,
                        1e3 * line.latencies.p99,
                        1e3 * line.latencies.max,
                        line.cost / best.outcome.final_cost,
                    );
                }
            }
        }
    }
    Ok(())
}
