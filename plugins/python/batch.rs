//! Factors whose residual is a Python function, evaluated for a whole batch in one call.
//!
//! A batch of these factors calls its function once per pass for all residuals or all derivatives. The
//! batch of the core then reads the results factor by factor. If the function returns no derivatives, they
//! are central differences in the tangent space, whose points are evaluated in a single call.
mod cached;
mod evaluate;
mod memory;
mod whole;

use crate::errors;
use cached::{Cached, Results};
use evaluate::{Function, Point};
use manifactor::graph::batch::Batch;
use manifactor::graph::catalogue::{Signature, find};
use manifactor::graph::loss::Loss;
use manifactor::graph::noise::Whitener;
use manifactor::graph::quantity::variable_quantity;
use manifactor::graph::{Dynamic, ErasedResidual, Factor, Linearization, Variable};
use manifactor::nalgebra::DMatrix;
use manifactor::typetag;
use pyo3::prelude::*;
use serde::{Serialize, Serializer};
use std::any::{Any, TypeId};
use std::sync::Arc;
use whole::Whole;

/// A factor whose residual is a Python function. It can be solved, but not written into a document.
#[derive(Debug, Clone)]
struct Batched {
    like: Dynamic<Cached>,
    /// Row of constants of this factor, concatenated.
    constants: Arc<[f64]>,
}

impl Serialize for Batched {
    fn serialize<S: Serializer>(&self, _: S) -> Result<S::Ok, S::Error> {
        let message = format!(
            "`{}` is a function of Python, which no document can hold; a factor by @factor is saved as its formula",
            self.function().name
        );
        Err(serde::ser::Error::custom(message))
    }
}

#[typetag::serialize(name = "python")]
impl Factor for Batched {
    fn erased(&self) -> &dyn ErasedResidual {
        self
    }
}

impl Batched {
    fn function(&self) -> &Arc<Function> {
        &self.like.get().function
    }

    /// The point of these variables; `None` if their number or types do not fit.
    fn at(&self, variables: &[&dyn Variable]) -> Option<Point> {
        let types = &self.function().types;
        (types.len() == variables.len()).then_some(())?;
        let fit = |(v, id): (&&dyn Variable, &TypeId)| {
            (v.erased().type_id() == *id).then(|| v.erased().clone_box())
        };
        let variables = variables.iter().zip(types).map(fit).collect::<Option<_>>()?;
        Some(Point { variables, constants: self.constants.clone() })
    }
}

impl ErasedResidual for Batched {
    fn as_any(&self) -> &dyn Any {
        self
    }
    fn type_id(&self) -> TypeId {
        TypeId::of::<Self>()
    }
    fn signature(&self) -> Signature {
        let variables = self.function().types.clone();
        Signature { rows: Some(self.function().rows), row_names: &[], variables, many: false, tangent: &[] }
    }
    fn new_batch(&self, noise: &Whitener, loss: Option<&dyn Loss>) -> Box<dyn Batch> {
        Box::new(Whole::new(&self.like, noise, loss))
    }
    fn residual(&self, variables: &[&dyn Variable]) -> Option<Vec<f64>> {
        Some(self.function().residuals(&[self.at(variables)?]))
    }
    fn is_defined(&self, variables: &[&dyn Variable]) -> Option<bool> {
        Some(self.residual(variables)?.iter().all(|x| !x.is_nan()))
    }
    fn linearize(&self, variables: &[&dyn Variable]) -> Option<Linearization> {
        let (residual, blocks) = self.function().linearized(&[self.at(variables)?]);
        let (rows, sizes) = (self.function().rows, self.function().dimensions.iter().zip(&blocks));
        let jacobians = sizes.map(|(n, block)| DMatrix::from_column_slice(rows, *n, block)).collect();
        Some(Linearization { residual, jacobians })
    }
    fn autodiff(&self, variables: &[&dyn Variable]) -> Option<Linearization> {
        ErasedResidual::linearize(self, variables)
    }
}

/// Returns the address of a factor's Python function, which identifies it; `None` for other factors.
pub(crate) fn function_address(factor: &dyn Factor) -> Option<usize> {
    let batched = factor.erased().as_any().downcast_ref::<Batched>()?;
    Some(Arc::as_ptr(batched.function()).addr())
}

/// A Python function with the types of its variables, from which factors are made.
#[pyclass(module = "manifactor._native", frozen)]
struct BatchFunction(Dynamic<Cached>);

#[pymethods]
impl BatchFunction {
    /// `evaluate(arrays, constants, derivatives)` returns the residuals, shape (n, rows), and None or one
    /// Jacobian per variable, shape (n, rows, size), with respect to its numbers. `constants` has the
    /// lengths of the constants.
    #[new]
    fn new(
        name: String,
        variables: Vec<String>,
        rows: usize,
        constants: Vec<usize>,
        evaluate: Py<PyAny>,
        has_jacobian: bool,
    ) -> PyResult<Self> {
        let mut quantities = vec![];
        for of in &variables {
            crate::chosen::known("variable", of)?;
            match find("variable", of).and_then(|entry| variable_quantity((entry.type_id)())) {
                Some(quantity) => quantities.push(quantity),
                None => {
                    let message = format!("nothing says what the numbers of a `{of}` are");
                    return Err(errors::argument(&name, "variables", message));
                }
            }
        }
        let function =
            Arc::new(Function::new(name.clone(), quantities, rows, constants, evaluate, has_jacobian));
        let like = Dynamic::new(Cached { function, number: 0, results: Results::default() });
        like.map(Self).map_err(|error| errors::argument(&name, "rows", error))
    }

    /// Returns the factor with this row of constants.
    fn factor<'py>(&self, py: Python<'py>, constants: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let function = &self.0.get().function;
        let width = function.constants.iter().sum();
        let row = crate::input::numbers(&function.name, "constants", constants, &[Some(width)])?;
        let factor = Batched { like: self.0.clone(), constants: row.values.into() };
        crate::chosen::What::Factor(Arc::new(factor)).into_python(py)
    }
}

/// The factors of a function, one per row of its constants.
pub(crate) struct Rows {
    like: Dynamic<Cached>,
    constants: crate::input::Numbers,
}

impl Rows {
    /// Creates the rows from the function and the constants that a Python factor provides.
    pub(crate) fn new(rows: usize, made: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (function, constants): (Py<BatchFunction>, Bound<'_, PyAny>) = made.extract()?;
        let like = function.get().0.clone();
        let function = &like.get().function;
        let width = function.constants.iter().sum();
        let constants =
            crate::input::numbers(&function.name, "constants", &constants, &[Some(rows), Some(width)])?;
        Ok(Self { like, constants })
    }

    pub(crate) fn row(&self, row: usize) -> Arc<dyn Factor> {
        Arc::new(Batched { like: self.like.clone(), constants: self.constants.row(row).into() })
    }
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_class::<BatchFunction>()
}
