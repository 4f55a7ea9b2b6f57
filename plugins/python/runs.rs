//! Runs and experiments from their documents, and the command line.
use crate::errors;
use crate::solution::Watch;
use crate::threads::detach;
use manifactor::config::{Diagnostics, Document, Format};
use manifactor::slam::estimate::Estimate;
use manifactor::slam::experiment::{self, Experiment, ExperimentProgress, Shard, Trial, TrialLog};
use manifactor::slam::online::ObjectUpdates;
use manifactor::slam::output::OutputFolder;
use manifactor::slam::record::{RunRecord, VariantRecord};
use manifactor::slam::run::{MappedFrame, Run, RunError, StreamEvent, StreamWatcher};
use manifactor::slam::run_document::{RunDocument, RunVariant};
use manifactor::slam::source::InputFolders;
use manifactor::solve::{Interrupt, Observer};
use manifactor::viz::run_page;
use manifactor_cli::{Failure, write_experiment};
use pyo3::prelude::*;
use serde_json::json;
use std::io::{self, BufReader, Cursor, Read};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::sync::{Arc, Mutex};

/// Opens a document from a file, or from JSON instead, and applies overrides.
fn open(config: &Path, json: Option<String>, set: &[String]) -> Result<Document, Diagnostics> {
    let mut document = match json {
        Some(text) => Document::parse(config.display().to_string(), text, Format::Json)?,
        None => Document::open(config)?,
    };
    document.set(set)?;
    Ok(document)
}

/// Returns an experiment and the text of its document.
fn opened(config: &Path, json: Option<String>, set: &[String]) -> PyResult<(Experiment, String)> {
    let read = open(config, json, set)
        .and_then(|document| Ok((Experiment::read(&document)?, document.source().text().to_owned())));
    read.map_err(|error| errors::document(&error))
}

/// A run as JSON: its report, its table and its record; and its page as HTML.
type Told = (String, String, String, String);

/// Builds, solves and evaluates each variant of a run.
#[pyfunction]
#[pyo3(signature = (config, json, set, data, observer = None))]
fn run(
    py: Python<'_>,
    config: PathBuf,
    json: Option<String>,
    set: Vec<String>,
    data: Option<PathBuf>,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<Told> {
    let mut watch = Watch::new(observer);
    let read = open(&config, json, &set).and_then(|document| RunDocument::read(&document));
    let document = read.map_err(|error| errors::document(&error))?;
    let done = detach(py, || {
        let batch = |variant: &RunVariant, run: &mut Run<'_>| {
            run.run_variant(variant, &mut watch).map(|(estimate, _)| estimate)
        };
        report_of(Run::new(&document, data), &document, batch)
    })?;
    watch.finish()?;
    done.map_err(|error: String| errors::solve(error))
}

/// Maps the frames of an iterable of lines, or of the source, one by one. Returns the result of [`run`], the
/// number of rejected frames, and the error of the first one.
#[pyfunction]
#[pyo3(signature = (config, json, set, data, lines = None, on_frame = None))]
fn online(
    py: Python<'_>,
    config: PathBuf,
    json: Option<String>,
    set: Vec<String>,
    data: Option<PathBuf>,
    lines: Option<Py<PyAny>>,
    on_frame: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Told, usize, Option<String>)> {
    let watch = Watch::new(on_frame);
    let mut frames = Frames { watch, objects: ObjectUpdates::default(), rejected: 0, first: None };
    let raised = Raised::default();
    let read = open(&config, json, &set).and_then(|document| RunDocument::read(&document));
    let document = read.map_err(|error| errors::document(&error))?;
    let done = detach(py, || {
        let mut run = Run::new(&document, data);
        if let Some(lines) = lines {
            let lines = PythonLines { lines, pending: Cursor::default(), raised: raised.clone() };
            run.read_frames_from("frames", Box::new(BufReader::new(lines)));
        }
        let online = |variant: &RunVariant, run: &mut Run<'_>| {
            run.run_variant_online(variant, &mut frames).map(|(estimate, _)| estimate)
        };
        report_of(run, &document, online)
    })?;
    frames.watch.finish()?;
    if let Some(error) = raised.lock().ok().and_then(|mut raised| raised.take()) {
        return Err(error);
    }
    let told = done.map_err(|error: String| errors::solve(error))?;
    Ok((told, frames.rejected, frames.first))
}

/// Runs all variants of a document, and returns their results.
fn report_of(
    mut run: Run<'_>,
    document: &RunDocument,
    mut estimate: impl FnMut(&RunVariant, &mut Run<'_>) -> Result<Estimate, RunError>,
) -> Result<Told, String> {
    let (mut records, mut configs) = (vec![], vec![]);
    for variant in &document.variants {
        let estimate = estimate(variant, &mut run).map_err(|error| error.to_string())?;
        records.push(VariantRecord::new(variant, &estimate));
        configs.push(manifactor::config::to_toml(&variant.settings).map_err(|error| error.to_string())?);
    }
    let (report, record) = (run.finish(), RunRecord::new(&document.title, records));
    let page = run_page(&report, &record, &configs);
    let json = |value: Result<String, serde_json::Error>| value.map_err(|error| error.to_string());
    let (told, table) = (serde_json::to_string(&report), serde_json::to_string(&report.table()));
    Ok((json(told)?, json(table)?, json(serde_json::to_string(&record))?, page))
}

/// An exception of an iterator, which may be read on another thread.
type Raised = Arc<Mutex<Option<PyErr>>>;

/// Lines of a Python iterator. An exception ends them, and is raised after the run.
struct PythonLines {
    lines: Py<PyAny>,
    pending: Cursor<Vec<u8>>,
    raised: Raised,
}

impl Read for PythonLines {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        loop {
            let read = self.pending.read(buffer)?;
            if read > 0 {
                return Ok(read);
            }
            let next = Python::attach(|py| {
                let next = self.lines.bind(py).try_iter()?.next();
                next.transpose()?.map(|line| line.extract::<String>()).transpose()
            });
            match next {
                Ok(None) => return Ok(0),
                Ok(Some(line)) => self.pending = Cursor::new((line + "\n").into_bytes()),
                Err(error) => {
                    if let Ok(mut raised) = self.raised.lock() {
                        raised.get_or_insert(error);
                    }
                    return Err(io::Error::other("the frames raised an exception"));
                }
            }
        }
    }
}

/// Passes each frame to a Python function.
struct Frames {
    watch: Watch,
    objects: ObjectUpdates,
    /// Number of rejected frames, and the error of the first one.
    rejected: usize,
    first: Option<String>,
}

impl StreamWatcher for Frames {
    fn event(&mut self, event: StreamEvent<'_>) -> ControlFlow<()> {
        match event {
            StreamEvent::Idle | StreamEvent::FrameArrived { .. } | StreamEvent::Iteration(_) => {
                self.watch.poll()
            }
            StreamEvent::Frame(MappedFrame { report, mapper, seconds, .. }) => {
                if let Err(error) = report {
                    self.rejected += 1;
                    self.first.get_or_insert_with(|| error.to_string());
                }
                self.watch.call(&match report {
                    Ok(report) => {
                        json!({ "seconds": seconds, "report": report, "map": self.objects.take(mapper) })
                    }
                    Err(error) => json!({ "seconds": seconds, "error": error.to_string() }),
                })
            }
            StreamEvent::LastFrame { mapper } => match self.objects.take(mapper) {
                changed if changed.is_empty() => ControlFlow::Continue(()),
                changed => self.watch.call(&json!({ "map": changed })),
            },
        }
    }
}

/// Runs the unfinished trials of an experiment and writes its tables, pictures and page. Returns the
/// summary as JSON, and the folder.
#[pyfunction]
#[pyo3(name = "experiment", signature = (config, json, set, data, out, force, retry_failed, threads, shard = None, progress = None))]
#[expect(clippy::too_many_arguments, reason = "the arguments of the command")]
fn experiment_of(
    py: Python<'_>,
    config: PathBuf,
    json: Option<String>,
    set: Vec<String>,
    data: Option<PathBuf>,
    out: Option<PathBuf>,
    force: bool,
    retry_failed: bool,
    threads: Option<usize>,
    shard: Option<String>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Option<String>, PathBuf)> {
    let (mut sweep, text) = opened(&config, json, &set)?;
    if let Some(out) = out {
        sweep.output = out;
    }
    let shard = shard.map(|shard| shard.parse::<Shard>()).transpose();
    let shard = shard.map_err(|error| errors::argument("experiment", "shard", error))?;
    if let Some(shard) = shard {
        sweep.restrict_to_shard(shard);
    }
    let folders = sweep.open_inputs(data);
    let interrupt = Interrupt::default();
    let mut raised = None;
    let show = |now: ExperimentProgress| {
        let shown = Python::attach(|py| {
            py.check_signals()?;
            progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (now.done, now.trials)).map(drop))
        });
        if let Err(error) = shown {
            interrupt.0.store(true, Ordering::Relaxed);
            raised = Some(error);
        }
    };
    let done = detach(py, || {
        let claimed = OutputFolder::claim(&sweep.output, "experiment", &config, force)?;
        let mut journal = TrialLog::open(claimed)?;
        journal.take_over_shards()?;
        if retry_failed {
            journal.retry_failed();
        }
        let threads = threads.unwrap_or_else(rayon::current_num_threads);
        experiment::run(&sweep, &folders, &mut journal, threads, &interrupt, show)?;
        // a shard has no tables
        if shard.is_some() {
            return Ok(None);
        }
        write_experiment(&sweep, &journal, &text).map(Some)
    })?;
    raised.map_or(Ok(()), Err)?;
    let summary = done.map_err(|error: Failure| errors::failure(error))?;
    let summary = summary.map(|summary| serde_json::to_string(&summary)).transpose();
    Ok((summary.map_err(errors::internal)?, sweep.output))
}

/// The trials of an experiment, for a driver that runs them in other processes.
#[pyclass(module = "manifactor._native")]
struct Sweep {
    sweep: Experiment,
    /// Text of the document.
    text: String,
    folders: InputFolders,
    journal: Option<TrialLog>,
}

#[pymethods]
impl Sweep {
    /// Opens an experiment; the driver owns its journal, a worker has none.
    #[new]
    #[pyo3(signature = (config, json, set, data, out, force, is_driver))]
    fn new(
        config: PathBuf,
        json: Option<String>,
        set: Vec<String>,
        data: Option<PathBuf>,
        out: Option<PathBuf>,
        force: bool,
        is_driver: bool,
    ) -> PyResult<Self> {
        let (mut sweep, text) = opened(&config, json, &set)?;
        if let Some(out) = out {
            sweep.output = out;
        }
        let folders = sweep.open_inputs(data);
        let journal = is_driver.then(|| {
            let claimed =
                OutputFolder::claim(&sweep.output, "experiment", &config, force).map_err(errors::failure)?;
            let mut journal = TrialLog::open(claimed).map_err(errors::failure)?;
            journal.take_over_shards().map_err(errors::failure)?;
            Ok::<_, PyErr>(journal)
        });
        Ok(Self { journal: journal.transpose()?, sweep, text, folders })
    }

    /// Marks the failed trials as unfinished.
    fn retry_failed(&mut self) {
        self.journal.iter_mut().for_each(TrialLog::retry_failed);
    }

    /// Returns the numbers of the unfinished trials.
    fn open(&self) -> Vec<usize> {
        let is_open =
            |trial: &Trial| self.journal.as_ref().is_none_or(|journal| journal.record_of(trial).is_none());
        self.sweep.trials.iter().enumerate().filter(|(_, trial)| is_open(trial)).map(|(i, _)| i).collect()
    }

    /// Runs a trial, and returns its line of the journal.
    fn run(&self, py: Python<'_>, number: usize) -> PyResult<String> {
        let Some(trial) = self.sweep.trials.get(number) else {
            return Err(errors::argument("Sweep.run", "number", format!("there is no trial {number}")));
        };
        let mut watch = Watch::new(None);
        let record = detach(py, || experiment::run_single_threaded(trial, &self.folders, &mut watch))?;
        watch.finish()?;
        let record = record.ok_or_else(|| errors::solve("the trial was interrupted"))?;
        serde_json::to_string(&record).map_err(errors::internal)
    }

    /// Saves a finished trial, given as its line of the journal.
    fn save_trial(&mut self, line: &str) -> PyResult<()> {
        let record = serde_json::from_str(line)
            .map_err(|error| errors::argument("Sweep.save_trial", "line", error))?;
        self.journal.as_mut().map_or(Ok(()), |journal| journal.append(record).map_err(errors::failure))
    }

    /// Writes the tables, pictures and page. Returns the summary as JSON, and the folder.
    fn write(&self, py: Python<'_>) -> PyResult<(String, PathBuf)> {
        let journal = self.journal.as_ref().ok_or_else(|| errors::solve("a worker has no journal"))?;
        let written = detach(py, || write_experiment(&self.sweep, journal, &self.text));
        let summary = written?.map_err(errors::failure)?;
        let summary = serde_json::to_string(&summary).map_err(errors::internal)?;
        Ok((summary, self.sweep.output.clone()))
    }
}

/// Runs a command line, which begins with the name of the program, and returns the exit code.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<String>) -> PyResult<u8> {
    detach(py, || manifactor_cli::main_with(arguments))
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(online, module)?)?;
    module.add_function(wrap_pyfunction!(experiment_of, module)?)?;
    module.add_class::<Sweep>()?;
    module.add_function(wrap_pyfunction!(main, module)?)
}
