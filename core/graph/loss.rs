//! Robust losses, which limit the influence of large residuals.
//!
//! All losses follow one convention. A factor with whitened residual r costs ½ρ(s) with s = ‖r‖², and has
//! weight ρ'(s) in the normal equations. Each ρ has ρ(0) = 0. All except L1 have ρ(s) ≈ s near 0, so that a
//! small residual costs as much as without a loss.
use crate::registry::checked::Positive;
use crate::variable::column::Plain;
use std::any::{Any, TypeId};
use std::fmt::Debug;
use std::sync::Arc;

mod kernels;
mod tempered;
pub use kernels::{Cauchy, Constraint, Dcs, Fair, GemanMcClure, Huber, L1, L2, Tukey, Welsch};
pub use tempered::Tempered;

/// The trait for authors: ρ and its derivative. Register a loss with
/// [`register_loss!`](crate::register_loss).
pub trait RobustLoss: Debug + Clone + Send + Sync + 'static {
    /// Returns (ρ(s), ρ'(s)) at the squared norm `s` of a whitened residual.
    fn rho(&self, s: f64) -> (f64, f64);

    /// Returns ρ(τs)/τ as a loss of this type. It serves residuals that are whitened by √τ times their σ,
    /// because τ of them carry the information of one. A loss with one scale k, in σ's, has it with the
    /// scale k/√τ.
    ///
    /// The default is `None`: the loss is wrapped in a [`Tempered`], which is as exact and costs one
    /// virtual call per factor.
    fn tempered(&self, tau: Positive) -> Option<Self> {
        let _ = tau;
        None
    }
}

/// A robust loss, chosen by name.
#[typetag::serialize(tag = "type")]
pub trait Loss: Debug + Send + Sync {
    /// Returns the type-erased view of the loss.
    fn erased(&self) -> &dyn ErasedLoss;
}

crate::kind!(dyn Loss, "loss");

/// The object-safe view of [`RobustLoss`], implemented once for all losses.
pub trait ErasedLoss: Send + Sync {
    /// Returns the loss for a downcast to the concrete type.
    fn as_any(&self) -> &dyn Any;
    /// Returns an empty column for the losses of a batch.
    fn column(&self) -> Box<dyn LossColumn>;
    /// Returns (ρ(s), ρ'(s)).
    fn rho(&self, s: f64) -> (f64, f64);
    /// Returns the loss ρ(τs)/τ, see [`RobustLoss::tempered`].
    fn tempered(&self, tau: Positive) -> Arc<dyn Loss>;
}

impl<L: RobustLoss + Loss> ErasedLoss for L {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn column(&self) -> Box<dyn LossColumn> {
        Box::new(Plain::<L>(Vec::new()))
    }
    fn rho(&self, s: f64) -> (f64, f64) {
        RobustLoss::rho(self, s)
    }
    fn tempered(&self, tau: Positive) -> Arc<dyn Loss> {
        match RobustLoss::tempered(self, tau) {
            Some(loss) => Arc::new(loss),
            None => Arc::new(Tempered { tau, loss: Arc::new(self.clone()) }),
        }
    }
}

/// The losses of a batch, all of one type. One call handles a chunk of factors.
pub trait LossColumn: Send + Sync {
    /// Returns the type of its losses.
    fn loss_type(&self) -> TypeId;
    /// Appends a loss of that type. A loss of a different type is ignored.
    fn push(&mut self, loss: &dyn Loss);
    /// Replaces loss `index` by the last one.
    fn swap_remove(&mut self, index: usize);
    /// Replaces the squared norms of the factors from `first` on by weights. Returns ½ Σ ρ.
    fn weights_from_norms(&self, first: usize, squared: &mut [f64]) -> f64;
}

impl<L: RobustLoss> LossColumn for Plain<L> {
    fn loss_type(&self) -> TypeId {
        TypeId::of::<L>()
    }
    fn push(&mut self, loss: &dyn Loss) {
        self.0.extend(loss.erased().as_any().downcast_ref::<L>().cloned());
    }
    fn swap_remove(&mut self, index: usize) {
        self.0.swap_remove(index);
    }
    fn weights_from_norms(&self, first: usize, squared: &mut [f64]) -> f64 {
        let mut cost = 0.0;
        for (s, loss) in squared.iter_mut().zip(&self.0[first..]) {
            let (rho, weight) = RobustLoss::rho(loss, *s);
            *s = weight;
            cost += rho;
        }
        0.5 * cost
    }
}
