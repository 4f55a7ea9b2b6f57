//! Tables for any width from 60 columns on; no number and no name is ever broken.
//!
//! A table of numbers leaves out columns without any number. One that is too wide keeps the columns of
//! highest priority that fit, and lists the hidden ones. A table of words wraps its last column. If that is
//! not enough, rows are turned: a name, and below it one line for each cell.
use super::{on_one_line, width, wrapped};
use unicode_width::UnicodeWidthStr;

/// Space between two columns.
const GAP: usize = 2;
/// Smallest readable width of a last column of words.
const NARROW: usize = 24;

/// A table whose cells are [fit for a terminal](on_one_line).
pub(crate) struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
    kind: Kind,
}

enum Kind {
    /// All columns except the first, by decreasing priority, and the number of left-aligned columns with
    /// names.
    Numbers {
        by_priority: Vec<usize>,
        names: usize,
    },
    Words,
}

impl Table {
    /// Creates a table of right-aligned numbers; the first column has names. If space is short, the left
    /// columns have priority.
    pub(crate) fn of_numbers(header: &[&str]) -> Self {
        let by_priority = (1..header.len()).collect();
        Self { kind: Kind::Numbers { by_priority, names: 1 }, ..Self::of_words(header) }
    }

    /// Creates a table of left-aligned words; the last column has sentences.
    pub(crate) fn of_words(header: &[&str]) -> Self {
        let header = header.iter().map(|cell| on_one_line(cell).into_owned()).collect();
        Self { header, rows: vec![], kind: Kind::Words }
    }

    /// Gives the columns `names` the highest priority, in this order.
    pub(crate) fn with_priority(mut self, names: &[&str]) -> Self {
        if let Kind::Numbers { by_priority, .. } = &mut self.kind {
            let rank = |column: &usize| {
                names.iter().position(|name| self.header.get(*column).is_some_and(|h| h == name))
            };
            by_priority.sort_by_key(|column| rank(column).unwrap_or(names.len()));
        }
        self
    }

    /// Sets the number of left-aligned columns with names.
    pub(crate) fn with_name_columns(mut self, columns: usize) -> Self {
        if let Kind::Numbers { names, .. } = &mut self.kind {
            *names = columns;
        }
        self
    }

    /// Adds a row.
    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = impl AsRef<str>>) {
        let cells = cells.into_iter().map(|cell| on_one_line(cell.as_ref()).into_owned());
        self.rows.push(cells.collect());
    }

    /// Formats the table for the width of the terminal.
    pub(crate) fn text(&self) -> String {
        self.at(width())
    }

    /// Formats the table for a width, without trailing spaces.
    pub(crate) fn at(&self, width: usize) -> String {
        let lines = match &self.kind {
            Kind::Numbers { by_priority, names } => self.numbers(by_priority, *names, width),
            Kind::Words => self.words(width),
        };
        let lines = lines.unwrap_or_else(|| self.turned(width));
        lines.iter().map(|line| line.trim_end()).collect::<Vec<_>>().join("\n")
    }

    fn cell(row: &[String], column: usize) -> &str {
        row.get(column).map_or("", String::as_str)
    }

    /// The two header lines of a column: its name and its unit.
    fn head(&self, column: usize) -> [&str; 2] {
        let name = Self::cell(&self.header, column);
        name.split_once(" (")
            .map_or([name, ""], |(before, _)| [before, name.get(before.len() + 1..).unwrap_or_default()])
    }

    fn column_width(&self, column: usize) -> usize {
        let cells = self.rows.iter().map(|row| Self::cell(row, column).width());
        let head = match self.kind {
            Kind::Numbers { .. } => {
                self.head(column).map(UnicodeWidthStr::width).into_iter().max().unwrap_or(0)
            }
            Kind::Words => Self::cell(&self.header, column).width(),
        };
        cells.max().unwrap_or(0).max(head)
    }

    /// Returns `None` if not even the first column of numbers fits next to the names. Columns without a number
    /// are left out.
    fn numbers(&self, by_priority: &[usize], names: usize, width: usize) -> Option<Vec<String>> {
        let mut shown = vec![0];
        let mut taken = self.column_width(0);
        let is_empty = |column: usize| {
            column >= names && self.rows.iter().all(|row| matches!(Self::cell(row, column), "" | "-"))
        };
        for column in by_priority.iter().filter(|column| !is_empty(**column)) {
            let wide = self.column_width(*column) + GAP;
            if taken + wide <= width {
                taken += wide;
                shown.push(*column);
            }
        }
        if taken > width || (shown.len() == 1 && !by_priority.is_empty()) {
            return None;
        }
        shown.sort_unstable();
        let widths: Vec<usize> = shown.iter().map(|column| self.column_width(*column)).collect();
        let line = |cell: &dyn Fn(usize) -> String| {
            let cells = shown.iter().zip(&widths).map(|(column, width)| {
                let text = cell(*column);
                let blanks = " ".repeat(width.saturating_sub(text.width()));
                let gap = " ".repeat(if *column == 0 { 0 } else { GAP });
                if *column < names { gap + &text + &blanks } else { gap + &blanks + &text }
            });
            cells.collect::<String>()
        };
        let rule = "─".repeat(taken);
        let mut lines = vec![rule.clone(), line(&|column| self.head(column)[0].to_owned())];
        if shown.iter().any(|column| !self.head(*column)[1].is_empty()) {
            lines.push(line(&|column| self.head(column)[1].to_owned()));
        }
        lines.push(rule.clone());
        lines.extend(self.rows.iter().map(|row| line(&|column| Self::cell(row, column).to_owned())));
        lines.push(rule);
        let hidden = (0..self.header.len()).filter(|column| !shown.contains(column) && !is_empty(*column));
        let hidden: Vec<&str> = hidden.map(|column| self.head(column)[0]).collect();
        if !hidden.is_empty() {
            lines.extend(wrapped(&format!("Not shown at this width: {}.", hidden.join(", ")), width));
        }
        Some(lines)
    }

    /// Returns `None` if the last column would be too narrow.
    fn words(&self, width: usize) -> Option<Vec<String>> {
        let last = self.header.len().saturating_sub(1);
        let widths: Vec<usize> = (0..last).map(|column| self.column_width(column)).collect();
        let before: usize = widths.iter().map(|width| width + GAP).sum();
        let left = width.checked_sub(before).filter(|left| *left >= NARROW)?;
        let line = |row: &[String], lines: &mut Vec<String>| {
            let start = widths.iter().enumerate().map(|(column, width)| {
                let text = Self::cell(row, column);
                text.to_owned() + &" ".repeat(width - text.width() + GAP)
            });
            let (mut start, blank) = (start.collect::<String>(), " ".repeat(before));
            for part in wrapped(Self::cell(row, last), left) {
                lines.push(start + &part);
                start = blank.clone();
            }
        };
        let rule = "─".repeat(before + left.min(self.column_width(last)));
        let mut lines = vec![rule.clone()];
        line(&self.header, &mut lines);
        lines.push(rule.clone());
        self.rows.iter().for_each(|row| line(row, &mut lines));
        lines.push(rule);
        Some(lines)
    }

    /// Formats each row as its name, and below it each cell after the name of its column.
    fn turned(&self, width: usize) -> Vec<String> {
        let widest = self.header.iter().skip(1).map(|name| name.width()).max().unwrap_or(0);
        let mut lines = vec![];
        for row in &self.rows {
            lines.push(Self::cell(row, 0).to_owned());
            for column in 1..self.header.len() {
                let (name, cell) = (Self::cell(&self.header, column), Self::cell(row, column));
                if cell.is_empty() {
                    continue;
                }
                let mut start = format!("  {name}{}", " ".repeat(widest - name.width() + GAP));
                let indent = start.width();
                for part in wrapped(cell, width.saturating_sub(indent).max(NARROW)) {
                    lines.push(start + &part);
                    start = " ".repeat(indent);
                }
            }
        }
        lines
    }
}

#[cfg(test)]
mod tests;
