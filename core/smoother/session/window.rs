//! Which variables a window has no room for any more, by their number or by the time when they came.
use super::Session;
use crate::error::ChangeError;
use crate::settings::Span;
use manifactor_graph::Key;
use manifactor_graph::checked::Positive;
use std::collections::BTreeSet;

/// A variable that a window holds.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held {
    variable: u32,
    /// When it came among all variables: its number is used again.
    born: u64,
    /// When it came by the clock of the caller; a window by poses does not look at it.
    time: f64,
}

impl Session {
    /// Says what time it is: variables that are pushed from now on come at this time. The unit is a second, the origin is free. A
    /// window by seconds needs it before the first [`push`](Self::push). Takes effect at the next [`update`](Self::update), and is taken
    /// back with it where that fails.
    ///
    /// # Errors
    /// Where `time` is not finite, or before the one that was set last.
    pub fn set_time(&mut self, time: f64) -> Result<(), ChangeError> {
        let last = self.pending.time.or(self.time);
        if !time.is_finite() || last.is_some_and(|last| time < last) {
            return Err(ChangeError::Time { time, last });
        }
        self.pending.time = Some(time);
        Ok(())
    }

    /// The time at which a variable comes that is pushed now; 0 where nothing asks for it.
    pub(super) fn time_of_new(&self) -> Result<f64, ChangeError> {
        match self.pending.time.or(self.time) {
            None if self.seconds().is_some() => Err(ChangeError::NoTime),
            time => Ok(time.unwrap_or_default()),
        }
    }

    /// How far a window by seconds reaches back.
    fn seconds(&self) -> Option<Positive> {
        match self.schedule.settings().window.as_ref()?.span {
            Span::Seconds(seconds) => Some(seconds),
            Span::Poses(_) => None,
        }
    }

    /// Notes when a variable came, where the window holds it: where it is of a type that leaves.
    pub(super) fn note_age(&mut self, variable: u32, time: f64) {
        if self.leaves(variable) {
            self.ages.push_back(Held { variable, born: self.model.place(variable).born, time });
        }
    }

    /// Whether a variable is of a type that leaves a window.
    fn leaves(&self, variable: u32) -> bool {
        let Some(window) = &self.schedule.settings().window else { return false };
        let name = self.model.point(variable).map_or("", |point| point.typetag_name());
        !window.keep.iter().any(|keep| keep.as_str() == name)
    }

    /// The variables that leave at the end of an update: those that were asked to, and those that the window has no room for.
    pub(super) fn leaving(&mut self, asked: &[Key]) -> Vec<u32> {
        let mut leaving: Vec<u32> =
            asked.iter().filter_map(|key| self.model.variable(key.as_str())).collect();
        if let Some(window) = &self.schedule.settings().window {
            let model = &self.model;
            self.ages.retain(|held| {
                let place = model.place(held.variable);
                place.is_there && place.born == held.born && !leaving.contains(&held.variable)
            });
            let more = match window.span {
                Span::Poses(poses) => self.ages.len().saturating_sub(poses.get()),
                Span::Seconds(seconds) => {
                    let from = self.time.unwrap_or_default() - seconds.get();
                    let older = self.ages.partition_point(|held| held.time < from);
                    older.min(self.ages.len().saturating_sub(1))
                }
            };
            leaving.extend(self.ages.drain(..more).map(|held| held.variable));
        }
        let mut seen = BTreeSet::new();
        leaving.retain(|v| seen.insert(*v));
        leaving
    }

    /// By variable that a window by seconds holds, the oldest first: the bits of its time.
    pub(super) fn times(&self) -> Vec<u64> {
        match self.seconds() {
            Some(_) => self.ages.iter().map(|held| held.time.to_bits()).collect(),
            None => vec![],
        }
    }

    /// Puts back what a window holds; whether these can be the times of the variables that are there.
    pub(super) fn put_times(&mut self, now: Option<u64>, times: &[u64]) -> bool {
        self.time = now.map(f64::from_bits);
        let held: Vec<u32> = self.model.by_age().into_iter().filter(|v| self.leaves(*v)).collect();
        let times: Vec<f64> = times.iter().map(|bits| f64::from_bits(*bits)).collect();
        let expected = if self.seconds().is_some() { held.len() } else { 0 };
        let is_set = times.is_empty() || self.time.is_some();
        let ascending: Vec<f64> = times.iter().copied().chain(self.time).collect();
        let is_finite = ascending.iter().all(|time| time.is_finite());
        if times.len() != expected || !is_set || !is_finite || !ascending.is_sorted() {
            return false;
        }
        for (i, v) in held.into_iter().enumerate() {
            self.note_age(v, times.get(i).copied().unwrap_or_default());
        }
        true
    }
}
