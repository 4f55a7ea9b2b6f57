//! Which sightings of a pose are of which landmarks: the cheapest hypothesis of all of them together, by branch and bound.
use crate::session::{Given, Innovation};

/// A sighting, taken for one of a landmark.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hypothesis {
    /// The landmark's place in the list of all.
    pub(super) landmark: usize,
    /// The factor's place in the innovation.
    pub(super) factor: usize,
}

/// What a sighting is of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Choice {
    /// A landmark that is known, by its place in the list.
    Landmark(usize),
    New,
    /// More than one of these are nearly as likely.
    Unclear,
}

/// Steps of the search, at most. Beyond them the cheapest hypothesis that was found counts, and sightings that have a choice are unclear.
const NODES: usize = 20_000;

/// Finds the cheapest hypothesis: each sighting is of one of its `options` or new, at a cost of `new`, and no two are of one landmark.
/// What is not cheaper by `slack` than with another choice is unclear.
pub(super) fn choose(
    innovation: &Innovation,
    options: &[Vec<Hypothesis>],
    new: f64,
    slack: f64,
) -> Vec<Choice> {
    // what leaves least to choose comes first
    let mut order: Vec<usize> = (0..options.len()).collect();
    order.sort_by_key(|i| options[*i].len());
    let least = |i: &usize| {
        let volumes = options[*i].iter().map(|option| innovation.least_cost(option.factor));
        volumes.fold(new, f64::min)
    };
    let mut left: Vec<f64> = vec![0.0];
    left.extend(order.iter().rev().map(least).scan(0.0, |sum, cost| {
        *sum += cost;
        Some(*sum)
    }));
    left.reverse();
    let mut search = Search {
        options,
        order,
        left,
        new,
        slack,
        given: Given::nothing(innovation),
        chosen: vec![],
        taken: vec![],
        nodes: 0,
        best: f64::INFINITY,
        choice: vec![],
        costs: options.iter().map(|options| vec![f64::INFINITY; options.len() + 1]).collect(),
    };
    search.descend(0.0);
    search.choices()
}

struct Search<'a> {
    options: &'a [Vec<Hypothesis>],
    order: Vec<usize>,
    /// What the sightings from one on cost at least.
    left: Vec<f64>,
    new: f64,
    slack: f64,
    given: Given<'a>,
    /// By sighting in order, which option; `None` where it is new.
    chosen: Vec<Option<usize>>,
    taken: Vec<usize>,
    nodes: usize,
    best: f64,
    choice: Vec<Option<usize>>,
    /// By sighting and option, new ones last: the cheapest hypothesis of all that has it.
    costs: Vec<Vec<f64>>,
}

impl Search<'_> {
    fn descend(&mut self, cost: f64) {
        let depth = self.chosen.len();
        let is_over = self.nodes >= NODES && self.best.is_finite();
        if is_over || cost + self.left[depth] > self.best + self.slack {
            return;
        }
        let Some(&sighting) = self.order.get(depth) else { return self.note(cost) };
        self.nodes += 1;
        let options = &self.options[sighting];
        let mut next = vec![(self.new, None)];
        for (o, option) in options.iter().enumerate().filter(|(_, o)| !self.taken.contains(&o.landmark)) {
            next.push((self.given.push(option.factor).cost(), Some(o)));
            self.given.pop();
        }
        next.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (more, option) in next {
            if let Some(o) = option {
                self.given.push(options[o].factor);
                self.taken.push(options[o].landmark);
            }
            self.chosen.push(option);
            self.descend(cost + more);
            self.chosen.pop();
            if option.is_some() {
                self.taken.pop();
                self.given.pop();
            }
        }
    }

    fn note(&mut self, cost: f64) {
        for (sighting, option) in self.order.iter().zip(&self.chosen) {
            let costs = &mut self.costs[*sighting];
            let o = option.unwrap_or(costs.len() - 1);
            costs[o] = costs[o].min(cost);
        }
        if cost < self.best {
            self.best = cost;
            self.choice.clone_from(&self.chosen);
        }
    }

    fn choices(&self) -> Vec<Choice> {
        let mut choices = vec![Choice::Unclear; self.options.len()];
        for (&sighting, option) in self.order.iter().zip(&self.choice) {
            let (options, costs) = (&self.options[sighting], &self.costs[sighting]);
            let chosen = option.unwrap_or(options.len());
            let others = costs.iter().enumerate().filter(|(o, _)| *o != chosen).map(|(_, cost)| *cost);
            let has_choice = self.nodes >= NODES && !options.is_empty() && self.slack > 0.0;
            if !has_choice && others.fold(f64::INFINITY, f64::min) >= self.best + self.slack {
                choices[sighting] = option.map_or(Choice::New, |o| Choice::Landmark(options[o].landmark));
            }
        }
        choices
    }
}
