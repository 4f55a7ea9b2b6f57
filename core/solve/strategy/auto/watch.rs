//! Early detection of a solve that leads to no minimum.
use crate::observer::Observer;
use crate::outcome::IterationRecord;
use std::ops::ControlFlow;

/// Iterations after which further starts are tried, which takes about as long as one or two iterations.
/// From a fair start, full steps need fewer.
const PATIENCE: usize = 10;
/// A rise of the cost below this share of the initial cost is rounding.
const ROUNDING: f64 = 1e-9;
/// A solve continues after a step that raises the cost if the next step has at most this share of its
/// length. Then Newton's method converges although the cost does not show it (monotonicity tests:
/// Deuflhard, *Newton methods for nonlinear problems*, 2004). The measured ratio is 0.25 to 1.1 from poor
/// starts of public graphs, and 0.05 if only the weights are uneven.
const CONTRACTION: f64 = 0.1;

/// Reason for pausing a solve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Pause {
    /// A step of this length raised the cost.
    Rise { step: f64 },
    /// A step left the domain of a factor.
    Undefined,
    /// The solve takes many iterations. `damping` is that of its last step.
    Long { damping: f64 },
}

/// Pauses a solve if a further start may do better, and stops it if the observer requests so.
pub(super) struct Watch<'a> {
    observer: &'a mut dyn Observer,
    /// The initial cost.
    initial: Option<f64>,
    /// Upper bound for the length of the next step.
    longest: f64,
    /// Whether it may still pause a solve.
    is_awake: bool,
    pub pause: Option<Pause>,
    pub stopped: bool,
}

impl<'a> Watch<'a> {
    pub(super) fn new(observer: &'a mut dyn Observer) -> Self {
        let longest = f64::INFINITY;
        Self { observer, initial: None, longest, is_awake: true, pause: None, stopped: false }
    }

    /// Continues after a step of this length; the next one must be much shorter.
    pub(super) fn expect_shorter_than(&mut self, step: f64) {
        (self.pause, self.longest) = (None, CONTRACTION * step);
    }

    /// Disables pausing, so that solves run to their end.
    pub(super) fn disable_pausing(&mut self) {
        (self.is_awake, self.pause) = (false, None);
    }

    fn pause(&self, record: &IterationRecord, initial: f64) -> Option<Pause> {
        let IterationRecord { iteration, cost, trial_cost, step, control, .. } = *record;
        match trial_cost {
            None => Some(Pause::Undefined),
            Some(trial) if trial - cost > ROUNDING * initial => Some(Pause::Rise { step }),
            _ if step > self.longest => Some(Pause::Rise { step }),
            _ if iteration >= PATIENCE => Some(Pause::Long { damping: control }),
            _ => None,
        }
    }
}

impl Observer for Watch<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        self.stopped |= self.observer.iteration(record).is_break();
        let initial = *self.initial.get_or_insert(record.cost);
        if self.is_awake {
            self.pause = self.pause(record, initial);
            self.longest = f64::INFINITY;
        }
        match self.stopped || self.pause.is_some() {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }

    fn poll(&mut self) -> ControlFlow<()> {
        self.stopped |= self.observer.poll().is_break();
        if self.stopped { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Ends a solve with full steps once a step leaves the domain of a factor, because halved steps may lead
/// anywhere.
pub(super) struct InDomain<'a> {
    pub observer: &'a mut dyn Observer,
    pub has_left: bool,
}

impl Observer for InDomain<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        self.has_left |= record.trial_cost.is_none();
        match self.observer.iteration(record) {
            ControlFlow::Continue(()) if self.has_left => ControlFlow::Break(()),
            flow => flow,
        }
    }

    fn poll(&mut self) -> ControlFlow<()> {
        self.observer.poll()
    }
}
