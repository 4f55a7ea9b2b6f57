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
    /// Tells what is run and what is made of it from others: all trials with their settings, and the summary; the same on all machines. It does not
    /// tell one program from another that would find other figures.
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

/// A place for a table: a path, and the 16 digits of a digest behind it where there is a table.
fn begin(line: &str) -> Option<PageTable> {
    let named = line.trim().strip_prefix(BEGIN)?.strip_suffix("-->")?.trim();
    let is_digest = |word: &str| word.len() == 16 && word.bytes().all(|byte| byte.is_ascii_hexdigit());
    let (experiment, digest) = match named.rsplit_once(char::is_whitespace) {
        Some((path, digest)) if is_digest(digest) => (path.trim_end(), Some(digest.to_owned())),
        _ => (named, None),
    };
    (!experiment.is_empty()).then(|| PageTable { experiment: experiment.to_owned(), digest })
}

/// The lines of a page with their ends, each with whether it stands in a block of code, which is shown and means nothing.
fn lines(page: &str) -> impl Iterator<Item = (&str, bool)> + Clone {
    page.split_inclusive('\n').scan(false, |in_code, line| {
        let is_fence = ["```", "~~~"].iter().any(|fence| line.trim_start().starts_with(fence));
        let shown = *in_code || is_fence;
        *in_code ^= is_fence;
        Some((line, shown))
    })
}

/// The tables of a page.
pub fn page_tables(page: &str) -> Vec<PageTable> {
    lines(page).filter(|(_, in_code)| !in_code).filter_map(|(line, _)| begin(line)).collect()
}

/// The page with this table in each place for an experiment that `is_meant`, in place of the table that was there; `None` where it has no
/// such place. Nothing but lines of a table is left out, and lines end as they did.
pub fn put_into(page: &str, is_meant: impl Fn(&str) -> bool, digest: &str, table: &str) -> Option<String> {
    let end = if page.contains("\r\n") { "\r\n" } else { "\n" };
    let (mut written, mut found) = (String::with_capacity(page.len() + table.len()), false);
    let mut all = lines(page);
    while let Some((line, in_code)) = all.next() {
        let place = begin(line).filter(|place| !in_code && is_meant(&place.experiment));
        let Some(place) = place else {
            written += line;
            continue;
        };
        found = true;
        let is_row = |(line, _): &(&str, bool)| line.trim_start().starts_with('|');
        let rows = all.clone().take_while(is_row).count();
        if all.clone().nth(rows).is_some_and(|(line, _)| line.trim() == END) {
            all.nth(rows);
        }
        written += &format!("{BEGIN}{} {digest} -->\n{table}{END}\n", place.experiment).replace('\n', end);
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

    const PAGE: &str = "# Page\n\n<!-- experiment: a.toml -->\n\ntext\n<!-- experiment: b.toml 00000000000000aa -->\n| old |\n<!-- end of experiment -->\nend\n";

    #[test]
    fn a_table_takes_the_place_of_the_one_before_and_of_nothing_else() {
        let found = page_tables(PAGE);
        assert_eq!(found[0], PageTable { experiment: "a.toml".into(), digest: None });
        assert_eq!(found[1].digest.as_deref(), Some("00000000000000aa"));
        let put = |page: &str, name: &str| put_into(page, |e| e == name, "00000000000000bb", "| new |\n");
        let new = put(PAGE, "b.toml").unwrap();
        assert_eq!(new, PAGE.replace("00000000000000aa", "00000000000000bb").replace("| old |", "| new |"));
        let both = put(&new, "a.toml").unwrap();
        assert_eq!(both.matches("| new |").count(), 2);
        assert!(both.contains(
            "a.toml 00000000000000bb -->\n| new |\n<!-- end of experiment -->\n\ntext\n<!-- experiment: b.toml 00000000000000bb"
        ));
        // once more, and nothing changes
        assert_eq!(put(&both, "a.toml").unwrap(), both);
        assert_eq!(put(PAGE, "c.toml"), None);
    }

    #[test]
    fn nothing_of_the_page_is_lost() {
        let put =
            |page: &str| put_into(page, |e| e == "my sweep/a.toml", "00000000000000bb", "| new |\n").unwrap();
        let new =
            "<!-- experiment: my sweep/a.toml 00000000000000bb -->\n| new |\n<!-- end of experiment -->\n";
        // no end, or one that is of something else: the text behind stays, as do ends of lines
        for rest in ["text", "text\n", "text\n~~~\n<!-- end of experiment -->\n~~~\n", "| a row\n", ""] {
            let page = format!("<!-- experiment: my sweep/a.toml -->\n{rest}");
            assert_eq!(put(&page), format!("{new}{rest}"));
            let page = page.replace('\n', "\r\n");
            assert_eq!(put(&page), format!("{new}{rest}").replace('\n', "\r\n"));
        }
        // what is shown in a block of code is no place
        let shown = "```\n<!-- experiment: my sweep/a.toml -->\n```\n";
        assert_eq!(put_into(shown, |_| true, "00000000000000bb", "| new |\n"), None);
        assert_eq!(page_tables(shown), []);
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
        let expected = "| input | x | y |\n| --- | ---: | ---: |\n| a | 0.5000 | 0.2500 (1 not converged) |\n| b | 1.000 | - |\n";
        assert_eq!(summary.markdown(), expected);
    }
}
