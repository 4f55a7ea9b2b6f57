//! Strategies for directions and planes, including the cases that tend to break formulas.
use crate::{Plane, S2};
use manifactor_graph::Direction;
use manifactor_testing::register_points;
use manifactor_testing::strategies::direction;
use proptest::prelude::*;

/// Arbitrary directions.
pub fn any_direction() -> impl Strategy<Value = Direction> + Clone {
    direction().prop_map(|v| Direction::new(v.into_inner()).unwrap_or_default())
}

/// Directions as variables.
pub fn any_s2() -> impl Strategy<Value = S2> + Clone {
    any_direction().prop_map(S2::new)
}

/// Planes up to 10 m from the origin.
pub fn any_plane() -> impl Strategy<Value = Plane> + Clone {
    (any_direction(), -10.0..10.0).prop_map(|(normal, offset)| Plane { normal, offset })
}

register_points!(S2, any_s2(), [S2::new(Direction::Z)]);
register_points!(Plane, any_plane(), [Plane { normal: Direction::Z, offset: 0.0 }]);
