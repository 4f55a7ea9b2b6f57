//! Replays pose graphs through a session, pose by pose: latencies, and how far the estimate is from the optimum of what was
//! known so far.
//!
//! `cargo run --release -p manifactor-formats --example replay -- [--gaps N] [--clamp] GRAPH.g2o…`. Each pose starts from its
//! odometry, never from the file's vertices. Milliseconds; the gap is (cost − optimum) / optimum, every N poses.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]
use manifactor_formats::pose_graph::{self, Options, Repair};
use manifactor_formats::replay::{Latencies, Replay};
use manifactor_online::{Session, Settings};
use manifactor_solve::{LevenbergMarquardt, Silent};
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut gaps, mut options, mut files) = (0, Options::default(), vec![]);
    let mut arguments = std::env::args().skip(1);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--gaps" => gaps = arguments.next().ok_or("--gaps takes a number")?.parse()?,
            "--clamp" => options.repair = Repair::Clamp,
            _ => files.push(argument),
        }
    }
    println!("| graph | steps | total s | p50 | p99 | max | gap, median | gap, max | cost | after finish | MB |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    for path in files {
        let graph = pose_graph::read(&path, &options)?.graph;
        let mut session = Session::new(Settings::default());
        let (mut times, mut differences) = (vec![], vec![]);
        let mut replay = Replay::of(&graph);
        while let Some(step) = replay.step(|key| session.estimate(key))? {
            let clock = Instant::now();
            session.push(&step.factors, &step.values)?;
            session.update()?;
            let _newest = step.values.iter().last().and_then(|(key, _)| session.estimate(key.as_str()));
            times.push(clock.elapsed().as_secs_f64());
            if gaps > 0 && times.len() % gaps == 0 {
                let best = session.finish(&LevenbergMarquardt::default(), &mut Silent)?.outcome.final_cost;
                differences.push((session.cost() - best) / best.max(1e-9));
            }
        }
        let name = std::path::Path::new(&path).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let cost = session.cost();
        let finished = session.finish(&LevenbergMarquardt::default(), &mut Silent)?.outcome.final_cost;
        let (table, gap) = (Latencies::of(&times), Latencies::of(&differences));
        println!(
            "| {name} | {} | {:.3} | {:.3} | {:.2} | {:.1} | {:.1e} | {:.1e} | {cost:.6} | {finished:.6} | {:.1} |",
            times.len(),
            table.total,
            1e3 * table.p50,
            1e3 * table.p99,
            1e3 * table.max,
            gap.p50,
            gap.max,
            session.bytes() as f64 / 1e6,
        );
    }
    Ok(())
}
