//! Quantities, the values in formulas: numbers, vectors, rotations, and types registered by plugins.
//!
//! A [`Quantity`] is a type with a flat form: a fixed number of scalars.
//! [`register_quantity!`](crate::register_quantity) registers a [`Manifold`](crate::Manifold) whose points
//! are quantities. [`register_functions!`](crate::register_functions) registers functions of quantities.
//! Formulas in a config can then use both by name.
use crate::algebra::Dimension;
use crate::algebra::{JetOf, Scalar};
use nalgebra::{Const, SVector, U3};
use std::any::{Any, TypeId};
use std::fmt;

/// The dual number that differentiates formulas, [`LANES`] directions at a time.
pub type Lanes = JetOf<U3>;
/// Number of directions of a [`Lanes`].
pub const LANES: usize = <Const<3> as Dimension>::N;

/// The name of a type of quantities, and the length of its flat form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Shape {
    /// Name in formulas, unique among the types.
    pub name: &'static str,
    /// Number of scalars in the flat form.
    pub size: usize,
}

impl Shape {
    /// Returns whether it is a vector of numbers.
    pub fn is_vector(&self) -> bool {
        VECTORS.contains(&self.name)
    }
}

impl fmt::Display for Shape {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// A type of values in formulas, over any scalar.
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no flat form, so that formulas cannot compute with it",
    note = "implement `Quantity` for `{Self}`, or use a type that has one: `f64`, `Vector3<f64>`, …"
)]
pub trait Quantity: 'static {
    /// Its name and size.
    const SHAPE: Shape;
    /// The type over the scalar `T`.
    type Of<T: Scalar>;
    /// Reads a value from its flat form. `from` may be longer.
    fn read<T: Scalar>(from: &[T]) -> Self::Of<T>;
    /// Writes a value to its flat form. `to` has exactly its length.
    fn write<T: Scalar>(x: &Self::Of<T>, to: &mut [T]);
}

impl Quantity for f64 {
    const SHAPE: Shape = Shape { name: "number", size: 1 };
    type Of<T: Scalar> = T;
    #[inline]
    fn read<T: Scalar>(from: &[T]) -> T {
        from[0]
    }
    #[inline]
    fn write<T: Scalar>(x: &T, to: &mut [T]) {
        to[0] = *x;
    }
}

/// Names of vectors, by their length.
const VECTORS: [&str; 10] = [
    "vector0", "vector1", "vector2", "vector3", "vector4", "vector5", "vector6", "vector7", "vector8",
    "vector9",
];

/// Vectors of up to nine entries.
impl<const N: usize> Quantity for SVector<f64, N> {
    const SHAPE: Shape = Shape { name: VECTORS[N], size: N };
    type Of<T: Scalar> = SVector<T, N>;
    #[inline]
    fn read<T: Scalar>(from: &[T]) -> SVector<T, N> {
        SVector::from_column_slice(&from[..N])
    }
    #[inline]
    fn write<T: Scalar>(x: &SVector<T, N>, to: &mut [T]) {
        to.copy_from_slice(x.as_slice());
    }
}

/// A type of variables that formulas accept. Created by [`register_quantity!`](crate::register_quantity).
pub struct VariableQuantity {
    /// The type of the variables.
    pub type_id: fn() -> TypeId,
    /// The quantity that represents them in formulas.
    pub shape: Shape,
    /// Dimension of their tangent space.
    pub dimension: usize,
    /// Writes the flat form of a variable. A variable of a different type is ignored.
    pub values: fn(&dyn Any, &mut [f64]),
    /// Writes the derivative of the flat form with respect to the tangent, at zero: the gradient of each
    /// scalar, one after the next.
    pub gradients: fn(&dyn Any, &mut [f64]),
}
inventory::collect!(VariableQuantity);

#[doc(hidden)]
pub fn with<A, B>(x: A, f: impl FnOnce(A) -> B) -> B {
    f(x)
}

/// Returns the quantity for variables of a type; `None` if the type is not registered as a quantity.
pub fn variable_quantity(id: TypeId) -> Option<&'static VariableQuantity> {
    inventory::iter::<VariableQuantity>.into_iter().find(|q| (q.type_id)() == id)
}

/// A function for formulas. Created by [`register_functions!`](crate::register_functions).
pub struct Function {
    /// Name in formulas; `+` and the like are operators. Functions may be overloaded.
    pub name: &'static str,
    /// Its arguments: names and types.
    pub arguments: &'static [(&'static str, Shape)],
    /// The type of its result.
    pub result: Shape,
    /// Its meaning, in one sentence.
    pub summary: &'static str,
    /// The module that registered it.
    pub module: &'static str,
    /// The function over numbers.
    pub over_numbers: Call<f64>,
    /// The function over dual numbers.
    pub over_lanes: Call<Lanes>,
}
inventory::collect!(Function);

/// A function over flat forms. `at` gives the start of each argument in `from`; the result is written to
/// `to`.
pub type Call<T> = fn(from: &[T], at: &[u32], to: &mut [T]);

impl Function {
    /// Formats the signature: `dot(a: vector3, b: vector3) -> number`
    pub fn signature(&self) -> String {
        let arguments = self.arguments.iter().map(|(name, shape)| format!("{name}: {shape}"));
        format!("{}({}) -> {}", self.name, arguments.collect::<Vec<_>>().join(", "), self.result)
    }
}

/// Returns every linked function, sorted by name and arguments.
pub fn functions() -> Vec<&'static Function> {
    let mut all: Vec<_> = inventory::iter::<Function>.into_iter().collect();
    // the order of inventory differs between builds
    all.sort_by_key(|f| {
        (f.name, f.arguments.len(), f.arguments.first().map(|(_, shape)| shape.name), f.signature())
    });
    all
}

/// Lets formulas use variables of a type, as quantities of this type or of a given one with equal points:
/// `register_quantity!(Se3);`, `register_quantity!(Point3 as Vector3<f64>);`,
/// `register_quantity!(Point1 as f64, |p| p.x);`
#[macro_export]
macro_rules! register_quantity {
    ($type:ty) => {
        $crate::register_quantity!($type as $type);
    };
    ($type:ty as $quantity:ty) => {
        $crate::register_quantity!($type as $quantity, |x| x);
    };
    ($type:ty as $quantity:ty, $by:expr) => {
        const _: () = {
            use $crate::quantity::{Quantity, VariableQuantity, with};
            use $crate::{Dimension, Jet, JetOf, Manifold};
            const SIZE: usize = <$quantity as Quantity>::SHAPE.size;
            type Tangent = <$type as Manifold>::Dim;

            fn values(x: &dyn ::std::any::Any, to: &mut [f64]) {
                if let Some(x) = x.downcast_ref::<$type>() {
                    <$quantity as Quantity>::write::<f64>(&with(x.lift(), $by), to);
                }
            }
            fn gradients(x: &dyn ::std::any::Any, to: &mut [f64]) {
                let Some(x) = x.downcast_ref::<$type>() else { return };
                let mut flat = [JetOf::<Tangent>::from(0.0); SIZE];
                <$quantity as Quantity>::write::<JetOf<Tangent>>(&with(x.seed(), $by), &mut flat);
                for (to, jet) in to.chunks_exact_mut(<Tangent as Dimension>::N).zip(&flat) {
                    match jet.gradient() {
                        Some(gradient) => to.copy_from_slice(gradient),
                        None => to.fill(0.0),
                    }
                }
            }
            $crate::__private::inventory::submit! {
                VariableQuantity {
                    type_id: || ::std::any::TypeId::of::<$type>(),
                    shape: <$quantity as Quantity>::SHAPE,
                    dimension: <Tangent as Dimension>::N,
                    values,
                    gradients,
                }
            }
        };
    };
}

/// Registers functions of quantities for formulas, by name or as operators. Bodies are over a scalar `T`:
///
/// ```
/// # use manifactor_graph::register_functions;
/// # use nalgebra::Vector3;
/// register_functions! {
///     /// a · b.
///     fn dot(a: Vector3<f64>, b: Vector3<f64>) -> f64 { a.dot(&b) }
///
///     /// The vector, scaled.
///     "*" fn scale(v: Vector3<f64>, by: f64) -> Vector3<f64> { v * by }
/// }
/// ```
#[macro_export]
macro_rules! register_functions {
    ($(
        $(#[doc = $doc:literal])+
        $($operator:literal)? fn $name:ident($($argument:ident: $type:ty),*) -> $result:ty $body:block
    )+) => {
        $($crate::register_functions!(
            @ [$($operator)?] $name, [$($doc)+] [$($argument: $type),*] $result, $body
        );)+
    };
    (@ [] $name:ident, $($rest:tt)+) => {
        $crate::register_functions!(@@ stringify!($name), $($rest)+);
    };
    (@ [$operator:literal] $name:ident, $($rest:tt)+) => {
        $crate::register_functions!(@@ $operator, $($rest)+);
    };
    (@@ $name:expr, [$($doc:literal)+] [$($argument:ident: $type:ty),*] $result:ty, $body:block) => {
        const _: () = {
            #[inline(always)]
            fn function<T: $crate::Scalar>(
                $($argument: <$type as $crate::quantity::Quantity>::Of<T>),*
            ) -> <$result as $crate::quantity::Quantity>::Of<T> $body

            fn call<T: $crate::Scalar>(from: &[T], at: &[u32], to: &mut [T]) {
                let mut at = at.iter();
                let mut next = || at.next().map_or(&[][..], |at| &from[*at as usize..]);
                let result = function::<T>($(<$type as $crate::quantity::Quantity>::read(next())),*);
                <$result as $crate::quantity::Quantity>::write(&result, to);
            }
            $crate::__private::inventory::submit! {
                $crate::quantity::Function {
                    name: $name,
                    arguments: &[$((stringify!($argument), <$type as $crate::quantity::Quantity>::SHAPE)),*],
                    result: <$result as $crate::quantity::Quantity>::SHAPE,
                    summary: concat!($($doc),+),
                    module: module_path!(),
                    over_numbers: call::<f64>,
                    over_lanes: call::<$crate::quantity::Lanes>,
                }
            }
        };
    };
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::algebra::Jet;
    use nalgebra::Vector3;

    register_functions! {
        /// How far up a vector goes.
        fn rise(v: Vector3<f64>, up: Vector3<f64>) -> f64 { v.dot(&up) }
    }

    #[test]
    fn a_function_is_found_by_name_and_computes_over_both_scalars() {
        let rise = functions().into_iter().find(|f| f.name == "rise").unwrap();
        assert_eq!(rise.signature(), "rise(v: vector3, up: vector3) -> number");
        assert_eq!(rise.summary.trim(), "How far up a vector goes.");
        let (from, mut to) = ([9.0, 1.0, 2.0, 3.0, 0.0, 0.0, 2.0], [0.0]);
        (rise.over_numbers)(&from, &[1, 4], &mut to);
        assert_eq!(to, [6.0]);
        let mut duals = from.map(Lanes::from);
        duals[3] = Lanes::with_gradient(3.0, &[0.0, 1.0, 0.0]);
        let mut to = [Lanes::from(0.0)];
        (rise.over_lanes)(&duals, &[1, 4], &mut to);
        assert_eq!(to[0].gradient(), Some(&[0.0, 2.0, 0.0][..]));
    }
}
