//! `manifactor experiment`: runs a sweep from its document to its tables.
use crate::failure::Failure;
use crate::input::pictures::PictureStyle;
use crate::input::{document, kind};
use crate::interrupt;
use crate::output::text::{count, on_one_line};
use crate::output::{self, summary_table};
use crate::status::Status;
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};

use manifactor::slam::experiment::{
    self, Experiment as Sweep, ExperimentProgress, ExperimentSummary, Shard, TrialLog,
};
use manifactor::slam::output::{OutputFolder, write_whole};
use manifactor::solve::{Interrupt, Observer};
use manifactor::viz::{experiment_page, experiment_pictures};
use std::io::IsTerminal;
use std::ops::ControlFlow;
use std::path::PathBuf;
use std::time::Duration;

/// Run a base config once for each cell of a grid, and write tables of the results.
///
/// Each core runs one trial at a time. Every finished trial is saved in trials.jsonl, so after a kill or
/// Ctrl-C the same command continues from there. The outputs are trials.csv and trials.parquet (one row per
/// trial), summary.csv, summary.md and summary.json (means, and paired differences with 95 % bootstrap
/// intervals), times.csv, and report.html, which needs no network.
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  manifactor experiment examples/experiments/simulation/tuning.toml")]
pub(crate) struct Experiment {
    /// The document that describes the experiment.
    config: PathBuf,
    /// Set a value of the document, such as `set.solver.stop.max_iterations=50` or `summary.seed=2`.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<String>,
    /// The folder of the public data sets.
    #[arg(long, value_name = "DIR", env = "MANIFACTOR_DATA")]
    data: Option<PathBuf>,
    /// The folder for the results. Default: the one in the document.
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write into a folder that holds other files, and overwrite files with the same names.
    #[arg(long)]
    force: bool,
    /// Repeat the trials that failed before.
    #[arg(long)]
    retry_failed: bool,
    /// Run only part K of N of the trials and save them in a separate folder, for several machines that
    /// share one disk: `--shard $SLURM_ARRAY_TASK_ID/8`. The same command without --shard collects the
    /// trials of all parts, runs the missing ones and writes the tables.
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Print JSON: the summary that is also written.
    #[arg(long)]
    pub(crate) json: bool,
}

impl Experiment {
    pub(crate) fn run(&self) -> Result<Status, Failure> {
        let mut document = document::open(&self.config, kind::EXPERIMENT)?;
        document.set(&self.set)?;
        let mut sweep = Sweep::read(&document)?;
        if let Some(out) = &self.out {
            sweep.output.clone_from(out);
        }
        if let Some(shard) = self.shard {
            sweep.restrict_to_shard(shard);
        }
        let folders = sweep.open_inputs(self.data.clone());
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
            output::print_message(&format!(
                "The {trials} of this part are in {folder}. The same command without --shard writes the tables."
            ));
            return Ok(status);
        }
        // a Ctrl-C that ended the trials must not end the drawing too
        if !complete {
            interrupt = Interrupt::default();
        }
        let (summary, is_drawn) = write_until(&sweep, &journal, document.source().text(), |file| {
            bar.show_drawing(file);
            interrupt.poll()
        })?;
        drop(bar);
        self.print_summary(&sweep, &summary);
        if !is_drawn {
            status = Status::Interrupted;
            output::print_message(
                "interrupted: some pictures are missing or from an earlier run; repeat the command to draw them",
            );
        }
        Ok(status)
    }

    fn print_summary(&self, sweep: &Sweep, summary: &ExperimentSummary) {
        if self.json {
            output::print_json(summary);
        } else {
            output::print(&summary_table::of(summary));
            output::print(&format!("\nWritten to {}.\n", sweep.output.display()));
        }
        if summary.open > 0 {
            let open = count(summary.open, "trial");
            output::print_message(&format!("{open} not yet run; repeat the command to continue."));
        }
    }
}

/// Writes all files of an experiment: tables, pictures and page. `text` is the text of its document.
///
/// # Errors
/// If a file cannot be written. The files before it are complete.
pub fn write_experiment(sweep: &Sweep, journal: &TrialLog, text: &str) -> Result<ExperimentSummary, Failure> {
    write_until(sweep, journal, text, |_| ControlFlow::Continue(())).map(|(summary, _)| summary)
}

/// Writes all files of an experiment, the pictures last. `goes_on` can end the drawing before each file.
/// The second result is true if all pictures are written.
fn write_until(
    sweep: &Sweep,
    journal: &TrialLog,
    text: &str,
    goes_on: impl FnMut(&str) -> ControlFlow<()>,
) -> Result<(ExperimentSummary, bool), Failure> {
    let summary = experiment::write(sweep, journal)?;
    let trials = experiment::trials_table(sweep, journal);
    let page = experiment_page(sweep, &summary, &trials, text);
    write_whole(&sweep.output.join("report.html"), page)?;
    let style = PictureStyle::default();
    let pictures = experiment_pictures(sweep, &summary, &trials, style.width());
    let is_drawn = style.write(&sweep.output, &pictures, goes_on)?;
    Ok((summary, is_drawn))
}

/// Progress display: a bar on a terminal, an occasional line in a file.
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
        let template = "{prefix} {wide_bar} {pos}/{len} trials, {elapsed} elapsed, {eta} left {msg}";
        // if the literal template is invalid, the default style is good enough
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        Self::Terminal(bar)
    }

    fn show(&self, ExperimentProgress { done, kept, trials }: ExperimentProgress) {
        match self {
            Self::Terminal(bar) => {
                if done == kept {
                    // saved trials took no time in this process, so they must not count in the remaining
                    // time
                    bar.set_length(trials as u64);
                    bar.set_position(kept as u64);
                    bar.reset_eta();
                    if kept > 0 {
                        bar.set_message(format!("({kept} kept)"));
                    }
                }
                bar.set_position(done as u64);
            }
            // about twenty lines
            Self::Lines if done == kept || done == trials || done % trials.div_ceil(20) == 0 => {
                output::print_message(&format!(
                    "{done} of {} done, {kept} of them by earlier commands",
                    count(trials, "trial")
                ));
            }
            Self::Lines => {}
        }
    }

    /// Shows the name of the picture being drawn, after all trials are done.
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
