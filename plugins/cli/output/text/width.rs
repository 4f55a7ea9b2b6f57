//! The width of a line.
use std::sync::LazyLock;

/// Width if neither COLUMNS nor the terminal has a value: the usual width of a terminal.
const USUAL: usize = 80;
/// Smallest width of a table.
const LEAST: usize = 60;

static WIDTH: LazyLock<usize> = LazyLock::new(|| {
    let asked = std::env::var("COLUMNS").ok().and_then(|text| text.trim().parse().ok());
    let terminal = || terminal_size::terminal_size().map(|(width, _)| width.0.into());
    columns(asked.or_else(terminal))
});

/// Width of a line: from COLUMNS, else from the terminal, else 80; at least 60. Unit: columns.
pub(crate) fn width() -> usize {
    *WIDTH
}

/// A terminal that does not know its width reports 0.
fn columns(known: Option<usize>) -> usize {
    known.filter(|width| *width > 0).unwrap_or(USUAL).max(LEAST)
}

#[cfg(test)]
mod tests {
    use super::columns;

    #[test]
    fn what_is_unknown_is_80_and_tables_need_60() {
        assert_eq!([None, Some(0), Some(20), Some(60), Some(200)].map(columns), [80, 80, 60, 60, 200]);
    }
}
