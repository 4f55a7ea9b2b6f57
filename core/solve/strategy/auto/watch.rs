//! Seeing early that a solve leads nowhere.
use crate::observer::Observer;
use crate::outcome::IterationRecord;
use std::ops::ControlFlow;

/// A solve that has not settled after so many steps is worth asking the other starts, which takes as long as one or two
/// of them: from a fair start, full steps are there in fewer.
const PATIENCE: usize = 10;
/// A rise by this share of the cost at the beginning is rounding.
const ROUNDING: f64 = 1e-9;
/// A step that raises the cost leads on all the same, if the next is at most this share of its length: Newton's method
/// converges, though the cost does not show it (monotonicity tests: Deuflhard, *Newton methods for nonlinear problems*,
/// 2004). From poor starts of public graphs, it is 0.25 to 1.1; where the weights alone are uneven, 0.05.
const CONTRACTION: f64 = 0.1;

/// Why a solve was paused.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Pause {
    /// A step of this length has raised the cost.
    Rise { step: f64 },
    /// A step has left the domain of a factor.
    Undefined,
    /// It takes long. The damping of its last step.
    Long { damping: f64 },
}

/// Pauses a solve where another start may do better, or where who watches asks for it.
pub(super) struct Watch<'a> {
    observer: &'a mut dyn Observer,
    /// The cost at the beginning.
    initial: Option<f64>,
    /// Most that the next step may be long.
    longest: f64,
    /// Whether it may still pause.
    is_awake: bool,
    pub pause: Option<Pause>,
    pub stopped: bool,
}

impl<'a> Watch<'a> {
    pub(super) fn new(observer: &'a mut dyn Observer) -> Self {
        let longest = f64::INFINITY;
        Self { observer, initial: None, longest, is_awake: true, pause: None, stopped: false }
    }

    /// Goes on after a step of this length: the next has to be much shorter.
    pub(super) fn expect_shorter_than(&mut self, step: f64) {
        (self.pause, self.longest) = (None, CONTRACTION * step);
    }

    /// Lets solves go on to their ends from now on.
    pub(super) fn sleep(&mut self) {
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

/// Ends a solve by full steps once one leaves the domain of a factor: halved until it does not, it leads anywhere.
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
