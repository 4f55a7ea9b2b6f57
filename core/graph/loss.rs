//! Robust losses: how much of a large residual counts.
//!
//! One convention throughout. A factor with whitened residual r costs ½ρ(s), s = ‖r‖², and enters
//! the normal equations with the weight ρ'(s). Each ρ has ρ(0) = 0 and, but for L1, ρ(s) ≈ s near 0:
//! a small residual costs what it costs without a loss.
use crate::registry::checked::Positive;
use crate::variable::column::Plain;
use std::any::{Any, TypeId};
use std::fmt::Debug;
use std::sync::Arc;

mod kernels;
mod tempered;
pub use kernels::{Cauchy, Dcs, Fair, GemanMcClure, Huber, L1, L2, Tukey, Welsch};
pub use tempered::Tempered;

/// The author's trait: ρ and its derivative. Register it with [`register_loss!`](crate::register_loss).
pub trait RobustLoss: Debug + Clone + Send + Sync + 'static {
    /// (ρ(s), ρ'(s)) at the squared norm `s` of a whitened residual.
    fn rho(&self, s: f64) -> (f64, f64);

    /// ρ(τs)/τ as a loss of the same type: the loss of a residual that was whitened by √τ times its σ, because τ of its
    /// kind say as much as one alone. A loss with one scale k, in σ's, has it with the scale k/√τ.
    ///
    /// The default is `None`: the loss is put into a [`Tempered`], which is as exact and costs one virtual call a factor.
    fn tempered(&self, tau: Positive) -> Option<Self> {
        let _ = tau;
        None
    }
}

/// A robust loss, chosen by name.
#[typetag::serialize(tag = "type")]
pub trait Loss: Debug + Send + Sync {
    /// The type-erased view of it.
    fn erased(&self) -> &dyn ErasedLoss;
}

crate::kind!(dyn Loss, "loss");

/// The object-safe face of [`RobustLoss`], implemented once for all of them.
pub trait ErasedLoss: Send + Sync {
    /// For a downcast to the concrete type.
    fn as_any(&self) -> &dyn Any;
    /// Room for the losses of a batch.
    fn column(&self) -> Box<dyn LossColumn>;
    /// (ρ(s), ρ'(s)).
    fn rho(&self, s: f64) -> (f64, f64);
    /// ρ(τs)/τ, see [`RobustLoss::tempered`].
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

/// The losses of a batch's factors, one type: called once for a chunk of factors.
pub trait LossColumn: Send + Sync {
    /// The type of its losses.
    fn loss_type(&self) -> TypeId;
    /// Appends a loss of that type; others are left out.
    fn push(&mut self, loss: &dyn Loss);
    /// Puts the last loss in place of the `index`-th.
    fn swap_remove(&mut self, index: usize);
    /// Turns the squared norms of factors `first..` into weights; returns ½ Σ ρ.
    fn weigh(&self, first: usize, squared: &mut [f64]) -> f64;
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
    fn weigh(&self, first: usize, squared: &mut [f64]) -> f64 {
        let mut cost = 0.0;
        for (s, loss) in squared.iter_mut().zip(&self.0[first..]) {
            let (rho, weight) = RobustLoss::rho(loss, *s);
            *s = weight;
            cost += rho;
        }
        0.5 * cost
    }
}
