//! Columns of numbers in a CSV file, found by their names.
use crate::detections::line;
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

/// Returns the text without the comment sign before its header.
fn without_sign(text: &str) -> &str {
    text.trim_start_matches(['\u{feff}', '#', ' '])
}

/// Returns the names of the columns, without their units.
pub(super) fn header(text: &str) -> impl Iterator<Item = &str> {
    without_sign(text).lines().next().unwrap_or_default().split(',').map(plain)
}

/// Returns the name of a column without its unit, such as `[ns]` or `(ns)`.
fn plain(name: &str) -> &str {
    name.split(['[', '(']).next().unwrap_or_default().trim()
}

/// Returns the rows that have values in these columns, the first of which is a time, with their lines. The
/// mistakes go to `problems`.
pub(super) fn rows<const N: usize>(
    text: &str,
    wanted: &[Column; N],
    problems: &mut ProblemList<'_>,
) -> Vec<(usize, [f64; N])> {
    let text = without_sign(text);
    let mut reader =
        ReaderBuilder::new().trim(Trim::All).comment(Some(b'#')).flexible(true).from_reader(text.as_bytes());
    let header = reader.headers().cloned().unwrap_or_default();
    let mut places: Vec<Option<usize>> = vec![];
    for column in wanted {
        match find(&header, column) {
            Ok(place) => places.push(place),
            Err(mistake) => {
                problems.push(1, mistake);
                return vec![];
            }
        }
    }
    let missing = wanted.iter().zip(&places).filter(|(_, place)| place.is_none());
    let missing: Vec<&str> = missing.map(|(column, _)| column.name).collect();
    if !missing.is_empty() {
        let all = wanted.map(|column| column.name).join(", ");
        let missing = missing.join(", ");
        let message = format!("the header has no column {missing}: expected {all} in the first line");
        problems.push(1, Mistake::Row(message));
        return vec![];
    }
    let places: Vec<usize> = places.into_iter().flatten().collect();
    let is_in_ns = places.first().and_then(|time| header.get(*time)).is_some_and(|time| time.contains("ns"));
    let scale = if is_in_ns { 1e-9 } else { 1.0 };
    let mut rows = vec![];
    for record in reader.records() {
        let record = match record {
            Ok(record) => record,
            Err(error) => {
                let at = error.position().map_or(0, |position| line(text, position));
                problems.push(at, Mistake::Row(error.to_string()));
                continue;
            }
        };
        let fields: Vec<&str> = places.iter().map(|place| record.get(*place).unwrap_or_default()).collect();
        // the time alone may belong to the row of another table
        if fields.iter().skip(1).all(|field| field.is_empty()) {
            continue;
        }
        let at = record.position().map_or(0, |position| line(text, position));
        rows.extend(problems.ok(at, numbers(&fields, wanted, scale)).map(|numbers| (at, numbers)));
    }
    rows
}

/// Returns the place of a column: the one with its own name, otherwise the only one with another name of it.
fn find(header: &csv::StringRecord, column: &Column) -> Result<Option<usize>, Mistake> {
    let with = |is: &dyn Fn(&str) -> bool| -> Vec<usize> {
        header.iter().enumerate().filter(|(_, name)| is(plain(name))).map(|(place, _)| place).collect()
    };
    let own = with(&|name| name == column.name);
    let found = if own.is_empty() { with(&|name| column.others.contains(&name)) } else { own };
    if found.len() > 1 {
        let names: Vec<&str> = found.iter().filter_map(|place| header.get(*place)).collect();
        let message = format!(
            "the columns {} can all be `{}`: name the right one `{}`, and the others differently",
            names.join(", "),
            column.name,
            column.name
        );
        return Err(Mistake::Row(message));
    }
    Ok(found.first().copied())
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
