//! The invariance law: what leaves a residual unchanged.
use crate::error::{LawError, json_of_all, json_of_factor};
use crate::jacobian::same_residual;
use manifactor_graph::{Factor, Variable};

/// Checks that the residual is the same at `moved` as at `variables`, to 1e-9 of its size or of 1.
///
/// # Errors
/// The row that differs most; [`LawError::NotDefined`] where the factor is not defined at one of the two.
pub fn invariance_law(
    factor: &dyn Factor,
    variables: &[&dyn Variable],
    moved: &[&dyn Variable],
) -> Result<(), LawError> {
    unchanged("invariance", factor, variables, moved)
}

/// [`invariance_law`], for a motion that has a name.
pub(crate) fn unchanged(
    motion: &'static str,
    factor: &dyn Factor,
    variables: &[&dyn Variable],
    moved: &[&dyn Variable],
) -> Result<(), LawError> {
    let value = |x: &[&dyn Variable]| match factor.erased().is_defined(x) {
        None => Err(LawError::WrongVariables { factor: json_of_factor(factor), point: json_of_all(x) }),
        Some(false) => Err(LawError::NotDefined { factor: json_of_factor(factor), point: json_of_all(x) }),
        Some(true) => Ok(factor.erased().residual(x).unwrap_or_default()),
    };
    same_residual(motion, factor, moved, &value(moved)?, &value(variables)?, 1e-9)
}
