//! Observers, which watch a solve and can stop it.
use crate::outcome::IterationRecord;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// An observer of each step that a solver tries. `Break` ends the solve with the best values so far.
pub trait Observer {
    /// Called after each tried step.
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()>;

    /// Called during long steps: before each iteration of conjugate gradients, and before each refinement.
    /// `Break` ends the solve with the best values so far.
    fn poll(&mut self) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// An observer that does nothing.
#[derive(Debug, Clone, Copy, Default)]
pub struct Silent;

impl Observer for Silent {
    fn iteration(&mut self, _: &IterationRecord) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Stops the solve once a flag is set, for example by Ctrl-C or from a different thread.
#[derive(Debug, Clone, Default)]
pub struct Interrupt(pub Arc<AtomicBool>);

impl Observer for Interrupt {
    fn iteration(&mut self, _: &IterationRecord) -> ControlFlow<()> {
        self.poll()
    }
    fn poll(&mut self) -> ControlFlow<()> {
        if self.0.load(Ordering::Relaxed) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// A closure over the record, which may end the solve.
impl<F: FnMut(&IterationRecord) -> ControlFlow<()>> Observer for F {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        self(record)
    }
}

/// Several observers, called in order; each receives each record.
pub struct AllObservers<'a>(pub Vec<&'a mut dyn Observer>);

impl Observer for AllObservers<'_> {
    fn iteration(&mut self, record: &IterationRecord) -> ControlFlow<()> {
        let mut flow = ControlFlow::Continue(());
        for observer in &mut self.0 {
            if observer.iteration(record).is_break() {
                flow = ControlFlow::Break(());
            }
        }
        flow
    }
    fn poll(&mut self) -> ControlFlow<()> {
        let stops = self.0.iter_mut().any(|observer| observer.poll().is_break());
        if stops { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }
}

/// Hides the records of an inner solve from an observer that may still end it.
pub(crate) struct Quiet<'a>(pub &'a mut dyn Observer);

impl Observer for Quiet<'_> {
    fn iteration(&mut self, _: &IterationRecord) -> ControlFlow<()> {
        self.0.poll()
    }
    fn poll(&mut self) -> ControlFlow<()> {
        self.0.poll()
    }
}

impl std::fmt::Debug for AllObservers<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} observers", self.0.len())
    }
}
