//! Replay of a pose graph in the order in which a robot would have built it: pose by pose, each with the
//! factors to earlier variables.
//!
//! Steps are the variables `x<number>`, in numeric order. A factor belongs to the step of its latest pose.
//! Other variables, such as landmarks, are added with the first factor that connects them to a known
//! variable. Factors without a known variable wait. The last step adds all factors that never become
//! reachable: parts of the graph that are not connected to the rest.
use manifactor_geometry::{Tree, spanning_tree};
use manifactor_graph::{FactorEntry, Graph, Key, ValueError, Values, Variable};
use manifactor_solve::odometry::{best_fit, by_variables};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet, VecDeque};

/// A graph, step by step.
#[derive(Debug, Clone)]
pub struct GraphReplay {
    steps: VecDeque<Vec<FactorEntry>>,
    waiting: WaitingFactors,
    known: HashSet<Key>,
    /// Held variables that no step has returned yet.
    fixed: Graph,
    /// Initial values of the whole graph.
    initial: Values,
}

/// The content of one step: factors, and the initial values of their new variables.
#[derive(Debug, Clone, Default)]
pub struct ReplayStep {
    /// New factors. New variables that the whole graph holds are held here too.
    pub factors: Graph,
    /// Initial values of the new variables. A held variable has its value in the file. Any other variable is
    /// placed by odometry from the estimate of known variables, or has its value in the file if that is not
    /// possible.
    pub values: Values,
}

/// Sorts factors between the same variables: the one with the best fit to the initial values comes first, as
/// the remaining ones may be false loop closures.
fn best_first(factors: &mut [FactorEntry], initial: &Values) {
    let point = |key: &Key| Some(initial.variable(key.as_str())?.erased().clone_box());
    let all = factors.iter().enumerate().map(|(i, entry)| (entry.keys.clone(), i));
    for parallel in by_variables(all).into_values().filter(|parallel| parallel.len() > 1) {
        let misfit =
            |i: &usize| factors.get(*i).and_then(|entry| entry.squared(point)).unwrap_or(f64::INFINITY);
        if let (Some(first), Some(best)) = (parallel.first(), best_fit(parallel.iter().copied(), misfit)) {
            factors.swap(*first, best);
        }
    }
}

/// Returns the number in a pose's key.
fn number(key: &Key) -> Option<u64> {
    key.as_str().strip_prefix('x')?.parse().ok()
}

impl GraphReplay {
    /// Splits a graph with these initial values into steps; there are none if it has no poses.
    pub fn of(graph: &Graph, initial: &Values) -> Self {
        let poses = |entry: &FactorEntry| entry.keys.iter().filter_map(number).collect::<Vec<_>>();
        let first = graph.factors().iter().flat_map(poses).min();
        let mut steps: BTreeMap<u64, Vec<FactorEntry>> = BTreeMap::new();
        for entry in graph.factors() {
            for pose in poses(entry) {
                steps.entry(pose).or_default();
            }
            let Some(latest) = poses(entry).into_iter().max().or(first) else { break };
            steps.entry(latest).or_default().push(entry.clone());
        }
        // Odometry first, as a pose is initialized from the previous one.
        for factors in steps.values_mut() {
            factors.sort_by_key(|entry| Reverse(poses(entry).into_iter().min()));
            best_first(factors, initial);
        }
        let mut fixed = Graph::new();
        fixed.hold_all_like(graph);
        Self {
            steps: steps.into_values().collect(),
            waiting: WaitingFactors::default(),
            known: HashSet::new(),
            fixed,
            initial: initial.clone(),
        }
    }

    /// Returns the number of remaining steps.
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Returns whether no step is left.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Returns the next step, `None` after the last. New variables are placed relative to the `estimate` of
    /// known ones.
    ///
    /// # Errors
    /// If a factor expects a variable of a different type than its estimate has.
    pub fn step(
        &mut self,
        estimate: impl Fn(&str) -> Option<Box<dyn Variable>>,
    ) -> Result<Option<ReplayStep>, ValueError> {
        let Some(new) = self.steps.pop_front() else { return Ok(None) };
        new.into_iter().for_each(|entry| self.waiting.push(entry, &self.known));
        let (factors, keys) = self.mark_reached();
        let mut values = Values::new();
        let mut step = ReplayStep::default();
        let mut graph = Graph::new();
        for entry in factors {
            graph.push(entry);
        }
        for key in graph.factors().iter().flat_map(|entry| &entry.keys) {
            if !keys.contains(key)
                && let Some(value) = estimate(key.as_str())
            {
                values.insert_boxed(key.clone(), value);
            }
        }
        let held: Vec<&Key> = keys.iter().filter(|key| self.fixed.fixed().contains_key(*key)).collect();
        // The first pose keeps its value in the file, as other factors may measure it in the world frame.
        let first =
            keys.iter().find(|key| number(key).is_some()).filter(|_| values.is_empty() && held.is_empty());
        for key in held.into_iter().chain(first) {
            if let Some(value) = self.initial.variable(key.as_str()) {
                values.insert_boxed(key.clone(), value.erased().clone_box());
            }
        }
        let placed = spanning_tree(&graph, &values, Tree::Chain)?;
        for key in keys {
            graph.hold_like(&self.fixed, &key);
            if let Some(value) = placed.variable(key.as_str()).or_else(|| self.initial.variable(key.as_str()))
            {
                step.values.insert_boxed(key, value.erased().clone_box());
            }
        }
        step.factors = graph;
        Ok(Some(step))
    }

    /// Removes and returns the waiting factors that are reachable from known variables, one after another,
    /// and the new variables in order. The first factor needs no known variable, nor do the remaining ones in
    /// the last step.
    fn mark_reached(&mut self) -> (Vec<FactorEntry>, Vec<Key>) {
        let (mut factors, mut keys) = (vec![], vec![]);
        while let Some(entry) = self.waiting.next(self.known.is_empty() || self.steps.is_empty()) {
            for key in &entry.keys {
                if self.known.insert(key.clone()) {
                    keys.push(key.clone());
                    self.waiting.mark_known(key);
                }
            }
            factors.push(entry);
        }
        (factors, keys)
    }
}

/// Factors that have arrived but were not returned yet. The first one with a known variable is next.
#[derive(Debug, Clone, Default)]
struct WaitingFactors {
    /// By number, in order of arrival.
    factors: BTreeMap<usize, FactorEntry>,
    reached: BTreeSet<usize>,
    /// For each unknown variable, the factors that wait for it.
    by_key: HashMap<Key, Vec<usize>>,
    numbers: usize,
}

impl WaitingFactors {
    fn push(&mut self, entry: FactorEntry, known: &HashSet<Key>) {
        let number = self.numbers;
        self.numbers += 1;
        if entry.keys.iter().any(|key| known.contains(key)) {
            self.reached.insert(number);
        } else {
            for key in &entry.keys {
                self.by_key.entry(key.clone()).or_default().push(number);
            }
        }
        self.factors.insert(number, entry);
    }

    /// Marks a variable as known.
    fn mark_known(&mut self, key: &Key) {
        let factors = self.by_key.remove(key).unwrap_or_default();
        self.reached.extend(factors.into_iter().filter(|number| self.factors.contains_key(number)));
    }

    /// Removes the first factor that is reached, otherwise the first of all if `unreached` allows it.
    fn next(&mut self, unreached: bool) -> Option<FactorEntry> {
        let first = || self.factors.keys().next().copied().filter(|_| unreached);
        let number = self.reached.first().copied().or_else(first)?;
        self.reached.remove(&number);
        self.factors.remove(&number)
    }
}

/// Durations of steps, in seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Latencies {
    /// Sum of all durations.
    pub total: f64,
    /// Median.
    pub p50: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Maximum.
    pub max: f64,
}

impl Latencies {
    /// Computes the statistics of durations in any order; zeros if there are none.
    pub fn of(seconds: &[f64]) -> Self {
        let mut sorted = seconds.to_vec();
        sorted.sort_unstable_by(f64::total_cmp);
        let at = |share: f64| {
            let place = (share * sorted.len().saturating_sub(1) as f64) as usize;
            sorted.get(place).copied().unwrap_or_default()
        };
        Self { total: seconds.iter().sum(), p50: at(0.5), p99: at(0.99), max: at(1.0) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::{Between, Point2, Range, Se2, So2};
    use manifactor_graph::checked::Positive;

    #[test]
    fn held_variables_and_those_without_odometry_start_at_their_initial_values() {
        let at = |x: f64| Se2::new(So2::identity(), [x, 0.0].into());
        let (mut graph, mut initial) = (Graph::new(), Values::new());
        for (key, x) in [("x0", 5.0), ("x1", 9.0), ("x2", 20.0)] {
            initial.insert(key, at(x));
        }
        initial.insert("l0", Point2::new([7.0, 8.0]));
        graph.add(["x0", "l0"], Range::<Se2, Point2>::new(Positive::literal(2.0)));
        graph.add(["x0", "x1"], Between { relative: at(1.0) });
        graph.add(["x1", "x2"], Between { relative: at(1.0) });
        graph.fix("x2");
        let (mut replay, mut known) = (GraphReplay::of(&graph, &initial), Values::new());
        while let Some(step) = replay.step(|key| known.variable(key).map(|v| v.erased().clone_box())).unwrap()
        {
            for (key, value) in step.values.iter() {
                known.insert_boxed(key.clone(), value.erased().clone_box());
            }
        }
        let x = |key: &str| known.get::<Se2>(key).unwrap().translation.x;
        assert_eq!([x("x0"), x("x1"), x("x2")], [5.0, 6.0, 20.0]);
        assert_eq!(known.get::<Point2>("l0").unwrap().0[1], 8.0);
    }

    #[test]
    fn factors_wait_until_something_known_reaches_them_and_come_in_their_order() {
        let mut graph = Graph::new();
        let mut link = |a: &str, b: &str| {
            graph.add([a, b], Between { relative: Se2::identity() });
        };
        // Pose 3 is connected to known variables only through pose 5, and landmark m only through pose 3.
        [("x0", "x1"), ("x1", "x2"), ("x3", "m"), ("m", "x4"), ("x2", "x5"), ("x4", "x5")]
            .into_iter()
            .for_each(|(a, b)| link(a, b));
        let mut replay = GraphReplay::of(&graph, &Values::new());
        let mut told: Vec<Vec<String>> = vec![];
        let mut known = Values::new();
        while let Some(step) = replay.step(|key| known.variable(key).map(|v| v.erased().clone_box())).unwrap()
        {
            let links = step.factors.factors().iter().map(|f| format!("{}-{}", f.keys[0], f.keys[1]));
            told.push(links.collect());
            for (key, value) in step.values.iter() {
                known.insert_boxed(key.clone(), value.erased().clone_box());
            }
        }
        assert_eq!(told[..5], [vec![], vec!["x0-x1".to_owned()], vec!["x1-x2".into()], vec![], vec![]]);
        assert_eq!(told[5], ["x2-x5", "x4-x5", "m-x4", "x3-m"].map(String::from));
        assert_eq!(known.len(), 7);
    }
}
