//! After any sequence of insertions and removals, the estimate equals the estimate of a graph that is built
//! at once.
use crate::toy::{Apart, At, Centre, Distance, Plane};
use crate::world::{Beyond, Near, Shadow, Space};
use manifactor_graph::checked::NotNegative;
use manifactor_graph::loss::Huber;
use manifactor_graph::{Fixed, Graph, Key, Noise, TypeName, Values, Variable};
use manifactor_smoother::{
    ChangeError, FactorId, Outliers, Smoother, SmootherSettings, Span, UpdateReport, Window,
};
use manifactor_solve::{GaussNewton, Silent};
use proptest::prelude::*;
use std::num::NonZeroUsize;

#[derive(Debug, Clone)]
pub(crate) enum Change {
    Plane,
    Space,
    Pair(usize, usize),
    Triple(usize, usize, usize),
    Prior(usize),
    Remove(usize),
    SetWeight(usize, f64),
    Replace(usize),
    Fix(usize, u32),
    Move(usize),
    Update,
}

pub(crate) fn change() -> impl Strategy<Value = Change> {
    let n = 0..64usize;
    prop_oneof![
        2 => Just(Change::Plane),
        2 => Just(Change::Space),
        6 => (n.clone(), n.clone()).prop_map(|(a, b)| Change::Pair(a, b)),
        1 => (n.clone(), n.clone(), n.clone()).prop_map(|(a, b, c)| Change::Triple(a, b, c)),
        2 => n.clone().prop_map(Change::Prior),
        2 => n.clone().prop_map(Change::Remove),
        1 => (n.clone(), prop_oneof![Just(0.0), 0.1..3.0]).prop_map(|(f, w)| Change::SetWeight(f, w)),
        1 => n.clone().prop_map(Change::Replace),
        1 => (n.clone(), 0..8u32).prop_map(|(v, bits)| Change::Fix(v, bits)),
        1 => n.prop_map(Change::Move),
        4 => Just(Change::Update),
    ]
}

pub(crate) fn window() -> impl Strategy<Value = Window> {
    let keep = prop_oneof![Just(vec![]), Just(vec![TypeName::new("toy_space").unwrap()])];
    (1..6usize, keep).prop_map(|(poses, keep)| Window {
        span: Span::Poses(NonZeroUsize::new(poses).unwrap()),
        keep,
        keep_keys: vec![],
    })
}

pub(crate) fn outliers() -> impl Strategy<Value = Option<Outliers>> {
    prop_oneof![Just(None), Just(Some(Outliers::default()))]
}

/// Accepts the rejection of a change to a marginalized variable or factor, and no other error.
pub(crate) fn allowed<T: Default>(result: Result<T, ChangeError>) -> T {
    match result {
        Err(
            ChangeError::Marginalized { .. }
            | ChangeError::MarginalizedFactor { .. }
            | ChangeError::FixedLinearization { .. },
        ) => T::default(),
        result => result.unwrap(),
    }
}

/// A smoother with its keys and factor ids.
pub(crate) struct History {
    pub(crate) smoother: Smoother,
    pub(crate) keys: Vec<Key>,
    pub(crate) ids: Vec<FactorId>,
    count: usize,
}

impl History {
    pub(crate) fn new(settings: SmootherSettings) -> Self {
        Self { smoother: Smoother::new(settings), keys: vec![], ids: vec![], count: 0 }
    }

    fn is_plane(&self, v: usize) -> bool {
        self.keys[v].as_str().starts_with('p')
    }

    /// Returns a number that differs from factor to factor.
    fn number(&mut self) -> f64 {
        self.count += 1;
        (self.count as f64 * 0.7).sin()
    }

    fn push(&mut self, graph: &Graph, values: &Values) {
        self.ids.extend(allowed(self.smoother.push(graph, values)));
    }

    fn variable(&mut self, is_plane: bool) {
        let (mut graph, mut values, x) = (Graph::new(), Values::new(), self.number());
        let key = Key::indexed(if is_plane { "p" } else { "s" }, self.keys.len());
        if is_plane {
            values.insert(key.clone(), Plane { x, y: 1.0 - x });
            graph.add([key.clone()], At { at: [2.0 * x, x] }).noise(Noise::sigma(3.0).unwrap());
        } else {
            values.insert(key.clone(), Space { at: [x, 0.0, -x] });
            graph.add([key.clone()], Near { at: [x, x, x] }).noise(Noise::sigma(4.0).unwrap());
        }
        self.push(&graph, &values);
        self.keys.push(key);
    }

    fn pair(&mut self, a: usize, b: usize) -> Graph {
        let (mut graph, x) = (Graph::new(), self.number());
        let keys = [self.keys[a].clone(), self.keys[b].clone()];
        let noise = Noise::sigma(0.5 + x.abs()).unwrap();
        match (self.is_plane(a), self.is_plane(b)) {
            (true, true) if self.count.is_multiple_of(3) => {
                graph.add(keys, Distance { by: 1.0 + x }).loss(Huber::default())
            }
            (true, true) => graph.add(keys, Apart { by: [x, 1.0] }).noise(noise),
            (true, false) => graph.add(keys, Shadow { by: [x, 0.3] }).noise(noise),
            (false, true) => {
                let [a, b] = keys;
                graph.add([b, a], Shadow { by: [0.2, x] })
            }
            (false, false) => graph.add(keys, Beyond { by: [x, -x, 0.5] }).noise(noise),
        };
        graph
    }

    /// Returns this history with a different smoother.
    pub(crate) fn with(&self, smoother: Smoother) -> Self {
        Self { smoother, keys: self.keys.clone(), ids: self.ids.clone(), count: self.count }
    }

    /// Returns the keys of the present variables.
    pub(crate) fn present(&self) -> Vec<&str> {
        self.keys.iter().map(Key::as_str).filter(|key| self.smoother.estimate(key).is_some()).collect()
    }

    pub(crate) fn apply_all(&mut self, changes: &[Change]) -> Vec<UpdateReport> {
        changes.iter().filter_map(|change| self.apply(change)).collect()
    }

    /// Applies a change. Returns the report of an update.
    pub(crate) fn apply(&mut self, change: &Change) -> Option<UpdateReport> {
        let (n, m) = (self.keys.len(), self.ids.len());
        match *change {
            Change::Plane => self.variable(true),
            Change::Space => self.variable(false),
            Change::Pair(a, b) if n > 1 && a % n != b % n => {
                let graph = self.pair(a % n, b % n);
                self.push(&graph, &Values::new());
            }
            Change::Triple(a, b, c) => {
                let planes: Vec<usize> = (0..n).filter(|v| self.is_plane(*v)).collect();
                let k = (planes.len() > 2).then_some(planes.len())?;
                let mut chosen = vec![planes[a % k], planes[b % k], planes[c % k]];
                chosen.dedup();
                if chosen.first() == chosen.last() {
                    return None;
                }
                let (mut graph, x) = (Graph::new(), self.number());
                graph.add(chosen.iter().map(|v| self.keys[*v].clone()), Centre { at: [x, -x] });
                self.push(&graph, &Values::new());
            }
            Change::Prior(v) if n > 0 => {
                let (mut graph, x) = (Graph::new(), self.number());
                match self.is_plane(v % n) {
                    true => graph.add([self.keys[v % n].clone()], At { at: [x, x] }),
                    false => graph.add([self.keys[v % n].clone()], Near { at: [0.0, x, x] }),
                };
                self.push(&graph, &Values::new());
            }
            Change::Remove(f) if m > 0 => {
                let id = self.ids.swap_remove(f % m);
                allowed(self.smoother.remove(&[id]));
            }
            Change::SetWeight(f, weight) if m > 0 => {
                allowed(self.smoother.set_weight(self.ids[f % m], weight));
            }
            Change::Replace(f) if m > 0 => {
                let mut entry = self.smoother.entry(self.ids[f % m])?.clone();
                let observed = entry.factor.erased().signature().rows.unwrap();
                entry.noise(Noise::sigmas(&vec![0.7; observed]).unwrap());
                self.smoother.replace(self.ids[f % m], entry).unwrap();
            }
            Change::Fix(v, bits) if n > 0 => {
                let tangent = if self.is_plane(v % n) { &["x", "y"][..] } else { &["x", "y", "z"] };
                let named = tangent.iter().enumerate().filter(|(d, _)| bits >> d & 1 == 1);
                let names: Vec<String> = named.map(|(_, name)| (*name).to_owned()).collect();
                let key = self.keys[v % n].clone();
                allowed(self.smoother.fix(&key, &Fixed::Directions(names)));
            }
            Change::Move(v) if n > 0 => {
                let x = self.number();
                let moved = match self.is_plane(v % n) {
                    true => self.smoother.move_to(self.keys[v % n].as_str(), &Plane { x, y: 2.0 * x }),
                    false => self.smoother.move_to(self.keys[v % n].as_str(), &Space { at: [x, 1.0, x] }),
                };
                allowed(moved);
            }
            Change::Update => return Some(self.smoother.update().unwrap()),
            _ => {}
        }
        None
    }
}

/// Returns the bits of all estimates.
pub(crate) fn bits(smoother: &Smoother) -> Vec<(Key, Vec<u64>)> {
    let numbers = |value: &dyn Variable| -> Vec<f64> {
        let (plane, space) = (Plane { x: 0.0, y: 0.0 }, Space { at: [0.0; 3] });
        plane.erased().local(value).or_else(|| space.erased().local(value)).unwrap()
    };
    let bits = |value| numbers(value).into_iter().map(f64::to_bits).collect();
    smoother.estimates().iter().map(|(key, value)| (key.clone(), bits(value))).collect()
}

fn difference(a: &Values, b: &Values) -> f64 {
    let steps = a.iter().map(|(key, x)| x.erased().local(b.variable(key.as_str()).unwrap()).unwrap());
    steps
        .flatten()
        .fold(0.0, |most, step| if step.is_nan() { f64::INFINITY } else { f64::max(most, step.abs()) })
}

/// Everything is relinearized, and every change is propagated: updates are Gauss-Newton steps.
fn exact() -> SmootherSettings {
    SmootherSettings {
        relinearize_every: NonZeroUsize::MIN,
        relinearization_threshold: NotNegative::literal(0.0),
        wildfire_threshold: NotNegative::literal(0.0),
        passes: 0,
        ..SmootherSettings::default()
    }
}

proptest! {
    #![proptest_config(ProptestConfig::default())]
    #[test]
    fn any_history_ends_where_a_fresh_build_does(changes in prop::collection::vec(change(), 1..60), outliers in outliers()) {
        let mut history = History::new(SmootherSettings { outliers, ..exact() });
        history.apply_all(&changes);
        let mut report = history.smoother.update().unwrap();
        let mut quiet = 0;
        for _ in 0..20 {
            report = history.smoother.update().unwrap();
            quiet = if report.damped + report.halved == 0 && !report.solved_batch { quiet + 1 } else { 0 };
        }
        // a few updates after the last change, no step is damped
        prop_assume!(report.undetermined_directions.is_empty() && quiet > 8);
        let (graph, _) = history.smoother.graph();
        let mut values = history.smoother.estimates();
        for key in &report.undetermined_variables {
            values.remove(key.as_str());
        }
        prop_assume!(!values.is_empty());
        // push the factors at once into a new smoother at the current estimate: both take equal steps from
        // there
        let mut fresh = Smoother::new(exact());
        let ids = fresh.push(&graph, &values).unwrap();
        for (id, old) in ids.iter().zip(history.smoother.graph().1) {
            fresh.set_weight(*id, history.smoother.weight(old).unwrap()).unwrap();
        }
        let anew = fresh.update().unwrap();
        prop_assert!(anew.undetermined_directions.is_empty() && anew.undetermined_variables.is_empty());
        let last = history.smoother.update().unwrap();
        // rounding can decide whether a step is damped, or whether a factor at the limit fits
        prop_assume!(last.damped + last.halved + anew.damped + anew.halved == 0 && !last.solved_batch);
        prop_assume!(last.rejected.is_empty() && last.readmitted.is_empty());
        let now = history.smoother.estimates();
        let apart = difference(&fresh.estimates(), &now);
        // Gauss-Newton may take long steps on ranges
        let far = 1.0 + difference(&values, &now);
        prop_assert!(apart < 1e-10 * far, "{apart} of {far}");
        // at a fixed point of Gauss-Newton, a batch solver does not move
        if difference(&values, &now) < 1e-9 && let Ok(finished) = history.smoother.finish(&GaussNewton::default(), &mut Silent) {
            prop_assert!(difference(&now, &finished.values) < 1e-6);
        }
        let keys: Vec<&str> = values.iter().map(|(key, _)| key.as_str()).collect();
        let (one, other) = (history.smoother.covariance(&keys).unwrap(), fresh.covariance(&keys).unwrap());
        prop_assert!((&one - &other).amax() <= 1e-10 * one.amax().max(1.0), "{}", (&one - &other).amax());
    }
}
