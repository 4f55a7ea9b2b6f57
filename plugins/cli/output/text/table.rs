//! Tables for people.
use super::on_one_line;
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, TableStyle};

/// Lines above and below the header, none between rows.
const STYLE: TableStyle = TableStyle::new().top_border(LINE).header_separator(LINE).bottom_border(LINE);
const LINE: LineStyle = LineStyle::none().fill('─').junction('─');

/// A table whose cells are [fit for a terminal](on_one_line).
pub(crate) struct Table(comfy_table::Table);

impl Table {
    /// Numbers to the right: all columns but the first.
    pub(crate) fn of_numbers(header: &[&str]) -> Self {
        let mut table = comfy_table::Table::new();
        table.load_style(STYLE).set_content_arrangement(ContentArrangement::Dynamic);
        table.set_header(header.iter().map(|cell| on_one_line(cell)));
        for column in table.column_iter_mut().skip(1) {
            column.set_cell_alignment(CellAlignment::Right);
        }
        Self(table)
    }

    /// Words, all to the left.
    pub(crate) fn of_words(header: &[&str]) -> Self {
        let Self(mut table) = Self::of_numbers(header);
        for column in table.column_iter_mut() {
            column.set_cell_alignment(CellAlignment::Left);
        }
        if table.width().is_none() {
            table.set_width(super::WIDTH);
        }
        Self(table)
    }

    /// Adds a row.
    pub(crate) fn row(&mut self, cells: impl IntoIterator<Item = impl AsRef<str>>) {
        let cells = cells.into_iter().map(|cell| on_one_line(cell.as_ref()).into_owned());
        self.0.add_row(cells.collect::<Vec<_>>());
    }

    /// The table, without blanks at the ends of its lines.
    pub(crate) fn text(&self) -> String {
        self.0.trim_fmt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_do_not_command_the_terminal() {
        let mut table = Table::of_numbers(&["variant", "\u{9b}31m"]);
        table.row(["red \u{1b}[31m", "1\nconverged"]);
        let text = table.text();
        assert!(!text.contains(|c: char| c.is_control() && c != '\n'), "{text:?}");
        assert!(text.contains("red \\u{1b}[31m") && text.contains("1\\nconverged"), "{text}");
    }
}
