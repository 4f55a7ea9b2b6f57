//! Tables for people, at any width from 60 columns on: no number and no name is ever broken.
//!
//! A table of numbers that is too wide keeps its columns, in an order of its own, as long as they fit, and says which it
//! leaves out. A table of words breaks the lines of its last column. Where that is not enough, rows are turned: a name, and
//! below it what it has, a line each.
use super::{on_one_line, width, wrapped};
use unicode_width::UnicodeWidthStr;

/// Between two columns.
const GAP: usize = 2;
/// A last column of words that is narrower than this is not read with pleasure.
const NARROW: usize = 24;

/// A table whose cells are [fit for a terminal](on_one_line).
pub(crate) struct Table {
    header: Vec<String>,
    rows: Vec<Vec<String>>,
    kind: Kind,
}

enum Kind {
    /// Columns but the first, in the order in which they are kept; how many have names, and stand to the left.
    Numbers {
        kept_first: Vec<usize>,
        names: usize,
    },
    Words,
}

impl Table {
    /// Numbers to the right: all columns but the first, which has names. The first are kept where there is no room for all.
    pub(crate) fn of_numbers(header: &[&str]) -> Self {
        let kept_first = (1..header.len()).collect();
        Self { kind: Kind::Numbers { kept_first, names: 1 }, ..Self::of_words(header) }
    }

    /// Words, all to the left; the last column has sentences.
    pub(crate) fn of_words(header: &[&str]) -> Self {
        let header = header.iter().map(|cell| on_one_line(cell).into_owned()).collect();
        Self { header, rows: vec![], kind: Kind::Words }
    }

    /// The same, with columns that are kept before all others, in this order.
    pub(crate) fn keeping(mut self, names: &[&str]) -> Self {
        if let Kind::Numbers { kept_first, .. } = &mut self.kind {
            let rank = |column: &usize| {
                names.iter().position(|name| self.header.get(*column).is_some_and(|h| h == name))
            };
            kept_first.sort_by_key(|column| rank(column).unwrap_or(names.len()));
        }
        self
    }

    /// The same, where the first so many columns have names.
    pub(crate) fn naming(mut self, columns: usize) -> Self {
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

    /// The table, as wide as the terminal is.
    pub(crate) fn text(&self) -> String {
        self.at(width())
    }

    /// The table at a width, without blanks at the ends of its lines.
    pub(crate) fn at(&self, width: usize) -> String {
        let lines = match &self.kind {
            Kind::Numbers { kept_first, names } => self.numbers(kept_first, *names, width),
            Kind::Words => self.words(width),
        };
        let lines = lines.unwrap_or_else(|| self.turned(width));
        lines.iter().map(|line| line.trim_end()).collect::<Vec<_>>().join("\n")
    }

    fn cell(row: &[String], column: usize) -> &str {
        row.get(column).map_or("", String::as_str)
    }

    /// The lines of a column's header: its unit below its name.
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

    /// `None`, where not even the first column of numbers fits beside the names.
    fn numbers(&self, kept_first: &[usize], names: usize, width: usize) -> Option<Vec<String>> {
        let mut shown = vec![0];
        let mut taken = self.column_width(0);
        for column in kept_first {
            let wide = self.column_width(*column) + GAP;
            if taken + wide <= width {
                taken += wide;
                shown.push(*column);
            }
        }
        if taken > width || (shown.len() == 1 && !kept_first.is_empty()) {
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
        let hidden = (0..self.header.len()).filter(|column| !shown.contains(column));
        let hidden: Vec<&str> = hidden.map(|column| self.head(column)[0]).collect();
        if !hidden.is_empty() {
            lines.extend(wrapped(&format!("Not shown at this width: {}.", hidden.join(", ")), width));
        }
        Some(lines)
    }

    /// `None`, where too little is left for the last column.
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

    /// Row by row: its name, and below it each of its cells behind the name of its column.
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
