//! Exit codes.
use manifactor::slam::mapping::Warning;
use manifactor::slam::report::{RunReport, VariantReport};
use manifactor::solve::{Stall, Termination};

/// How a command ended that did what it was asked to do.
///
/// In order: of several, the last counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// All went well: exit code 0. An estimate beside a jump of the cost counts: it is the least there is nearby, and
    /// the report says what it is.
    Done,
    /// A solve ended without a minimum; its best values are written all the same: exit code 1.
    NotConverged,
    /// Objects were detected, and none is in the map: exit code 1.
    NothingMapped,
    /// More detections were left out than the source expects: exit code 1.
    DetectionsLeftOut,
    /// A factor was checked, and breaks a law: exit code 1.
    Broken,
    /// All is written but a journal, which lacks frames: exit code 3.
    JournalIncomplete,
    /// Ctrl-C before all was done; the best values so far are written: exit code 130.
    Interrupted,
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

impl From<&RunReport> for Status {
    /// That of its worst variant. A signal that comes when all is done interrupts nothing.
    fn from(report: &RunReport) -> Self {
        let variants = report.variants.iter().map(Self::from).max().unwrap_or(Self::Done);
        if report.complete { variants } else { Self::Interrupted }
    }
}

impl From<&VariantReport> for Status {
    fn from(report: &VariantReport) -> Self {
        let nothing = report.counts.detections > 0 && report.counts.objects == 0;
        let mapped = if nothing { Self::NothingMapped } else { Self::Done };
        let is_partial = report.warnings.iter().any(|w| matches!(w, Warning::TooManyUnused { .. }));
        let used = if is_partial { Self::DetectionsLeftOut } else { Self::Done };
        let is_lost = report.warnings.iter().any(|w| matches!(w, Warning::JournalIncomplete(_)));
        let kept = if is_lost { Self::JournalIncomplete } else { Self::Done };
        mapped.max(used).max(kept).max(Self::from(&report.solve.termination))
    }
}

impl From<Status> for u8 {
    fn from(status: Status) -> u8 {
        match status {
            Status::Done => 0,
            Status::NotConverged | Status::NothingMapped | Status::DetectionsLeftOut | Status::Broken => 1,
            Status::JournalIncomplete => 3,
            Status::Interrupted => 130,
        }
    }
}
