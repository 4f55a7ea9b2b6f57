//! Document of an experiment.
mod axis;
mod check;
mod names;
mod shard;
mod summary_settings;

use crate::trial::Trial;
use axis::{Axis, AxisChoice, AxisDocument, Column};
use manifactor_config::{Diagnostics, Document, Errors, Fault, Node, merge};
use manifactor_mapping::settings::RunSettings;
use manifactor_mapping::settings::run_document::{absolute_path, document_stem, split_document};
use names::SummaryNameCheck;
use schemars::JsonSchema;
use serde::Deserialize;
use serde_json::Map;
use std::path::{Path, PathBuf};

pub(crate) use shard::shard_folders;
pub use shard::{Shard, ShardError};
pub use summary_settings::SummarySettings;

/// An experiment: all its trials, in the order of the table.
#[derive(Debug, Clone)]
pub struct Experiment {
    /// Title in reports.
    pub title: String,
    /// Folder of the results. Default: `out/` followed by the document's name.
    pub output: PathBuf,
    /// Columns that distinguish trials.
    pub columns: Vec<String>,
    /// At least one trial.
    pub trials: Vec<Trial>,
    /// Settings of means and comparisons.
    pub summary: SummarySettings,
    /// Folder that the paths of the base are relative to.
    pub folder: PathBuf,
    /// The experiment and its base as they were read, including values that the caller has set. They are
    /// written beside the results.
    pub documents: ExperimentSources,
}

/// An experiment in its document: a run over a grid of settings and seeds.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub(crate) struct ExperimentDocument {
    /// Title in reports. Default: the document's name.
    #[serde(default)]
    title: Option<String>,
    /// Folder of the results. Default: `out/` followed by the document's name.
    #[serde(default)]
    output: Option<PathBuf>,
    /// The run to vary: a path relative to this document.
    base: String,
    /// Settings that replace those of the base in all trials.
    #[serde(default)]
    #[schemars(with = "Option<Map<String, serde_json::Value>>")]
    set: Option<Node>,
    /// Settings to vary; all combinations are run.
    #[serde(default)]
    axes: Vec<AxisDocument>,
    /// Means and comparisons.
    #[serde(default)]
    #[schemars(with = "Option<SummarySettings>")]
    summary: Option<Node>,
}

/// Documents that reproduce an experiment.
#[derive(Debug, Clone, Default)]
pub struct ExperimentSources {
    /// Document of the experiment, which refers to `base.toml`.
    pub experiment: serde_json::Value,
    /// Document of the run.
    pub base: serde_json::Value,
}

/// Column of the base's variants.
const VARIANT_COLUMN: &str = "variant";
/// Largest number of trials; more of them are likely a mistake in a list.
const MAX_TRIALS: usize = 1_000_000;

impl Experiment {
    /// Reads an experiment and its base. Paths are relative to the folder of the base.
    ///
    /// # Errors
    /// All errors in both documents. If settings of trials are invalid, only the errors of the first such
    /// trial are returned.
    pub fn read(document: &Document) -> Result<Self, Diagnostics> {
        let stem = document_stem(document, "experiment");
        let errors = Errors::new();
        let read = document.root().read::<ExperimentDocument>(&errors).and_then(|written| {
            let base = open_base(document, &written.base, &errors)?;
            let (header, mut node) = split_document(base.root(), &errors)?;
            let folder = header.folder(&base);
            let mut axes: Vec<Axis> =
                written.axes.into_iter().filter_map(|axis| Axis::read(axis, &errors)).collect();
            let has_variants = |axis: &Axis| axis.columns.iter().any(|column| column.name == VARIANT_COLUMN);
            if !header.variants.is_empty() && !axes.iter().any(has_variants) {
                let place = base.source().place(0..0);
                axes.push(Axis::of_options(
                    Column { name: VARIANT_COLUMN.to_owned(), place },
                    header.variants,
                ));
            }
            check::check_axes(&axes, &errors);
            let summary = written.summary.as_ref().and_then(|node| node.read(&errors)).unwrap_or_default();
            let place =
                written.summary.as_ref().map_or_else(|| document.root().place.clone(), |s| s.place.clone());
            let names = SummaryNameCheck {
                settings: &summary,
                written: written.summary.as_ref(),
                place,
                errors: &errors,
            };
            names.check(&axes);
            if let Some(set) = written.set {
                merge(&mut node, set);
            }
            let trials = if errors.is_empty() { trials(&node, &axes, &folder, &errors)? } else { vec![] };
            names.check_alignments(&trials);
            let columns = axes.into_iter().flat_map(|axis| axis.columns).map(|column| column.name).collect();
            let title = written.title.unwrap_or_else(|| stem.clone());
            let output = written.output.unwrap_or_else(|| Path::new("out").join(&stem));
            let documents = ExperimentSources::new((&title, document), &base, &folder, &errors)?;
            Some(Self { title, output, columns, trials, summary, folder, documents })
        });
        errors.finish(read)
    }
}

impl ExperimentSources {
    fn new(
        (title, experiment): (&str, &Document),
        base: &Document,
        folder: &Path,
        errors: &Errors,
    ) -> Option<Self> {
        let json = |document: &Document| match document.root().to_json() {
            Ok(serde_json::Value::Object(fields)) => Some(fields),
            Ok(_) => None,
            Err(diagnostics) => {
                diagnostics.into_iter().for_each(|diagnostic| errors.push(diagnostic));
                None
            }
        };
        let (mut experiment, mut base) = (json(experiment)?, json(base)?);
        experiment.insert("title".to_owned(), title.into());
        experiment.insert("base".to_owned(), "base.toml".into());
        base.insert("folder".to_owned(), absolute_path(folder).display().to_string().into());
        Some(Self { experiment: experiment.into(), base: base.into() })
    }
}

/// Opens the run that `base` names. Errors are reported.
fn open_base(document: &Document, name: &str, errors: &Errors) -> Option<Document> {
    let beside = Path::new(document.source().name()).parent().unwrap_or(Path::new(""));
    Document::open(beside.join(name)).map_err(|diagnostics| errors.extend(diagnostics)).ok()
}

/// Returns the trials of all combinations; the last axis changes fastest.
fn trials(base: &Node, axes: &[Axis], folder: &Path, errors: &Errors) -> Option<Vec<Trial>> {
    let count = axes.iter().try_fold(1usize, |n, axis| n.checked_mul(axis.options.len()));
    if count.is_none_or(|count| count > MAX_TRIALS) {
        let message = format!("the axes make more than {MAX_TRIALS} trials");
        errors.report(base.place.clone(), Fault::invalid(message));
        return None;
    }
    let mut trials = vec![];
    let mut place = vec![0; axes.len()];
    loop {
        let choices = || axes.iter().zip(&place).filter_map(|(axis, i)| axis.options.get(*i));
        match trial(base, choices(), folder) {
            Ok(trial) => trials.push(trial),
            Err(diagnostics) => {
                // the remaining trials usually have equal errors
                errors.extend(diagnostics);
                return None;
            }
        }
        let Some(turn) = (0..axes.len()).rev().find(|axis| place[*axis] + 1 < axes[*axis].options.len())
        else {
            return Some(trials);
        };
        place[turn] += 1;
        place[turn + 1..].fill(0);
    }
}

fn trial<'a>(
    base: &Node,
    choices: impl Iterator<Item = &'a AxisChoice>,
    folder: &Path,
) -> Result<Trial, Diagnostics> {
    let (mut node, mut labels) = (base.clone(), vec![]);
    for choice in choices {
        labels.extend(choice.labels.iter().cloned());
        for set in &choice.sets {
            merge(&mut node, set.clone());
        }
    }
    Ok(Trial { labels, settings: RunSettings::read(&node, folder)?, inputs: 0 })
}
