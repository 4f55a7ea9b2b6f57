//! The serde deserializer of a node.
use crate::hand_over::{self, NODE};
use crate::node::{Field, Node, Table, Value};
use crate::read_error::ReadError;
use serde::de::value::StrDeserializer;
use serde::de::{
    DeserializeSeed, Deserializer, EnumAccess, Error, IntoDeserializer, MapAccess, SeqAccess, Unexpected,
    VariantAccess, Visitor,
};
use serde::forward_to_deserialize_any;

/// A deserializer of a [`Node`]. Each error has the position of its node.
#[derive(Debug, Clone, Copy)]
pub struct Reader<'a> {
    node: &'a Node,
    /// A field of the node that is skipped.
    tag: Option<&'static str>,
}

impl<'a> Reader<'a> {
    /// Creates a reader of a whole node.
    pub fn new(node: &'a Node) -> Self {
        Self { node, tag: None }
    }

    /// Creates a reader that skips the field `tag`, which has already selected the type.
    pub fn without(node: &'a Node, tag: &'static str) -> Self {
        Self { node, tag: Some(tag) }
    }
}

impl<'de> Deserializer<'de> for Reader<'de> {
    type Error = ReadError;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        let read = match &self.node.value {
            Value::Null => visitor.visit_unit(),
            Value::Bool(value) => visitor.visit_bool(*value),
            Value::Integer(value) => visitor.visit_i64(*value),
            Value::Unsigned(value) => visitor.visit_u64(*value),
            Value::Float(value) => visitor.visit_f64(*value),
            Value::String(value) => visitor.visit_borrowed_str(value),
            Value::Array(items) => visit_array(items, visitor),
            Value::Table(table) => visit_table(table, self.tag, visitor),
        };
        read.map_err(|error| error.at(self.node))
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        match self.node.value {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        name: &'static str,
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        if name == NODE {
            hand_over::run(self.node)?;
            return visitor.visit_unit();
        }
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        _name: &'static str,
        _variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        let read = match &self.node.value {
            Value::String(name) => visitor.visit_enum(name.as_str().into_deserializer()),
            Value::Table(table) => {
                let mut fields = table.iter().filter(|(name, _)| Some(name.as_str()) != self.tag);
                match (fields.next(), fields.next()) {
                    (Some((name, field)), None) => visitor.visit_enum(Variant { name, field }),
                    _ => Err(ReadError::invalid_value(Unexpected::Map, &"a table of one field")),
                }
            }
            _ => Err(ReadError::invalid_type(Unexpected::Other(""), &"a name or a table")),
        };
        read.map_err(|error| error.at(self.node))
    }

    fn deserialize_ignored_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, ReadError> {
        visitor.visit_unit()
    }

    forward_to_deserialize_any! {
        bool i8 i16 i32 i64 i128 u8 u16 u32 u64 u128 f32 f64 char str string bytes byte_buf unit unit_struct seq tuple
        tuple_struct map struct identifier
    }
}

fn visit_array<'de, V: Visitor<'de>>(items: &'de [Node], visitor: V) -> Result<V::Value, ReadError> {
    let mut rest = items.iter();
    let value = visitor.visit_seq(Items(&mut rest))?;
    match rest.len() {
        0 => Ok(value),
        _ => Err(ReadError::invalid_length(items.len(), &"fewer elements in array")),
    }
}

struct Items<'a, 'de>(&'a mut std::slice::Iter<'de, Node>);

impl<'de> SeqAccess<'de> for Items<'_, 'de> {
    type Error = ReadError;

    fn next_element_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<Option<T::Value>, ReadError> {
        self.0.next().map(|node| read_seed(seed, node)).transpose()
    }

    fn size_hint(&self) -> Option<usize> {
        Some(self.0.len())
    }
}

fn visit_table<'de, V: Visitor<'de>>(
    table: &'de Table,
    tag: Option<&'static str>,
    visitor: V,
) -> Result<V::Value, ReadError> {
    let mut fields = Fields { rest: table.iter(), tag, value: None };
    let value = visitor.visit_map(&mut fields)?;
    match fields.next() {
        None => Ok(value),
        Some(_) => Err(ReadError::invalid_length(table.len(), &"fewer elements in map")),
    }
}

struct Fields<'de> {
    rest: indexmap::map::Iter<'de, String, Field>,
    tag: Option<&'static str>,
    /// The value of the last key.
    value: Option<&'de Node>,
}

impl<'de> Fields<'de> {
    fn next(&mut self) -> Option<(&'de String, &'de Field)> {
        let tag = self.tag;
        self.rest.find(|(name, _)| Some(name.as_str()) != tag)
    }
}

impl<'de> MapAccess<'de> for Fields<'de> {
    type Error = ReadError;

    fn next_key_seed<K: DeserializeSeed<'de>>(&mut self, seed: K) -> Result<Option<K::Value>, ReadError> {
        let Some((name, field)) = self.next() else { return Ok(None) };
        self.value = Some(&field.node);
        seed.deserialize(StrDeserializer::new(name)).map(Some)
    }

    fn next_value_seed<T: DeserializeSeed<'de>>(&mut self, seed: T) -> Result<T::Value, ReadError> {
        let node = self.value.take().ok_or_else(|| ReadError::custom("a value without a key"))?;
        read_seed(seed, node)
    }
}

/// Reads a value. An error that the type reports afterwards also has the position of this value.
fn read_seed<'de, T: DeserializeSeed<'de>>(seed: T, node: &'de Node) -> Result<T::Value, ReadError> {
    seed.deserialize(Reader::new(node)).map_err(|error| error.at(node))
}

/// An enum variant `{ name = value }`.
struct Variant<'de> {
    name: &'de str,
    field: &'de Field,
}

impl<'de> EnumAccess<'de> for Variant<'de> {
    type Error = ReadError;
    type Variant = Self;

    fn variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<(T::Value, Self), ReadError> {
        let variant = seed.deserialize(StrDeserializer::<ReadError>::new(self.name))?;
        Ok((variant, self))
    }
}

impl<'de> VariantAccess<'de> for Variant<'de> {
    type Error = ReadError;

    fn unit_variant(self) -> Result<(), ReadError> {
        read_seed(std::marker::PhantomData, &self.field.node)
    }

    fn newtype_variant_seed<T: DeserializeSeed<'de>>(self, seed: T) -> Result<T::Value, ReadError> {
        read_seed(seed, &self.field.node)
    }

    fn tuple_variant<V: Visitor<'de>>(self, _length: usize, visitor: V) -> Result<V::Value, ReadError> {
        Reader::new(&self.field.node).deserialize_seq(visitor)
    }

    fn struct_variant<V: Visitor<'de>>(
        self,
        _fields: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, ReadError> {
        Reader::new(&self.field.node).deserialize_map(visitor)
    }
}
