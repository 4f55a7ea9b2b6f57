//! The table that an experiment prints.
use crate::output::text::{Table, on_one_line, wrap};
use manifactor::slam::experiment::ExperimentSummary;

/// Means of each group, and below each compared group its difference from the baseline.
pub(crate) fn of(summary: &ExperimentSummary) -> String {
    let header: Vec<&str> = summary
        .columns
        .iter()
        .map(String::as_str)
        .chain(["trials", "failed"])
        .chain(summary.metrics.iter().map(String::as_str))
        .collect();
    let labels: Vec<&str> = header.iter().take(summary.columns.len()).copied().collect();
    let kept: Vec<&str> = labels.iter().copied().chain(summary.metrics.iter().map(String::as_str)).collect();
    let mut table = Table::of_numbers(&header).with_priority(&kept).with_name_columns(labels.len());
    for group in &summary.groups {
        let mean = |metric| group.means.get(metric).map_or("-".into(), |mean| format!("{:.5}", mean.mean));
        let counts = [group.trials.to_string(), group.failed.to_string()];
        table.row(group.labels.iter().cloned().chain(counts).chain(summary.metrics.iter().map(mean)));
        if !group.comparisons.is_empty() {
            let compared = |metric| group.comparisons.get(metric).map_or("-".into(), ToString::to_string);
            let pairs = group.comparisons.values().map(|c| c.pairs).max().unwrap_or_default();
            let mut row = vec![String::new(); group.labels.len() + 2];
            row[0] = "  minus the baseline".into();
            row[group.labels.len()] = pairs.to_string();
            table.row(row.into_iter().chain(summary.metrics.iter().map(compared)));
        }
    }
    format!("{}\n{}\n{}\n", on_one_line(&summary.title), table.text(), wrap(NOTE))
}

const NOTE: &str = "Means over trials, and mean differences of paired trials with 95 % bootstrap intervals.";
