//! Replays pose graphs through a session, pose by pose. Reports latencies, and the gap between the estimate
//! and the optimum of the graph so far.
//!
//! `cargo run --release -p manifactor-bench -- measure replay [--gaps N] [--clamp] [--json] GRAPH.g2o…`.
//! The initial value of each pose comes from its odometry, never from the file's vertices. Times are CPU
//! times of one thread in milliseconds; the gap is (cost − optimum) / optimum, every N poses.
use super::{Arguments, BenchmarkResult, cpu_seconds};
use manifactor_formats::pose_graph::{self, InformationRepair, PoseGraph, PoseGraphOptions};
use manifactor_formats::replay::{GraphReplay, Latencies};
use manifactor_smoother::{Smoother, SmootherSettings};
use manifactor_solve::{LevenbergMarquardt, Silent};

pub(super) fn run(mut arguments: Arguments) -> BenchmarkResult {
    let (mut gaps, mut options, mut json, mut files) = (0, PoseGraphOptions::default(), false, vec![]);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--gaps" => gaps = arguments.next().ok_or("--gaps takes a number")?.parse()?,
            "--clamp" => options.repair = InformationRepair::Clamp,
            "--json" => json = true,
            _ => files.push(argument),
        }
    }
    if !json {
        println!(
            "| graph | steps | total s | p50 | p99 | max | gap, median | gap, max | damped | batches | cost | after finish | MB |"
        );
        println!(
            "| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |"
        );
    }
    for path in files {
        let PoseGraph { graph, values, .. } = pose_graph::read(&path, &options)?;
        let mut session = Smoother::new(SmootherSettings::default());
        let (mut times, mut differences) = (vec![], vec![]);
        let (mut damped, mut batches) = (0, 0);
        let mut replay = GraphReplay::of(&graph, &values);
        while let Some(step) = replay.step(|key| session.estimate(key))? {
            let begin = cpu_seconds();
            session.push(&step.factors, &step.values)?;
            let report = session.update()?;
            let _newest = step.values.iter().last().and_then(|(key, _)| session.estimate(key.as_str()));
            times.push(cpu_seconds() - begin);
            damped += report.damped;
            batches += usize::from(report.solved_batch);
            if gaps > 0 && times.len() % gaps == 0 {
                let best = session.finish(&LevenbergMarquardt::default(), &mut Silent)?.outcome.final_cost;
                differences.push((session.cost() - best) / best.max(1e-9));
            }
        }
        let name = std::path::Path::new(&path).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let cost = session.cost();
        let finished = session.finish(&LevenbergMarquardt::default(), &mut Silent)?.outcome.final_cost;
        if json {
            let latencies = Latencies::of(&times);
            let told = serde_json::json!({
                "latencies": latencies, "steps": times.len(), "cost": cost, "finished": finished, "gaps": differences,
                "damped": damped, "batches": batches, "bytes": session.bytes(),
            });
            println!("{told}");
            continue;
        }
        let (table, gap) = (Latencies::of(&times), Latencies::of(&differences));
        println!(
            "| {name} | {} | {:.3} | {:.3} | {:.2} | {:.1} | {:.1e} | {:.1e} | {damped} | {batches} | {cost:.6} | {finished:.6} | {:.1} |",
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
