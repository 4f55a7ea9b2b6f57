//! A document as a tree with positions, independent of the format.
use crate::diagnostic::Diagnostic;
use crate::source::Place;
use crate::text_error::TextError;
use foldhash::fast::RandomState;
use indexmap::IndexMap;
use serde::de::{Deserialize, Deserializer, Error, MapAccess, SeqAccess, Visitor};
use serde::{Serialize, Serializer};
use std::fmt;

/// Largest nesting depth of tables and arrays.
pub const MAX_DEPTH: usize = 64;

/// A value and its position.
#[derive(Debug, Clone, PartialEq)]
pub struct Node {
    /// Position of the value.
    pub place: Place,
    /// The value.
    pub value: Value,
}

/// The values that TOML, JSON and YAML have in common.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// Null. TOML does not have it.
    Null,
    /// A boolean.
    Bool(bool),
    /// An integer.
    Integer(i64),
    /// A whole number above `i64::MAX`, as programs write it.
    Unsigned(u64),
    /// Any other number. It may be infinite or NaN until it is read.
    Float(f64),
    /// A string.
    String(String),
    /// Values in order.
    Array(Vec<Node>),
    /// Named values in order.
    Table(Table),
}

/// Named values, in the order of the document. They are boxed to keep [`Value`] small, because most nodes of
/// a large document are numbers.
pub type Table = Box<IndexMap<String, Field, RandomState>>;

/// A named value. Its name is the key in the table.
#[derive(Debug, Clone, PartialEq)]
pub struct Field {
    /// Position of the name.
    pub key: Place,
    /// The value.
    pub node: Node,
}

impl Node {
    /// Creates a node.
    pub fn new(place: Place, value: Value) -> Self {
        Node { place, value }
    }

    /// Returns an empty table without a position.
    pub fn empty_table() -> Self {
        Node::new(Place::nowhere(), Value::Table(Table::default()))
    }

    /// Returns a field of a table.
    pub fn field(&self, name: &str) -> Option<&Node> {
        match &self.value {
            Value::Table(table) => table.get(name).map(|field| &field.node),
            _ => None,
        }
    }

    /// Keeps the fields of a table whose name is `wanted`.
    pub fn retain(&mut self, mut wanted: impl FnMut(&str) -> bool) {
        if let Value::Table(table) = &mut self.value {
            table.retain(|name, _| wanted(name));
        }
    }

    /// Returns the elements of a field that is an array; empty for any other field.
    pub fn items(&self, name: &str) -> &[Node] {
        match self.field(name) {
            Some(Node { value: Value::Array(items), .. }) => items,
            _ => &[],
        }
    }

    /// Converts the node to JSON for reading serde types. Each number that is infinite or NaN is an error.
    pub fn to_json(&self) -> Result<serde_json::Value, Vec<Diagnostic>> {
        let mut errors = Vec::new();
        let json = self.json(&mut errors);
        if errors.is_empty() { Ok(json) } else { Err(errors) }
    }

    fn json(&self, errors: &mut Vec<Diagnostic>) -> serde_json::Value {
        match &self.value {
            Value::Null => serde_json::Value::Null,
            Value::Bool(value) => (*value).into(),
            Value::Integer(value) => (*value).into(),
            Value::Unsigned(value) => (*value).into(),
            Value::Float(value) => match serde_json::Number::from_f64(*value) {
                Some(number) => number.into(),
                None => {
                    errors.push(self.not_finite(*value));
                    serde_json::Value::Null
                }
            },
            Value::String(value) => value.clone().into(),
            Value::Array(items) => items.iter().map(|item| item.json(errors)).collect(),
            Value::Table(table) => {
                table.iter().map(|(key, field)| (key.clone(), field.node.json(errors))).collect()
            }
        }
    }

    /// Returns the position of an error within a string below this node. For a string with escapes, this is
    /// the whole string. Returns `None` if no string matches.
    pub(crate) fn place_in_text(&self, error: &TextError) -> Option<Place> {
        match &self.value {
            Value::String(text) if TextError::line(text) == error.text => {
                let written = self.place.text();
                let quote = written.len() - written.trim_start_matches(['"', '\'', '\n', '\r']).len();
                let plain = written.get(quote..quote + text.len()) == Some(text);
                let start = self.place.span().start + quote;
                let within = start + error.span.start..start + error.span.end;
                Some(if plain { self.place.source.place(within) } else { self.place.clone() })
            }
            Value::Array(items) => items.iter().find_map(|item| item.place_in_text(error)),
            Value::Table(table) => table.values().find_map(|field| field.node.place_in_text(error)),
            _ => None,
        }
    }

    /// Returns the position of a name below this node.
    pub(crate) fn place_of_name(&self, name: &str) -> Option<Place> {
        match &self.value {
            Value::Table(table) => match table.get(name) {
                Some(field) => Some(field.key.clone()),
                None => table.values().find_map(|field| field.node.place_of_name(name)),
            },
            Value::Array(items) => items.iter().find_map(|item| item.place_of_name(name)),
            _ => None,
        }
    }

    /// Describes the value for messages: `the number 3`, `a table`.
    pub fn in_words(&self) -> String {
        match &self.value {
            Value::Null => "nothing".into(),
            Value::Bool(value) => value.to_string(),
            Value::Integer(value) => format!("the number {value}"),
            Value::Unsigned(value) => format!("the number {value}"),
            Value::Float(value) => format!("the number {value}"),
            Value::String(value) => format!("the text {:?}", cut(value)),
            Value::Array(_) => "an array".into(),
            Value::Table(_) => "a table".into(),
        }
    }
}

/// Serializes the value without positions, and tables without null values. `Format::write` of the crate
/// `manifactor-config` writes a document with overrides in this form.
impl Serialize for Node {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.value {
            Value::Null => serializer.serialize_unit(),
            Value::Bool(value) => serializer.serialize_bool(*value),
            Value::Integer(value) => serializer.serialize_i64(*value),
            Value::Unsigned(value) => serializer.serialize_u64(*value),
            Value::Float(value) => serializer.serialize_f64(*value),
            Value::String(value) => serializer.serialize_str(value),
            Value::Array(items) => serializer.collect_seq(items),
            Value::Table(table) => {
                let present = table.iter().filter(|(_, field)| field.node.value != Value::Null);
                serializer.collect_map(present.map(|(key, field)| (key, &field.node)))
            }
        }
    }
}

/// A part of a value from a different format.
struct Part(Node);

impl<'de> Deserialize<'de> for Part {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Node::without_places(deserializer).map(Part)
    }
}

impl Node {
    /// Converts a value of a different format to a node without positions.
    pub(crate) fn without_places<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Anything;
        impl<'de> Visitor<'de> for Anything {
            type Value = Value;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a value")
            }
            fn visit_unit<E: Error>(self) -> Result<Value, E> {
                Ok(Value::Null)
            }
            fn visit_none<E: Error>(self) -> Result<Value, E> {
                Ok(Value::Null)
            }
            fn visit_some<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
                deserializer.deserialize_any(self)
            }
            fn visit_bool<E: Error>(self, value: bool) -> Result<Value, E> {
                Ok(Value::Bool(value))
            }
            fn visit_i64<E: Error>(self, value: i64) -> Result<Value, E> {
                Ok(Value::Integer(value))
            }
            fn visit_u64<E: Error>(self, value: u64) -> Result<Value, E> {
                Ok(i64::try_from(value).map_or(Value::Unsigned(value), Value::Integer))
            }
            fn visit_f64<E: Error>(self, value: f64) -> Result<Value, E> {
                Ok(Value::Float(value))
            }
            fn visit_str<E: Error>(self, value: &str) -> Result<Value, E> {
                Ok(Value::String(value.to_owned()))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
                let mut array = vec![];
                while let Some(Part(item)) = items.next_element()? {
                    array.push(item);
                }
                Ok(Value::Array(array))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<Value, A::Error> {
                let mut table = Table::default();
                while let Some((name, Part(node))) = fields.next_entry()? {
                    table.insert(name, Field { key: Place::nowhere(), node });
                }
                Ok(Value::Table(table))
            }
        }
        Ok(Node::new(Place::nowhere(), deserializer.deserialize_any(Anything)?))
    }
}

/// Returns the start of a text, so that messages stay short.
pub(crate) fn cut(text: &str) -> String {
    match text.char_indices().nth(60) {
        Some((end, _)) => text.get(..end).unwrap_or_default().to_owned() + "…",
        None => text.to_owned(),
    }
}
