use crate::input::sequence::ObjectId;
use manifactor_graph::checked::Positive;

/// A box that may show another object than the one that it was put to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ambiguity {
    /// The frame of the box, from 0.
    pub frame: usize,
    /// The object that it was put to.
    pub object: ObjectId,
    /// The object that it may show instead.
    pub other: ObjectId,
    /// How many times as likely the box's class is of the other object.
    pub class_ratio: Positive,
}
