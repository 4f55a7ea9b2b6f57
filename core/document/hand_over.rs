//! Types that serde reads from a whole [`Node`] instead of its data model.
//!
//! A trait object is chosen by its field `type`, and only the node has the positions of its fields. Serde
//! cannot pass a node to a type. The type therefore stores its function in a thread-local slot and requests a
//! newtype struct with a reserved name. A [`Reader`](crate::Reader) that receives this request runs the
//! function on its node and stores the result in the slot.
use crate::node::Node;
use crate::read_error::ReadError;
use crate::source::Place;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error, Visitor};
use std::any::Any;
use std::cell::RefCell;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

/// The reserved name.
pub(crate) const NODE: &str = "$manifactor::Node";

type Run = fn(&Node) -> Result<Box<dyn Any>, ReadError>;

enum Slot {
    Empty,
    Run(Run),
    Done(Box<dyn Any>),
}

thread_local! {
    static SLOT: RefCell<Slot> = const { RefCell::new(Slot::Empty) };
}

/// Runs the stored function, if there is one, and stores its result.
pub(crate) fn run(node: &Node) -> Result<(), ReadError> {
    if let Slot::Run(run) = SLOT.replace(Slot::Empty) {
        let done = run(node)?;
        SLOT.set(Slot::Done(done));
    }
    Ok(())
}

/// Implements `Deserialize` for a type that is read from a node. `read` returns a boxed `T`. With any
/// deserializer except [`Reader`](crate::Reader), the value is first converted to a node without positions.
///
/// # Errors
/// The errors of `read`. With a [`Reader`](crate::Reader) they have positions.
pub fn deserialize_with<'de, T: 'static, D: Deserializer<'de>>(
    deserializer: D,
    read: Run,
) -> Result<T, D::Error> {
    SLOT.set(Slot::Run(read));
    deserializer.deserialize_newtype_struct(NODE, NodeVisitor(read, PhantomData))
}

struct NodeVisitor<T>(Run, PhantomData<T>);

impl<T: 'static> NodeVisitor<T> {
    fn unpack<E: Error>(done: Box<dyn Any>) -> Result<T, E> {
        done.downcast().map(|value| *value).map_err(|_| E::custom("read as another type"))
    }
}

impl<'de, T: 'static> Visitor<'de> for NodeVisitor<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table")
    }

    /// Returns the result, after a [`Reader`](crate::Reader) has run the function.
    fn visit_unit<E: Error>(self) -> Result<T, E> {
        match SLOT.replace(Slot::Empty) {
            Slot::Done(done) => Self::unpack(done),
            _ => Err(E::custom("nothing was read")),
        }
    }

    /// Runs the function on a node without positions, for all remaining deserializers.
    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        SLOT.set(Slot::Empty);
        let node = Node::without_places(deserializer)?;
        Self::unpack((self.0)(&node).map_err(D::Error::custom)?)
    }
}

/// A value with its position, for errors that only show together with other values.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed<T> {
    /// Position of the value.
    pub place: Place,
    /// The value.
    pub value: T,
}

impl<T> Deref for Placed<T> {
    type Target = T;
    fn deref(&self) -> &T {
        &self.value
    }
}

impl<'de, T: DeserializeOwned + 'static> Deserialize<'de> for Placed<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize_with(deserializer, |node| {
            let (place, value) = (node.place.clone(), node.try_read::<T>()?);
            Ok(Box::new(Self { place, value }))
        })
    }
}

/// Reads a node from a document with its positions, or from a different format without positions.
impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize_with(deserializer, |node| Ok(Box::new(node.clone())))
    }
}
