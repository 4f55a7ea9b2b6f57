//! Parser for strict JSON, with positions.
use crate::format::too_deep;
use indexmap::map::Entry;
use jsonc_parser::ast::{Object, Value as Ast};
use jsonc_parser::common::{Range, Ranged};
use jsonc_parser::{CollectOptions, ParseOptions, parse_to_ast};
use manifactor_document::Fault;
use manifactor_document::{Diagnostic, Diagnostics};
use manifactor_document::{Field, MAX_DEPTH, Node, Table, Value};
use manifactor_document::{Place, SourceText};

/// Parses a document.
pub(crate) fn parse(source: &SourceText) -> Result<Node, Diagnostics> {
    let text = source.text();
    let strict = ParseOptions {
        allow_comments: false,
        allow_loose_object_property_names: false,
        allow_trailing_commas: false,
        allow_missing_commas: false,
        allow_single_quoted_strings: false,
        allow_hexadecimal_numbers: false,
        allow_unary_plus_numbers: false,
        allow_bare_decimal_point_numbers: false,
        allow_non_finite_numbers: false,
        allow_extended_string_escapes: false,
    };
    let parsed = parse_to_ast(text, &CollectOptions::default(), &strict).map_err(|error| {
        let range = error.range();
        syntax(source.place(range.start..range.end), &error.kind().to_string())
    })?;
    let Some(root) = parsed.value else {
        return Err(syntax(source.place(0..0), "the document is empty").into());
    };
    let mut reader = Reader { source, errors: Vec::new() };
    let node = reader.value(&root, 0);
    if reader.errors.is_empty() {
        refuse_what_else_is_not_json(source)?;
    }
    Diagnostics::from_list(reader.errors).map_or(Ok(node), Err)
}

/// Rejects texts that the parser accepts although they are not valid JSON, such as line breaks within
/// strings.
fn refuse_what_else_is_not_json(source: &SourceText) -> Result<(), Diagnostics> {
    let Err(error) = serde_json::from_str::<serde::de::IgnoredAny>(source.text()) else { return Ok(()) };
    let lines = source.text().split_inclusive('\n').take(error.line().saturating_sub(1));
    let at = lines.map(str::len).sum::<usize>() + error.column().saturating_sub(1);
    let message = error.to_string();
    let message = message.split(" at line ").next().unwrap_or(&message);
    Err(syntax(source.place(at..at + 1), message).into())
}

struct Reader<'a> {
    source: &'a SourceText,
    errors: Vec<Diagnostic>,
}

impl Reader<'_> {
    fn value(&mut self, ast: &Ast<'_>, depth: usize) -> Node {
        let place = self.place(ast.range());
        if depth > MAX_DEPTH {
            self.errors.push(too_deep(place.clone()));
            return Node::new(place, Value::Null);
        }
        let value = match ast {
            Ast::NullKeyword(_) => Value::Null,
            Ast::BooleanLit(value) => Value::Bool(value.value),
            Ast::NumberLit(number) => number_of(number.value),
            Ast::StringLit(text) => Value::String(text.value.clone().into_owned()),
            Ast::Array(array) => {
                Value::Array(array.elements.iter().map(|item| self.value(item, depth + 1)).collect())
            }
            Ast::Object(object) => Value::Table(self.table(object, depth)),
        };
        Node::new(place, value)
    }

    fn table(&mut self, object: &Object<'_>, depth: usize) -> Table {
        let mut table = Table::default();
        table.reserve(object.properties.len());
        for property in &object.properties {
            let key = self.place(property.name.range());
            let node = self.value(&property.value, depth + 1);
            match table.entry(property.name.as_str().to_owned()) {
                Entry::Vacant(entry) => {
                    entry.insert(Field { key, node });
                }
                Entry::Occupied(first) => {
                    let first_key = first.get().key.clone();
                    self.errors.push(Diagnostic::duplicate("key", first.key(), key, first_key));
                }
            }
        }
        table
    }

    fn place(&self, range: Range) -> Place {
        self.source.place(range.start..range.end)
    }
}

/// Parses a number. Integers that fit into 64 bits stay integers; all other numbers and negative zero become
/// the nearest `f64`.
fn number_of(text: &str) -> Value {
    match text.parse::<i64>() {
        Ok(value) if value != 0 || !text.starts_with('-') => Value::Integer(value),
        _ => Value::Float(text.parse().unwrap_or(f64::NAN)),
    }
}

fn syntax(place: Place, message: &str) -> Diagnostic {
    let message =
        message.chars().take(1).flat_map(char::to_lowercase).chain(message.chars().skip(1)).collect();
    Diagnostic::new(place, Fault::Syntax { format: "JSON", message })
}
