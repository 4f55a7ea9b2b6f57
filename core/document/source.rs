//! Texts with a name, and positions in them.
use std::fmt;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// A text and the name of its origin. Clones share the text.
#[derive(Clone)]
pub struct SourceText(Arc<Text>);

struct Text {
    name: String,
    text: String,
    /// True for a text from the command line, which has no meaningful lines and columns.
    argument: bool,
    /// Byte offsets of the line starts, computed when the first position is displayed.
    lines: OnceLock<Vec<usize>>,
}

impl SourceText {
    /// Creates a source. `name` is the path of a file and is shown before each position.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let (name, text) = (name.into(), text.into());
        SourceText(Arc::new(Text { name, text, argument: false, lines: OnceLock::new() }))
    }

    /// Creates a source from the argument of a command line option, such as `--set a=1`. Messages show the
    /// whole argument instead of a line.
    pub fn argument(option: &str, text: impl Into<String>) -> Self {
        let text = text.into();
        let name = format!("{option} {text}");
        SourceText(Arc::new(Text { name, text, argument: true, lines: OnceLock::new() }))
    }

    /// Returns the path of the file or the name that replaces it.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// Returns the whole text.
    pub fn text(&self) -> &str {
        &self.0.text
    }

    /// Returns a position in this text, clipped to its length.
    pub fn place(&self, span: Range<usize>) -> Place {
        let end = span.end.min(self.text().len());
        // a text of 4 GiB is never read: see `MAX_BYTES` of `manifactor_config`
        Place { source: self.clone(), start: span.start.min(end) as u32, end: end as u32 }
    }

    /// Returns line and column of a byte offset, both counted from 1. The column counts characters.
    pub(crate) fn line_and_column(&self, offset: usize) -> (usize, usize) {
        let text = self.text();
        let lines = self.0.lines.get_or_init(|| {
            std::iter::once(0).chain(text.match_indices('\n').map(|(at, _)| at + 1)).collect()
        });
        let line = lines.partition_point(|&start| start <= offset).max(1);
        let start = lines.get(line - 1).copied().unwrap_or_default();
        let column = text.get(start..offset).map_or(0, |before| before.chars().count());
        (line, column + 1)
    }
}

impl PartialEq for SourceText {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || (self.name() == other.name() && self.text() == other.text())
    }
}

impl fmt::Debug for SourceText {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_tuple("SourceText").field(&self.name()).finish()
    }
}

/// A range of bytes in a source.
#[derive(Clone, PartialEq)]
pub struct Place {
    /// The source.
    pub source: SourceText,
    start: u32,
    end: u32,
}

impl Place {
    /// Returns the position of a value that does not come from a text.
    pub fn nowhere() -> Self {
        static NOWHERE: OnceLock<SourceText> = OnceLock::new();
        NOWHERE.get_or_init(|| SourceText::new("document", "")).place(0..0)
    }

    /// Returns the range of bytes.
    pub fn span(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }

    /// Returns the line, counted from 1.
    pub fn line(&self) -> usize {
        self.source.line_and_column(self.span().start).0
    }

    /// Returns the column in characters, counted from 1.
    pub fn column(&self) -> usize {
        self.source.line_and_column(self.span().start).1
    }

    /// Returns the part on the first line, so that a message does not show a whole table.
    #[must_use]
    pub(crate) fn first_line(mut self) -> Place {
        if let Some(length) = self.text().find(['\n', '\r']) {
            self.end = self.start + length as u32;
        }
        self
    }

    /// Returns whether a position is equal to this one or within it. The result is false for positions
    /// without a text.
    pub fn contains(&self, other: &Place) -> bool {
        self.start <= other.start
            && other.end <= self.end
            && self.start < self.end
            && self.source == other.source
    }

    /// Returns the text at this position.
    pub fn text(&self) -> &str {
        self.source.text().get(self.span()).unwrap_or_default()
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.source.0.argument {
            return f.write_str(self.source.name());
        }
        let (line, column) = self.source.line_and_column(self.span().start);
        write!(f, "{}:{line}:{column}", self.source.name())
    }
}

impl fmt::Debug for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{self}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_count_characters() {
        let source = SourceText::new("a.toml", "α = 1\nβγ = x\n");
        let at = source.text().find('x').unwrap();
        assert_eq!(source.place(at..at + 1).to_string(), "a.toml:2:6");
        assert_eq!(source.place(at..at + 1).text(), "x");
    }

    #[test]
    fn places_past_the_end_are_cut() {
        let source = SourceText::new("a.toml", "a\n");
        assert_eq!(source.place(9..12).to_string(), "a.toml:2:1");
        assert_eq!(source.place(9..12).text(), "");
        assert_eq!(SourceText::new("b", "").place(0..0).to_string(), "b:1:1");
    }
}
