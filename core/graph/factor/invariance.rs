//! What leaves a factor's residual unchanged, as its author states it.
use crate::registry::catalogue;
use crate::residual::Variables;
use crate::residual::{Refs, Residual};
use crate::variable::Manifold;
use crate::variable::Variable;
use std::any::{Any, TypeId};

/// A motion of a factor's variables that does not change its residual. Made by
/// [`register_invariance!`](crate::register_invariance), shown by the catalogue, checked with the factor's Jacobian.
pub struct Invariance {
    /// The type of the factor.
    pub factor: fn() -> TypeId,
    /// What the motion is, such as `turning about up`.
    pub motion: &'static str,
    /// The variables after the motion; `None` where they are not of the factor's types.
    pub moved: Motion,
}
inventory::collect!(Invariance);

/// A factor, its variables, and a source of random numbers → the variables elsewhere.
pub type Motion = fn(&dyn Any, &[&dyn Variable], Random<'_>) -> Option<Vec<Box<dyn Variable>>>;

/// Draws a number from -size to size.
pub type Random<'a> = &'a mut dyn FnMut(f64) -> f64;

/// What is stated of a type of factors, in the order of the alphabet.
pub fn invariances(factor: TypeId) -> Vec<&'static Invariance> {
    let mut all: Vec<_> =
        inventory::iter::<Invariance>.into_iter().filter(|i| (i.factor)() == factor).collect();
    // inventory's order differs between builds
    all.sort_by_key(|i| i.motion);
    all
}

/// The same for an entry of the catalogue.
pub fn invariances_of(entry: &catalogue::Entry) -> Vec<&'static Invariance> {
    invariances((entry.type_id)())
}

/// Points of a factor's variables: a tuple of one for each, or a list.
pub trait Moved {
    /// As trait objects.
    fn boxed(self) -> Vec<Box<dyn Variable>>;
}

macro_rules! moved {
    ($($v:ident $i:tt),+) => {
        impl<$($v: Variable + 'static),+> Moved for ($($v,)+) {
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

impl<M: Manifold + Variable> Moved for Vec<M> {
    fn boxed(self) -> Vec<Box<dyn Variable>> {
        self.into_iter().map(|x| Box::new(x) as Box<dyn Variable>).collect()
    }
}

#[doc(hidden)]
pub fn apply<R: Residual, P: Moved>(
    factor: &dyn Any,
    variables: &[&dyn Variable],
    random: Random<'_>,
    motion: impl Fn(&R, Refs<'_, R::Variables>, Random<'_>) -> P,
) -> Option<Vec<Box<dyn Variable>>> {
    let variables = R::Variables::downcast(variables)?;
    Some(motion(factor.downcast_ref()?, variables, random).boxed())
}

/// States what leaves a factor's residual unchanged. The closure gets the factor, references to its variables and a
/// source of random numbers, and returns the variables after the motion, as a tuple:
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
