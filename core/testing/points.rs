//! Strategies for the points of manifolds, and points at which formulas often fail.
use manifactor_graph::__private::inventory;
use manifactor_graph::Variable;
use proptest::prelude::*;
use std::any::TypeId;
use std::fmt::Debug;

/// Points of a manifold, registered by [`register_points!`](crate::register_points).
pub struct Points {
    /// The type of the points.
    pub type_id: fn() -> TypeId,
    /// Strategy for arbitrary points.
    pub anywhere: fn() -> BoxedStrategy<Box<dyn Variable>>,
    /// Singular points: no rotation, half a turn, equal semi-axes.
    pub singular: fn() -> Vec<Box<dyn Variable>>,
}
inventory::collect!(Points);

/// Returns the registered points of a type.
pub fn points_of(id: TypeId) -> Option<&'static Points> {
    inventory::iter::<Points>.into_iter().find(|p| (p.type_id)() == id)
}

/// Registers the strategy for the points of a manifold, and its singular points, for the checks of all
/// factors on it: `register_points!(So3, any_so3(), [So3::identity(), So3::exp(&half_a_turn)]);`
#[macro_export]
macro_rules! register_points {
    ($type:ty, $anywhere:expr, [$($singular:expr),* $(,)?]) => {
        const _: () = {
            use $crate::__private::{BoxedStrategy, Strategy, Variable, inventory};
            inventory::submit! {
                $crate::points::Points {
                    type_id: || ::std::any::TypeId::of::<$type>(),
                    anywhere: || -> BoxedStrategy<Box<dyn Variable>> {
                        Strategy::boxed(Strategy::prop_map($anywhere, |x: $type| Box::new(x) as Box<dyn Variable>))
                    },
                    singular: || vec![$(Box::new($singular)),*],
                }
            }
        };
    };
}

/// Variables of a factor that a check has drawn.
#[derive(Debug, Clone)]
pub(crate) struct Drawn {
    /// The variables.
    pub variables: Vec<Box<dyn Variable>>,
    /// True if one of them is at a singular point, or so close that it affects the differences.
    pub singular: bool,
}

impl Drawn {
    /// Returns references to the variables.
    pub(crate) fn refs(&self) -> Vec<&dyn Variable> {
        self.variables.iter().map(|x| &**x).collect()
    }
}

/// Returns a strategy for the variables of a factor: around a given point at which it is defined, at
/// arbitrary points, and with one variable at or near a singular point of its manifold.
pub(crate) fn any_point(around: &[Box<dyn Variable>]) -> BoxedStrategy<Drawn> {
    let near_start: Vec<_> = around.iter().map(|x| moved(x.clone(), -1.0..1.0f64)).collect();
    let mut sources = vec![(24, all(near_start.clone(), false))];
    let registered: Vec<_> = around.iter().map(|x| points_of(x.erased().type_id())).collect();
    let anywhere = |i: usize| match registered[i] {
        Some(points) => (points.anywhere)(),
        None => near_start[i].clone(),
    };
    if registered.iter().any(Option::is_some) {
        sources.push((8, all((0..around.len()).map(anywhere).collect(), false)));
    }
    for (i, points) in registered.iter().enumerate() {
        for singular in points.map(|p| (p.singular)()).unwrap_or_default() {
            // from distances at which differences are just affected to distances at which they are not
            let exponents = -5.0..-2.0f64;
            let near = exponents
                .prop_flat_map({
                    let singular = singular.clone();
                    move |e| moved(singular.clone(), -10f64.powf(e)..10f64.powf(e))
                })
                .boxed();
            for (weight, place) in [(1, Just(singular).boxed()), (1, near)] {
                let mut variables = near_start.clone();
                variables[i] = place;
                sources.push((weight, all(variables, true)));
            }
        }
    }
    proptest::strategy::Union::new_weighted(sources).boxed()
}

/// Returns a strategy for points whose distance from `x` in each direction is within a range.
fn moved(
    x: Box<dyn Variable>,
    range: impl Strategy<Value = f64> + Clone + 'static,
) -> BoxedStrategy<Box<dyn Variable>> {
    let delta = proptest::collection::vec(range, x.erased().dim());
    delta.prop_map(move |delta| x.erased().retract(&delta).unwrap_or_else(|| x.clone())).boxed()
}

fn all(each: Vec<BoxedStrategy<Box<dyn Variable>>>, singular: bool) -> BoxedStrategy<Drawn> {
    each.prop_map(move |variables| Drawn { variables, singular }).boxed()
}
