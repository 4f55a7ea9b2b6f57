//! Columns of numbers in a CSV file, found by their names.
use crate::error::{Mistake, ProblemList};
use csv::{ReaderBuilder, Trim};

/// A column: its name in our documentation, and in other datasets.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    pub name: &'static str,
    pub others: &'static [&'static str],
}

/// Seconds above which a timestamp is in a smaller unit: the year 5138.
const MAX_SECONDS: f64 = 1e11;

/// Rows of numbers, one for each line that has them.
pub(super) struct Columns<const N: usize> {
    rows: Vec<(usize, [f64; N])>,
}

/// Returns the names in the first line, without a comment sign and units.
pub(super) fn header(text: &str) -> impl Iterator<Item = &str> {
    let first = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    first.trim_start_matches(['#', ' ', '\u{feff}']).split(',').map(plain)
}

/// Returns the name of a column without its unit, such as `[ns]` or `(ns)`.
fn plain(name: &str) -> &str {
    name.split(['[', '(']).next().unwrap_or_default().trim()
}

impl<const N: usize> Columns<N> {
    /// Reads the rows that have values in these columns, the first of which is a time. The mistakes go to
    /// `problems`.
    pub(super) fn read(text: &str, wanted: &[Column; N], problems: &mut ProblemList<'_>) -> Self {
        let mut rows = vec![];
        let names: Vec<&str> = header(text).collect();
        let find = |column: &Column| {
            names.iter().position(|name| *name == column.name || column.others.contains(name))
        };
        let places: Vec<Option<usize>> = wanted.iter().map(find).collect();
        let missing = wanted.iter().zip(&places).filter(|(_, place)| place.is_none());
        let missing: Vec<&str> = missing.map(|(column, _)| column.name).collect();
        if !missing.is_empty() {
            let all: Vec<&str> = wanted.iter().map(|column| column.name).collect();
            let message = format!(
                "the header has no column {}: expected {} and a header in the first line",
                missing.join(", "),
                all.join(", ")
            );
            problems.push(1, Mistake::Row(message));
            return Self { rows };
        }
        let places: Vec<usize> = places.into_iter().flatten().collect();
        let time = header_field(text, places.first().copied().unwrap_or(0));
        let scale = if time.contains("ns") { 1e-9 } else { 1.0 };
        let mut reader = ReaderBuilder::new().trim(Trim::All).flexible(true).from_reader(text.as_bytes());
        for record in reader.records() {
            let record = match record {
                Ok(record) => record,
                Err(error) => {
                    let line = error.position().map_or(0, |position| position.line() as usize);
                    problems.push(line, Mistake::Row(error.to_string()));
                    continue;
                }
            };
            let line = record.position().map_or(0, |position| position.line() as usize);
            let fields: Vec<&str> =
                places.iter().map(|place| record.get(*place).unwrap_or_default()).collect();
            // the time alone may be that of another table's row
            let is_comment = record.get(0).is_some_and(|first| first.starts_with('#'));
            if is_comment || fields.iter().skip(1).all(|field| field.is_empty()) {
                continue;
            }
            rows.extend(problems.ok(line, numbers(&fields, wanted, scale)).map(|numbers| (line, numbers)));
        }
        Self { rows }
    }

    /// Returns the rows, with their lines.
    pub(super) fn rows(self) -> impl Iterator<Item = (usize, [f64; N])> {
        self.rows.into_iter()
    }
}

/// Returns a field of the header with its unit.
fn header_field(text: &str, place: usize) -> &str {
    let first = text.lines().find(|line| !line.trim().is_empty()).unwrap_or_default();
    first.split(',').nth(place).unwrap_or_default()
}

fn numbers<const N: usize>(fields: &[&str], wanted: &[Column; N], scale: f64) -> Result<[f64; N], Mistake> {
    let mut numbers = [0.0; N];
    for (i, (number, (field, column))) in numbers.iter_mut().zip(fields.iter().zip(wanted)).enumerate() {
        let read = if i == 0 { time(field, scale) } else { field.parse().ok() };
        *number = read.filter(|x: &f64| x.is_finite()).ok_or_else(|| {
            Mistake::Row(format!("column `{}`: expected a finite number, got `{field}`", column.name))
        })?;
    }
    match numbers.first() {
        Some(seconds) if *seconds > MAX_SECONDS => Err(Mistake::Row(format!(
            "a timestamp of {seconds:e} s is implausible: if it is in nanoseconds, name the column `timestamp [ns]`"
        ))),
        _ => Ok(numbers),
    }
}

/// Reads a time. Whole numbers of nanoseconds are split before the division, because a double has too few
/// digits for them.
fn time(field: &str, scale: f64) -> Option<f64> {
    match field.parse::<i64>() {
        Ok(whole) if scale < 1.0 => {
            Some((whole / 1_000_000_000) as f64 + (whole % 1_000_000_000) as f64 * 1e-9)
        }
        _ => field.parse::<f64>().ok().map(|time| time * scale),
    }
}
