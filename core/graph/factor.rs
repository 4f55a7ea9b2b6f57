//! Factors of a graph: a registered residual with its keys, noise and loss.
pub mod batch;
mod dynamic;
pub mod invariance;
mod kernel;
mod unnamed;

use crate::algebra::{Dimension, Direction};
use crate::factor::batch::{Batch, BatchOf};
use crate::loss::{Constraint, Loss};
use crate::noise::{Noise, Whitener};
use crate::registry::catalogue::Signature;
use crate::residual::Residual;
use crate::residual::Variables;
use crate::variable::Key;
use crate::variable::Variable;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};
use std::any::{Any, TypeId};
use std::borrow::Cow;
use std::fmt::Debug;
use std::sync::Arc;

pub use dynamic::{Dynamic, DynamicBlocks, DynamicResidual, MAX_ROWS, WrongRows};
pub use unnamed::Unnamed;

/// A registered residual. Implemented by [`register_factor!`](crate::register_factor).
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not registered as a factor",
    label = "not a factor",
    note = "write `register_factor!(\"its_name\", {Self});` below `impl Residual for {Self}`"
)]
#[typetag::serialize(tag = "type")]
pub trait Factor: Debug + Send + Sync {
    /// Returns the type-erased view of the residual.
    fn erased(&self) -> &dyn ErasedResidual;

    /// Returns a copy with this up direction. `None` if the factor has no [`Up`](crate::Up), or its
    /// document sets the direction.
    fn with_up(&self, _up: Direction) -> Option<Box<dyn Factor>> {
        None
    }
}

crate::kind!(dyn Factor, "factor");

/// One factor of a graph.
#[derive(Debug, Clone, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FactorEntry {
    /// The variables that it connects, in the order of the residual's arguments.
    pub keys: Vec<Key>,
    /// Label in reports. Default: the name of its type.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<Arc<str>>,
    /// The residual and its parameters.
    pub factor: Arc<dyn Factor>,
    /// Noise of the residual. Default: unit.
    #[serde(default, skip_serializing_if = "Noise::is_default")]
    pub noise: Noise,
    /// Robust loss. Default: none, so that the residual counts in full.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
}

impl FactorEntry {
    /// Returns the label in reports: the factor's name, or else the name of its type.
    pub fn label(&self) -> Cow<'static, str> {
        match &self.name {
            Some(name) => Cow::Owned((**name).to_owned()),
            None => Cow::Borrowed(self.factor.typetag_name()),
        }
    }
    /// Sets the label in reports.
    pub fn name(&mut self, name: &str) -> &mut Self {
        self.name = Some(name.into());
        self
    }
    /// Sets the noise.
    pub fn noise(&mut self, noise: Noise) -> &mut Self {
        self.noise = noise;
        self
    }
    /// Makes the factor an equality constraint: see [`Constraint`].
    pub fn constraint(&mut self) -> &mut Self {
        self.loss(Constraint {})
    }
    /// Returns whether the factor is an equality constraint.
    pub fn is_constraint(&self) -> bool {
        self.loss.as_ref().is_some_and(|loss| loss.erased().as_any().is::<Constraint>())
    }
    /// Sets the loss.
    pub fn loss(&mut self, loss: impl Loss + 'static) -> &mut Self {
        self.loss = Some(Arc::new(loss));
        self
    }
}

/// An unwhitened residual and its Jacobian, one block for each variable.
#[derive(Debug, Clone, PartialEq)]
pub struct Linearization {
    /// The residual.
    pub residual: Vec<f64>,
    /// One block for each variable: rows × tangent dimension.
    pub jacobians: Vec<DMatrix<f64>>,
}

/// The object-safe view of [`Residual`], implemented once for all residuals.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a residual, so it cannot be registered as a factor",
    note = "implement `Residual` for `{Self}`: `type Variables`, `type Dim` and `fn residual`"
)]
pub trait ErasedResidual: Send + Sync {
    /// Returns the residual for a downcast to the concrete type.
    fn as_any(&self) -> &dyn Any;
    /// Returns the concrete type.
    fn type_id(&self) -> TypeId;
    /// Returns the number of rows and the types of the variables.
    fn signature(&self) -> Signature;
    /// Returns an empty batch for factors of this type, with noise and loss of the given kinds.
    fn new_batch(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> Box<dyn Batch>;
    /// Evaluates the residual; `None` if the number or the types of the variables do not fit.
    fn residual(&self, variables: &[&dyn Variable]) -> Option<Vec<f64>>;
    /// Returns whether the residual is defined at these values; `None` if the variables do not fit.
    fn is_defined(&self, variables: &[&dyn Variable]) -> Option<bool>;
    /// Evaluates the residual and its Jacobian, which is analytic if the author wrote one.
    fn linearize(&self, variables: &[&dyn Variable]) -> Option<Linearization>;
    /// Evaluates the residual and its Jacobian by automatic differentiation.
    fn autodiff(&self, variables: &[&dyn Variable]) -> Option<Linearization>;
}

/// Returns the signature of a residual for the catalogue.
pub fn signature<R: Residual>() -> Signature {
    let (variables, many) = R::Variables::types();
    Signature { rows: Some(R::Dim::N), row_names: R::ROWS, variables, many, tangent: &[] }
}

/// Runs `run`, analytic or automatic differentiation, on blocks that are filled with NaN first.
fn linearization<R: Residual>(
    residual: &R,
    variables: &[&dyn Variable],
    run: impl FnOnce(
        &R,
        crate::Refs<'_, R::Variables>,
        &[bool],
        &mut crate::Jacobians<R>,
    ) -> crate::Vector<R::Dim>,
) -> Option<Linearization> {
    let refs = R::Variables::downcast(variables)?;
    let mut blocks = R::Variables::blocks::<R::Dim>(variables.len());
    R::Variables::each::<R::Dim>(&mut blocks, |_, block| block.fill(f64::NAN));
    let value = run(residual, refs, &vec![true; variables.len()], &mut blocks);
    let mut jacobians = Vec::with_capacity(variables.len());
    R::Variables::each::<R::Dim>(&mut blocks, |_, block| {
        let columns = block.len() / R::Dim::N;
        jacobians.push(DMatrix::from_column_slice(R::Dim::N, columns, block));
    });
    Some(Linearization { residual: value.as_ref().to_vec(), jacobians })
}

impl<R: Residual> ErasedResidual for R {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn type_id(&self) -> TypeId {
        TypeId::of::<R>()
    }
    fn signature(&self) -> Signature {
        signature::<R>()
    }
    fn new_batch(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> Box<dyn Batch> {
        Box::new(BatchOf::<R>::new(noise, loss))
    }
    fn residual(&self, variables: &[&dyn Variable]) -> Option<Vec<f64>> {
        let refs = R::Variables::downcast(variables)?;
        let value = Residual::residual::<f64>(self, R::Variables::lift(&refs));
        Some(value.as_ref().to_vec())
    }
    fn is_defined(&self, variables: &[&dyn Variable]) -> Option<bool> {
        Some(Residual::is_defined(self, R::Variables::downcast(variables)?))
    }
    fn linearize(&self, variables: &[&dyn Variable]) -> Option<Linearization> {
        linearization(self, variables, R::linearize)
    }
    fn autodiff(&self, variables: &[&dyn Variable]) -> Option<Linearization> {
        linearization(self, variables, R::Variables::autodiff)
    }
}
