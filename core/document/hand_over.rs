//! Types that are read from a whole [`Node`] rather than from serde's data model, wherever serde meets them.
//!
//! A trait object is told by its `type`, and only the node knows the places of its fields. Serde has no way to hand a
//! node to a type. So the type leaves its function here and asks for a newtype struct of a name that no other type has;
//! a [`Reader`](crate::Reader) that is asked for it runs the function on its node and leaves the result.
use crate::node::Node;
use crate::read_error::ReadError;
use crate::source::Place;
use serde::de::{Deserialize, DeserializeOwned, Deserializer, Error, Visitor};
use std::any::Any;
use std::cell::RefCell;
use std::fmt;
use std::marker::PhantomData;
use std::ops::Deref;

/// The name that is asked for.
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

/// Runs the function that was left, if there is one, and leaves its result.
pub(crate) fn run(node: &Node) -> Result<(), ReadError> {
    if let Slot::Run(run) = SLOT.replace(Slot::Empty) {
        let done = run(node)?;
        SLOT.set(Slot::Done(done));
    }
    Ok(())
}

/// `impl Deserialize` for a type that is read from a node: `read` returns a boxed `T`. From another deserializer than a
/// [`Reader`](crate::Reader), the node is made first, and has no places.
///
/// # Errors
/// Those of `read`; at their places, where the deserializer is a [`Reader`](crate::Reader).
pub fn deserialize_with<'de, T: 'static, D: Deserializer<'de>>(
    deserializer: D,
    read: Run,
) -> Result<T, D::Error> {
    SLOT.set(Slot::Run(read));
    deserializer.deserialize_newtype_struct(NODE, Handed(read, PhantomData))
}

struct Handed<T>(Run, PhantomData<T>);

impl<T: 'static> Handed<T> {
    fn unpack<E: Error>(done: Box<dyn Any>) -> Result<T, E> {
        done.downcast().map(|value| *value).map_err(|_| E::custom("read as another type"))
    }
}

impl<'de, T: 'static> Visitor<'de> for Handed<T> {
    type Value = T;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a table")
    }

    /// A [`Reader`](crate::Reader) has run the function.
    fn visit_unit<E: Error>(self) -> Result<T, E> {
        match SLOT.replace(Slot::Empty) {
            Slot::Done(done) => Self::unpack(done),
            _ => Err(E::custom("nothing was read")),
        }
    }

    /// Any other deserializer.
    fn visit_newtype_struct<D: Deserializer<'de>>(self, deserializer: D) -> Result<T, D::Error> {
        SLOT.set(Slot::Empty);
        let node = Node::without_places(deserializer)?;
        Self::unpack((self.0)(&node).map_err(D::Error::custom)?)
    }
}

/// A value and where it is written, for what can be wrong with it only beside others.
#[derive(Debug, Clone, PartialEq)]
pub struct Placed<T> {
    /// Where it is written.
    pub place: Place,
    /// What is written.
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

/// As it is written, with its places; from any other format, without.
impl<'de> Deserialize<'de> for Node {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize_with(deserializer, |node| Ok(Box::new(node.clone())))
    }
}
