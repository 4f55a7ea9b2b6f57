//! Text in SVG and HTML.

/// Escapes a text for XML and HTML. Markup becomes entities. Control characters except for line breaks and
/// tabs, and characters that are not allowed in documents, become U+FFFD.
pub fn escape(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in visible(text) {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            c => out.push(c),
        }
    }
    out
}

/// Replaces the characters of a text that are not valid in XML (1.0, section 2.2) by U+FFFD.
pub(crate) fn visible(text: &str) -> impl Iterator<Item = char> {
    let unfit = |c: char| matches!(c, '\u{fffe}' | '\u{ffff}') || (c.is_control() && c != '\n' && c != '\t');
    text.chars().map(move |c| if unfit(c) { char::REPLACEMENT_CHARACTER } else { c })
}

#[cfg(test)]
mod tests {
    use super::escape;

    #[test]
    fn what_xml_cannot_hold_is_replaced() {
        assert_eq!(escape("a<b> & \"c\"\n\td"), "a&lt;b&gt; &amp; &quot;c&quot;\n\td");
        assert_eq!(escape("\0\u{1b}\r\u{7f}\u{9b}\u{fffe}\u{ffff}"), "\u{fffd}".repeat(7));
        assert_eq!(escape("Tasse ☕ 🏺"), "Tasse ☕ 🏺");
    }
}
