//! Errors within a string of a document, such as a formula.
use std::fmt;
use std::ops::Range;

/// An error at a position within a string. Displays with the string and a caret under the position:
///
/// ```text
/// unknown function `dto`
///   1 - abs(dto(a, b))
///           ^^^
/// did you mean `dot`?
/// ```
/// A type that is read with [`deserialize_with`](crate::deserialize_with) returns it as a
/// [`ReadError`](crate::ReadError), which has the position in the document.
#[derive(Debug, Clone, PartialEq)]
pub struct TextError {
    /// The string, on one line.
    pub text: String,
    /// The range of bytes with the error; empty at the end of the string.
    pub span: Range<usize>,
    /// The error, on one line.
    pub message: String,
    /// The remedy, on one line.
    pub help: Option<String>,
}

impl std::error::Error for TextError {}

impl TextError {
    /// Replaces line breaks and tabs by spaces, so that byte positions do not change.
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
