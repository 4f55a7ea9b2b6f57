//! Each flaw of a manifold breaks the corresponding law.
use crate::toy::*;
use manifactor_testing::strategies::vector;
use manifactor_testing::{LawError, manifold_laws};
use proptest::prelude::*;

fn spot<const F: u8>() -> impl Strategy<Value = Spot<F>> {
    vector::<2>(10.0).prop_map(Spot)
}

manifold_laws! { a_sound_manifold_keeps_the_laws: (spot::<SOUND>(), spot::<SOUND>(), vector::<2>(3.0)) }
manifold_laws! { spot }

fn broken<const F: u8>() -> String
where
    Spot<F>: manifactor_graph::Variable,
{
    let x = Spot::<F>([0.123456, 0.654321].into());
    let y = Spot::<F>([-1.0, 2.0].into());
    match manifold_laws(&x, &y, &[0.3, -0.2]) {
        Err(LawError::Manifold { law, .. }) => law.to_owned(),
        other => format!("{other:?}"),
    }
}

#[test]
fn each_flaw_breaks_its_law() {
    assert_eq!(broken::<LONG_STEPS>(), "x.retract(x.local(y)) is y");
    assert_eq!(broken::<DRIFTING>(), "x.retract(0) is x");
    assert_eq!(broken::<UNEVEN_NAMES>(), "each tangent direction has a name of its own");
    assert_eq!(broken::<ROUNDED_DOCUMENT>(), "a document reads back as the same document");
    assert_eq!(broken::<INFINITE>(), "x.retract(x.local(y)) is y");
    assert_eq!(broken::<DOUBLED_SEED>(), "the derivative of x.seed() is that of x.retract(delta)");
}

#[test]
fn points_and_tangents_of_other_manifolds_are_refused() {
    let (x, y) = (Spot::<SOUND>([1.0, 2.0].into()), Spot::<LONG_STEPS>([1.0, 2.0].into()));
    assert!(manifold_laws(&x, &y, &[0.0, 0.0]).is_err());
    assert!(manifold_laws(&x, &x, &[0.0]).is_err());
    assert!(manifold_laws(&x, &x, &[0.0, 0.0]).is_ok());
}

#[test]
#[should_panic(expected = "no manifold `blot` is registered")]
fn a_name_that_none_has_is_told() {
    manifactor_testing::catalogue::assert_manifold_laws("blot");
}
