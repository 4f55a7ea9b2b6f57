//! How wide a line may be.
use std::sync::LazyLock;

/// Where nobody says how wide: a terminal as it comes.
const USUAL: usize = 80;
/// Tables are not made for less.
const LEAST: usize = 60;

static WIDTH: LazyLock<usize> = LazyLock::new(|| {
    let asked = std::env::var("COLUMNS").ok().and_then(|text| text.trim().parse().ok());
    let terminal = || terminal_size::terminal_size().map(|(width, _)| width.0.into());
    columns(asked.or_else(terminal))
});

/// Columns that a line may take: those that COLUMNS names, else those of the terminal, else 80; at least 60.
pub(crate) fn width() -> usize {
    *WIDTH
}

/// 0 is what terminals say that do not know.
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
