//! What is wrong within a text of a document, such as a formula.
use std::fmt;
use std::ops::Range;

/// Something wrong at a place within a text. Displays with the text and a caret under the place:
///
/// ```text
/// unknown function `dto`
///   1 - abs(dto(a, b))
///           ^^^
/// did you mean `dot`?
/// ```
/// An error of serde carries no more than such a message: [`TextError::parse`] gets the error back out of it, so that
/// a caller that knows where the text is written can point there.
#[derive(Debug, Clone, PartialEq)]
pub struct TextError {
    /// The text, on one line.
    pub text: String,
    /// The bytes of it that are wrong; none, at the end.
    pub span: Range<usize>,
    /// What is wrong, in a line.
    pub message: String,
    /// What to do about it, in a line.
    pub help: Option<String>,
}

impl std::error::Error for TextError {}

impl TextError {
    /// A text without its line breaks, byte for byte at the same places.
    pub fn line(text: &str) -> String {
        text.replace(['\n', '\r', '\t'], " ")
    }

    /// The error that a message displays; `None`, if it is another message.
    pub fn parse(message: &str) -> Option<Self> {
        let mut lines = message.lines();
        let (first, text, carets) = (lines.next()?, lines.next()?.strip_prefix("  ")?, lines.next()?);
        let indent = carets.strip_prefix("  ")?;
        let before = indent.len() - indent.trim_start_matches(' ').len();
        let width = indent.get(before..).filter(|c| !c.is_empty() && c.bytes().all(|b| b == b'^'))?.len();
        let byte = |character: usize| text.char_indices().nth(character).map_or(text.len(), |(at, _)| at);
        let span = byte(before)..byte(before + width);
        let help = lines.next().map(str::to_owned);
        Some(Self { text: text.to_owned(), span, message: first.to_owned(), help })
    }
}

impl fmt::Display for TextError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = |range: Range<usize>| self.text.get(range).map_or(0, |part| part.chars().count());
        let (before, width) = (count(0..self.span.start), count(self.span.clone()).max(1));
        write!(f, "{}\n  {}\n  {}{}", self.message, self.text, " ".repeat(before), "^".repeat(width))?;
        self.help.iter().try_for_each(|help| write!(f, "\n{help}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_read_back_from_its_message() {
        let text = "α + abs(dto(a, b))";
        let at = text.find("dto").unwrap();
        let help = Some("did you mean `dot`?".to_owned());
        let error = TextError { text: text.into(), span: at..at + 3, message: "unknown".into(), help };
        assert_eq!(error.to_string(), "unknown\n  α + abs(dto(a, b))\n          ^^^\ndid you mean `dot`?");
        assert_eq!(TextError::parse(&error.to_string()), Some(error.clone()));
        let end = TextError { span: text.len()..text.len(), help: None, ..error };
        assert_eq!(TextError::parse(&end.to_string()), Some(end));
    }

    #[test]
    fn other_messages_are_none() {
        for message in ["", "wrong", "wrong\n  text", "wrong\ntext\n ^", "a\n  b\n  c"] {
            assert_eq!(TextError::parse(message), None, "{message}");
        }
    }
}
