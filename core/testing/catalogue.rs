//! Laws of all linked types, checked from their catalogue entries.
//!
//! The docs of a registered type have an example. It is a factor to check, or a point around which further
//! points are drawn. Every type can therefore be checked.
use crate::error::LawError;
use crate::example::{example_fields, problem};
use crate::factor_check::{FactorCheck, FactorReport, Subject};
use crate::manifold_check::{ManifoldCheck, ManifoldReport};
use manifactor_document::Reader;
use manifactor_graph::catalogue::{self, Entry, Kind};
use manifactor_graph::checked::Positive;
use manifactor_graph::loss::Loss;
use manifactor_graph::{Factor, Variable};

pub use crate::example::example;

/// Checks that an entry has a name in snake case, a summary, a schema that is an object, and a readable TOML
/// example of the type.
///
/// # Errors
/// The first missing part.
pub fn documentation_law(entry: &'static Entry) -> Result<(), LawError> {
    let require = |holds: bool, text: &str| if holds { Ok(()) } else { Err(problem(entry, text.into())) };
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_' || c == '-';
    require(entry.name.chars().all(plain), "its name is not in snake case")?;
    require(!entry.summary().is_empty(), "its type has no doc comment")?;
    let schema = (entry.schema)();
    require(schema.as_object().is_some(), "its schema is no object")?;
    let read = (entry.read_boxed)(Reader::new(&example_fields(entry)?));
    read.map(drop).map_err(|e| problem(entry, format!("its example: {e}")))
}

/// Checks the example of a factor at `points` points, see [`FactorCheck`]. Returns the report.
///
/// # Errors
/// If a law does not hold, or the catalogue entry is incomplete.
pub fn factor_law(entry: &'static Entry, points: usize) -> Result<FactorReport, LawError> {
    let report = FactorCheck { points, ..FactorCheck::default() }.run(&Subject::example(entry)?);
    if report.holds() { Ok(report) } else { Err(problem(entry, report.to_string())) }
}

/// Asserts [`documentation_law`] and [`factor_law`] of a registered factor, at 256 points. The tests of
/// [`factor_laws!`](crate::factor_laws) call this function.
///
/// # Panics
/// If a law does not hold, with its error. It is an assertion for tests.
#[track_caller]
pub fn assert_factor_laws(name: &str) {
    let entry = catalogue::find(<dyn Factor as Kind>::NAME, name);
    let entry = entry.unwrap_or_else(|| panic!(
        "no factor `{name}` is registered: is there a line `register_factor!(\"{name}\", …);`, and is its module part of the crate?"
    ));
    catalogue::check_names(&catalogue::all()).unwrap_or_else(|e| panic!("{e}"));
    documentation_law(entry).unwrap_or_else(|e| panic!("{e}"));
    factor_law(entry, 256).unwrap_or_else(|e| panic!("{e}"));
}

/// Defines one test for each registered factor name: its docs are complete, its Jacobian is right, its
/// residual is finite, and its stated invariances hold. Example: `factor_laws! { rests_on, leans }`
#[macro_export]
macro_rules! factor_laws {
    ($($name:ident),+ $(,)?) => {
        mod factor_laws {
            $(#[test]
            fn $name() {
                $crate::catalogue::assert_factor_laws(stringify!($name));
            })+
        }
    };
}

/// Checks a manifold at `points` pairs of points, see [`ManifoldCheck`]. Returns the report.
///
/// # Errors
/// If a law does not hold, or the catalogue entry is incomplete.
pub fn manifold_law(entry: &'static Entry, points: usize) -> Result<ManifoldReport, LawError> {
    let report = ManifoldCheck { points, ..ManifoldCheck::default() }.run(entry)?;
    if report.holds() { Ok(report) } else { Err(problem(entry, report.to_string())) }
}

/// Asserts [`documentation_law`] and [`manifold_law`] of a registered manifold, at 256 pairs of points,
/// including its `seed`. The tests of [`manifold_laws!`](crate::manifold_laws!) call this function.
///
/// # Panics
/// If a law does not hold, with its error. It is an assertion for tests.
#[track_caller]
pub fn assert_manifold_laws(name: &str) {
    let entry = catalogue::find(<dyn Variable as Kind>::NAME, name);
    let entry = entry.unwrap_or_else(|| panic!(
        "no manifold `{name}` is registered: is there a line `register_manifold!(\"{name}\", …);`, and is its module part of the crate?"
    ));
    documentation_law(entry).unwrap_or_else(|e| panic!("{e}"));
    let report = manifold_law(entry, 256).unwrap_or_else(|e| panic!("{e}"));
    assert!(
        report.seed_error.is_some(),
        "nothing says what the numbers of `{name}` are, so that its `seed` cannot be checked: write a line `register_quantity!(…);`, \
         which lets formulas compute with it, too"
    );
}

/// Checks the example of a loss at many s. Its weight has to be the derivative of ρ. The loss, [tempered]
/// once and twice, has to be ρ(τs)/τ for many τ.
///
/// # Errors
/// If a law does not hold, or the catalogue entry is incomplete.
///
/// [tempered]: manifactor_graph::loss::RobustLoss::tempered
pub fn loss_law(entry: &'static Entry) -> Result<(), LawError> {
    let loss = example::<dyn Loss>(entry)?;
    let rho = |s: f64| loss.erased().rho(s);
    // between round numbers, at which a loss may have its bounds
    let grid = |exponents: std::ops::Range<i32>| exponents.map(|i| 10f64.powf(0.37 * f64::from(i) + 0.013));
    let near = |(a, b): (f64, f64), share: f64| (a - b).abs() <= share * (1.0 + b.abs());
    for s in grid(-40..20) {
        let h = 1e-5 * s;
        let (slope, weight) = ((rho(s + h).0 - rho(s - h).0) / (2.0 * h), rho(s).1);
        if !near((slope, weight), 1e-4) {
            return Err(problem(
                entry,
                format!("at s = {s} its weight is {weight}, and the derivative of ρ {slope}"),
            ));
        }
    }
    for tau in grid(-10..15).filter_map(|tau| Positive::new(tau).ok()) {
        let tempered = loss.erased().tempered(tau);
        let twice = tempered.erased().tempered(tau);
        for (tempered, tau) in [(tempered, tau.get()), (twice, tau.get().powi(2))] {
            for s in grid(-40..20) {
                let (expected, found) = ((rho(tau * s).0 / tau, rho(tau * s).1), tempered.erased().rho(s));
                if !(near((found.0, expected.0), 1e-11) && near((found.1, expected.1), 1e-11)) {
                    let text = format!(
                        "tempered by τ = {tau}, at s = {s}, it is {found:?}, not ρ(τs)/τ and ρ'(τs), {expected:?}"
                    );
                    return Err(problem(entry, text));
                }
            }
        }
    }
    Ok(())
}
