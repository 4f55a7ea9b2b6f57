//! Exit codes.
use manifactor::solve::{Stall, Termination};
use std::process::ExitCode;

/// How a command ended that did what it was asked to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    /// All went well: exit code 0. An estimate beside a jump of the cost counts: it is the least there is nearby, and
    /// the report says what it is.
    Done,
    /// A solve ended without a minimum; its best values are written all the same: exit code 1.
    NotConverged,
    /// A factor was checked, and breaks a law: exit code 1.
    Broken,
    /// Ctrl-C; the best values so far are written: exit code 130.
    Interrupted,
}

impl Status {
    /// The worse of two.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        match (self, other) {
            (Self::Interrupted, _) | (_, Self::Interrupted) => Self::Interrupted,
            (Self::Done, other) => other,
            (status, _) => status,
        }
    }
}

impl From<&Termination> for Status {
    fn from(termination: &Termination) -> Self {
        match termination {
            Termination::Converged { .. } | Termination::Stalled { reason: Stall::Jump } => Self::Done,
            Termination::Interrupted => Self::Interrupted,
            _ => Self::NotConverged,
        }
    }
}

impl From<Status> for ExitCode {
    fn from(status: Status) -> ExitCode {
        match status {
            Status::Done => ExitCode::SUCCESS,
            Status::NotConverged | Status::Broken => ExitCode::from(1),
            Status::Interrupted => ExitCode::from(130),
        }
    }
}
