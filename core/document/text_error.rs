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
/// A type that is read with [`deserialize_with`](crate::deserialize_with) returns it as a [`ReadError`](crate::ReadError), which has the place
/// in the document.
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
    fn a_caret_is_under_the_fault() {
        let text = "α + abs(dto(a, b))";
        let at = text.find("dto").unwrap();
        let help = Some("did you mean `dot`?".to_owned());
        let error = TextError { text: text.into(), span: at..at + 3, message: "unknown".into(), help };
        assert_eq!(error.to_string(), "unknown\n  α + abs(dto(a, b))\n          ^^^\ndid you mean `dot`?");
    }
}
