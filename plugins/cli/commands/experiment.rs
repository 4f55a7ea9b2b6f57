//! `manifactor experiment`: a sweep from its document to its tables.
use crate::failure::Failure;
use crate::input::document;
use crate::input::pictures::Look;
use crate::interrupt;
use crate::output::text::{count, on_one_line};
use crate::output::{self, summary_table};
use crate::status::Status;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use manifactor::slam::experiment::{self, Experiment as Sweep, Progress, Shard, Summary, TrialLog};
use manifactor::slam::output::{OutputFolder, write_whole};
use manifactor::slam::source::Folders;
use manifactor::solve::{Interrupt, Observer};
use manifactor::viz::{experiment_page, experiment_pictures};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

/// Run a base config once for each cell of a grid, and put what is measured into tables.
///
/// One trial a core at a time. Each trial that is done is kept in trials.jsonl: after a kill or Ctrl-C, the same command
/// goes on where it was. Written are trials.csv and trials.parquet (a row a trial), summary.csv, summary.md and
/// summary.json (means, and paired differences with 95 % bootstrap intervals), times.csv, and report.html, which needs no
/// network.
#[derive(Debug, Args)]
pub(crate) struct Experiment {
    /// The document that describes the experiment.
    config: PathBuf,
    /// Set a value of the document, such as `set.solver.stop.max_iterations=50` or `summary.seed=2`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The folder where public data sets lie.
    #[arg(long, value_name = "DIR", env = "MANIFACTOR_DATA")]
    data: Option<PathBuf>,
    /// The folder for the results. Default: the one that the document names.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that holds files of something else, over those of the same names.
    #[arg(long)]
    force: bool,
    /// Run the trials again that failed before.
    #[arg(long)]
    retry_failed: bool,
    /// Run one part of the trials only, the K-th of N, and keep what is done in a folder of its own: for several machines
    /// that write to one disk, as in `--shard $SLURM_ARRAY_TASK_ID/8`. The same command without it takes over what all parts have
    /// done, runs what is left, and writes the tables.
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Print JSON: the summary that is also written.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Experiment {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let mut document = document::open(&self.config)?;
        document.set(&self.set)?;
        let mut sweep = Sweep::read(&document)?;
        if let Some(out) = &self.out {
            sweep.output.clone_from(out);
        }
        if let Some(shard) = self.shard {
            sweep.keep(shard);
        }
        let folders = Folders { data: self.data.clone(), document: sweep.folder.clone() };
        let claimed = OutputFolder::claim(&sweep.output, "experiment", &self.config, self.force)?;
        let mut journal = TrialLog::open(claimed)?;
        journal.take_over_shards()?;
        if self.retry_failed {
            journal.retry_failed();
        }
        let mut interrupt = interrupt::on_ctrl_c();
        let bar = Bar::new(&sweep.title);
        let threads = rayon::current_num_threads();
        let show = |progress| bar.show(progress);
        let complete = experiment::run(&sweep, &folders, &mut journal, threads, &interrupt, show)?;
        let mut status = if complete { Status::Done } else { Status::Interrupted };
        if self.shard.is_some() {
            drop(bar);
            let (trials, folder) = (count(sweep.trials.len(), "trial"), sweep.output.display());
            output::say(&format!(
                "This part has {trials}: {folder}. The same command without --shard makes the tables."
            ));
            return Ok(status);
        }
        // one that has ended the trials does not end the drawing as well
        if !complete {
            interrupt = Interrupt::default();
        }
        let (summary, is_drawn) = write_until(&sweep, &journal, document.source().text(), |file| {
            bar.show_drawing(file);
            interrupt.poll()
        })?;
        drop(bar);
        self.tell(&sweep, &summary);
        if !is_drawn {
            status = Status::Interrupted;
            output::say(
                "interrupted: pictures are missing, or those of an earlier run; the same command draws them",
            );
        }
        Ok(status)
    }

    fn tell(&self, sweep: &Sweep, summary: &Summary) {
        if self.json {
            output::json(summary);
        } else {
            output::print(&summary_table::of(summary));
            output::print(&format!("\nWritten to {}.\n", sweep.output.display()));
        }
        if summary.open > 0 {
            let open = count(summary.open, "trial");
            output::say(&format!("{open} still to be run: the same command goes on."));
        }
    }
}

/// Writes all files of an experiment: its tables, pictures and page. `text` is its document.
///
/// # Errors
/// If one cannot be written; those before it are there.
pub fn write_experiment(sweep: &Sweep, journal: &TrialLog, text: &str) -> Result<Summary, Failure> {
    write_until(sweep, journal, text, |_| ControlFlow::Continue(())).map(|(summary, _)| summary)
}

/// Writes all files of an experiment, the pictures last. `goes_on` can end the drawing before each file; returns also
/// whether all pictures are written.
fn write_until(
    sweep: &Sweep,
    journal: &TrialLog,
    text: &str,
    goes_on: impl FnMut(&str) -> ControlFlow<()>,
) -> Result<(Summary, bool), Failure> {
    let summary = experiment::write(sweep, journal)?;
    let trials = experiment::trials_table(sweep, journal);
    let page = experiment_page(sweep, &summary, &trials, text);
    write_whole(&sweep.output.join("report.html"), page)?;
    let look = Look::default();
    let pictures = experiment_pictures(sweep, &summary, &trials, look.width());
    let is_drawn = look.write(&sweep.output, &pictures, goes_on)?;
    Ok((summary, is_drawn))
}

/// How far it is: a bar on a terminal, a line now and then in a file.
enum Bar {
    Terminal(ProgressBar),
    Lines,
}

impl Bar {
    fn new(title: &str) -> Self {
        if !std::io::stderr().is_terminal() {
            return Self::Lines;
        }
        let bar = ProgressBar::new(0).with_prefix(on_one_line(title).into_owned());
        let template = "{prefix} {wide_bar} {pos}/{len} trials, {elapsed} gone, {eta} left {msg}";
        // the template is a literal: without it the default style is as good
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self::Terminal(bar)
    }

    fn show(&self, Progress { done, kept, trials }: Progress) {
        match self {
            Self::Terminal(bar) => {
                if done == kept {
                    // what was kept took no time now, and says nothing of the time left
                    bar.set_length(trials as u64);
                    bar.set_position(kept as u64);
                    bar.reset_eta();
                    if kept > 0 {
                        bar.set_message(format!("({kept} kept)"));
                    }
                }
                bar.set_position(done as u64);
            }
            // twenty lines or so
            Self::Lines if done == kept || done == trials || done % trials.div_ceil(20) == 0 => {
                output::say(&format!("{done} of {} done, {kept} of them before", count(trials, "trial")));
            }
            Self::Lines => {}
        }
    }

    /// Names the picture that is drawn, once all trials are done.
    fn show_drawing(&self, file: &str) {
        if let Self::Terminal(bar) = self {
            bar.set_message(format!("drawing {file}"));
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        if let Self::Terminal(bar) = self {
            bar.finish_and_clear();
        }
    }
}
