//! Exit codes.
use manifactor::slam::mapping::Warning;
use manifactor::slam::report::{RunReport, VariantReport};
use manifactor::solve::{Stall, Termination};

/// Outcome of a command that did its work.
///
/// The variants are ordered by severity: if several apply, the last one counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Status {
    /// Success: exit code 0. This includes an estimate at a jump of the cost, which is the lowest cost
    /// nearby; the report describes it.
    Done,
    /// A solve did not reach a minimum; its best values are written: exit code 1.
    NotConverged,
    /// Objects were detected, but none is in the map: exit code 1.
    NothingMapped,
    /// More detections were left out than the source expects: exit code 1.
    DetectionsLeftOut,
    /// A factor or a type of variables breaks a law: exit code 1.
    Broken,
    /// A recording has a probable fault: exit code 1.
    FaultsFound,
    /// Everything is written except for a journal that lacks frames: exit code 3.
    JournalIncomplete,
    /// Ctrl-C ended the command early; the best values so far are written: exit code 130.
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
    /// The status of the worst variant. A signal after the end of the work interrupts nothing.
    fn from(report: &RunReport) -> Self {
        let variants = report.variants.iter().map(Self::from).max().unwrap_or(Self::Done);
        if report.complete { variants } else { Self::Interrupted }
    }
}

impl From<&VariantReport> for Status {
    fn from(report: &VariantReport) -> Self {
        let nothing = report.counts.detections > 0 && report.counts.objects == 0;
        let mapped = if nothing { Self::NothingMapped } else { Self::Done };
        let is_partial = report.warnings.iter().any(Warning::is_partial);
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
            Status::NotConverged
            | Status::NothingMapped
            | Status::DetectionsLeftOut
            | Status::FaultsFound
            | Status::Broken => 1,
            Status::JournalIncomplete => 3,
            Status::Interrupted => 130,
        }
    }
}
