//! `manifactor replay`: replays a pose graph through the incremental smoother.
use crate::failure::Failure;
use crate::input::destination::Destination;
use crate::input::graph_file::{self, GraphFile};
use crate::input::pictures::PictureStyle;
use crate::input::solver::SolverArguments;
use crate::interrupt;
use crate::output;
use crate::output::text::{Table, count, keys, seconds};
use crate::status::Status;
use clap::Args;
use manifactor::formats::replay::{GraphReplay as Steps, Latencies, ReplayStep};
use manifactor::graph::{Graph, Key};
use manifactor::slam::output::OutputFolder;
use manifactor::smoother::{FactorRejection, Finished, Smoother, Span, UpdateReport};
use manifactor::solve::{AllObservers, Interrupt, Silent};
use manifactor::viz::latencies;
use serde_json::json;
use std::collections::HashSet;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::time::Instant;

/// Replay a pose graph (.g2o, TORO, or a literal graph) pose by pose through the incremental smoother.
///
/// The poses are the variables x0, x1, … in this order. The initial value of each comes from odometry and
/// the estimate of the previous pose. Fixed variables, and those that odometry does not reach, begin at the
/// values in the file. At the end, the whole graph is solved as one batch.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor replay tests/fuzz/corpus/replay/plane.g2o")]
pub(crate) struct Replay {
    /// The graph.
    graph: PathBuf,
    #[command(flatten)]
    solver: SolverArguments,
    #[command(flatten)]
    reading: graph_file::Reading,
    /// Report every N-th pose and the last one; with --json, as one line of JSON each.
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// At each reported pose, also solve the graph so far as one batch, and print by which fraction the
    /// estimate costs more (not timed).
    #[arg(long)]
    gap: bool,
    #[command(flatten)]
    destination: Destination,
    /// Draw the latency of each update into this folder: latency.svg and latency.png.
    #[arg(long, value_name = "DIR")]
    plot: Option<PathBuf>,
    /// Print lines of JSON: the poses, then a summary.
    #[arg(long)]
    pub(crate) json: bool,
}

/// Largest number of rejected factors that are listed.
const NAMED: usize = 6;

/// Result of a replay.
struct Replayed {
    session: Smoother,
    times: Vec<f64>,
    report: UpdateReport,
    interrupted: bool,
    /// Number of factors left out because a variable had already left the window.
    left_out: usize,
    /// Whether old poses leave the smoother.
    has_window: bool,
}

impl Replay {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        self.destination.check(&self.graph)?;
        let claim = |folder| OutputFolder::claim(folder, "replay", &self.graph, false);
        let _claimed = self.plot.as_deref().map(claim).transpose()?;
        if self.solver.names_a_start() {
            return Err(Failure::with_help(
                "--start has no effect in a replay: odometry gives the initial value of each pose",
                "remove --start",
            ));
        }
        let input = self.reading.open(&self.graph, &self.solver)?;
        if matches!(&input.online.window, Some(window) if matches!(window.span, Span::Seconds(_))) {
            return Err(Failure::with_help(
                format!(
                    "{}: the poses have no timestamps, so `online.window.seconds` cannot be used",
                    self.graph.display()
                ),
                "use `window.poses`: --set online.window.poses=200",
            ));
        }
        if input.online.window.is_some() && self.destination.is_given() {
            return Err(Failure::with_help(
                "--out: with `online.window` the smoother keeps only the last poses and a linear prior, which a graph cannot \
                 express",
                "remove the window, or `manifactor solve` the whole graph with --out",
            ));
        }
        input.notes.iter().for_each(|note| output::print_note(note));
        let keys = input.graph.factors().iter().flat_map(|entry| &entry.keys);
        let keys: HashSet<&str> = keys.map(Key::as_str).collect();
        let alone = input.values.iter().filter(|(key, _)| !keys.contains(key.as_str())).count();
        if alone > 0 {
            output::print_note(&format!("{} without factors: left out", count(alone, "variable")));
        }
        let mut interrupt = interrupt::on_ctrl_c();
        let mut replayed = self.replay(&input, &interrupt)?;
        let cost = replayed.session.cost();
        let clock = Instant::now();
        let observer = &mut AllObservers(vec![&mut interrupt]);
        let finished = match replayed.interrupted {
            true => None,
            false => Some(replayed.session.finish(&*input.optimizer, observer).map_err(Failure::input)?),
        };
        let batch = clock.elapsed().as_secs_f64();
        if self.destination.is_given() {
            let values = finished.as_ref().map_or_else(|| replayed.session.estimates(), |f| f.values.clone());
            self.destination.write(&replayed.session.graph().0, &values, &self.graph)?;
        }
        if let Some(folder) = &self.plot {
            let title = format!("{}: latency of each update", self.graph.display());
            let style = PictureStyle::default();
            let picture = latencies(&title, &replayed.times, style.width());
            style.write(folder, picture.as_slice(), |_| ControlFlow::Continue(()))?;
        }
        self.print_summary(&mut replayed, cost, finished.as_ref(), batch);
        Ok(match finished {
            Some(finished) => Status::from(&finished.outcome.termination),
            None => Status::Interrupted,
        })
    }

    fn replay(&self, input: &GraphFile, interrupt: &Interrupt) -> Result<Replayed, Failure> {
        let session = Smoother::new(input.online.clone());
        let report = UpdateReport::default();
        let has_window = input.online.window.is_some();
        let mut replayed =
            Replayed { session, times: vec![], report, interrupted: false, left_out: 0, has_window };
        let mut steps = Steps::of(&input.graph, &input.values);
        if steps.is_empty() {
            return Err(Failure::with_help(
                format!("{}: there are no poses to replay", self.graph.display()),
                "poses are the variables x0, x1, …",
            ));
        }
        let windowed = input.online.window.is_some();
        while let Some(mut step) = steps.step(|key| replayed.session.estimate(key)).map_err(Failure::input)? {
            if interrupt.0.load(Ordering::Relaxed) {
                replayed.interrupted = true;
                break;
            }
            if windowed {
                replayed.left_out += leave_out(&mut step, &replayed.session);
            }
            let clock = Instant::now();
            replayed.session.push(&step.factors, &step.values).map_err(Failure::input)?;
            replayed.report = replayed.session.update().map_err(Failure::input)?;
            let _newest =
                step.values.iter().last().and_then(|(key, _)| replayed.session.estimate(key.as_str()));
            replayed.times.push(clock.elapsed().as_secs_f64());
            if (replayed.times.len() as u64).is_multiple_of(self.every) || steps.is_empty() {
                self.print_step(&mut replayed, input)?;
            }
        }
        Ok(replayed)
    }

    /// Reports the state after the last step.
    fn print_step(&self, replayed: &mut Replayed, input: &GraphFile) -> Result<(), Failure> {
        let Replayed { session, times, report, .. } = replayed;
        let (poses, last) = (times.len(), times.last().copied().unwrap_or_default());
        let cost = session.cost();
        let gap = match self.gap {
            true => {
                let batch = session.finish(&*input.optimizer, &mut Silent).map_err(Failure::input)?;
                Some((cost - batch.outcome.final_cost) / batch.outcome.final_cost.max(1e-9))
            }
            false => None,
        };
        if self.json {
            let line = json!({
                "poses": poses, "variables": session.variables(), "cost": cost, "gap": gap,
                "seconds": last, "report": report,
            });
            output::print_json_line(&line);
        } else {
            let (redone, last) = (count(report.refactorized, "variable"), seconds(last));
            let gap = gap.map_or_else(String::new, |gap| format!(", {gap:.1e} above the batch solve"));
            output::print_message(&format!(
                "{}: cost {cost:.6}{gap}, last update {last} ({redone} eliminated again)",
                count(poses, "pose")
            ));
        }
        Ok(())
    }

    fn print_summary(&self, replayed: &mut Replayed, cost: f64, finished: Option<&Finished>, batch: f64) {
        let Replayed { session, times, report, interrupted, left_out, has_window } = replayed;
        let rejections = session.rejections();
        let latencies = Latencies::of(times);
        let outcome = finished.map(|finished| &finished.outcome);
        if self.json {
            output::print_json_line(&json!({
                "graph": self.graph.display().to_string(),
                "poses": times.len(),
                "variables": session.variables(),
                "latencies": latencies,
                "bytes": session.bytes(),
                "cost": cost,
                "parked": report.undetermined_variables,
                "undetermined": report.undetermined_directions,
                "inactive": report.inactive,
                "final_cost": outcome.map(|o| o.final_cost),
                "termination": outcome.map(|o| &o.termination),
                "batch_seconds": finished.map(|_| batch),
                "rejected": rejections.iter().map(|r| json!({
                    "keys": session.entry(r.factor).map(|entry| &entry.keys), "since": r.since, "cost": r.cost,
                })).collect::<Vec<_>>(),
                "interrupted": interrupted,
                "left_out": left_out,
            }));
            return;
        }
        let mut table = Table::of_numbers(&["", "total", "p50", "p99", "max"]);
        let cells = [latencies.total, latencies.p50, latencies.p99, latencies.max].map(seconds);
        table.row(["updates".to_owned()].into_iter().chain(cells));
        let mut text =
            table.text() + "\n" + &format!("cost {cost:.6} after {}\n", count(times.len(), "pose"));
        if let Some(outcome) = outcome {
            text += &format!(
                "cost {:.6} after a batch solve{} of {}: {}\n",
                outcome.final_cost,
                if *has_window { ", with the linear prior of the window," } else { "" },
                seconds(batch),
                outcome.termination
            );
        }
        if *left_out > 0 {
            text += &format!("{} left out: a variable had left the window\n", count(*left_out, "factor"));
        }
        if !rejections.is_empty() {
            text += &format!("{} rejected as outliers: ", count(rejections.len(), "factor"));
            let name = |r: &FactorRejection| {
                let entry = session.entry(r.factor)?;
                let keys: Vec<&str> = entry.keys.iter().map(Key::as_str).collect();
                Some(format!("{} (update {})", keys.join("-"), r.since))
            };
            let first: Vec<String> = rejections.iter().take(NAMED).filter_map(name).collect();
            let more = if rejections.len() > NAMED { ", …; see --json" } else { "" };
            text += &format!("{}{more}\n", first.join(", "));
        }
        if !report.undetermined_variables.is_empty() {
            text += &format!(
                "undetermined, and excluded until factors determine them: {}\n",
                keys(&report.undetermined_variables)
            );
        }
        for (key, direction) in &report.undetermined_directions {
            text += &format!("no factor constrains {key}.{direction}\n");
        }
        output::print(&text);
    }
}

/// Removes the factors of variables that are no longer in the smoother, and returns their number.
fn leave_out(step: &mut ReplayStep, session: &Smoother) -> usize {
    let is_there = |key: &Key| step.values.contains(key.as_str()) || session.estimate(key.as_str()).is_some();
    let mut factors = Graph::new();
    for entry in step.factors.factors().iter().filter(|entry| entry.keys.iter().all(is_there)) {
        factors.push(entry.clone());
    }
    factors.hold_all_like(&step.factors);
    let left_out = step.factors.factors().len() - factors.factors().len();
    step.factors = factors;
    left_out
}
