//! Errors with a place, and lists of them.
use crate::fault::Fault;
use crate::source::{Place, SourceText};
use std::cell::RefCell;
use std::fmt;

/// One thing that is wrong, and where. Displays as `file:line:column: what (what to do)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Where: at most one line.
    pub place: Place,
    /// What.
    pub fault: Fault,
    /// A second place that belongs to it, and what is there: `first given here`.
    pub related: Option<(Place, String)>,
}

impl Diagnostic {
    /// A fault at a place, of which the first line is kept.
    pub fn new(place: Place, fault: Fault) -> Self {
        Diagnostic { place: place.first_line(), fault, related: None }
    }

    /// The second of two things of one name, of which there may be one only.
    pub fn duplicate(what: &str, name: &str, second: Place, first: Place) -> Self {
        let fault = Fault::Duplicate { what: what.into(), name: name.into() };
        let related = Some((first, "first given here".into()));
        Diagnostic { related, ..Diagnostic::new(second, fault) }
    }

    /// The line, from 1.
    pub fn line(&self) -> usize {
        self.place.line()
    }

    /// The column in characters, from 1.
    pub fn column(&self) -> usize {
        self.place.column()
    }

    /// What is wrong, without the place.
    pub fn message(&self) -> String {
        self.fault.to_string()
    }

    /// What to do about it.
    pub fn help(&self) -> Option<String> {
        self.fault.help()
    }

    fn order(&self) -> (&str, usize, usize) {
        (self.place.source.name(), self.place.span().start, self.place.span().end)
    }
}

impl fmt::Display for Diagnostic {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.place, self.fault)?;
        if let Some((place, label)) = &self.related {
            write!(f, "; {label}: {place}")?;
        }
        self.help().map_or(Ok(()), |help| write!(f, " ({help})"))
    }
}

impl std::error::Error for Diagnostic {}

/// Diagnostics that are shown; of further ones, the number.
const TOLD: usize = 200;

/// Everything that is wrong with a document, sorted by place. Never empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    omitted: usize,
}

impl Diagnostics {
    /// Sorted by place, each once; none if there are none. After the first 200, the others are only counted.
    pub fn from_list(mut list: Vec<Diagnostic>) -> Option<Self> {
        list.sort_by(|a, b| a.order().cmp(&b.order()));
        list.dedup();
        let omitted = list.len().saturating_sub(TOLD);
        list.truncate(TOLD);
        (!list.is_empty()).then_some(Diagnostics { list, omitted })
    }

    /// In order of place.
    pub fn iter(&self) -> std::slice::Iter<'_, Diagnostic> {
        self.list.iter()
    }

    /// How many are listed: at least one.
    #[expect(clippy::len_without_is_empty, reason = "never empty")]
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// How many more there were than are listed.
    pub fn omitted(&self) -> usize {
        self.omitted
    }
}

impl From<Diagnostic> for Diagnostics {
    fn from(one: Diagnostic) -> Self {
        Diagnostics { list: vec![one], omitted: 0 }
    }
}

impl IntoIterator for Diagnostics {
    type Item = Diagnostic;
    type IntoIter = std::vec::IntoIter<Diagnostic>;
    fn into_iter(self) -> Self::IntoIter {
        self.list.into_iter()
    }
}

impl<'a> IntoIterator for &'a Diagnostics {
    type Item = &'a Diagnostic;
    type IntoIter = std::slice::Iter<'a, Diagnostic>;
    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl fmt::Display for Diagnostics {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, diagnostic) in self.iter().enumerate() {
            write!(f, "{}{diagnostic}", if i > 0 { "\n" } else { "" })?;
        }
        match self.omitted {
            0 => Ok(()),
            more => write!(f, "\nand {more} more"),
        }
    }
}

impl std::error::Error for Diagnostics {}

/// Collects what is wrong while a document is read, so that all of it can be said at once.
#[derive(Debug, Default)]
pub struct Errors(RefCell<Vec<Diagnostic>>);

impl Errors {
    /// None yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one.
    pub fn push(&self, diagnostic: Diagnostic) {
        self.0.borrow_mut().push(diagnostic);
    }

    /// Adds a problem at a place.
    pub fn report(&self, place: Place, fault: Fault) {
        self.push(Diagnostic::new(place, fault));
    }

    /// Adds all of a list.
    pub fn extend(&self, diagnostics: impl IntoIterator<Item = Diagnostic>) {
        self.0.borrow_mut().extend(diagnostics);
    }

    /// Returns whether nothing is wrong so far.
    pub fn is_empty(&self) -> bool {
        self.0.borrow().is_empty()
    }

    /// How many so far.
    pub fn len(&self) -> usize {
        self.0.borrow().len()
    }

    /// What was read, if nothing was wrong. Every reader that returns `None` has reported why.
    pub fn finish<T>(self, value: Option<T>) -> Result<T, Diagnostics> {
        match (Diagnostics::from_list(self.0.into_inner()), value) {
            (None, Some(value)) => Ok(value),
            (Some(errors), _) => Err(errors),
            (None, None) => {
                let nowhere = SourceText::new("document", "").place(0..0);
                Err(Diagnostic::new(nowhere, Fault::invalid("incomplete")).into())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_sorted_and_says_each_thing_once() {
        let source = SourceText::new("a.toml", "x = 1\ny = 2\n");
        let errors = Errors::new();
        errors.report(source.place(6..7), Fault::MissingField { field: "z".into() });
        errors.push(Diagnostic::duplicate("key", "x", source.place(6..7), source.place(0..1)));
        errors.report(source.place(0..1), Fault::invalid("odd"));
        errors.report(source.place(0..1), Fault::invalid("odd"));
        let list = errors.finish(Some(())).unwrap_err();
        assert_eq!(
            list.to_string(),
            "a.toml:1:1: odd\n\
             a.toml:2:1: missing field `z`\n\
             a.toml:2:1: key `x` is given twice; first given here: a.toml:1:1 (remove or rename one of them)"
        );
        assert_eq!(list.len(), 3);
    }

    #[test]
    fn a_long_list_is_cut_and_counted() {
        let source = SourceText::new("a", "x".repeat(300));
        let at = |i| Diagnostic::new(source.place(i..i + 1), Fault::invalid("odd"));
        let list = Diagnostics::from_list((0..300).map(at).collect()).unwrap();
        assert_eq!((list.len(), list.omitted()), (200, 100));
        assert!(list.to_string().ends_with("a:1:200: odd\nand 100 more"));
    }

    #[test]
    fn no_errors_give_the_value() {
        assert_eq!(Errors::new().finish(Some(3)), Ok(3));
        assert!(Errors::new().finish(None::<()>).is_err());
        assert_eq!(Diagnostics::from_list(vec![]), None);
    }
}
