//! Errors in a formula, with their position.
use manifactor_graph::TextError;
use std::ops::Range;
use winnow::error::ParserError;
use winnow::stream::{LocatingSlice, Location, Stream};

/// An error at a byte range of a formula.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mistake {
    pub span: Range<usize>,
    pub message: String,
    pub help: Option<String>,
}

impl Mistake {
    pub(crate) fn new(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { span, message: message.into(), help: None }
    }
    pub(crate) fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
    /// Adds the formula that contains the mistake.
    pub(crate) fn within(self, formula: &str) -> TextError {
        let Self { span, message, help } = self;
        TextError { text: TextError::line(formula), span, message, help }
    }
}

/// Input of the parser.
pub(crate) type Input<'i> = LocatingSlice<&'i str>;

impl ParserError<Input<'_>> for Mistake {
    type Inner = Self;

    fn from_input(input: &Input<'_>) -> Self {
        let start = input.current_token_start();
        match input.peek_token() {
            None => Self::new(start..start, "the formula ends where a value is expected"),
            Some(c) => Self::new(start..start + c.len_utf8(), format!("unexpected `{c}`")).help(
                "expected a number, a name, a call such as `norm(v)`, a vector such as `[0, 0, 1]`, or `(`",
            ),
        }
    }
    fn into_inner(self) -> Result<Self, Self> {
        Ok(self)
    }
}
