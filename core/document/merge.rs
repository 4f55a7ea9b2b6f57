//! Merging of two documents, as for the variants of a run.
use crate::node::{Node, Table, Value};

/// Merges `patch` into `base`. Tables are merged field by field; all other values are replaced. A table with
/// a different `type` is also replaced, because its fields belong to a different type.
pub fn merge(base: &mut Node, patch: Node) {
    match (&mut base.value, patch.value) {
        (Value::Table(old), Value::Table(new)) if same_type(old, &new) => {
            for (name, field) in *new {
                match old.get_mut(&name) {
                    Some(there) => {
                        there.key = field.key;
                        merge(&mut there.node, field.node);
                    }
                    None => {
                        old.insert(name, field);
                    }
                }
            }
        }
        (_, value) => *base = Node::new(patch.place, value),
    }
}

fn same_type(old: &Table, new: &Table) -> bool {
    match (old.get("type"), new.get("type")) {
        (Some(old), Some(new)) => old.node.value == new.node.value,
        (None, Some(_)) => false,
        _ => true,
    }
}
