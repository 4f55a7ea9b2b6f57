//! Memory and time of a pose graph that is repeated through a moving window.
//!
//! `cargo run --release -p manifactor-bench -- measure window [--passes N] [--poses N] GRAPH.g2o`. Each
//! pass drives the graph again from the end of the previous pass, with new names; factors to marginalized
//! poses are left out. Times are CPU times of one thread in milliseconds.
use super::{Arguments, BenchmarkResult, cpu_seconds, resident};
use manifactor_formats::pose_graph::{self, PoseGraph, PoseGraphOptions};
use manifactor_formats::replay::{GraphReplay, Latencies};
use manifactor_graph::{FactorEntry, Graph, Key, Values};
use manifactor_smoother::{Smoother, SmootherSettings, Span, Window};
use std::num::NonZeroUsize;

pub(super) fn run(mut arguments: Arguments) -> BenchmarkResult {
    let (mut passes, mut poses, mut path) = (10, 200, String::new());
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--passes" => passes = arguments.next().ok_or("--passes takes a number")?.parse()?,
            "--poses" => poses = arguments.next().ok_or("--poses takes a number")?.parse()?,
            _ => path = argument,
        }
    }
    let PoseGraph { graph, values, .. } = pose_graph::read(&path, &PoseGraphOptions::default())?;
    let window = Some(Window::from(Span::Poses(NonZeroUsize::new(poses).unwrap())));
    let mut session = Smoother::new(SmootherSettings { window, ..SmootherSettings::default() });
    let name = |pass: usize, key: &Key| Key::from(format!("{pass}:{key}"));
    let mut last: Option<Key> = None;
    println!("| pass | left out | p50 | p99 | max | MB of fronts | MB of the process | bytes saved |");
    println!("| ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for pass in 0..passes {
        let (mut replay, mut times, mut left_out) = (GraphReplay::of(&graph, &values), vec![], 0);
        // estimates of the pass without a window, from which odometry continues
        let mut all = Values::new();
        while let Some(step) = replay.step(|key| {
            let now = session.estimate(name(pass, &key.into()).as_str());
            now.or_else(|| all.variable(key).map(|value| value.erased().clone_box()))
        })? {
            let (mut factors, mut values) = (Graph::new(), Values::new());
            for (key, value) in step.values.iter() {
                all.insert_boxed(key.clone(), value.erased().clone_box());
                // a new pass begins at the end of the previous one
                let start = last.take_if(|_| pass > 0 && times.is_empty());
                let place = start.and_then(|last| session.estimate(last.as_str()));
                values.insert_boxed(name(pass, key), place.unwrap_or_else(|| value.erased().clone_box()));
                last = Some(name(pass, key));
            }
            let is_there =
                |key: &Key| values.contains(key.as_str()) || session.estimate(key.as_str()).is_some();
            for entry in step.factors.factors() {
                let keys: Vec<Key> = entry.keys.iter().map(|key| name(pass, key)).collect();
                if keys.iter().all(is_there) {
                    factors.push(FactorEntry { keys, ..entry.clone() });
                } else {
                    left_out += 1;
                }
            }
            for (key, held) in step.factors.fixed() {
                factors.set_fixed(name(pass, key), held.clone());
            }
            let begin = cpu_seconds();
            session.push(&factors, &values)?;
            session.update()?;
            times.push(1e3 * (cpu_seconds() - begin));
        }
        let Latencies { p50, p99, max, .. } = Latencies::of(&times);
        let (fronts, saved) = (session.bytes() as f64 / 1e6, session.save()?.len());
        println!(
            "| {pass} | {left_out} | {p50:.3} | {p99:.2} | {max:.1} | {fronts:.2} | {:.1} | {saved} |",
            resident()
        );
    }
    Ok(())
}
