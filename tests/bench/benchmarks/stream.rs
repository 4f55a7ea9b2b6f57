//! A run's sequence frame by frame, compared with the batch: latencies, gaps, trajectories.
//!
//! `measure stream RUN.toml [--data FOLDER] [--variant NAME] [--gap N] [KEY=VALUE…]`; times are
//! wall-clock times of one thread.
use super::{Arguments, BenchmarkResult};
use manifactor_config::Document;
use manifactor_formats::replay::Latencies;
use manifactor_slam::report::{TrajectoryReport, VariantReport};
use manifactor_slam::run::{MappedFrame, Run, StreamEvent, StreamWatcher};
use manifactor_slam::run_document::RunDocument;
use manifactor_solve::{Optimizer, Silent};
use std::ops::ControlFlow;
use std::sync::Arc;

/// Computes the gap to a batch solve of the same factors, every `every` frames.
struct Gaps {
    every: usize,
    frames: usize,
    solver: Arc<dyn Optimizer>,
    found: Vec<f64>,
    batches: Vec<usize>,
    longest: Vec<(f64, usize, String)>,
}

impl StreamWatcher for Gaps {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        let StreamEvent::Frame(MappedFrame { report, mapper, seconds, .. }) = event else {
            return ControlFlow::Continue(());
        };
        self.frames += 1;
        if let Ok(report) = report {
            if report.updates.iter().any(|u| u.solved_batch) {
                self.batches.push(report.frame);
            }
            let what = format!(
                "initialized {} revised {} redone {:?} damped {:?} passes {:?} batch {:?}",
                report.initialized.len(),
                report.revised.len(),
                report.updates.iter().map(|u| u.refactorized).collect::<Vec<_>>(),
                report.updates.iter().map(|u| u.damped).collect::<Vec<_>>(),
                report.updates.iter().map(|u| u.passes).collect::<Vec<_>>(),
                report.updates.iter().map(|u| u.solved_batch).collect::<Vec<_>>(),
            );
            self.longest.push((seconds, report.frame, what));
        }
        if self.every > 0 && self.frames.is_multiple_of(self.every) {
            let session = mapper.smoother();
            let cost = session.cost();
            let batch = session.finish(&*self.solver, &mut Silent).unwrap().outcome.final_cost;
            self.found.push((cost - batch) / batch.max(1e-9));
        }
        ControlFlow::Continue(())
    }
}

pub(super) fn run(mut arguments: Arguments) -> BenchmarkResult {
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global().unwrap();
    let (mut config, mut data, mut name, mut every, mut sets) = (None, None, None, 0, vec![]);
    while let Some(argument) = arguments.next() {
        match argument.as_str() {
            "--data" => data = arguments.next(),
            "--variant" => name = arguments.next(),
            "--gap" => every = arguments.next().unwrap().parse().unwrap(),
            _ if argument.contains('=') => sets.push(argument),
            _ => config = Some(argument),
        }
    }
    let data = data.or_else(|| std::env::var("MANIFACTOR_DATA").ok());
    let mut document = Document::open(config.unwrap()).unwrap();
    document.set(&sets).unwrap();
    let document = RunDocument::read(&document).unwrap();
    for variant in document.variants.iter().filter(|v| name.as_ref().is_none_or(|name| *name == v.name)) {
        let mut run = Run::new(&document, data.clone().map(Into::into));
        let solver = variant.settings.solver.clone();
        let mut gaps = Gaps { every, frames: 0, solver, found: vec![], batches: vec![], longest: vec![] };
        let (_, report) = run.run_variant_online(variant, &mut gaps).unwrap();
        let (_, batch) = run.run_variant(variant, &mut Silent).unwrap();
        print_report(&report, &batch);
        gaps.found.sort_by(f64::total_cmp);
        if let (Some(median), Some(most)) = (gaps.found.get(gaps.found.len() / 2), gaps.found.last()) {
            println!("  gap: median {median:.1e}, max {most:.1e}");
        }
        println!("  batches at {:?}", gaps.batches);
        gaps.longest.sort_by(|a, b| b.0.total_cmp(&a.0));
        for (seconds, frame, what) in gaps.longest.iter().take(5) {
            println!("  {:.1} ms at {frame}: {what}", 1e3 * seconds);
        }
    }
    Ok(())
}

/// Prints the latencies of the stream, and its result next to that of the batch.
fn print_report(report: &VariantReport, batch: &VariantReport) {
    let Some(online) = &report.online else { return };
    let Latencies { total, p50, p99, max } = online.latencies;
    let ms = 1e3;
    println!(
        "{}: {} frames, total {total:.2} s, p50 {:.2}, p99 {:.2}, max {:.1} ms; {} MB",
        report.name,
        online.seconds.len(),
        ms * p50,
        ms * p99,
        ms * max,
        online.bytes / 1_000_000
    );
    println!(
        "  {} objects live ({} initialized, {} removed, {} revised, {} refused), {} at the end, {} in batch; {} boxes, {}",
        online.objects,
        online.initialized,
        online.removed,
        online.revised,
        online.refusals,
        report.counts.objects,
        batch.counts.objects,
        report.counts.boxes,
        batch.counts.boxes,
    );
    println!(
        "  cost live {:.3}, at the end {:.6}, in batch {:.6}; {} batch solves",
        online.cost, report.solve.final_cost, batch.solve.final_cost, online.solved_batch
    );
    for (how, report) in [("live", report), ("batch", batch)] {
        if let Some((then, now)) =
            report.association.as_ref().and_then(|a| Some((a.at_the_time?, a.in_the_end?)))
        {
            println!(
                "  {how}: F1 at the time {:.3}; in the end P {:.3} R {:.3} F1 {:.3}, homogeneity {:.3}, completeness {:.3}, identity F1 {:.3}, {} switches, {} objects of {}",
                then.f1,
                now.precision,
                now.recall,
                now.f1,
                now.homogeneity,
                now.completeness,
                now.identity_f1,
                now.switches,
                now.objects,
                now.true_objects,
            );
        }
    }
    let ate = |of: &[TrajectoryReport]| {
        of.first().map_or((0.0, 0.0), |t| (t.odometry.ate.rmse, t.estimate.ate.rmse))
    };
    println!(
        "  first refusals: {:?}\n  ATE odometry {:.5}, live {:.5}, at the end {:.5}, batch {:.5}",
        online.refused.iter().take(2).collect::<Vec<_>>(),
        ate(&online.trajectory).0,
        ate(&online.trajectory).1,
        ate(&report.trajectory).1,
        ate(&batch.trajectory).1
    );
}
