//! Runs and experiments from their documents, and the command line.
use crate::errors;
use crate::solution::Watch;
use manifactor::config::{Diagnostics, Document, Format};
use manifactor::slam::experiment::{self, Experiment, Journal, Progress};
use manifactor::slam::output::OutputFolder;
use manifactor::slam::record::{RunRecord, VariantRecord};
use manifactor::slam::run::Run;
use manifactor::slam::run_document::RunDocument;
use manifactor::slam::source::Folders;
use manifactor::solve::Interrupt;
use manifactor::viz::run_page;
use pyo3::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

/// A document from a file, or from JSON in place of one, with overrides.
fn open(config: &Path, json: Option<String>, set: &[String]) -> Result<Document, Diagnostics> {
    let mut document = match json {
        Some(text) => Document::parse(config.display().to_string(), text, Format::Json)?,
        None => Document::open(config)?,
    };
    document.set(set)?;
    Ok(document)
}

/// Builds, solves and evaluates each variant of a run. Returns its report and its record, as JSON, and its page.
#[pyfunction]
#[pyo3(signature = (config, json, set, data, observer = None))]
fn run(
    py: Python<'_>,
    config: PathBuf,
    json: Option<String>,
    set: Vec<String>,
    data: Option<PathBuf>,
    observer: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, String, String)> {
    let mut watch = Watch::new(observer);
    let read = open(&config, json, &set).and_then(|document| RunDocument::read(&document));
    let document = read.map_err(|error| errors::document(&error))?;
    let done = py.detach(|| {
        let mut run = Run::new(&document, data);
        let (mut records, mut configs) = (vec![], vec![]);
        for variant in &document.variants {
            let (estimate, _) = run.variant(variant, &mut watch).map_err(|error| error.to_string())?;
            records.push(VariantRecord::new(variant, &estimate));
            configs.push(manifactor::config::to_toml(&variant.settings).map_err(|error| error.to_string())?);
        }
        let (report, record) = (run.finish(), RunRecord::new(&document.title, records));
        let page = run_page(&report, &record, &configs);
        let json = |value: Result<String, serde_json::Error>| value.map_err(|error| error.to_string());
        Ok((json(serde_json::to_string(&report))?, json(serde_json::to_string(&record))?, page))
    });
    watch.finish()?;
    done.map_err(|error: String| errors::solve(error))
}

/// Runs the trials of an experiment that are not done yet, writes its tables, and returns the summary as JSON and the folder.
#[pyfunction]
#[pyo3(name = "experiment", signature = (config, json, set, data, out, force, retry_failed, threads, progress = None))]
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
    progress: Option<Py<PyAny>>,
) -> PyResult<(String, PathBuf)> {
    let read = open(&config, json, &set).and_then(|document| Experiment::read(&document));
    let mut sweep = read.map_err(|error| errors::document(&error))?;
    if let Some(out) = out {
        sweep.output = out;
    }
    let folders = Folders { data, document: sweep.folder.clone() };
    let interrupt = Interrupt::default();
    let mut raised = None;
    let show = |now: Progress| {
        let shown = Python::attach(|py| {
            py.check_signals()?;
            progress.as_ref().map_or(Ok(()), |progress| progress.call1(py, (now.done, now.trials)).map(drop))
        });
        if let Err(error) = shown {
            interrupt.0.store(true, Ordering::Relaxed);
            raised = Some(error);
        }
    };
    let done = py.detach(|| {
        let claimed = OutputFolder::claim(&sweep.output, "experiment", &config, force).map_err(|e| e.to_string())?;
        let mut journal = Journal::open(claimed).map_err(|error| error.to_string())?;
        if retry_failed {
            journal.retry_failed();
        }
        let threads = threads.unwrap_or_else(rayon::current_num_threads);
        experiment::run(&sweep, &folders, &mut journal, threads, &interrupt, show).map_err(|e| e.to_string())?;
        let summary = experiment::write(&sweep, &journal).map_err(|error| error.to_string())?;
        serde_json::to_string(&summary).map_err(|error| error.to_string())
    });
    raised.map_or(Ok(()), Err)?;
    Ok((done.map_err(|error: String| errors::solve(error))?, sweep.output))
}

/// The command line, the name of the program first; returns the exit code.
#[pyfunction]
fn main(py: Python<'_>, arguments: Vec<String>) -> u8 {
    py.detach(|| manifactor_cli::main_with(arguments))
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(experiment_of, module)?)?;
    module.add_function(wrap_pyfunction!(main, module)?)
}
