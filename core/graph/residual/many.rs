//! Residuals over any number of variables of one type.
use crate::algebra::{Block, Dimension, Matrix, Vector};
use crate::algebra::{JetOf, Scalar};
use crate::residual::Residual;
use crate::residual::Variables;
use crate::residual::normal_equations::{NormalEquations, Places};
use crate::residual::variables::store;
use crate::variable::Manifold;
use crate::variable::Variable;
use crate::variable::column::Columns;
use smallvec::SmallVec;
use std::any::TypeId;
use std::marker::PhantomData;

/// Number of variables up to which a factor needs no allocation for its blocks.
const INLINE: usize = 8;

/// A list without allocation up to eight entries.
pub type List<T> = SmallVec<[T; INLINE]>;

/// Any number of variables of type `M`: one for each key of the factor.
///
/// `residual` gets a [`List`] of them. Up to eight need no allocation.
#[derive(Debug, Clone, Copy)]
pub struct Many<M>(PhantomData<M>);

impl<M: Manifold> Variables for Many<M> {
    type Lifted<T: Scalar> = List<M::Of<T>>;
    type Refs<'a> = List<&'a M>;
    type Columns<'a> = &'a [M];
    type Jacobians<R: Dimension> = List<Matrix<R, M::Dim>>;

    fn types() -> (Vec<TypeId>, bool) {
        (vec![TypeId::of::<M>()], true)
    }
    fn columns(columns: &Columns) -> &[M] {
        columns.typed::<M>()
    }
    fn load<'a>(column: Self::Columns<'a>, index: &[u32]) -> Self::Refs<'a> {
        index.iter().map(|i| &column[*i as usize]).collect()
    }
    fn downcast<'a>(variables: &[&'a dyn Variable]) -> Option<List<&'a M>> {
        variables.iter().map(|v| v.erased().as_any().downcast_ref()).collect()
    }
    fn lift<T: Scalar>(x: &List<&M>) -> List<M::Of<T>> {
        x.iter().map(|x| x.lift()).collect()
    }
    fn blocks<R: Dimension>(count: usize) -> Self::Jacobians<R> {
        SmallVec::from_elem(Block::zeros(), count)
    }
    fn resize<R: Dimension>(blocks: &mut Self::Jacobians<R>, count: usize) {
        blocks.resize(count, Block::zeros());
    }
    fn autodiff<F: Residual<Variables = Self>>(
        residual: &F,
        x: List<&M>,
        free: &[bool],
        blocks: &mut Self::Jacobians<F::Dim>,
    ) -> Vector<F::Dim> {
        for (seeded, _) in free.iter().enumerate().filter(|(_, free)| **free) {
            let lifted = x.iter().enumerate().map(|(i, x)| match i == seeded {
                true => x.seed(),
                false => x.lift::<JetOf<M::Dim>>(),
            });
            let r = residual.residual(lifted.collect());
            store::<M::Dim, F::Dim>(r.as_ref(), &mut blocks[seeded]);
        }
        residual.residual::<f64>(Self::lift(&x))
    }
    fn each<R: Dimension>(blocks: &mut Self::Jacobians<R>, mut visit: impl FnMut(usize, &mut [f64])) {
        blocks.iter_mut().enumerate().for_each(|(i, block)| visit(i, block.as_mut_slice()));
    }
    fn scatter<R: Dimension>(
        blocks: &Self::Jacobians<R>,
        r: &[f64],
        w: f64,
        places: Places<'_>,
        to: &mut NormalEquations<'_>,
    ) {
        for (a, ja) in blocks.iter().enumerate() {
            to.add_gradient::<R, M::Dim>(places, a, ja, r, w);
            for (b, jb) in blocks[..a].iter().enumerate() {
                to.add_pair::<R, M::Dim, M::Dim>(places, (a, b), ja, jb, w);
            }
            to.add_diagonal::<R, M::Dim>(places, a, ja, w);
        }
    }
}
