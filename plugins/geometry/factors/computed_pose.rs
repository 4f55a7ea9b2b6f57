//! Factors that contain a factor on a pose, and compute this pose from their variables.
use manifactor_graph::catalogue::Signature;

mod interpolated;
mod interpolation;
mod on_body;
mod time_offset;

pub use interpolated::{Interpolated, InterpolatedError};
pub use on_body::{OnBody, OnBodyError};
pub use time_offset::TimeOffset;

/// Returns the types of a factor's variables by name, for messages.
fn variable_names(signature: &Signature) -> String {
    let names = signature.variables.iter().map(|id| manifactor_graph::manifold_name(*id));
    names.collect::<Vec<_>>().join(", ") + if signature.many { ", …" } else { "" }
}
