//! The table of an experiment as Markdown, in a page that says which experiment it is of.
//!
//! ```markdown
//! <!-- experiment: ../examples/experiments/tum/better.toml 1f0c3ab2d4e59687 -->
//! | input | …
//! <!-- end of experiment -->
//! ```
//! The number is the experiment's [digest](Experiment::digest) when the table was made: with another one the table is stale.
use super::{Experiment, Group, Summary};
use indexmap::{IndexMap, IndexSet};
use std::hash::Hasher;

const BEGIN: &str = "<!-- experiment: ";
const END: &str = "<!-- end of experiment -->";

/// A table in a page.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PageTable {
    /// The document that it is of: a path from the page.
    pub experiment: String,
    /// Of that document, when the table was made; `None` before it ever was.
    pub digest: Option<String>,
}

impl Experiment {
    /// Tells what is run and what is made of it from others: all trials with their settings, and the summary; the same on all machines.
    pub fn digest(&self) -> String {
        let mut hash = fnv::FnvHasher::default();
        for trial in &self.trials {
            let written = serde_json::to_string(&(&trial.labels, &trial.settings));
            hash.write(written.unwrap_or_default().as_bytes());
        }
        hash.write(serde_json::to_string(&self.summary).unwrap_or_default().as_bytes());
        format!("{:016x}", hash.finish())
    }
}

fn begin(line: &str) -> Option<PageTable> {
    let mut words = line.trim().strip_prefix(BEGIN)?.strip_suffix("-->")?.split_whitespace();
    let (experiment, digest) = (words.next()?.to_owned(), words.next().map(str::to_owned));
    Some(PageTable { experiment, digest })
}

/// The tables of a page.
pub fn page_tables(page: &str) -> Vec<PageTable> {
    page.lines().filter_map(begin).collect()
}

/// The page with this table in each place for an experiment that `is_meant`, in place of what was there; `None` where it has no such place.
pub fn put_into(page: &str, is_meant: impl Fn(&str) -> bool, digest: &str, table: &str) -> Option<String> {
    let (mut written, mut found) = (String::with_capacity(page.len() + table.len()), false);
    let mut lines = page.lines().peekable();
    while let Some(line) = lines.next() {
        let Some(place) = begin(line).filter(|place| is_meant(&place.experiment)) else {
            written += line;
            written.push('\n');
            continue;
        };
        found = true;
        // what a table was made of may stand there without one
        let has_table = lines.clone().take_while(|next| begin(next).is_none()).any(|next| next.trim() == END);
        if has_table {
            lines.by_ref().take_while(|next| next.trim() != END).for_each(drop);
        }
        written += &format!("{BEGIN}{} {digest} -->\n{table}{END}\n", place.experiment);
    }
    found.then_some(written)
}

impl Summary {
    /// A table of means for people, with the difference from the baseline behind each that is compared.
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

    /// Names of the columns of [`rows`](Self::rows).
    pub fn header(&self) -> Vec<String> {
        let counts = ["trials", "failed", "not converged"].map(str::to_owned);
        self.columns.iter().cloned().chain(counts).chain(self.metrics.clone()).collect()
    }

    /// A row for each group, for people: means, and behind each the difference from the baseline.
    pub fn rows(&self) -> impl Iterator<Item = Vec<String>> {
        self.groups.iter().map(|group| {
            let counts = [group.trials, group.failed, group.not_converged].map(|n| n.to_string());
            let metrics = self.metrics.iter().map(|metric| group.cell(metric));
            group.labels.iter().cloned().chain(counts).chain(metrics).collect()
        })
    }

    /// Header and rows, without the numbers of trials that failed or did not converge where there is none.
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

    /// Header and rows with the values of one column beside each other, metric by metric. A group with trials that failed, or ended without
    /// a minimum, has their number behind.
    fn side_by_side(&self, column: &str) -> (Vec<String>, Vec<Vec<String>>) {
        let place = self.columns.iter().position(|name| name == column);
        let (mut values, mut rows): (IndexSet<&str>, IndexMap<Vec<&str>, Vec<&Group>>) = Default::default();
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
        let row = |(labels, groups): (&Vec<&str>, &Vec<&Group>)| {
            let cell = |(metric, value): (&String, &str)| {
                let has =
                    |group: &&&Group| place.and_then(|i| group.labels.get(i)).is_some_and(|l| l == value);
                groups.iter().find(has).map_or("-".to_owned(), |group| {
                    let ended = group.failed + group.not_converged;
                    let mark = if ended > 0 { format!(" (! {ended})") } else { String::new() };
                    group.cell(metric) + &mark
                })
            };
            labels.iter().map(|label| (*label).to_owned()).chain(cells().map(cell)).collect()
        };
        (header, rows.iter().map(row).collect())
    }
}

impl Group {
    /// A mean, and the difference from the baseline.
    fn cell(&self, metric: &str) -> String {
        let mean = self.means.get(metric).map_or("-".to_owned(), |mean| rounded(mean.mean));
        self.comparisons.get(metric).map_or(mean.clone(), |c| format!("{mean} ({c})"))
    }
}

/// Four digits that count, and no more than five behind the point.
fn rounded(x: f64) -> String {
    let before = if x == 0.0 { 0 } else { x.abs().log10().floor().clamp(-9.0, 9.0) as i32 };
    format!("{x:.*}", (3 - before).clamp(0, 5) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiment::Interval;

    const PAGE: &str = "# Page\n\n<!-- experiment: a.toml -->\n\ntext\n<!-- experiment: b.toml 12 -->\n| old |\n<!-- end of experiment -->\nend\n";

    #[test]
    fn a_table_takes_the_place_of_the_one_before_and_of_nothing_else() {
        let found = page_tables(PAGE);
        assert_eq!(found[0], PageTable { experiment: "a.toml".into(), digest: None });
        assert_eq!(found[1].digest.as_deref(), Some("12"));
        let put = |page: &str, name: &str| put_into(page, |e| e == name, "34", "| new |\n");
        let new = put(PAGE, "b.toml").unwrap();
        assert_eq!(new, PAGE.replace("b.toml 12", "b.toml 34").replace("| old |", "| new |"));
        let both = put(&new, "a.toml").unwrap();
        assert_eq!(both.matches("| new |").count(), 2);
        assert!(both.contains(
            "a.toml 34 -->\n| new |\n<!-- end of experiment -->\n\ntext\n<!-- experiment: b.toml 34"
        ));
        // once more, and nothing changes
        assert_eq!(put(&both, "a.toml").unwrap(), both);
        assert_eq!(put(PAGE, "c.toml"), None);
    }

    #[test]
    fn four_digits_count() {
        assert_eq!(
            [0.0, 0.02655, 0.2655, 12.3456, -201.04, 98765.4].map(rounded),
            ["0.000", "0.02655", "0.2655", "12.35", "-201.0", "98765"]
        );
    }

    #[test]
    fn one_column_stands_side_by_side_and_what_did_not_converge_is_marked() {
        let group = |input: &str, variant: &str, mean: f64, not_converged: usize| Group {
            labels: vec![input.into(), variant.into()],
            trials: 1,
            failed: 0,
            not_converged,
            means: [("gain".to_owned(), Interval { mean, low: None, high: None })].into(),
            comparisons: IndexMap::new(),
        };
        let summary = Summary {
            title: "t".into(),
            columns: vec!["input".into(), "variant".into()],
            metrics: vec!["gain".into()],
            across: Some("variant".into()),
            groups: vec![group("a", "x", 0.5, 0), group("a", "y", 0.25, 1), group("b", "x", 1.0, 0)],
            open: 0,
        };
        let expected =
            "| input | x | y |\n| --- | ---: | ---: |\n| a | 0.5000 | 0.2500 (! 1) |\n| b | 1.000 | - |\n";
        assert_eq!(summary.markdown(), expected);
    }
}
