//! Errors with a position, and lists of them.
use crate::fault::Fault;
use crate::source::{Place, SourceText};
use std::cell::RefCell;
use std::fmt;

/// One error with its position. Displays as `file:line:column: error (remedy)`.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostic {
    /// Position of the error, at most one line long.
    pub place: Place,
    /// The error.
    pub fault: Fault,
    /// A second position that belongs to the error, with a label such as `first given here`.
    pub related: Option<(Place, String)>,
}

impl Diagnostic {
    /// Creates a diagnostic for the first line of a position.
    pub fn new(place: Place, fault: Fault) -> Self {
        Diagnostic { place: place.first_line(), fault, related: None }
    }

    /// Creates the error for a name that is given twice but must be unique.
    pub fn duplicate(what: &str, name: &str, second: Place, first: Place) -> Self {
        let fault = Fault::Duplicate { what: what.into(), name: name.into() };
        let related = Some((first, "first given here".into()));
        Diagnostic { related, ..Diagnostic::new(second, fault) }
    }

    /// Returns the line, counted from 1.
    pub fn line(&self) -> usize {
        self.place.line()
    }

    /// Returns the column in characters, counted from 1.
    pub fn column(&self) -> usize {
        self.place.column()
    }

    /// Returns the error without its position.
    pub fn message(&self) -> String {
        self.fault.to_string()
    }

    /// Returns the remedy, if there is one.
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

/// Largest number of diagnostics in a list. Further ones are only counted.
const MAX_DIAGNOSTICS: usize = 200;

/// All errors of a document, sorted by position. Never empty.
#[derive(Debug, Clone, PartialEq)]
pub struct Diagnostics {
    list: Vec<Diagnostic>,
    omitted: usize,
}

impl Diagnostics {
    /// Sorts diagnostics by position and removes duplicates. Returns `None` for an empty list. After the
    /// first 200, further ones are only counted.
    pub fn from_list(mut list: Vec<Diagnostic>) -> Option<Self> {
        list.sort_by(|a, b| a.order().cmp(&b.order()));
        list.dedup();
        let omitted = list.len().saturating_sub(MAX_DIAGNOSTICS);
        list.truncate(MAX_DIAGNOSTICS);
        (!list.is_empty()).then_some(Diagnostics { list, omitted })
    }

    /// Returns an iterator in the order of positions.
    pub fn iter(&self) -> std::slice::Iter<'_, Diagnostic> {
        self.list.iter()
    }

    /// Returns the number of listed diagnostics, at least one.
    #[expect(clippy::len_without_is_empty, reason = "never empty")]
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// Returns the number of diagnostics beyond the listed ones.
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

/// A collector of the errors of a document, so that all of them are reported at once.
#[derive(Debug, Default)]
pub struct Errors(RefCell<Vec<Diagnostic>>);

impl Errors {
    /// Creates an empty collector.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a diagnostic.
    pub fn push(&self, diagnostic: Diagnostic) {
        self.0.borrow_mut().push(diagnostic);
    }

    /// Adds a fault at a position.
    pub fn report(&self, place: Place, fault: Fault) {
        self.push(Diagnostic::new(place, fault));
    }

    /// Adds all diagnostics of a list.
    pub fn extend(&self, diagnostics: impl IntoIterator<Item = Diagnostic>) {
        self.0.borrow_mut().extend(diagnostics);
    }

    /// Returns whether there is no error so far.
    pub fn is_empty(&self) -> bool {
        self.0.borrow().is_empty()
    }

    /// Returns the number of errors so far.
    pub fn len(&self) -> usize {
        self.0.borrow().len()
    }

    /// Returns the value if there were no errors. A reader that returns `None` has always reported the
    /// reason.
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
