//! The serializer of values as nodes of a document.
use manifactor::config::{Field, Node, Place, Table, Value};
use serde::de::value::Error;
use serde::ser::{
    Error as _, Impossible, Serialize, SerializeMap, SerializeSeq, SerializeStruct, Serializer,
};
use serde::ser::{SerializeTuple, SerializeTupleStruct};

/// Converts a value to a node, all of whose parts have one place.
///
/// # Errors
/// If a value is no number, text, array or table, for example an enum with fields.
pub(super) fn serialized(value: &(impl Serialize + ?Sized), place: &Place) -> Result<Node, Error> {
    value.serialize(Serialized(place))
}

#[derive(Clone, Copy)]
struct Serialized<'a>(&'a Place);

impl Serialized<'_> {
    fn node(self, value: Value) -> Result<Node, Error> {
        Ok(Node::new(self.0.clone(), value))
    }
}

/// Defines the methods for numbers.
macro_rules! numbers {
    ($($method:ident: $type:ty => $variant:ident,)+) => {
        $(fn $method(self, x: $type) -> Result<Node, Error> {
            self.node(Value::$variant(x.into()))
        })+
    };
}

impl<'a> Serializer for Serialized<'a> {
    type Ok = Node;
    type Error = Error;
    type SerializeSeq = Items<'a>;
    type SerializeTuple = Items<'a>;
    type SerializeTupleStruct = Items<'a>;
    type SerializeTupleVariant = Impossible<Node, Error>;
    type SerializeMap = Fields<'a>;
    type SerializeStruct = Fields<'a>;
    type SerializeStructVariant = Impossible<Node, Error>;

    numbers! {
        serialize_bool: bool => Bool,
        serialize_i8: i8 => Integer,
        serialize_i16: i16 => Integer,
        serialize_i32: i32 => Integer,
        serialize_i64: i64 => Integer,
        serialize_u8: u8 => Integer,
        serialize_u16: u16 => Integer,
        serialize_u32: u32 => Integer,
        serialize_f32: f32 => Float,
        serialize_f64: f64 => Float,
        serialize_char: char => String,
        serialize_str: &str => String,
    }

    fn serialize_u64(self, x: u64) -> Result<Node, Error> {
        self.node(i64::try_from(x).map_or(Value::Unsigned(x), Value::Integer))
    }
    fn serialize_bytes(self, _: &[u8]) -> Result<Node, Error> {
        Err(Error::custom("bytes"))
    }
    fn serialize_none(self) -> Result<Node, Error> {
        self.node(Value::Null)
    }
    fn serialize_some<T: Serialize + ?Sized>(self, value: &T) -> Result<Node, Error> {
        value.serialize(self)
    }
    fn serialize_unit(self) -> Result<Node, Error> {
        self.node(Value::Null)
    }
    fn serialize_unit_struct(self, _: &'static str) -> Result<Node, Error> {
        self.node(Value::Null)
    }
    fn serialize_unit_variant(self, _: &'static str, _: u32, variant: &'static str) -> Result<Node, Error> {
        self.serialize_str(variant)
    }
    fn serialize_newtype_struct<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        value: &T,
    ) -> Result<Node, Error> {
        value.serialize(self)
    }
    fn serialize_newtype_variant<T: Serialize + ?Sized>(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        value: &T,
    ) -> Result<Node, Error> {
        let mut fields = self.serialize_map(Some(1))?;
        fields.insert(variant, value)?;
        SerializeMap::end(fields)
    }
    fn serialize_seq(self, length: Option<usize>) -> Result<Items<'a>, Error> {
        Ok(Items { place: self.0, items: Vec::with_capacity(length.unwrap_or_default()) })
    }
    fn serialize_tuple(self, length: usize) -> Result<Items<'a>, Error> {
        self.serialize_seq(Some(length))
    }
    fn serialize_tuple_struct(self, _: &'static str, length: usize) -> Result<Items<'a>, Error> {
        self.serialize_seq(Some(length))
    }
    fn serialize_tuple_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Impossible<Node, Error>, Error> {
        Err(Error::custom(format_args!("the variant {variant} with fields")))
    }
    fn serialize_map(self, _: Option<usize>) -> Result<Fields<'a>, Error> {
        Ok(Fields { place: self.0, table: Table::default(), key: None })
    }
    fn serialize_struct(self, _: &'static str, length: usize) -> Result<Fields<'a>, Error> {
        self.serialize_map(Some(length))
    }
    fn serialize_struct_variant(
        self,
        _: &'static str,
        _: u32,
        variant: &'static str,
        _: usize,
    ) -> Result<Impossible<Node, Error>, Error> {
        Err(Error::custom(format_args!("the variant {variant} with fields")))
    }
}

/// An array that is written.
struct Items<'a> {
    place: &'a Place,
    items: Vec<Node>,
}

impl Items<'_> {
    fn push<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Error> {
        self.items.push(serialized(value, self.place)?);
        Ok(())
    }

    fn node(self) -> Result<Node, Error> {
        Serialized(self.place).node(Value::Array(self.items))
    }
}

/// Implements a trait of serde for arrays.
macro_rules! items {
    ($($trait:ident, $method:ident;)+) => { $(
        impl $trait for Items<'_> {
            type Ok = Node;
            type Error = Error;
            fn $method<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Error> {
                self.push(value)
            }
            fn end(self) -> Result<Node, Error> {
                self.node()
            }
        }
    )+ };
}
items! {
    SerializeSeq, serialize_element;
    SerializeTuple, serialize_element;
    SerializeTupleStruct, serialize_field;
}

/// A table that is written.
struct Fields<'a> {
    place: &'a Place,
    table: Table,
    /// The key of the next value.
    key: Option<String>,
}

impl Fields<'_> {
    fn insert<T: Serialize + ?Sized>(&mut self, name: impl Into<String>, value: &T) -> Result<(), Error> {
        let node = serialized(value, self.place)?;
        self.table.insert(name.into(), Field { key: self.place.clone(), node });
        Ok(())
    }

    fn node(self) -> Result<Node, Error> {
        Serialized(self.place).node(Value::Table(self.table))
    }
}

impl SerializeMap for Fields<'_> {
    type Ok = Node;
    type Error = Error;
    fn serialize_key<T: Serialize + ?Sized>(&mut self, key: &T) -> Result<(), Error> {
        match serialized(key, self.place)?.value {
            Value::String(key) => self.key = Some(key),
            _ => return Err(Error::custom("a key that is no text")),
        }
        Ok(())
    }
    fn serialize_value<T: Serialize + ?Sized>(&mut self, value: &T) -> Result<(), Error> {
        let key = self.key.take().ok_or_else(|| Error::custom("a value without a key"))?;
        self.insert(key, value)
    }
    fn end(self) -> Result<Node, Error> {
        self.node()
    }
}

impl SerializeStruct for Fields<'_> {
    type Ok = Node;
    type Error = Error;
    fn serialize_field<T: Serialize + ?Sized>(&mut self, name: &'static str, value: &T) -> Result<(), Error> {
        self.insert(name, value)
    }
    fn end(self) -> Result<Node, Error> {
        self.node()
    }
}
