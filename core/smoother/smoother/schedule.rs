//! The settings, and the count of updates: when to relinearize, and how exactly.
mod window;

use crate::settings::SmootherSettings;
use window::SlidingWindow;

/// Share of the normal limits that applies in an idle update.
const IDLE_SHARE: f64 = 1e-8;

/// The settings of the smoother, the count of its updates, and its window.
#[derive(Debug)]
pub(super) struct Schedule {
    settings: SmootherSettings,
    updates: usize,
    /// True if the last update had no changes.
    is_quiet: bool,
    /// True if the current update and the one before it have no changes.
    is_idle: bool,
    window: SlidingWindow,
}

impl Schedule {
    /// Creates a schedule without updates.
    pub(super) fn new(settings: SmootherSettings) -> Self {
        Self { settings, updates: 0, is_quiet: false, is_idle: false, window: SlidingWindow::default() }
    }

    /// Restores the schedule of a saved smoother.
    pub(super) fn restore(&mut self, updates: usize, is_quiet: bool) {
        self.updates = updates;
        self.is_quiet = is_quiet;
    }

    pub(super) fn settings(&self) -> &SmootherSettings {
        &self.settings
    }

    /// Returns the number of updates that have succeeded.
    pub(super) fn updates(&self) -> usize {
        self.updates
    }

    /// Returns whether the last update had no changes.
    pub(super) fn is_quiet(&self) -> bool {
        self.is_quiet
    }

    /// Returns whether the current update and the one before it have no changes.
    pub(super) fn is_idle(&self) -> bool {
        self.is_idle
    }

    /// Begins an update. `is_quiet` is true if it has no changes.
    pub(super) fn begin(&mut self, is_quiet: bool) {
        self.is_idle = is_quiet && self.is_quiet;
    }

    /// Counts the current update, which has succeeded.
    pub(super) fn complete(&mut self, is_quiet: bool) {
        self.updates += 1;
        self.is_quiet = is_quiet;
    }

    /// Returns whether the current update relinearizes at a regular turn.
    pub(super) fn is_turn(&self) -> bool {
        self.is_idle || (self.updates + 1).is_multiple_of(self.settings.relinearize_every.get())
    }

    /// Returns the largest linearization error that remains, as a share of the relinearization threshold. An
    /// idle update leaves far less.
    pub(super) fn largest_excess(&self) -> f64 {
        if self.is_idle { IDLE_SHARE } else { 1.0 }
    }

    /// Returns the linearization error above which a variable does not wait for its turn, as a share of
    /// the relinearization threshold.
    pub(super) fn urgent_excess(&self) -> f64 {
        self.settings.immediate_relinearization_factor.powi(2)
    }

    /// Returns the largest change of a step that is not propagated. Unit: σ.
    pub(super) fn wildfire_threshold(&self) -> f64 {
        if self.is_idle {
            IDLE_SHARE * *self.settings.wildfire_threshold
        } else {
            *self.settings.wildfire_threshold
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::num::NonZeroUsize;

    fn update(schedule: &mut Schedule, is_quiet: bool) -> bool {
        schedule.begin(is_quiet);
        let is_turn = schedule.is_turn();
        schedule.complete(is_quiet);
        is_turn
    }

    #[test]
    fn every_third_update_relinearizes_and_each_idle_one() {
        let mut schedule = Schedule::new(SmootherSettings {
            relinearize_every: NonZeroUsize::new(3).unwrap(),
            ..SmootherSettings::default()
        });
        let turns: Vec<bool> = (0..6).map(|_| update(&mut schedule, false)).collect();
        assert_eq!(turns, [false, false, true, false, false, true]);
        assert!(!update(&mut schedule, true) && update(&mut schedule, true));
        assert!(schedule.is_idle() && schedule.largest_excess() < 1e-6);
        assert!(update(&mut schedule, false) && !update(&mut schedule, false));
        assert!(schedule.largest_excess() == 1.0 && schedule.updates() == 10);
    }
}
