//! Files that an experiment writes.
use crate::document::{Experiment, ExperimentSources};
use crate::journal::TrialLog;
use crate::summary::{Comparison, ExperimentSummary, times_table, trials_table};
use manifactor_config::to_toml;
use manifactor_formats::table::{DataColumn, DataTable, TableError, to_parquet};
use manifactor_metrics::Interval;
use manifactor_run::output::{OutputError, format_results, write_document, write_whole};
use std::fmt;

/// Writes all tables and returns the summary.
///
/// # Errors
/// If a file cannot be written; files written before it remain.
pub fn write(experiment: &Experiment, journal: &TrialLog) -> Result<ExperimentSummary, OutputError> {
    let file = |name: &str| experiment.output.join(name);
    let write = |name: &str, content: Result<Vec<u8>, TableError>| {
        let content = content.map_err(|source| OutputError::Table { path: file(name), source })?;
        write_whole(&file(name), content)
    };
    let ExperimentSources { experiment: own, base } = &experiment.documents;
    // in a separate folder, because the results may already be beside files with these names
    write_document(&file("repeat/experiment.toml"), to_toml(own))?;
    write_document(&file("repeat/base.toml"), to_toml(base))?;
    let csv = |table: &DataTable| table.to_csv().map(String::into_bytes);
    let trials = trials_table(experiment, journal);
    write("trials.csv", csv(&trials))?;
    write("trials.parquet", to_parquet(&trials))?;
    write("times.csv", csv(&times_table(experiment, journal)))?;
    let summary = ExperimentSummary::new(experiment, journal);
    write("summary.csv", csv(&summary.table()))?;
    write_whole(&file("summary.md"), summary.markdown())?;
    write_document(&file("summary.json"), format_results(&summary))?;
    Ok(summary)
}

impl ExperimentSummary {
    /// Returns a row for each group and metric.
    pub fn table(&self) -> DataTable {
        let mut table = DataTable::default();
        let mut rows = vec![];
        for group in &self.groups {
            for metric in &self.metrics {
                rows.push((group, metric, group.means.get(metric), group.comparisons.get(metric)));
            }
        }
        for (i, column) in self.columns.iter().enumerate() {
            let labels = rows.iter().map(|row| row.0.labels.get(i).cloned().unwrap_or_default()).collect();
            table.columns.push((column.clone(), DataColumn::Text(labels)));
        }
        let names = rows.iter().map(|row| row.1.clone()).collect();
        table.columns.push(("metric".into(), DataColumn::Text(names)));
        let mut number = |name: &str, cells: Vec<Option<f64>>| {
            table.columns.push((name.to_owned(), DataColumn::Number(cells)));
        };
        number("trials", rows.iter().map(|row| Some(row.0.trials as f64)).collect());
        number("failed", rows.iter().map(|row| Some(row.0.failed as f64)).collect());
        for (name, of) in BOUNDS {
            number(name, rows.iter().map(|row| of(row.2?)).collect());
        }
        number("pairs", rows.iter().map(|row| Some(row.3?.pairs as f64)).collect());
        for (name, of) in BOUNDS {
            let difference = |c: &Comparison| of(&c.difference);
            number(&format!("difference_{name}"), rows.iter().map(|row| difference(row.3?)).collect());
        }
        number("relative", rows.iter().map(|row| Some(row.3?.relative())).collect());
        table
    }
}

type Bound = (&'static str, fn(&Interval) -> Option<f64>);
const BOUNDS: [Bound; 3] = [("mean", |i| Some(i.mean)), ("low", |i| i.low), ("high", |i| i.high)];

/// Formats as a share of the baseline: `-1.4 % [-1.9, -0.8]`.
impl fmt::Display for Comparison {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Interval { mean, low, high } = self.difference;
        let percent = 100.0 / self.baseline.abs();
        match (percent.is_finite(), low.zip(high)) {
            (true, Some((low, high))) => {
                write!(f, "{:+.1} % [{:+.1}, {:+.1}]", mean * percent, low * percent, high * percent)
            }
            (true, None) => write!(f, "{:+.1} %", mean * percent),
            (false, Some((low, high))) => write!(f, "{mean:+.4} [{low:+.4}, {high:+.4}]"),
            (false, None) => write!(f, "{mean:+.4}"),
        }
    }
}
