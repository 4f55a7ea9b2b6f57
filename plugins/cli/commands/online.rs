//! `manifactor online`: a run frame by frame, as they come.
use super::run::RunOptions;
use crate::failure::Failure;
use crate::interrupt;
use crate::output;
use crate::output::text::{count, seconds};
use crate::output::watch::Watch as Progress;
use crate::status::Status;
use crate::view::{Solve, View, address};
use clap::Args;
use manifactor::slam::online::{FrameError, FrameReport, Mapper};
use manifactor::slam::run::{RunError, Watch};
use manifactor::slam::sequence::Observation;
use manifactor::solve::{All, Interrupt};
use serde_json::json;
use std::net::SocketAddr;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// Map frame by frame, as they come, then solve all of it as one batch.
///
/// The document is that of `manifactor run`, and so are the results; `live.txt` has the poses as they were estimated when their
/// frames came, and latency.svg how long each frame took. An object is mapped as soon as it can be placed. Noise is as given until the
/// end. The table `online` of the document has the settings of the smoother.
#[derive(Debug, Args)]
pub(crate) struct Online {
    #[command(flatten)]
    pub(crate) options: RunOptions,
    /// Wait for each frame's time: 1 is as fast as it was recorded, 2 twice as fast. Default: no waiting.
    #[arg(long, value_name = "X", value_parser = faster)]
    rate: Option<f64>,
    /// Keep the frames in this file as they come, and begin with those that it has: after a kill, the same command goes on with
    /// the same map.
    #[arg(long, value_name = "FILE")]
    journal: Option<PathBuf>,
    /// Tell of every N-th frame on stderr, and of the one that shows the place in a prior map; with --json, in a line of JSON each.
    #[arg(long, value_name = "N", default_value_t = 500, value_parser = clap::value_parser!(u64).range(1..))]
    every: u64,
    /// Serve a page of the map as it grows, and tell its address on stderr. Default: for browsers of this machine, at a free port;
    /// --view=8080 is another port. Other machines can look with --view=0.0.0.0:8080 and the token in the address.
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "0", value_parser = address)]
    view: Option<SocketAddr>,
}

fn faster(text: &str) -> Result<f64, String> {
    let rate = text.parse().ok().filter(|rate: &f64| *rate > 0.0 && rate.is_finite());
    rate.ok_or_else(|| "expected a number above 0: 1 is as fast as it was recorded".to_owned())
}

impl Online {
    pub(crate) fn run(&self, verbose: u8) -> Result<Status, Failure> {
        let mut interrupt = interrupt::on_ctrl_c();
        let for_results = interrupt.clone();
        let mut view = self.view.map(View::open).transpose()?;
        let report = self.options.run_as("online", verbose, for_results, |run, variant| {
            if let Some(view) = &mut view {
                view.begin(&run.document.title, &variant.name, self.options.json);
            }
            if let Some(journal) = &self.journal {
                check_journal(journal, &run.document.output)?;
                run.keep_frames(journal.clone());
            }
            let mut progress = Progress::new(verbose, &variant.name);
            let interrupted = interrupt.clone();
            let mut solve = Solve(view.as_ref());
            let mut observers = All(vec![&mut progress, &mut interrupt, &mut solve]);
            let mut frames =
                Frames { command: self, interrupt: interrupted, view: view.as_ref(), frames: 0, begun: None };
            let done = run.variant_online(variant, &mut frames, &mut observers)?;
            if let Some(view) = &view {
                view.settle(&done.0);
            }
            Ok(done)
        });
        if let Some(view) = view {
            view.end(match &report {
                Ok(report) if report.complete => "all is written",
                Ok(_) => "interrupted; what there was is written",
                Err(_) => "it failed: the program says why",
            });
        }
        let report = report?;
        if self.options.json {
            output::json_line(&report);
        }
        Ok(Status::from(&report))
    }
}

/// A journal in the folder of the results could be written over by them, or taken for one of them.
fn check_journal(journal: &Path, output: &Path) -> Result<(), RunError> {
    // the folder of the results is there by now
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

/// Tells of frames, and keeps their time.
struct Frames<'a> {
    command: &'a Online,
    interrupt: Interrupt,
    view: Option<&'a View>,
    frames: u64,
    /// When the first frame came, and its time stamp.
    begun: Option<(Instant, f64)>,
}

/// While it waits, it looks this often whether somebody has interrupted it.
const NAP: Duration = Duration::from_millis(50);

impl Frames<'_> {
    fn is_interrupted(&self) -> bool {
        self.interrupt.0.load(Ordering::Relaxed)
    }

    fn goes_on(&self) -> ControlFlow<()> {
        if self.is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn tell(&self, report: &FrameReport, mapper: &Mapper, took: f64) {
        let (objects, undetermined) =
            (mapper.mapped(), report.updates.last().map_or(0, |u| u.undetermined.len()));
        if self.command.options.json {
            output::json_line(&json!({ "seconds": took, "objects": objects, "report": report }));
        } else {
            let open = if undetermined > 0 {
                format!(", {undetermined} directions undetermined")
            } else {
                String::new()
            };
            let frames = count(report.frame + 1, "frame");
            output::say(&format!(
                "{frames}: {}{open}, the last in {}",
                count(objects, "object"),
                seconds(took)
            ));
        }
    }
}

impl Watch for Frames<'_> {
    fn quiet(&mut self) -> ControlFlow<()> {
        self.goes_on()
    }

    fn wait(&mut self, timestamp: f64) -> ControlFlow<()> {
        let Some(rate) = self.command.rate else { return ControlFlow::Continue(()) };
        let (begun, first) = *self.begun.get_or_insert((Instant::now(), timestamp));
        // a stamp that does not come after the first needs no waiting
        let due = Duration::try_from_secs_f64((timestamp - first) / rate).unwrap_or_default();
        while let Some(left) = due.checked_sub(begun.elapsed()).filter(|_| !self.is_interrupted()) {
            std::thread::sleep(left.min(NAP));
        }
        self.goes_on()
    }

    fn frame(
        &mut self,
        report: Result<&FrameReport, &FrameError>,
        observation: Option<&Observation>,
        mapper: &mut Mapper,
        took: f64,
    ) -> ControlFlow<()> {
        self.frames += 1;
        if let Some(view) = self.view {
            view.frame(report, observation, mapper, took);
        }
        match report {
            Ok(report) => {
                report.refused.iter().for_each(|refused| output::note(refused));
                if let Some(located) = &report.located {
                    let (frames, objects) =
                        (count(report.frame + 1, "frame"), count(located.matches.len(), "object"));
                    output::note(&format!(
                        "after {frames} the place in the prior map is found, by {objects}: names and poses are those of that map from now on"
                    ));
                }
                if self.frames.is_multiple_of(self.command.every) || report.located.is_some() {
                    self.tell(report, mapper, took);
                }
            }
            Err(error) => output::note(&error.to_string()),
        }
        self.goes_on()
    }

    fn end(&mut self, mapper: &mut Mapper) {
        if let Some(view) = self.view {
            view.refresh(mapper);
        }
    }
}
