//! Parser for TOML, with positions. It reports several syntax errors at once.
use crate::format::too_deep;
use ::toml::Spanned;
use ::toml::de::{DeInteger, DeTable, DeValue};
use manifactor_document::Fault;
use manifactor_document::{Diagnostic, Diagnostics};
use manifactor_document::{Field, MAX_DEPTH, Node, Table, Value};
use manifactor_document::{Place, SourceText};
use std::ops::Range;

/// Largest number of reported syntax errors, because one missing bracket causes a dozen.
const MAX_ERRORS: usize = 5;

/// Parses a document.
pub(crate) fn parse(source: &SourceText) -> Result<Node, Diagnostics> {
    let (document, errors) = DeTable::parse_recoverable(source.text());
    let mut reader = Reader { source, errors: Vec::new() };
    let root = reader.table(document.get_ref(), 0);
    for error in errors.into_iter().take(MAX_ERRORS) {
        let span = error.span().unwrap_or(0..0);
        let place = source.place(span.clone());
        reader.errors.push(match first_of_two(source, document.get_ref(), &span) {
            Some(first) if error.message() == "duplicate key" => {
                Diagnostic::duplicate("key", bare(place.text()), place.clone(), first)
            }
            _ => syntax(place, error.message()),
        });
    }
    match Diagnostics::from_list(reader.errors) {
        Some(errors) => Err(errors),
        None => Ok(Node::new(source.place(0..source.text().len()), Value::Table(root))),
    }
}

/// Parses a single value, as in `key=value` of an override.
pub(crate) fn parse_value(source: &SourceText, span: Range<usize>) -> Option<Result<Node, Diagnostics>> {
    let text = source.text().get(span.clone())?;
    let value = DeValue::parse(text).ok()?;
    let mut reader = Reader { source, errors: Vec::new() };
    let mut node = reader.value(&value, 0);
    shift(&mut node, source, span.start);
    Some(match Diagnostics::from_list(reader.errors) {
        Some(errors) => Err(errors),
        None => Ok(node),
    })
}

struct Reader<'a> {
    source: &'a SourceText,
    errors: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn value(&mut self, value: &Spanned<DeValue<'_>>, depth: usize) -> Node {
        let place = self.source.place(value.span());
        if depth > MAX_DEPTH {
            self.errors.push(too_deep(place.clone()));
            return Node::new(place, Value::Null);
        }
        let value = match value.get_ref() {
            DeValue::String(text) => Value::String(text.clone().into_owned()),
            DeValue::Integer(integer) => self.integer(integer, &place),
            // parse the literal, so that the standard library finds the nearest f64
            DeValue::Float(float) => Value::Float(float.as_str().parse().unwrap_or(f64::NAN)),
            DeValue::Boolean(value) => Value::Bool(*value),
            DeValue::Datetime(value) => Value::String(value.to_string()),
            DeValue::Array(items) => {
                Value::Array(items.iter().map(|item| self.value(item, depth + 1)).collect())
            }
            DeValue::Table(table) => Value::Table(self.table(table, depth)),
        };
        Node::new(place, value)
    }

    fn table(&mut self, table: &DeTable<'_>, depth: usize) -> Table {
        let fields = table
            .iter()
            .map(|(key, value)| {
                let node = self.value(value, depth + 1);
                (key.get_ref().to_string(), Field { key: self.source.place(key.span()), node })
            })
            .collect();
        Box::new(fields)
    }

    fn integer(&mut self, integer: &DeInteger<'_>, place: &Place) -> Value {
        match i64::from_str_radix(integer.as_str(), integer.radix()) {
            Ok(value) => Value::Integer(value),
            Err(_) => {
                let message = format!("the whole number {integer} does not fit into 64 bits");
                self.errors.push(syntax(place.clone(), &message));
                Value::Null
            }
        }
    }
}

fn syntax(place: Place, message: &str) -> Diagnostic {
    Diagnostic::new(place, Fault::Syntax { format: "TOML", message: message.to_owned() })
}

fn bare(key: &str) -> &str {
    key.trim_matches(['"', '\''])
}

/// Returns the first position of a key that is repeated at `second`: the last key of this name before it, in
/// a table that can still continue there.
fn first_of_two(source: &SourceText, table: &DeTable<'_>, second: &Range<usize>) -> Option<Place> {
    let name = bare(source.text().get(second.clone())?);
    let mut found: Option<Range<usize>> = None;
    let mut open = vec![table];
    while let Some(table) = open.pop() {
        for (key, value) in table {
            let span = key.span();
            let later = found.as_ref().is_none_or(|f| f.start < span.start);
            if key.get_ref() == name && span.end <= second.start && later {
                found = Some(span);
            }
            open.extend(
                tables(value)
                    .into_iter()
                    .filter(|(span, _)| {
                        let inline = source.text().get(span.clone()).is_some_and(|t| t.starts_with('{'));
                        !inline || span.end >= second.end
                    })
                    .map(|(_, table)| table),
            );
        }
    }
    found.map(|span| source.place(span))
}

fn tables<'a, 'i>(value: &'a Spanned<DeValue<'i>>) -> Vec<(Range<usize>, &'a DeTable<'i>)> {
    match value.get_ref() {
        DeValue::Table(table) => vec![(value.span(), table)],
        DeValue::Array(items) => items
            .iter()
            .filter_map(|item| item.get_ref().as_table().map(|table| (item.span(), table)))
            .collect(),
        _ => Vec::new(),
    }
}

/// Moves the positions of a value that was parsed from the middle of a text.
fn shift(node: &mut Node, source: &SourceText, by: usize) {
    let moved = |place: &Place| source.place(place.span().start + by..place.span().end + by);
    node.place = moved(&node.place);
    match &mut node.value {
        Value::Array(items) => items.iter_mut().for_each(|item| shift(item, source, by)),
        Value::Table(table) => table.values_mut().for_each(|field| {
            field.key = moved(&field.key);
            shift(&mut field.node, source, by);
        }),
        _ => {}
    }
}
