//! Numbers of objects, and the keys of the variables that every run has.
use manifactor_graph::Key;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Returns the key of a frame's pose: `x0`, `x1`, …
pub fn pose_key(frame: usize) -> Key {
    Key::indexed("x", frame)
}

/// Returns the key of an object's ellipsoid: `q1`, `q2`, …
pub fn object_key(id: ObjectId) -> Key {
    Key::indexed("q", id)
}

/// Returns the number of a key that is a prefix and a number, as digits: `12` of `x12` with the prefix `x`.
/// `None` for any other key.
pub fn key_number<'k>(key: &'k Key, prefix: &str) -> Option<&'k str> {
    let number = key.as_str().strip_prefix(prefix)?;
    let is_number = !number.is_empty() && number.bytes().all(|b| b.is_ascii_digit());
    is_number.then_some(number)
}

/// Returns whether a key is that of a pose or an object.
pub fn is_pose_or_object(key: &Key) -> bool {
    ["x", "q"].iter().any(|prefix| key_number(key, prefix).is_some())
}

/// Number of an object, shared by detections and ground truth.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct ObjectId(pub u32);

impl fmt::Display for ObjectId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
