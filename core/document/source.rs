//! Texts with a name, and places in them.
use std::fmt;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

/// A text that was read, and where it came from. Cloning shares it.
#[derive(Clone)]
pub struct SourceText(Arc<Text>);

struct Text {
    name: String,
    text: String,
    /// Given on the command line: the name says it all, lines and columns nothing.
    argument: bool,
    /// Byte offsets at which lines begin; found when the first place is shown.
    lines: OnceLock<Vec<usize>>,
}

impl SourceText {
    /// `name`, the path of a file, is shown before every place.
    pub fn new(name: impl Into<String>, text: impl Into<String>) -> Self {
        let (name, text) = (name.into(), text.into());
        SourceText(Arc::new(Text { name, text, argument: false, lines: OnceLock::new() }))
    }

    /// The argument of a command line option, as in `--set a=1`. Shown whole in place of a line.
    pub fn argument(option: &str, text: impl Into<String>) -> Self {
        let text = text.into();
        let name = format!("{option} {text}");
        SourceText(Arc::new(Text { name, text, argument: true, lines: OnceLock::new() }))
    }

    /// The path of the file, or what else stands for it.
    pub fn name(&self) -> &str {
        &self.0.name
    }

    /// The whole text.
    pub fn text(&self) -> &str {
        &self.0.text
    }

    /// A place in this text, cut to its length.
    pub fn place(&self, span: Range<usize>) -> Place {
        let end = span.end.min(self.text().len());
        // a text of 4 GiB is never read: see `MAX_BYTES` of `manifactor_config`
        Place { source: self.clone(), start: span.start.min(end) as u32, end: end as u32 }
    }

    /// Line and column of a byte offset, both from 1; the column counts characters.
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

/// Some bytes of a source: what a value was written as.
#[derive(Clone, PartialEq)]
pub struct Place {
    /// The text.
    pub source: SourceText,
    start: u32,
    end: u32,
}

impl Place {
    /// For what was not read from a text.
    pub fn nowhere() -> Self {
        static NOWHERE: OnceLock<SourceText> = OnceLock::new();
        NOWHERE.get_or_init(|| SourceText::new("document", "")).place(0..0)
    }

    /// The bytes.
    pub fn span(&self) -> Range<usize> {
        self.start as usize..self.end as usize
    }

    /// The line, from 1.
    pub fn line(&self) -> usize {
        self.source.line_and_column(self.span().start).0
    }

    /// The column in characters, from 1.
    pub fn column(&self) -> usize {
        self.source.line_and_column(self.span().start).1
    }

    /// The part on the first line, so that a message about a long table does not show all of it.
    #[must_use]
    pub(crate) fn first_line(mut self) -> Place {
        if let Some(length) = self.text().find(['\n', '\r']) {
            self.end = self.start + length as u32;
        }
        self
    }

    /// Returns whether all of another place is within this one, or is this one. What was not read from a text is nowhere.
    pub fn contains(&self, other: &Place) -> bool {
        self.start <= other.start
            && other.end <= self.end
            && self.start < self.end
            && self.source == other.source
    }

    /// What is written there.
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
