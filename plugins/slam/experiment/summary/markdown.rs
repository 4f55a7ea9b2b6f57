//! Table of an experiment as Markdown, for `summary.md`.
use super::{ExperimentSummary, TrialGroup};
use indexmap::{IndexMap, IndexSet};

impl ExperimentSummary {
    /// Returns a table of means for people. A compared mean is followed by its difference from the baseline.
    pub fn markdown(&self) -> String {
        let line = |cells: &[String]| format!("| {} |\n", cells.join(" | "));
        let (header, rows) = match &self.across {
            Some(column) => self.side_by_side(column),
            None => self.without_zeros(),
        };
        let labels = self.columns.len() - usize::from(self.across.is_some());
        let rules = (0..header.len()).map(|i| if i < labels { "---" } else { "---:" }.to_owned());
        line(&header)
            + &line(&rules.collect::<Vec<_>>())
            + &rows.iter().map(|row| line(row)).collect::<String>()
    }

    /// Returns the names of the columns of [`rows`](Self::rows).
    pub fn header(&self) -> Vec<String> {
        let counts = ["trials", "failed", "not converged"].map(str::to_owned);
        self.columns.iter().cloned().chain(counts).chain(self.metrics.clone()).collect()
    }

    /// Returns a row for each group, for people: means, each followed by its difference from the baseline.
    pub fn rows(&self) -> impl Iterator<Item = Vec<String>> {
        self.groups.iter().map(|group| {
            let counts = [group.trials, group.failed, group.not_converged].map(|n| n.to_string());
            let metrics = self.metrics.iter().map(|metric| group.cell(metric));
            group.labels.iter().cloned().chain(counts).chain(metrics).collect()
        })
    }

    /// Returns header and rows. The numbers of failed and unconverged trials are left out if they are all
    /// zero.
    fn without_zeros(&self) -> (Vec<String>, Vec<Vec<String>>) {
        let counts = self.columns.len() + 1;
        let all_well = self.groups.iter().all(|group| group.failed + group.not_converged == 0);
        let kept = |row: Vec<String>| -> Vec<String> {
            let cells = row.into_iter().enumerate();
            cells
                .filter(|(i, _)| !(all_well && (counts..counts + 2).contains(i)))
                .map(|(_, cell)| cell)
                .collect()
        };
        (kept(self.header()), self.rows().map(kept).collect())
    }

    /// Returns header and rows with the values of one column side by side, for each metric. The number of
    /// trials that failed or did not converge follows the mean of their group.
    fn side_by_side(&self, column: &str) -> (Vec<String>, Vec<Vec<String>>) {
        let place = self.columns.iter().position(|name| name == column);
        let (mut values, mut rows): (IndexSet<&str>, IndexMap<Vec<&str>, Vec<&TrialGroup>>) =
            Default::default();
        for group in &self.groups {
            let (own, others): (Vec<_>, Vec<_>) =
                group.labels.iter().enumerate().partition(|(i, _)| Some(*i) == place);
            values.extend(own.iter().map(|(_, label)| label.as_str()));
            let others = others.into_iter().map(|(_, label)| label.as_str()).collect();
            rows.entry(others).or_default().push(group);
        }
        let of = |metric: &String, value: &str| match self.metrics.len() {
            1 => value.to_owned(),
            _ => format!("{metric}: {value}"),
        };
        let cells =
            || self.metrics.iter().flat_map(|metric| values.iter().map(move |value| (metric, *value)));
        let labels = self.columns.iter().filter(|name| *name != column).cloned();
        let header = labels.chain(cells().map(|(metric, value)| of(metric, value))).collect();
        let row = |(labels, groups): (&Vec<&str>, &Vec<&TrialGroup>)| {
            let cell = |(metric, value): (&String, &str)| {
                let has = |group: &&&TrialGroup| {
                    place.and_then(|i| group.labels.get(i)).is_some_and(|l| l == value)
                };
                groups.iter().find(has).map_or("-".to_owned(), |group| {
                    let mark = |count: usize, what: &str| match count {
                        0 => String::new(),
                        count => format!(" ({count} {what})"),
                    };
                    group.cell(metric)
                        + &mark(group.failed, "failed")
                        + &mark(group.not_converged, "not converged")
                })
            };
            labels.iter().map(|label| (*label).to_owned()).chain(cells().map(cell)).collect()
        };
        (header, rows.iter().map(row).collect())
    }
}

impl TrialGroup {
    /// Returns a mean, followed by its difference from the baseline.
    fn cell(&self, metric: &str) -> String {
        let mean = self.means.get(metric).map_or("-".to_owned(), |mean| rounded(mean.mean));
        self.comparisons.get(metric).map_or(mean.clone(), |c| format!("{mean} ({c})"))
    }
}

/// Formats with four significant digits, and at most five decimals.
fn rounded(x: f64) -> String {
    let before = if x == 0.0 { 0 } else { x.abs().log10().floor().clamp(-9.0, 9.0) as i32 };
    format!("{x:.*}", (3 - before).clamp(0, 5) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_metrics::Interval;

    #[test]
    fn four_digits_count() {
        assert_eq!(
            [0.0, 0.02655, 0.2655, 12.3456, -201.04, 98765.4].map(rounded),
            ["0.000", "0.02655", "0.2655", "12.35", "-201.0", "98765"]
        );
    }

    #[test]
    fn one_column_stands_side_by_side_and_what_did_not_converge_is_marked() {
        let group = |input: &str, variant: &str, mean: f64, not_converged: usize| TrialGroup {
            labels: vec![input.into(), variant.into()],
            trials: 1,
            failed: 0,
            not_converged,
            means: [("gain".to_owned(), Interval { mean, low: None, high: None })].into(),
            comparisons: IndexMap::new(),
        };
        let summary = ExperimentSummary {
            title: "t".into(),
            columns: vec!["input".into(), "variant".into()],
            metrics: vec!["gain".into()],
            across: Some("variant".into()),
            groups: vec![group("a", "x", 0.5, 0), group("a", "y", 0.25, 1), group("b", "x", 1.0, 0)],
            open: 0,
        };
        let expected = "| input | x | y |\n| --- | ---: | ---: |\n| a | 0.5000 | 0.2500 (1 not converged) |\n| b | 1.000 | - |\n";
        assert_eq!(summary.markdown(), expected);
    }
}
