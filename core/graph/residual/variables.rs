//! Tuples of manifolds as variables of a residual, and automatic differentiation over them.
use crate::algebra::{Block, Dimension, Matrix, Vector};
use crate::algebra::{Jet, JetOf, Scalar};
use crate::residual::Residual;
use crate::residual::normal_equations::{NormalEquations, Places};
use crate::variable::Manifold;
use crate::variable::Variable;
use crate::variable::column::Columns;
use std::any::TypeId;

/// Variables of a residual: `(A,)`, `(A, B)`, … up to six manifolds, or [`Many<A>`](crate::Many).
#[diagnostic::on_unimplemented(
    message = "`{Self}` cannot be the variables of a residual",
    note = "write a tuple of one to six manifolds, such as `(Se3, DualQuadric)` or `(Se3,)` with its comma, or `Many<Se3>`"
)]
pub trait Variables: 'static {
    /// The variables over `T`.
    type Lifted<T: Scalar>;
    /// The variables, by reference.
    type Refs<'a>: Clone;
    /// The columns of the variables.
    type Columns<'a>: Copy + Send + Sync;
    /// A block of `R::N` rows for each variable.
    type Jacobians<R: Dimension>: Clone + Send + Sync;

    /// Returns their types, and whether the single type stands for any number of variables.
    fn types() -> (Vec<TypeId>, bool);
    /// Returns the columns of the variables: one downcast each, once per batch.
    fn columns(columns: &Columns) -> Self::Columns<'_>;
    /// Returns the variables at these indices of their columns.
    fn load<'a>(columns: Self::Columns<'a>, index: &[u32]) -> Self::Refs<'a>;
    /// Casts type-erased variables to these types; `None` if their number or types do not fit.
    fn downcast<'a>(variables: &[&'a dyn Variable]) -> Option<Self::Refs<'a>>;
    /// Returns the variables over `T`, as constants.
    fn lift<T: Scalar>(x: &Self::Refs<'_>) -> Self::Lifted<T>;
    /// Returns blocks for `count` variables.
    fn blocks<R: Dimension>(count: usize) -> Self::Jacobians<R>;
    /// Resizes the blocks for `count` variables.
    fn resize<R: Dimension>(_blocks: &mut Self::Jacobians<R>, _count: usize) {}
    /// Evaluates the residual and the blocks of the free variables by forward dual numbers, one pass per
    /// variable.
    fn autodiff<F: Residual<Variables = Self>>(
        residual: &F,
        x: Self::Refs<'_>,
        free: &[bool],
        blocks: &mut Self::Jacobians<F::Dim>,
    ) -> Vector<F::Dim>;
    /// Visits each block.
    fn each<R: Dimension>(blocks: &mut Self::Jacobians<R>, visit: impl FnMut(usize, &mut [f64]));
    /// Adds w JᵀJ and w Jᵀr.
    fn scatter<R: Dimension>(
        blocks: &Self::Jacobians<R>,
        r: &[f64],
        w: f64,
        places: Places<'_>,
        to: &mut NormalEquations<'_>,
    );
}

/// Copies the derivative rows of a dual residual into a Jacobian block.
#[inline(always)]
pub(crate) fn store<D: Dimension, R: Dimension>(r: &[JetOf<D>], block: &mut Matrix<R, D>) {
    let block = block.as_mut_slice();
    for (i, row) in r.iter().enumerate() {
        // num-dual drops zero derivatives: zeros have to overwrite the entries of the previous factor
        let gradient = row.gradient();
        for c in 0..D::N {
            block[i + c * R::N] = gradient.map_or(0.0, |g| g[c]);
        }
    }
}

macro_rules! tuple {
    ($($v:ident $i:tt),+) => {
        impl<$($v: Manifold),+> Variables for ($($v,)+) {
            type Lifted<T: Scalar> = ($($v::Of<T>,)+);
            type Refs<'a> = ($(&'a $v,)+);
            type Columns<'a> = ($(&'a [$v],)+);
            type Jacobians<R: Dimension> = ($(Matrix<R, $v::Dim>,)+);

            fn types() -> (Vec<TypeId>, bool) {
                (vec![$(TypeId::of::<$v>()),+], false)
            }
            fn columns(columns: &Columns) -> Self::Columns<'_> {
                ($(columns.typed::<$v>(),)+)
            }
            #[inline(always)]
            fn load<'a>(columns: Self::Columns<'a>, index: &[u32]) -> Self::Refs<'a> {
                ($(&columns.$i[index[$i] as usize],)+)
            }
            fn downcast<'a>(variables: &[&'a dyn Variable]) -> Option<Self::Refs<'a>> {
                const COUNT: usize = [$($i),+].len();
                (variables.len() == COUNT).then_some(())?;
                Some(($(variables[$i].erased().as_any().downcast_ref::<$v>()?,)+))
            }
            #[inline(always)]
            fn lift<T: Scalar>(x: &Self::Refs<'_>) -> Self::Lifted<T> {
                ($(x.$i.lift::<T>(),)+)
            }
            #[inline(always)]
            fn blocks<R: Dimension>(_count: usize) -> Self::Jacobians<R> {
                ($(<Matrix<R, $v::Dim> as Block>::zeros(),)+)
            }
            #[inline]
            fn autodiff<F: Residual<Variables = Self>>(
                residual: &F,
                x: Self::Refs<'_>,
                free: &[bool],
                blocks: &mut Self::Jacobians<F::Dim>,
            ) -> Vector<F::Dim> {
                tuple!(@passes residual x free blocks [$($v $i),+] [$($i),+]);
                residual.residual::<f64>(Self::lift(&x))
            }
            #[inline(always)]
            fn each<R: Dimension>(blocks: &mut Self::Jacobians<R>, mut visit: impl FnMut(usize, &mut [f64])) {
                $(visit($i, blocks.$i.as_mut_slice());)+
            }
            #[inline(always)]
            fn scatter<R: Dimension>(
                blocks: &Self::Jacobians<R>,
                r: &[f64],
                w: f64,
                places: Places<'_>,
                to: &mut NormalEquations<'_>,
            ) {
                tuple!(@rows R blocks r w places to [$($v $i),+] [$($v $i),+]);
            }
        }
    };
    // one pass for each free variable: this variable is seeded, all the rest are constants
    (@passes $f:ident $x:ident $free:ident $blocks:ident [$($v:ident $i:tt),+] $all:tt) => {
        $(if $free[$i] {
            let r = $f.residual(tuple!(@seeded $x $v $i $all));
            store::<$v::Dim, F::Dim>(r.as_ref(), &mut $blocks.$i);
        })+
    };
    (@seeded $x:ident $v:ident $s:tt [$($i:tt),+]) => { ($(tuple!(@argument $x $v $s $i),)+) };
    (@argument $x:ident $v:ident 0 0) => { $x.0.seed() };
    (@argument $x:ident $v:ident 1 1) => { $x.1.seed() };
    (@argument $x:ident $v:ident 2 2) => { $x.2.seed() };
    (@argument $x:ident $v:ident 3 3) => { $x.3.seed() };
    (@argument $x:ident $v:ident 4 4) => { $x.4.seed() };
    (@argument $x:ident $v:ident 5 5) => { $x.5.seed() };
    (@argument $x:ident $v:ident $s:tt $i:tt) => { $x.$i.lift::<JetOf<$v::Dim>>() };
    // lower triangle of the pairs
    (@rows $r:ident $j:ident $res:ident $w:ident $places:ident $to:ident [$($v:ident $i:tt),+] $all:tt) => {
        $(
            $to.add_gradient::<$r, $v::Dim>($places, $i, &$j.$i, $res, $w);
            tuple!(@row $r $j $w $places $to $v $i $all);
        )+
    };
    (@row $r:ident $j:ident $w:ident $places:ident $to:ident $a:ident $ai:tt [$($b:ident $bi:tt),+]) => {
        $(if $bi < $ai {
            $to.add_pair::<$r, $a::Dim, $b::Dim>($places, ($ai, $bi), &$j.$ai, &$j.$bi, $w);
        } else if $bi == $ai {
            $to.add_diagonal::<$r, $a::Dim>($places, $ai, &$j.$ai, $w);
        })+
    };
}
tuple!(A 0);
tuple!(A 0, B 1);
tuple!(A 0, B 1, C 2);
tuple!(A 0, B 1, C 2, D 3);
tuple!(A 0, B 1, C 2, D 3, E 4);
tuple!(A 0, B 1, C 2, D 3, E 4, F_ 5);
