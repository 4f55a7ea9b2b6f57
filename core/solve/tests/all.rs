//! Solvers on problems whose answer is known.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    clippy::print_stdout,
    clippy::print_stderr
)]
mod bounds;
mod change;
mod checked;
mod covariance;
mod endings;
mod gnc;
mod minima;
mod solvers;
mod toy;
