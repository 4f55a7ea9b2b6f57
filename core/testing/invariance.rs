//! The invariance law: motions that do not change a residual.
use crate::error::{LawError, json_of_all, json_of_factor};
use crate::jacobian::same_residual;
use manifactor_graph::{Factor, Variable};

/// Checks that the residuals at `moved` and at `variables` are equal, to 1e-9 of their size or of 1.
///
/// # Errors
/// The row with the largest difference; [`LawError::NotDefined`] if the factor is not defined at one of the
/// points.
pub fn invariance_law(
    factor: &dyn Factor,
    variables: &[&dyn Variable],
    moved: &[&dyn Variable],
) -> Result<(), LawError> {
    unchanged("invariance", factor, variables, moved)
}

/// Checks [`invariance_law`] for a named motion.
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
