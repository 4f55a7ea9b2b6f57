//! Makes foreign text safe for a terminal: titles, keys and file names may hold control characters, which a
//! terminal obeys.
use std::borrow::Cow;
use std::fmt::Write;

/// Escapes control characters except for line breaks (C0, DEL, C1) as `\u{1b}`.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |c| is_obeyed(c) && c != '\n')
}

/// Escapes control characters and line breaks, for names in tables and sentences.
pub(crate) fn on_one_line(text: &str) -> Cow<'_, str> {
    escaped(text, is_obeyed)
}

/// Returns whether a terminal obeys a character. These are the control characters, and those that change
/// the direction of text so that it looks like different text (Boucher and Anderson, *Trojan Source*,
/// 2021).
fn is_obeyed(c: char) -> bool {
    const DIRECTIONS: [char; 12] = [
        '\u{61c}', '\u{200e}', '\u{200f}', '\u{202a}', '\u{202b}', '\u{202c}', '\u{202d}', '\u{202e}',
        '\u{2066}', '\u{2067}', '\u{2068}', '\u{2069}',
    ];
    c.is_control() || DIRECTIONS.contains(&c)
}

/// Escapes control characters and limits the length, for messages that quote the input.
pub(crate) fn shortened(text: &str) -> String {
    /// Longest text that is shown. Unit: bytes.
    const MOST: usize = 2000;
    let end = text.char_indices().map(|(at, _)| at).find(|at| *at > MOST).unwrap_or(text.len());
    let more = if end < text.len() { "…" } else { "" };
    printable(text.get(..end).unwrap_or_default()).into_owned() + more
}

/// Escapes DEL and C1 in a JSON document. The serializer keeps them, and they only occur in strings.
pub(crate) fn json(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            // writing to a String cannot fail
            c if is_obeyed(c) && u32::from(c) >= 0x7f => _ = write!(out, "\\u{:04x}", u32::from(c)),
            c => out.push(c),
        }
    }
    out
}

/// Replaces control characters in a document that is shown around an error. The length in bytes is kept, so
/// positions stay valid.
pub(crate) fn same_length(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    let mut rest = text.chars().peekable();
    while let Some(c) = rest.next() {
        let ends_line = c == '\n' || (c == '\r' && rest.peek() == Some(&'\n'));
        if is_obeyed(c) && !ends_line && c != '\t' {
            out.extend(std::iter::repeat_n('?', c.len_utf8()));
        } else {
            out.push(c);
        }
    }
    out
}

fn escaped(text: &str, hidden: fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(hidden) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        if hidden(c) { out.extend(c.escape_default()) } else { out.push(c) }
    }
    Cow::Owned(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Clears the screen by C0 and by C1, rings the bell, deletes, and returns to the start of the line.
    const NASTY: &str = "a\u{1b}[2J\u{9b}2J\u{7}\u{7f}\rb\nc";

    #[test]
    fn no_control_character_reaches_a_terminal() {
        assert_eq!(printable(NASTY), "a\\u{1b}[2J\\u{9b}2J\\u{7}\\u{7f}\\rb\nc");
        assert_eq!(on_one_line(NASTY), "a\\u{1b}[2J\\u{9b}2J\\u{7}\\u{7f}\\rb\\nc");
        assert_eq!(on_one_line("cup\u{202e}gum"), "cup\\u{202e}gum");
        assert!(matches!(printable("Tasse α\n"), Cow::Borrowed(_)));
    }

    #[test]
    fn json_stays_json() {
        let text = serde_json::to_string(NASTY).unwrap();
        let safe = json(&text);
        assert!(text.contains('\u{9b}') && !safe.contains(char::is_control));
        assert_eq!(serde_json::from_str::<String>(&safe).unwrap(), NASTY);
    }

    #[test]
    fn lines_of_a_document_keep_their_places() {
        assert_eq!(same_length(NASTY), "a?[2J??2J???b\nc");
        assert_eq!(same_length("a\tb\r\nc"), "a\tb\r\nc");
    }

    #[test]
    fn long_texts_are_cut_between_characters() {
        let text = shortened(&"α".repeat(3000));
        assert!(text.ends_with("α…") && text.len() < 2010);
    }
}
