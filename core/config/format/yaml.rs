//! Parser for YAML 1.2 (core schema), with positions. It handles parser events without recursion.
//!
//! Aliases are expanded up to a limit. Tags outside of the core schema, several documents in one file, and
//! keys that are not scalars are rejected.
use crate::format::too_deep;
use indexmap::map::Entry;
use manifactor_document::Fault;
use manifactor_document::{Diagnostic, Diagnostics};
use manifactor_document::{Field, MAX_DEPTH, Node, Table, Value};
use manifactor_document::{Place, SourceText};
use saphyr_parser::{Event, Parser, ScalarStyle, Span, Tag};
use std::borrow::Cow;
use std::collections::HashMap;

/// Largest number of values in all anchors and aliases of a document.
const MAX_ALIASED: usize = 1_000_000;

/// Parses a document.
pub(crate) fn parse(source: &SourceText) -> Result<Node, Diagnostics> {
    let text = source.text();
    if let Some(at) = text.find('\0') {
        // the scanner takes it for the end of the text
        return Err(syntax(source.place(at..at + 1), "a NUL character").into());
    }
    let mut builder = Builder::new(source);
    let mut parser = Parser::new_from_str(text);
    while let Some(event) = parser.next_event() {
        match event {
            Ok((event, span)) => builder.event(event, span)?,
            Err(error) => {
                let at = builder.byte(error.marker().index());
                builder.errors.push(syntax(source.place(at..at + 1), error.info()));
                break;
            }
        }
    }
    match Diagnostics::from_list(builder.errors) {
        Some(errors) => Err(errors),
        None => Ok(builder.root.unwrap_or(Node::new(source.place(0..0), Value::Null))),
    }
}

/// A table or an array that is still open.
struct Open {
    start: usize,
    end: usize,
    anchor: usize,
    kind: Kind,
}

enum Kind {
    Array(Vec<Node>),
    Table(Table, Option<(String, Place)>),
}

struct Builder<'a> {
    source: &'a SourceText,
    /// Byte offset of each character; empty for ASCII texts, which have equal offsets.
    bytes: Vec<usize>,
    open: Vec<Open>,
    anchors: HashMap<usize, (Node, usize)>,
    aliased: usize,
    documents: usize,
    root: Option<Node>,
    errors: Vec<Diagnostic>,
}

impl<'a> Builder<'a> {
    fn new(source: &'a SourceText) -> Self {
        let text = source.text();
        let bytes = if text.is_ascii() { Vec::new() } else { text.char_indices().map(|(i, _)| i).collect() };
        Builder {
            source,
            bytes,
            open: Vec::new(),
            anchors: HashMap::new(),
            aliased: 0,
            documents: 0,
            root: None,
            errors: Vec::new(),
        }
    }

    fn event(&mut self, event: Event<'_>, span: Span) -> Result<(), Diagnostics> {
        let (start, end) = (self.byte(span.start.index()), self.byte(span.end.index()));
        let place = self.source.place(start..end.max(start));
        match event {
            Event::DocumentStart(_) => {
                self.documents += 1;
                if self.documents > 1 {
                    return Err(syntax(place, "a second document in one file").into());
                }
            }
            Event::Scalar(text, style, anchor, tag) => {
                let value = self.scalar(text, style, tag.as_deref(), &place);
                self.close(Node::new(place, value), anchor)?;
            }
            Event::SequenceStart(anchor, tag) => {
                self.open(place, anchor, Kind::Array(Vec::new()), tag, "seq")?;
            }
            Event::MappingStart(anchor, tag) => {
                self.open(place, anchor, Kind::Table(Table::default(), None), tag, "map")?;
            }
            Event::SequenceEnd | Event::MappingEnd => {
                if let Some(done) = self.open.pop() {
                    // a flow collection ends with its bracket, a block with its last value
                    let end = if place.text().is_empty() { done.end } else { place.span().end };
                    let value = match done.kind {
                        Kind::Array(items) => Value::Array(items),
                        Kind::Table(table, _) => Value::Table(table),
                    };
                    self.close(Node::new(self.source.place(done.start..end), value), done.anchor)?;
                }
            }
            Event::Alias(anchor) => self.alias(anchor, place)?,
            Event::Nothing | Event::StreamStart | Event::StreamEnd | Event::DocumentEnd => {}
        }
        Ok(())
    }

    fn open(
        &mut self,
        place: Place,
        anchor: usize,
        kind: Kind,
        tag: Option<Cow<'_, Tag>>,
        core: &str,
    ) -> Result<(), Diagnostics> {
        if self.open.len() >= MAX_DEPTH {
            return Err(too_deep(place).into());
        }
        if let Some(tag) = tag.filter(|tag| !(tag.is_yaml_core_schema() && tag.suffix == core)) {
            self.errors.push(syntax(place.clone(), &format!("the tag {tag} has no meaning here")));
        }
        self.open.push(Open { start: place.span().start, end: place.span().end, anchor, kind });
        Ok(())
    }

    /// Inserts a finished node: into its array, as the key or the value of its table, or as the root.
    fn close(&mut self, node: Node, anchor: usize) -> Result<(), Diagnostics> {
        if anchor > 0 {
            let size = count(&node);
            self.charge(size, &node.place)?;
            self.anchors.insert(anchor, (node.clone(), size));
        }
        let Some(parent) = self.open.last_mut() else {
            self.root = Some(node);
            return Ok(());
        };
        parent.end = parent.end.max(node.place.span().end);
        match &mut parent.kind {
            Kind::Array(items) => items.push(node),
            Kind::Table(_, key @ None) => *key = Some(key_of(node, &mut self.errors)),
            Kind::Table(table, key) => {
                let Some((name, key)) = key.take() else { return Ok(()) };
                match table.entry(name) {
                    Entry::Vacant(entry) => {
                        entry.insert(Field { key, node });
                    }
                    Entry::Occupied(first) => {
                        let first_key = first.get().key.clone();
                        self.errors.push(Diagnostic::duplicate("key", first.key(), key, first_key));
                    }
                }
            }
        }
        Ok(())
    }

    /// Counts the copied values of an anchor or an alias. Exceeding the limit is an error.
    fn charge(&mut self, size: usize, place: &Place) -> Result<(), Diagnostics> {
        self.aliased = self.aliased.saturating_add(size);
        if self.aliased > MAX_ALIASED {
            return Err(Diagnostic::new(place.clone(), Fault::TooManyAliases { limit: MAX_ALIASED }).into());
        }
        Ok(())
    }

    fn alias(&mut self, anchor: usize, place: Place) -> Result<(), Diagnostics> {
        let Some(&(_, size)) = self.anchors.get(&anchor) else {
            return Err(syntax(place, "this alias stands within what it stands for").into());
        };
        self.charge(size, &place)?;
        let Some((node, _)) = self.anchors.get(&anchor) else { return Ok(()) };
        if self.open.len() + depth(node) > MAX_DEPTH {
            return Err(too_deep(place).into());
        }
        let node = node.clone();
        self.close(node, 0)
    }

    fn scalar(&mut self, text: Cow<'_, str>, style: ScalarStyle, tag: Option<&Tag>, place: &Place) -> Value {
        let plain = style == ScalarStyle::Plain;
        match tag {
            None if plain => resolve(&text),
            None => Value::String(text.into_owned()),
            Some(tag) if tag.is_yaml_core_schema() && tag.suffix == "str" => Value::String(text.into_owned()),
            Some(tag) if tag.is_yaml_core_schema() && tag.suffix == "float" => {
                float(&text).map(Value::Float).unwrap_or(Value::String(text.into_owned()))
            }
            Some(tag) => {
                self.errors.push(syntax(place.clone(), &format!("the tag {tag} has no meaning here")));
                Value::Null
            }
        }
    }

    fn byte(&self, character: usize) -> usize {
        let end = self.source.text().len();
        if self.bytes.is_empty() {
            character.min(end)
        } else {
            self.bytes.get(character).copied().unwrap_or(end)
        }
    }
}

fn key_of(node: Node, errors: &mut Vec<Diagnostic>) -> (String, Place) {
    let name = match node.value {
        Value::String(name) => name,
        Value::Array(_) | Value::Table(_) => {
            errors.push(syntax(node.place.clone(), "a key has to be a scalar"));
            String::new()
        }
        // keys such as `1` and `true` keep their spelling
        _ => node.place.text().to_owned(),
    };
    (name, node.place)
}

/// Resolves a plain scalar by the core schema (YAML 1.2.2, §10.3.2).
fn resolve(text: &str) -> Value {
    match text {
        "" | "~" | "null" | "Null" | "NULL" => return Value::Null,
        "true" | "True" | "TRUE" => return Value::Bool(true),
        "false" | "False" | "FALSE" => return Value::Bool(false),
        _ => {}
    }
    let integer = match (text.strip_prefix("0x"), text.strip_prefix("0o")) {
        (Some(digits), _) if !digits.starts_with(['+', '-']) => i64::from_str_radix(digits, 16).ok(),
        (_, Some(digits)) if !digits.starts_with(['+', '-']) => i64::from_str_radix(digits, 8).ok(),
        _ => text.parse().ok(),
    };
    match integer {
        Some(value) if value != 0 || !text.starts_with('-') => Value::Integer(value),
        _ => float(text).map_or_else(|| Value::String(text.to_owned()), Value::Float),
    }
}

fn float(text: &str) -> Option<f64> {
    match text {
        ".inf" | ".Inf" | ".INF" | "+.inf" | "+.Inf" | "+.INF" => Some(f64::INFINITY),
        "-.inf" | "-.Inf" | "-.INF" => Some(f64::NEG_INFINITY),
        ".nan" | ".NaN" | ".NAN" => Some(f64::NAN),
        // Rust also parses `inf` and `nan`, which are strings in YAML
        _ if text.bytes().all(|b| b.is_ascii_digit() || b"+-.eE".contains(&b)) => text.parse().ok(),
        _ => None,
    }
}

fn count(node: &Node) -> usize {
    1 + match &node.value {
        Value::Array(items) => items.iter().map(count).sum(),
        Value::Table(table) => table.values().map(|field| count(&field.node)).sum(),
        _ => 0,
    }
}

fn depth(node: &Node) -> usize {
    match &node.value {
        Value::Array(items) => 1 + items.iter().map(depth).max().unwrap_or(0),
        Value::Table(table) => 1 + table.values().map(|field| depth(&field.node)).max().unwrap_or(0),
        _ => 0,
    }
}

fn syntax(place: Place, message: &str) -> Diagnostic {
    Diagnostic::new(place, Fault::Syntax { format: "YAML", message: message.to_owned() })
}
