//! Variables that leave the window, by their number or by the time of their insertion.
use super::Schedule;
use crate::error::ChangeError;
use crate::model::Model;
use crate::settings::Span;
use manifactor_graph::Key;
use manifactor_graph::checked::Positive;
use std::collections::{BTreeSet, VecDeque};

/// Share by which a window may be longer before its oldest variables are marginalized together. Each
/// marginalization eliminates the variables of the whole window again, so that groups cost less: a chain with a
/// window of 50 poses takes 122 µs for each pose without groups, 7 µs without a window.
const SLACK: f64 = 0.125;

/// A variable in the window.
#[derive(Debug, Clone, Copy)]
struct WindowVariable {
    variable: u32,
    /// Rank in the order of insertion among all variables. It identifies the variable, because its number can
    /// be reused.
    rank: u64,
    /// Time of insertion by the clock of the caller. A window by poses ignores it.
    time: f64,
}

/// The clock of the caller, and the variables in the window.
#[derive(Debug, Clone, Default)]
pub(in crate::smoother) struct SlidingWindow {
    /// The last time that was set, as of the last update.
    time: Option<f64>,
    /// The oldest first.
    held: VecDeque<WindowVariable>,
}

impl SlidingWindow {
    /// Returns the last time that was set, as of the last update.
    pub(in crate::smoother) fn time(&self) -> Option<f64> {
        self.time
    }

    /// Returns the variables that exceed the window; none until it is longer by [`SLACK`]. Variables of `leaving`
    /// are marginalized anyway and do not count.
    fn overflow(&mut self, span: Span, model: &Model, leaving: &[u32]) -> Vec<u32> {
        self.held.retain(|held| {
            let place = model.record(held.variable);
            place.is_present && place.rank == held.rank && !leaving.contains(&held.variable)
        });
        let more = match span {
            Span::Poses(poses) => {
                let more = self.held.len().saturating_sub(poses.get());
                if more as f64 > SLACK * poses.get() as f64 { more } else { 0 }
            }
            Span::Seconds(seconds) => {
                let from = self.time.unwrap_or_default() - seconds.get();
                let oldest = self.held.front().map_or(from, |held| held.time);
                let older = self.held.partition_point(|held| held.time < from);
                let is_due = oldest < from - SLACK * seconds.get();
                if is_due { older.min(self.held.len().saturating_sub(1)) } else { 0 }
            }
        };
        self.held.drain(..more).map(|held| held.variable).collect()
    }
}

impl Schedule {
    /// Checks a new time. `pending` is the time that was set since the last update.
    pub(in crate::smoother) fn check_time(&self, pending: Option<f64>, time: f64) -> Result<(), ChangeError> {
        let last = pending.or(self.window.time);
        if !time.is_finite() || last.is_some_and(|last| time < last) {
            return Err(ChangeError::Time { time, last });
        }
        Ok(())
    }

    /// Returns the insertion time of a variable that is pushed now; 0 if no window needs it.
    pub(in crate::smoother) fn time_of_new(&self, pending: Option<f64>) -> Result<f64, ChangeError> {
        match pending.or(self.window.time) {
            None if self.seconds().is_some() => Err(ChangeError::NoTime),
            time => Ok(time.unwrap_or_default()),
        }
    }

    /// Sets the time, if an update has one.
    pub(in crate::smoother) fn set_time(&mut self, time: Option<f64>) {
        self.window.time = time.or(self.window.time);
    }

    /// Returns the length of a window by seconds.
    fn seconds(&self) -> Option<Positive> {
        match self.settings.window.as_ref()?.span {
            Span::Seconds(seconds) => Some(seconds),
            Span::Poses(_) => None,
        }
    }

    /// Adds a variable to the window, unless it always stays.
    pub(in crate::smoother) fn add_to_window(&mut self, model: &Model, variable: u32, time: f64) {
        if self.leaves(model, variable) {
            self.window.held.push_back(WindowVariable { variable, rank: model.record(variable).rank, time });
        }
    }

    /// Returns whether a variable leaves the window.
    fn leaves(&self, model: &Model, variable: u32) -> bool {
        let Some(window) = &self.settings.window else { return false };
        let name = model.point(variable).map_or("", |point| point.typetag_name());
        let key = &model.record(variable).key;
        !window.keep.iter().any(|keep| keep.as_str() == name) && !window.keep_keys.contains(key)
    }

    /// Returns the variables to marginalize at the end of an update: the variables of `asked`, and the ones
    /// that exceed the window.
    pub(in crate::smoother) fn leaving(&mut self, model: &Model, asked: &[Key]) -> Vec<u32> {
        let mut leaving: Vec<u32> = asked.iter().filter_map(|key| model.variable(key.as_str())).collect();
        if let Some(window) = &self.settings.window {
            leaving.extend(self.window.overflow(window.span, model, &leaving));
        }
        let mut seen = BTreeSet::new();
        leaving.retain(|v| seen.insert(*v));
        leaving
    }

    /// Returns the window, which is restored if variables cannot be marginalized.
    pub(in crate::smoother) fn window(&self) -> &SlidingWindow {
        &self.window
    }

    /// Restores the window.
    pub(in crate::smoother) fn restore_window(&mut self, window: SlidingWindow) {
        self.window = window;
    }

    /// Returns the insertion times of all variables in a window by seconds, as bits, the oldest first.
    pub(in crate::smoother) fn times(&self) -> Vec<u64> {
        match self.seconds() {
            Some(_) => self.window.held.iter().map(|held| held.time.to_bits()).collect(),
            None => vec![],
        }
    }

    /// Restores a saved window. Returns whether the times are valid for the variables in the model.
    pub(in crate::smoother) fn load_times(&mut self, model: &Model, now: Option<u64>, times: &[u64]) -> bool {
        let now = now.map(f64::from_bits);
        self.window.time = now;
        let held: Vec<u32> = model.by_age().into_iter().filter(|v| self.leaves(model, *v)).collect();
        let times: Vec<f64> = times.iter().map(|bits| f64::from_bits(*bits)).collect();
        let expected = if self.seconds().is_some() { held.len() } else { 0 };
        let is_set = times.is_empty() || now.is_some();
        let ascending: Vec<f64> = times.iter().copied().chain(now).collect();
        let is_finite = ascending.iter().all(|time| time.is_finite());
        if times.len() != expected || !is_set || !is_finite || !ascending.is_sorted() {
            return false;
        }
        for (i, v) in held.into_iter().enumerate() {
            self.add_to_window(model, v, times.get(i).copied().unwrap_or_default());
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::SmootherSettings;

    #[test]
    fn time_goes_on() {
        let mut schedule = Schedule::new(SmootherSettings::default());
        assert_eq!(schedule.time_of_new(None), Ok(0.0));
        schedule.set_time(Some(2.0));
        schedule.set_time(None);
        assert_eq!(schedule.time_of_new(None), Ok(2.0));
        assert_eq!(schedule.time_of_new(Some(3.0)), Ok(3.0));
        assert!(schedule.check_time(None, 2.0).is_ok() && schedule.check_time(Some(3.0), 2.0).is_err());
        assert!(schedule.check_time(None, f64::NAN).is_err());
    }
}
