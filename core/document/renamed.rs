//! Fields that were renamed: their old names are still read, with a warning.
use crate::fault::Fault;
use crate::node::{Node, Value};
use crate::read_error::ReadError;
use crate::reader::Reader;
use std::borrow::Cow;
use std::collections::BTreeSet;
use std::sync::{Mutex, PoisonError};

/// A field that was renamed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RenamedField {
    /// Deprecated name.
    pub old: &'static str,
    /// Name that replaces it.
    pub new: &'static str,
}

/// Reads a table whose fields may have their old names. `read` reads the table with the new names.
/// The first use of an old name logs a warning.
///
/// # Errors
/// The errors of `read`. Also if a table has both names of a field.
pub fn read_renamed<T>(
    node: &Node,
    renamed: &[RenamedField],
    read: impl FnOnce(Reader<'_>) -> Result<T, ReadError>,
) -> Result<T, ReadError> {
    let current = with_new_names(node, renamed)?;
    read(Reader::new(&current)).map_err(|error| error.at(&current))
}

fn with_new_names<'a>(node: &'a Node, renamed: &[RenamedField]) -> Result<Cow<'a, Node>, ReadError> {
    let mut current = Cow::Borrowed(node);
    for RenamedField { old, new } in renamed {
        if node.field(old).is_none() {
            continue;
        }
        let Value::Table(table) = &mut current.to_mut().value else { continue };
        let Some((index, _, field)) = table.shift_remove_full(*old) else { continue };
        if table.contains_key(*new) {
            let message = format!("`{old}` is the old name of `{new}`, and both are given");
            return Err(ReadError::new(field.key, Fault::with_help(message, format!("remove `{old}`"))));
        }
        table.shift_insert(index, (*new).to_owned(), field);
        warn_once(old, new);
    }
    Ok(current)
}

/// Warns about an old name. A document may be read many times, so each name is reported once per process.
fn warn_once(old: &'static str, new: &'static str) {
    static REPORTED: Mutex<BTreeSet<&str>> = Mutex::new(BTreeSet::new());
    if REPORTED.lock().unwrap_or_else(PoisonError::into_inner).insert(old) {
        tracing::warn!("`{old}` is deprecated; use `{new}`");
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::node::{Field, Table};
    use crate::source::SourceText;
    use serde::Deserialize;

    const RENAMED: [RenamedField; 1] = [RenamedField { old: "wide", new: "width" }];

    #[derive(Debug, PartialEq, Deserialize)]
    #[serde(deny_unknown_fields)]
    struct Sizes {
        width: f64,
    }

    /// Reads a table of fields with their names, each with a value at the position after the name.
    fn read(fields: &[(&str, Value)]) -> Result<Sizes, ReadError> {
        let source = SourceText::new("sizes", "x".repeat(2 * fields.len()));
        let mut table = Table::default();
        for (i, (name, value)) in fields.iter().enumerate() {
            let key = source.place(2 * i..2 * i + 1);
            let node = Node::new(source.place(2 * i + 1..2 * i + 2), value.clone());
            table.insert((*name).to_owned(), Field { key, node });
        }
        let node = Node::new(source.place(0..2 * fields.len()), Value::Table(table));
        read_renamed(&node, &RENAMED, |reader| Sizes::deserialize(reader))
    }

    #[test]
    fn an_old_name_is_read_as_the_new_one() {
        assert_eq!(read(&[("wide", Value::Integer(2))]).ok(), Some(Sizes { width: 2.0 }));
        assert_eq!(read(&[("width", Value::Integer(2))]).ok(), Some(Sizes { width: 2.0 }));
    }

    #[test]
    fn errors_are_at_the_field_of_the_document() {
        let wrong = read(&[("wide", Value::String("x".into()))]).unwrap_err();
        assert_eq!(wrong.place().map(|place| place.span()), Some(1..2));
        let both = read(&[("width", Value::Integer(2)), ("wide", Value::Integer(3))]).unwrap_err();
        assert_eq!(both.place().map(|place| place.span()), Some(2..3));
        assert!(both.fault().to_string().contains("old name of `width`"));
        let unknown = read(&[("width", Value::Integer(2)), ("high", Value::Integer(3))]).unwrap_err();
        assert!(unknown.is_unread_field());
    }
}
