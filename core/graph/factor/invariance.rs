//! Invariances of factors: motions that do not change the residual, as stated by the author.
use crate::registry::catalogue;
use crate::residual::Variables;
use crate::residual::{Refs, Residual};
use crate::variable::Manifold;
use crate::variable::Variable;
use std::any::{Any, TypeId};

/// A motion of a factor's variables that does not change its residual. Created by
/// [`register_invariance!`](crate::register_invariance), listed in the catalogue, checked together with the
/// factor's Jacobian.
pub struct Invariance {
    /// The type of the factor.
    pub factor: fn() -> TypeId,
    /// Description of the motion, such as `turning about up`.
    pub motion: &'static str,
    /// The variables after the motion; `None` if they do not have the factor's types.
    pub moved: Motion,
}
inventory::collect!(Invariance);

/// Maps a factor, its variables and a source of random numbers to the moved variables.
pub type Motion = fn(&dyn Any, &[&dyn Variable], Random<'_>) -> Option<Vec<Box<dyn Variable>>>;

/// Draws a number from -size to size.
pub type Random<'a> = &'a mut dyn FnMut(f64) -> f64;

/// Returns the invariances that are registered for a factor type, sorted by name.
pub fn invariances(factor: TypeId) -> Vec<&'static Invariance> {
    let mut all: Vec<_> =
        inventory::iter::<Invariance>.into_iter().filter(|i| (i.factor)() == factor).collect();
    // inventory's order differs between builds
    all.sort_by_key(|i| i.motion);
    all
}

/// Returns the invariances of a factor in the catalogue.
pub fn invariances_of(entry: &catalogue::Entry) -> Vec<&'static Invariance> {
    invariances((entry.type_id)())
}

/// Moved variables of a factor: a tuple with one element for each, or a list.
pub trait MovedVariables {
    /// Returns the variables as trait objects.
    fn boxed(self) -> Vec<Box<dyn Variable>>;
}

macro_rules! moved {
    ($($v:ident $i:tt),+) => {
        impl<$($v: Variable + 'static),+> MovedVariables for ($($v,)+) {
            fn boxed(self) -> Vec<Box<dyn Variable>> {
                vec![$(Box::new(self.$i)),+]
            }
        }
    };
}
moved!(A 0);
moved!(A 0, B 1);
moved!(A 0, B 1, C 2);
moved!(A 0, B 1, C 2, D 3);
moved!(A 0, B 1, C 2, D 3, E 4);
moved!(A 0, B 1, C 2, D 3, E 4, F_ 5);

impl<M: Manifold + Variable> MovedVariables for Vec<M> {
    fn boxed(self) -> Vec<Box<dyn Variable>> {
        self.into_iter().map(|x| Box::new(x) as Box<dyn Variable>).collect()
    }
}

#[doc(hidden)]
pub fn apply<R: Residual, P: MovedVariables>(
    factor: &dyn Any,
    variables: &[&dyn Variable],
    random: Random<'_>,
    motion: impl Fn(&R, Refs<'_, R::Variables>, Random<'_>) -> P,
) -> Option<Vec<Box<dyn Variable>>> {
    let variables = R::Variables::downcast(variables)?;
    Some(motion(factor.downcast_ref()?, variables, random).boxed())
}

/// Registers a motion that does not change a factor's residual. The closure gets the factor, references to
/// its variables and a source of random numbers, and returns the moved variables as a tuple:
///
/// `register_invariance!(Upright, "turning about up", |factor, (quadric,), random| (turned(quadric, random(PI)),));`
#[macro_export]
macro_rules! register_invariance {
    ($factor:ty, $motion:literal, $by:expr) => {
        $crate::__private::inventory::submit! {
            $crate::invariance::Invariance {
                factor: || ::std::any::TypeId::of::<$factor>(),
                motion: $motion,
                moved: |factor, variables, random| {
                    $crate::invariance::apply::<$factor, _>(factor, variables, random, $by)
                },
            }
        }
    };
}
