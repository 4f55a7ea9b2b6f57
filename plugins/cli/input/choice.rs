//! A registered type, chosen by the document or by the command line.
use manifactor::config::{Field, Node, Section, SourceText, Table, Value};
use serde::de::DeserializeOwned;

/// Reads `field` from a document's table. The type named by the command line's `argument`, such as
/// `--solver`, has priority and uses the document's settings for that type. Next come the type in the
/// document, and `default`.
pub(crate) fn choose<K: ?Sized>(
    section: &mut Section<'_>,
    field: &str,
    (argument, name): (&str, Option<&str>),
    default: &str,
    document: &SourceText,
) -> Option<Box<K>>
where
    Box<K>: DeserializeOwned,
{
    let chosen = |node| named(argument, name.unwrap_or(default), node, document);
    let node = match section.optional_node(field) {
        Some(node) if name.is_none() && has_type(node) => node.clone(),
        Some(node) => chosen(node.clone()),
        None => {
            let nothing = SourceText::argument(argument, name.unwrap_or(default));
            chosen(Node::new(nothing.place(0..0), Value::Table(Table::default())))
        }
    };
    node.read(section.errors())
}

fn has_type(node: &Node) -> bool {
    !matches!(&node.value, Value::Table(table) if !table.contains_key("type"))
}

/// Returns the settings for the type `name`. The document's settings are dropped if they belong to a
/// different type.
pub(crate) fn named(argument: &str, name: &str, mut node: Node, document: &SourceText) -> Node {
    let Value::Table(table) = &mut node.value else { return node };
    let is = |field: &Field| matches!(&field.node.value, Value::String(text) if text == name);
    if !table.get("type").is_none_or(is) {
        table.retain(|_, field| field.key.source != *document);
    }
    let source = SourceText::argument(argument, name);
    let place = source.place(0..name.len());
    let tag = Field { key: place.clone(), node: Node::new(place, Value::String(name.to_owned())) };
    table.insert("type".to_owned(), tag);
    node
}
