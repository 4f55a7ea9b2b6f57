//! A pose graph as a robot would have built it: pose by pose, each with the factors to what was there before it.
//!
//! Steps are the variables `x<number>`, by number. A factor belongs to the step of its latest pose; anything else, a landmark
//! say, comes with the first factor that reaches it from what is known. Factors that nothing known reaches wait; with the
//! last step come those that nothing will reach, a part of the graph that hangs together with no other.
use manifactor_geometry::{Tree, spanning_tree};
use manifactor_graph::{FactorEntry, Graph, Key, ValueError, Values, Variable};
use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet, VecDeque};

/// A graph, step by step.
#[derive(Debug, Clone)]
pub struct Replay {
    steps: VecDeque<Vec<FactorEntry>>,
    waiting: Waiting,
    known: HashSet<Key>,
    /// What is held, and has not been told yet.
    fixed: Graph,
    /// Initial values of the whole graph.
    initial: Values,
}

/// What one step brings: factors, and the first values of their new variables.
#[derive(Debug, Clone, Default)]
pub struct Step {
    /// New factors; what the whole graph holds of the new variables is held.
    pub factors: Graph,
    /// By new variable: its initial value if it is held, else where odometry leads from the estimate of known variables, else
    /// its initial value.
    pub values: Values,
}

/// If several factors connect the same variables, puts the one first that fits the initial values best: the others may be wrong
/// closures.
fn best_first(factors: &mut [FactorEntry], initial: &Values) {
    let misfit = |entry: &FactorEntry| {
        let point = |key: &Key| Some(initial.variable(key.as_str())?.erased().clone_box());
        entry.squared(point).unwrap_or(f64::INFINITY)
    };
    let mut first: HashMap<Vec<Key>, usize> = HashMap::new();
    for i in 0..factors.len() {
        let Some(entry) = factors.get(i).filter(|entry| entry.keys.len() > 1) else { continue };
        let mut keys = entry.keys.clone();
        keys.sort_unstable();
        let before = *first.entry(keys).or_insert(i);
        if before != i && factors.get(before).is_some_and(|other| misfit(entry) < misfit(other)) {
            factors.swap(before, i);
        }
    }
}

/// The number of a pose's key.
fn number(key: &Key) -> Option<u64> {
    key.as_str().strip_prefix('x')?.parse().ok()
}

impl Replay {
    /// The steps of a graph with these initial values; none, where it has no poses.
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
        // the odometry first: a pose starts from the one before it
        for factors in steps.values_mut() {
            factors.sort_by_key(|entry| Reverse(poses(entry).into_iter().min()));
            best_first(factors, initial);
        }
        let mut fixed = Graph::new();
        graph.fixed().iter().for_each(|(key, held)| fixed.set_fixed(key, held.clone()));
        Self {
            steps: steps.into_values().collect(),
            waiting: Waiting::default(),
            known: HashSet::new(),
            fixed,
            initial: initial.clone(),
        }
    }

    /// Steps that are left.
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Returns whether no step is left.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// The next step, `None` after the last. New variables start from where `estimate` has those that are known.
    ///
    /// # Errors
    /// If a factor takes a variable for another type than its estimate has.
    pub fn step(
        &mut self,
        estimate: impl Fn(&str) -> Option<Box<dyn Variable>>,
    ) -> Result<Option<Step>, ValueError> {
        let Some(new) = self.steps.pop_front() else { return Ok(None) };
        new.into_iter().for_each(|entry| self.waiting.push(entry, &self.known));
        let (factors, keys) = self.reach();
        let mut values = Values::new();
        let mut step = Step::default();
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
        // the first pose of all is where the file has it: other factors may say where in the world that is
        let first =
            keys.iter().find(|key| number(key).is_some()).filter(|_| values.is_empty() && held.is_empty());
        for key in held.into_iter().chain(first) {
            if let Some(value) = self.initial.variable(key.as_str()) {
                values.insert_boxed(key.clone(), value.erased().clone_box());
            }
        }
        let placed = spanning_tree(&graph, &values, Tree::Chain)?;
        for key in keys {
            if let Some(held) = self.fixed.fixed().get(&key) {
                graph.set_fixed(&key, held.clone());
            }
            if let Some(value) = placed.variable(key.as_str()).or_else(|| self.initial.variable(key.as_str()))
            {
                step.values.insert_boxed(key, value.erased().clone_box());
            }
        }
        step.factors = graph;
        Ok(Some(step))
    }

    /// Takes out the waiting factors that what is known reaches, one over the other; and the variables that are new with
    /// them, in order. The very first are reached from nothing, and so is what is left at the end.
    fn reach(&mut self) -> (Vec<FactorEntry>, Vec<Key>) {
        let (mut factors, mut keys) = (vec![], vec![]);
        while let Some(entry) = self.waiting.next(self.known.is_empty() || self.steps.is_empty()) {
            for key in &entry.keys {
                if self.known.insert(key.clone()) {
                    keys.push(key.clone());
                    self.waiting.tell(key);
                }
            }
            factors.push(entry);
        }
        (factors, keys)
    }
}

/// Factors that have come, but are not out: the first that something known reaches is the next.
#[derive(Debug, Clone, Default)]
struct Waiting {
    /// By number, in the order in which they came.
    factors: BTreeMap<usize, FactorEntry>,
    reached: BTreeSet<usize>,
    /// By variable that is not known: the factors that wait for it.
    by_key: HashMap<Key, Vec<usize>>,
    numbers: usize,
}

impl Waiting {
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

    /// Says that a variable is known now.
    fn tell(&mut self, key: &Key) {
        let factors = self.by_key.remove(key).unwrap_or_default();
        self.reached.extend(factors.into_iter().filter(|number| self.factors.contains_key(number)));
    }

    /// Takes out the first factor that is reached; or else the first of all, if it need not be reached.
    fn next(&mut self, unreached: bool) -> Option<FactorEntry> {
        let first = || self.factors.keys().next().copied().filter(|_| unreached);
        let number = self.reached.first().copied().or_else(first)?;
        self.reached.remove(&number);
        self.factors.remove(&number)
    }
}

/// How long steps took, in seconds.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Latencies {
    /// All of them together.
    pub total: f64,
    /// Half of them took at most this.
    pub p50: f64,
    /// 99 of 100 took at most this.
    pub p99: f64,
    /// The longest.
    pub max: f64,
}

impl Latencies {
    /// Of steps in any order; zeros, where there is none.
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
        let (mut replay, mut known) = (Replay::of(&graph, &initial), Values::new());
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
        // pose 3 is tied to what is known by pose 5 alone, and landmark m by pose 3
        [("x0", "x1"), ("x1", "x2"), ("x3", "m"), ("m", "x4"), ("x2", "x5"), ("x4", "x5")]
            .into_iter()
            .for_each(|(a, b)| link(a, b));
        let mut replay = Replay::of(&graph, &Values::new());
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
