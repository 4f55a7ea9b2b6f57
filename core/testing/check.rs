//! Checks of a law on the cases of a strategy.
use crate::error::LawError;
use crate::jacobian::jacobian_law;
use crate::manifold::manifold_laws;
use manifactor_graph::{Factor, Variable};
use proptest::strategy::Strategy;
use proptest::test_runner::{Config, TestCaseError, TestError, TestRunner};
use std::fmt::Debug;

/// Smallest number of cases. `PROPTEST_CASES` can increase it.
const CASES: u32 = 256;

/// Checks a law for at least 256 cases of a strategy. Cases with an undefined factor are drawn again, up to a
/// limit.
///
/// # Panics
/// If the law does not hold, with the simplest case that was found. It is an assertion for tests.
#[track_caller]
pub fn check<S: Strategy>(cases: S, law: impl Fn(S::Value) -> Result<(), LawError>)
where
    S::Value: Debug,
{
    let usual = Config::default();
    let config = Config { cases: usual.cases.max(CASES), failure_persistence: None, ..usual };
    let outcome = TestRunner::new(config).run(&cases, |case| {
        law(case).map_err(|error| match error {
            LawError::NotDefined { .. } => TestCaseError::reject("not defined there"),
            broken => TestCaseError::fail(broken.to_string()),
        })
    });
    match outcome {
        Ok(()) => {}
        Err(TestError::Fail(reason, case)) => panic!("{reason}\n  case {case:?}"),
        Err(TestError::Abort(reason)) => panic!("no verdict: {reason}"),
    }
}

/// A factor with its variables: a tuple of the factor and each variable, or of the factor and [`Each`].
pub trait Case {
    /// Calls a function with the factor and the variables as trait objects.
    fn with<R>(&self, use_them: impl FnOnce(&dyn Factor, &[&dyn Variable]) -> R) -> R;
}

/// The variables of a factor that takes any number of them.
#[derive(Debug, Clone)]
pub struct Each<A>(pub Vec<A>);

impl<F: Factor, A: Variable> Case for (F, Each<A>) {
    fn with<R>(&self, use_them: impl FnOnce(&dyn Factor, &[&dyn Variable]) -> R) -> R {
        let variables: Vec<&dyn Variable> = self.1.0.iter().map(|v| v as &dyn Variable).collect();
        use_them(&self.0, &variables)
    }
}

macro_rules! case {
    ($($v:ident $i:tt),+) => {
        impl<F: Factor, $($v: Variable),+> Case for (F, $($v),+) {
            fn with<R>(&self, use_them: impl FnOnce(&dyn Factor, &[&dyn Variable]) -> R) -> R {
                use_them(&self.0, &[$(&self.$i),+])
            }
        }
    };
}
case!(V1 1);
case!(V1 1, V2 2);
case!(V1 1, V2 2, V3 3);
case!(V1 1, V2 2, V3 3, V4 4);
case!(V1 1, V2 2, V3 3, V4 4, V5 5);
case!(V1 1, V2 2, V3 3, V4 4, V5 5, V6 6);

/// Checks [`jacobian_law`] for the cases of a strategy.
///
/// # Panics
/// See [`check`].
#[track_caller]
pub fn check_jacobians<S: Strategy<Value: Case + Debug>>(cases: S) {
    check(cases, |case| case.with(jacobian_law));
}

/// Checks [`manifold_laws`] for the cases of a strategy: two points, and a tangent vector at the first.
///
/// # Panics
/// See [`check`].
#[track_caller]
pub fn check_manifolds<S, M, D>(cases: S)
where
    S: Strategy<Value = (M, M, D)>,
    M: Variable,
    D: AsRef<[f64]> + Debug,
{
    check(cases, |(x, y, delta)| manifold_laws(&x, &y, delta.as_ref()));
}

/// Defines tests of [`jacobian_law`]: `jacobian_laws! { name: strategy; … }`. The strategy yields a factor
/// and its variables as one tuple.
#[macro_export]
macro_rules! jacobian_laws {
    ($($name:ident: $cases:expr);+ $(;)?) => {
        $(#[test]
        fn $name() {
            $crate::check_jacobians($cases);
        })+
    };
}

/// Defines one test for each registered manifold name: `manifold_laws! { heading, se3 }`. See
/// [`assert_manifold_laws`](crate::catalogue::assert_manifold_laws).
///
/// The form `manifold_laws! { name: strategy; … }` checks [`manifold_laws`] for points of a custom strategy,
/// which yields two points and a tangent vector at the first.
#[macro_export]
macro_rules! manifold_laws {
    ($($name:ident),+ $(,)?) => {
        mod manifold_laws {
            $(#[test]
            fn $name() {
                $crate::catalogue::assert_manifold_laws(stringify!($name));
            })+
        }
    };
    ($($name:ident: $cases:expr);+ $(;)?) => {
        $(#[test]
        fn $name() {
            $crate::check_manifolds($cases);
        })+
    };
}
