//! `manifactor online`: maps a run frame by frame.
use super::run::RunOptions;
use crate::failure::Failure;
use crate::interrupt;
use crate::output;
use crate::output::text::{count, seconds};
use crate::output::watch::Watch as Progress;
use crate::status::Status;
use crate::view::{SolveDisplay, View, address};
use clap::Args;
use manifactor::slam::online::{FrameReport, Mapper, ObjectUpdates};
use manifactor::slam::run::{MappedFrame, RunError, StreamEvent, StreamWatcher};
use manifactor::solve::{Interrupt, Observer};
use manifactor::viz::SceneRecording;
use serde_json::json;
use std::net::SocketAddr;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Map frame by frame as the frames arrive, then solve everything as one batch.
///
/// The document and the results are the same as for `manifactor run`. In addition, live.txt holds the poses
/// as estimated when their frames arrived, and latency.svg the time of each frame. An object is added to
/// the map as soon as it can be initialized. With `variance_components`, the noise is estimated from the
/// first seconds, and again from all data at the end. The settings of the smoother are in the table `online`
/// of the document.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor online examples/desk/desk.toml --out out/online --every 50")]
pub(crate) struct Online {
    #[command(flatten)]
    pub(crate) options: RunOptions,
    /// Wait for the time of each frame: 1 is recorded speed, 2 is twice that. Default: no waiting.
    #[arg(long, value_name = "X", value_parser = faster)]
    rate: Option<f64>,
    /// Save the frames in this file as they arrive, and begin with the frames it already holds, so that
    /// after a kill the same command continues with the same map.
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// Report every N-th frame on stderr, and the frame of the relocalization in a prior map; with --json,
    /// as one line of JSON each.
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// Add the objects that have changed since the last line to each line of --json: state, class, ellipsoid and
    /// covariance. With --every 1, a program can follow the map frame by frame.
    #[arg(long, requires = "json")]
    map: bool,
    /// Serve a live page of the map, and print its address on stderr. Default: a free port, for browsers on
    /// this machine only; --view=8080 sets the port. --view=0.0.0.0:8080 admits other machines, which need
    /// the token in the address.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "0", value_parser = address)]
    view: Option<SocketAddr>,
}

fn faster(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| *rate > 0.0 && rate.is_finite());
    rate.ok_or_else(|| "expected a number above 0; 1 is the recorded speed".to_owned())
}

impl Online {
    pub(crate) fn run(&self, verbose: u8) -> Result<Status, Failure> {
        let interrupt = interrupt::on_ctrl_c();
        let for_results = interrupt.clone();
        let mut view = self.view.map(View::open).transpose()?;
        let report = self.options.run_as("online", verbose, for_results, |run, variant, scene| {
            if let Some(view) = &mut view {
                view.begin(&run.document.title, &variant.name, self.options.json);
            }
            if let Some(journal) = &self.journal {
                check_journal(journal, &run.document.output)?;
                run.journal_frames(journal.clone());
            }
            let mut frames = Frames {
                command: self,
                interrupt: interrupt.clone(),
                progress: Progress::new(verbose, &variant.name),
                view: view.as_ref(),
                scene: scene.as_mut().map(|scene| (scene, format!("{}/live", variant.name))),
                shown: ObjectUpdates::default(),
                frames: 0,
                begun: None,
                objects: ObjectUpdates::default(),
            };
            let done = run.run_variant_online(variant, &mut frames)?;
            if let Some(view) = &view {
                view.show_estimate(&done.0);
            }
            Ok(done)
        });
        if let Some(view) = view {
            view.end(match &report {
                Ok(report) if report.complete => "finished; all files are written",
                Ok(_) => "interrupted; the results so far are written",
                Err(_) => "failed; see the error message of the program",
            });
        }
        let report = report?;
        if self.options.json {
            output::print_json_line(&report);
        }
        Ok(Status::from(&report))
    }
}

/// Returns an error if the journal is in the folder of the results, which could overwrite it or be confused
/// with it.
fn check_journal(journal: &Path, output: &Path) -> Result<(), RunError> {
    // at this point, the folder of the results exists
    let folder = journal.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let is_inside = match (folder.canonicalize(), output.canonicalize()) {
        (Ok(folder), Ok(output)) => folder.starts_with(output),
        _ => false,
    };
    match is_inside {
        true => Err(RunError::JournalAmongResults { path: journal.to_owned(), output: output.to_owned() }),
        false => Ok(()),
    }
}

/// Reports frames and the final solve, and waits for the times of the frames.
struct Frames<'a> {
    command: &'a Online,
    interrupt: Interrupt,
    progress: Progress,
    view: Option<&'a View>,
    frames: u64,
    /// Arrival time of the first frame, and its timestamp.
    begun: Option<(Instant, f64)>,
    /// Objects as printed last.
    objects: ObjectUpdates,
    /// File for viewers, with the name of the growing map in it.
    scene: Option<(&'a mut SceneRecording, String)>,
    /// Objects as written to this file last.
    shown: ObjectUpdates,
}

/// Interval at which a waiting command checks for an interrupt.
const NAP: Duration = Duration::from_millis(50);

impl Frames<'_> {
    fn is_interrupted(&self) -> bool {
        self.interrupt.0.load(Ordering::Relaxed)
    }

    fn print_frame(&mut self, report: &FrameReport, mapper: &Mapper, took: f64) {
        let (objects, undetermined) =
            (mapper.mapped_objects(), report.updates.last().map_or(0, |u| u.undetermined_directions.len()));
        if self.command.options.json {
            let mut line = json!({ "seconds": took, "objects": objects, "report": report });
            if self.command.map {
                line["map"] = json!(self.objects.take(mapper));
            }
            output::print_json_line(&line);
        } else {
            let open = if undetermined > 0 {
                format!(", {undetermined} directions undetermined")
            } else {
                String::new()
            };
            let frames = count(report.frame + 1, "frame");
            output::print_message(&format!(
                "{frames}: {}{open}, last frame in {}",
                count(objects, "object"),
                seconds(took)
            ));
        }
    }

    /// Waits until the frame is due.
    fn wait_for(&mut self, timestamp: f64) {
        let Some(rate) = self.command.rate else { return };
        let (begun, first) = *self.begun.get_or_insert((Instant::now(), timestamp));
        // a timestamp that is not after the first one needs no waiting
        let due = Duration::try_from_secs_f64((timestamp - first) / rate).unwrap_or_default();
        while let Some(left) = due.checked_sub(begun.elapsed()).filter(|_| !self.is_interrupted()) {
            std::thread::sleep(left.min(NAP));
        }
    }

    fn report_frame(&mut self, mut frame: MappedFrame<'_>) {
        self.frames += 1;
        if let Some(view) = self.view {
            view.frame(&mut frame);
        }
        let report = match frame.report {
            Ok(report) => report,
            Err(error) => return output::print_note(&error.to_string()),
        };
        if let Some((scene, name)) = &mut self.scene {
            scene.add_frame(name, (report.timestamp, &report.pose), &self.shown.take(frame.mapper));
        }
        report.refused.iter().for_each(|refused| output::print_note(refused));
        let frames = count(report.frame + 1, "frame");
        if let Some(located) = &report.located {
            output::print_note(&format!(
                "after {frames}, relocalized in the prior map by {}: from now on, names and poses are those of that map",
                count(located.matches.len(), "object")
            ));
        }
        if let Some(jump) = &report.jump {
            output::print_note(&format!(
                "after {frames}, relocalized by {} after a jump of the odometry: the poses since then are corrected, and names may differ",
                count(jump.matches.len(), "object")
            ));
        }
        if let Some(noise) = &report.noise {
            output::print_note(&format!("after {frames}, noise estimated: {noise}"));
        }
        let is_special = report.located.is_some() || report.jump.is_some() || report.noise.is_some();
        if is_special || self.frames.is_multiple_of(self.command.every) {
            self.print_frame(report, frame.mapper, frame.seconds);
        }
    }

    fn report_last_frame(&mut self, mapper: &mut Mapper) {
        if self.command.map {
            let changed = self.objects.take(mapper);
            if !changed.is_empty() {
                output::print_json_line(&json!({ "map": changed }));
            }
        }
        if let Some(view) = self.view {
            view.refresh(mapper);
        }
    }
}

impl StreamWatcher for Frames<'_> {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        match event {
            StreamEvent::Idle => {}
            StreamEvent::FrameArrived { timestamp } => self.wait_for(timestamp),
            StreamEvent::Frame(frame) => self.report_frame(frame),
            StreamEvent::LastFrame { mapper } => self.report_last_frame(mapper),
            StreamEvent::Iteration(record) => {
                // neither ends the solve
                _ = self.progress.iteration(record);
                _ = SolveDisplay(self.view).iteration(record);
            }
        }
        if self.is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}
