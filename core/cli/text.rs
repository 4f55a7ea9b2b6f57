//! Numbers and words for people.
use comfy_table::{CellAlignment, ContentArrangement, LineStyle, Table, TableStyle};
use manifactor::graph::Key;

/// Lines above and below the header, none between rows.
const STYLE: TableStyle = TableStyle::new().top_border(LINE).header_separator(LINE).bottom_border(LINE);
const LINE: LineStyle = LineStyle::none().fill('─').junction('─');

/// What others wrote, fit for a terminal: without control characters, and not without end.
pub(crate) fn printable(text: &str) -> String {
    const MOST: usize = 2000;
    let mut out = String::new();
    for c in text.chars() {
        if out.len() > MOST {
            out.push('…');
            break;
        }
        if c.is_control() && c != '\n' { out.extend(c.escape_default()) } else { out.push(c) }
    }
    out
}

/// A table with a header, its numbers to the right: all columns but the first.
pub(crate) fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(STYLE).set_content_arrangement(ContentArrangement::Dynamic);
    table.set_header(header.to_vec());
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// A table of words, all to the left.
pub(crate) fn words(header: &[&str]) -> Table {
    let mut table = table(header);
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Left);
    }
    if table.width().is_none() {
        table.set_width(WIDTH);
    }
    table
}

/// Columns where nobody says how wide the terminal is.
const WIDTH: u16 = 110;

/// A paragraph, broken into lines.
pub(crate) fn wrap(paragraph: &str) -> String {
    let mut lines = vec![String::new()];
    for word in paragraph.split_whitespace() {
        let Some(line) = lines.last_mut() else { break };
        if line.is_empty() {
            *line += word;
        } else if line.chars().count() + word.chars().count() < WIDTH.into() {
            *line = format!("{line} {word}");
        } else {
            lines.push(word.to_owned());
        }
    }
    lines.join("\n")
}

/// `sphere2500: 2500 poses` and the like: a noun with its number.
pub(crate) fn count(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// The first few of a list, and how many more there are.
pub(crate) fn list(items: impl ExactSizeIterator<Item = String>) -> String {
    const SHOWN: usize = 8;
    let more = items.len().saturating_sub(SHOWN);
    let text = items.take(SHOWN).collect::<Vec<_>>().join(", ");
    if more > 0 { format!("{text} and {more} more") } else { text }
}

/// `x0, x1`.
pub(crate) fn keys(keys: &[Key]) -> String {
    keys.iter().map(Key::as_str).collect::<Vec<_>>().join(", ")
}

/// Seconds, with three digits that say something.
pub(crate) fn seconds(s: f64) -> String {
    match s {
        s if s < 0.9995e-3 => format!("{:.0} µs", s * 1e6),
        s if s < 0.9995 => format!("{:.1} ms", s * 1e3),
        s => format!("{s:.2} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_choose_their_unit() {
        assert_eq!(seconds(12e-6), "12 µs");
        assert_eq!(seconds(0.0123), "12.3 ms");
        assert_eq!(seconds(0.9999), "1.00 s");
    }

    #[test]
    fn paragraphs_are_broken_between_words() {
        let text = wrap(&"word ".repeat(50));
        assert!(text.lines().all(|l| l.chars().count() <= 110) && text.lines().count() == 3);
    }

    #[test]
    fn one_is_singular() {
        assert_eq!((count(1, "factor"), count(2, "factor")), ("1 factor".into(), "2 factors".into()));
    }
}
