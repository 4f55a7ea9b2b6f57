//! Numbers and words as readable text.
use manifactor::graph::Key;

mod printable;
mod table;
mod width;

pub(crate) use manifactor::formats::words::{count, list};
pub(crate) use printable::{json, on_one_line, printable, same_length, shortened};
pub(crate) use table::Table;
use unicode_width::UnicodeWidthStr;
pub(crate) use width::width;

/// Wraps a paragraph at the width of the terminal.
pub(crate) fn wrap(paragraph: &str) -> String {
    wrapped(paragraph, width()).join("\n")
}

/// Wraps a paragraph between words into lines of at most `width`; a longer word gets a separate line.
pub(crate) fn wrapped(paragraph: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in paragraph.split_whitespace() {
        let Some(line) = lines.last_mut() else { break };
        if line.is_empty() {
            *line += word;
        } else if line.width() + 1 + word.width() <= width {
            *line = format!("{line} {word}");
        } else {
            lines.push(word.to_owned());
        }
    }
    lines
}

/// Formats keys as `x0, x1`.
pub(crate) fn keys(keys: &[Key]) -> String {
    keys.iter().map(|key| on_one_line(key.as_str())).collect::<Vec<_>>().join(", ")
}

/// Formats a duration with three significant digits.
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
        let lines = wrapped(&"word ".repeat(50), 80);
        assert!(lines.iter().all(|l| l.width() <= 80) && lines.len() == 4);
        assert_eq!(wrapped("一二 三", 5), ["一二", "三"]);
        assert_eq!(wrapped("", 80), [""]);
    }

    #[test]
    fn one_is_singular() {
        assert_eq!((count(1, "factor"), count(2, "factor")), ("1 factor".into(), "2 factors".into()));
    }
}
