//! Bounds of unknowns: steps end at them, and unknowns that are pressed against one are held there.
use crate::outcome::{ActiveBound, Side};
use crate::problem::Problem;
use crate::problem::model::{Model, ProblemVariable};
use manifactor_graph::column::Columns;
use manifactor_graph::{Graph, Interval, OutOfBounds, Values};

/// A bounded scalar unknown.
struct BoundedUnknown {
    unknown: usize,
    /// Its variable, and its direction there.
    variable: usize,
    direction: usize,
    interval: Interval,
}

impl BoundedUnknown {
    fn coordinate(&self, model: &Model, columns: &Columns) -> f64 {
        let place = &model.variables[self.variable];
        // compilation admits only directions with a coordinate
        columns.column(place.column).coordinate(place.index, self.direction).unwrap_or(f64::NAN)
    }
    /// Returns the limit that keeps the coordinate from moving by a step of this sign, if it is there.
    fn side(&self, x: f64, step: f64) -> Option<Side> {
        match step {
            step if step < 0.0 && x <= self.interval.min() => Some(Side::Min),
            step if step > 0.0 && x >= self.interval.max() => Some(Side::Max),
            _ => None,
        }
    }
    /// Returns the step from `there` to the limit that a step from `here` would have reached without rounding.
    fn missed(&self, here: f64, there: f64) -> Option<f64> {
        const ROUNDING: f64 = 4.0 * f64::EPSILON;
        let is_missed = |limit: f64| {
            let distance = (there - limit).abs();
            limit.is_finite() && distance > 0.0 && distance <= ROUNDING * here.abs().max(limit.abs())
        };
        // the difference of such close numbers is exact
        [self.interval.min(), self.interval.max()].into_iter().find(|x| is_missed(*x)).map(|x| x - there)
    }
}

/// The bounds of a problem.
#[derive(Default)]
pub(crate) struct BoundedUnknowns {
    all: Vec<BoundedUnknown>,
    /// The active ones at the last linearization, with the derivative of the cost by the unknown.
    active: Vec<(usize, Side, f64)>,
}

impl BoundedUnknowns {
    /// Returns the bounds of a graph, without bounds on fixed directions, whose values were checked.
    pub(super) fn new(graph: &Graph, values: &Values, model: &Model) -> Self {
        if graph.bounds().is_empty() {
            return Self::default();
        }
        let of_variable = |(variable, place): (usize, &ProblemVariable)| {
            let unknowns: Vec<Option<usize>> = place.unknowns().collect();
            let bounds = graph.bounds().get(&place.key).zip(values.variable(place.key.as_str()));
            let bounded = bounds.into_iter().flat_map(|(bounds, value)| bounds.of(value));
            let bounded = bounded.filter_map(move |(direction, interval, _)| {
                Some(BoundedUnknown { unknown: unknowns[direction]?, variable, direction, interval })
            });
            bounded.collect::<Vec<_>>()
        };
        Self { all: model.variables.iter().enumerate().flat_map(of_variable).collect(), active: vec![] }
    }
}

impl Problem {
    /// Holds the unknowns at a bound that the negative gradient presses against it. Called by each linearization.
    pub(super) fn hold_active(&mut self) {
        let Self { model, system, bounds, .. } = self;
        if bounds.all.is_empty() {
            return;
        }
        let BoundedUnknowns { all, active } = bounds;
        active.clear();
        for (i, bounded) in all.iter().enumerate() {
            let gradient = system.g[bounded.unknown];
            let x = bounded.coordinate(model, model.columns());
            active.extend(bounded.side(x, -gradient).map(|side| (i, side, gradient)));
        }
        if !active.is_empty() {
            system.hold(active.iter().map(|(i, ..)| all[*i].unknown));
        }
    }

    /// Holds the unknowns at a bound that a step would cross, so that the step is to be computed again. Returns
    /// whether there are any.
    pub(crate) fn hold_crossing(&mut self, step: &[f64]) -> bool {
        let Self { model, system, bounds, .. } = self;
        let crosses = |bounded: &&BoundedUnknown| {
            let x = bounded.coordinate(model, model.columns());
            bounded.side(x, step[bounded.unknown]).is_some()
        };
        let crossing: Vec<usize> = bounds.all.iter().filter(crosses).map(|bounded| bounded.unknown).collect();
        if crossing.is_empty() {
            return false;
        }
        system.hold(crossing);
        true
    }

    /// Shortens a step in the unknowns that would leave their bounds. Returns whether there are any.
    pub(crate) fn clip(&self, step: &mut [f64]) -> bool {
        let mut is_clipped = false;
        for bounded in &self.bounds.all {
            let x = bounded.coordinate(&self.model, self.model.columns());
            let entry = &mut step[bounded.unknown];
            let clipped = bounded.interval.clip(x, *entry);
            is_clipped |= clipped != *entry;
            *entry = clipped;
        }
        is_clipped
    }

    /// Sets the trial to `estimate ⊞ step`, within the bounds. A coordinate that reaches a bound is equal to it.
    pub(crate) fn retract(&mut self, step: &[f64]) {
        if self.bounds.all.is_empty() {
            return self.model.retract(step);
        }
        let mut step = step.to_vec();
        self.clip(&mut step);
        self.model.retract(&step);
        for bounded in &self.bounds.all {
            let here = bounded.coordinate(&self.model, self.model.columns());
            let there = bounded.coordinate(&self.model, self.model.trial());
            if let Some(rest) = bounded.missed(here, there) {
                self.model.move_trial(bounded.variable, bounded.direction, rest);
            }
        }
    }

    /// Shortens steps so that they stay within the bounds in both directions.
    pub(crate) fn clip_both_ways(&self, steps: &mut [f64]) {
        for bounded in &self.bounds.all {
            let x = bounded.coordinate(&self.model, self.model.columns());
            let entry = &mut steps[bounded.unknown];
            let room = bounded.interval.clip(x, entry.abs()).min(-bounded.interval.clip(x, -entry.abs()));
            *entry = room.copysign(*entry);
        }
    }

    /// Returns the bounds that hold the estimate, as of the last linearization.
    pub(crate) fn active_bounds(&self) -> Vec<ActiveBound> {
        let active = self.bounds.active.iter().map(|(i, side, gradient)| {
            let bounded = &self.bounds.all[*i];
            let place = &self.model.variables[bounded.variable];
            let value = match side {
                Side::Min => bounded.interval.min(),
                Side::Max => bounded.interval.max(),
            };
            let direction = place.tangent[bounded.direction];
            ActiveBound { key: place.key.clone(), direction, side: *side, value, multiplier: gradient.abs() }
        });
        active.collect()
    }

    /// Returns the first coordinate of these values that is out of its bounds.
    pub(super) fn out_of_bounds(&self, values: &Values) -> Option<OutOfBounds> {
        self.bounds.all.iter().find_map(|bounded| {
            let place = &self.model.variables[bounded.variable];
            let value = values.variable(place.key.as_str())?.erased().coordinate(bounded.direction)?;
            let (key, direction) = (place.key.clone(), place.tangent[bounded.direction]);
            let interval = bounded.interval;
            (!interval.contains(value)).then_some(OutOfBounds { key, direction, value, interval })
        })
    }
}
