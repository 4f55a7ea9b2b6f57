//! Initial values from relative measurements: spanning trees and chordal relaxation.
mod chordal;
mod loops;
pub(crate) mod network;
pub(crate) mod parts;
pub(crate) mod pose;
mod relaxation;
mod spanning_tree;
mod start;

pub use chordal::Chordal;
pub use spanning_tree::{Tree, spanning_tree};
pub use start::SpanningTree;

use crate::{BearingRange2, BearingRange3, Landmark, Point2, Point3, Se2, Se3};
use manifactor_graph::{Factor, FactorEntry, Key, Values, Variable};

/// Returns the factor as type `F` and its keys, if it is of this type and has `N` keys.
pub(crate) fn as_factor<F: Factor + 'static, const N: usize>(entry: &FactorEntry) -> Option<(&F, &[Key; N])> {
    Some((entry.factor.erased().as_any().downcast_ref()?, entry.keys.as_slice().try_into().ok()?))
}

/// Returns the position of a measured point in the outer frame, if the pose has a value.
fn seen_point<'a>(entry: &'a FactorEntry, values: &Values) -> Option<(&'a Key, Box<dyn Variable>)> {
    if let Some((f, [x, p])) = as_factor::<Landmark<2>, 2>(entry) {
        return Some((p, Box::new(Point2::new(values.get::<Se2>(x).ok()?.act(&f.position)))));
    }
    if let Some((f, [x, p])) = as_factor::<Landmark<3>, 2>(entry) {
        return Some((p, Box::new(Point3::new(values.get::<Se3>(x).ok()?.act(&f.position)))));
    }
    if let Some((f, [x, p])) = as_factor::<BearingRange2, 2>(entry) {
        return Some((p, Box::new(Point2::new(values.get::<Se2>(x).ok()?.act(&f.measured())))));
    }
    let (f, [x, p]) = as_factor::<BearingRange3, 2>(entry)?;
    Some((p, Box::new(Point3::new(values.get::<Se3>(x).ok()?.act(&f.measured())))))
}
