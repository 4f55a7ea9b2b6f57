//! Input from Python: values as nodes of a document, arrays, keys.
mod arrays;
mod columns;
mod fields;
mod keys;
mod node;
mod serialized;

pub(crate) use arrays::{Numbers, any_numbers, array, array_like, frozen, numbers, numbers_or_nan, to_array};
pub(crate) use columns::{Columns, dict_of};
pub(crate) use fields::fields;
pub(crate) use keys::{key_of, key_rows, keys, unordered_keys};
pub(crate) use node::{Untagged, json_to_python, node, plain_node, to_python, unchangeable};
