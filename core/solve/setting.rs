//! Settings of solvers that are made in code: what a config is checked for when it is read.
/// A number outside its domain among the settings of a solver.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the solver's setting `{setting}`: expected a finite number, {expected}, got {got}")]
pub struct SettingError {
    /// Its name, as a config has it.
    pub setting: &'static str,
    /// Its domain.
    pub expected: &'static str,
    /// What it is.
    pub got: f64,
}

/// # Errors
/// Where one of these is negative or not finite.
pub(crate) fn not_negative(settings: &[(&'static str, f64)]) -> Result<(), SettingError> {
    check(settings, "0 or more", |x| x >= 0.0)
}

/// # Errors
/// Where one of these is not above zero, or not finite.
pub(crate) fn positive(settings: &[(&'static str, f64)]) -> Result<(), SettingError> {
    check(settings, "above zero", |x| x > 0.0)
}

/// # Errors
/// Where one of these is outside the domain that `expected` names.
pub(crate) fn check(
    settings: &[(&'static str, f64)],
    expected: &'static str,
    domain: impl Fn(f64) -> bool,
) -> Result<(), SettingError> {
    match settings.iter().find(|(_, x)| !(domain(*x) && x.is_finite())) {
        Some((setting, got)) => Err(SettingError { setting, expected, got: *got }),
        None => Ok(()),
    }
}
