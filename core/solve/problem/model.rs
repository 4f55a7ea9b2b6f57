//! The columnar side of a problem: variables, factors, weights and the estimate.
use manifactor_graph::batch::{Batch, Evaluation, FactorRows, FactorState};
use manifactor_graph::column::Columns;
use manifactor_graph::normal_equations::NormalEquations;
use manifactor_graph::{Key, Noise, Values, VariableIndices};
use std::borrow::Cow;
use std::sync::Arc;

/// A variable in a problem.
#[derive(Debug, Clone)]
pub(crate) struct ProblemVariable {
    pub key: Key,
    /// Its column, and its index in the column.
    pub column: usize,
    pub index: usize,
    pub tangent: &'static [&'static str],
    /// Its start in the linear system; `None` for a fixed variable.
    pub start: Option<usize>,
    /// One bit per tangent direction, set if the direction is fixed.
    pub held: u32,
}

impl ProblemVariable {
    /// Returns the scalar unknown of each tangent direction; `None` for a fixed one.
    pub(crate) fn unknowns(&self) -> impl Iterator<Item = Option<usize>> {
        let free = |d: usize| self.start.filter(|_| self.held >> d & 1 == 0).map(|start| start + d);
        (0..self.tangent.len()).map(free)
    }
}

/// A factor in a problem.
#[derive(Debug, Clone)]
pub(crate) struct ProblemFactor {
    pub variables: VariableIndices,
    /// Name of its type, and its own name if it has one.
    pub name: &'static str,
    pub own_name: Option<Arc<str>>,
    /// Rows of its residual, and the number of observed rows.
    pub all_rows: u32,
    pub rows: u32,
    /// Whether its residual has to be zero.
    pub is_constraint: bool,
    /// Its batch, and its index in the batch.
    pub batch: u32,
    pub index: u32,
}

impl ProblemFactor {
    /// Returns the label in reports.
    pub(crate) fn label(&self) -> Cow<'static, str> {
        self.own_name.as_ref().map_or(Cow::Borrowed(self.name), |name| Cow::Owned((**name).to_owned()))
    }
    /// Counts the rows that are observed with this noise.
    pub(crate) fn observe(&mut self, noise: &Noise) {
        self.rows = noise.observed().map_or(self.all_rows, |all| all.iter().filter(|o| **o).count() as u32);
    }
}

/// Variables in columns and factors in batches, by type.
pub(crate) struct Model {
    pub variables: Vec<ProblemVariable>,
    pub factors: Vec<ProblemFactor>,
    /// The weight of each factor; empty if none was set.
    weights: Vec<f64>,
    /// The estimate, and memory for a trial step.
    columns: Columns,
    trial: Columns,
    /// For each column, the start of each variable in the linear system.
    starts: Vec<Vec<u32>>,
    pub batches: Vec<Box<dyn Batch>>,
    /// Counts changes of the estimate, of weights and of measurements, to detect outdated results.
    revision: u64,
}

impl Model {
    pub(crate) fn new(
        variables: Vec<ProblemVariable>,
        factors: Vec<ProblemFactor>,
        columns: Columns,
        starts: Vec<Vec<u32>>,
        batches: Vec<Box<dyn Batch>>,
    ) -> Self {
        let trial = columns.clone();
        Self { variables, factors, weights: vec![], columns, trial, starts, batches, revision: 0 }
    }

    pub(crate) fn revision(&self) -> u64 {
        self.revision
    }

    /// Returns the batches for modification.
    pub(crate) fn batches_mut(&mut self) -> &mut [Box<dyn Batch>] {
        self.revision += 1;
        &mut self.batches
    }

    pub(crate) fn columns(&self) -> &Columns {
        &self.columns
    }

    pub(crate) fn trial(&self) -> &Columns {
        &self.trial
    }

    pub(crate) fn place(&self, key: &str) -> Option<&ProblemVariable> {
        self.variables.iter().find(|place| place.key.as_str() == key)
    }

    /// Returns the variables of a factor.
    pub(crate) fn keys(&self, factor: usize) -> Vec<Key> {
        let variables = self.factors.get(factor).into_iter().flat_map(|place| &place.variables);
        variables.map(|v| self.variables[*v as usize].key.clone()).collect()
    }

    /// Returns the estimate, in the order of the values at compilation.
    pub(crate) fn values(&self) -> Values {
        let mut values = Values::new();
        for place in &self.variables {
            if let Some(value) = self.columns.column(place.column).get(place.index) {
                values.insert_boxed(place.key.clone(), value);
            }
        }
        values
    }

    /// Sets the estimate to values that are known to fit. Variables without a value keep theirs.
    pub(crate) fn set_values(&mut self, values: &Values) {
        self.revision += 1;
        for place in &self.variables {
            if let Some(value) = values.variable(place.key.as_str()) {
                self.columns.column_mut(place.column).set(place.index, value);
            }
        }
    }

    /// Returns whether the estimate equals these values, so that results for it are still valid.
    pub(crate) fn is_at(&self, values: &Values) -> bool {
        self.variables.iter().all(|place| {
            let here = self.columns.column(place.column).get(place.index);
            let (Some(here), Some(there)) = (here, values.variable(place.key.as_str())) else { return false };
            here.erased().local(there).is_some_and(|step| step.iter().all(|x| *x == 0.0))
        })
    }

    /// Restores an earlier estimate.
    pub(crate) fn restore(&mut self, columns: Columns) {
        self.revision += 1;
        self.columns = columns;
    }

    pub(crate) fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// Sets weights that are known to fit. A factor without one gets weight 1.
    pub(crate) fn set_weights(&mut self, weights: &[f64]) {
        self.revision += 1;
        self.weights.clear();
        self.weights.extend_from_slice(weights);
        self.weights.resize(self.factors.len(), 1.0);
        self.batches.iter_mut().for_each(|b| b.set_weights(&self.weights));
    }

    /// Scales and shifts the whitened residual of a factor; see [`Batch::augment`].
    pub(crate) fn augment(&mut self, factor: usize, scale: f64, shift: &[f64]) {
        let (batch, index) = (self.factors[factor].batch as usize, self.factors[factor].index as usize);
        self.batches_mut()[batch].augment(index, scale, shift);
    }

    /// Adds all factors to H and g, and decides which of them are active.
    pub(crate) fn linearize(&mut self, to: &mut NormalEquations<'_>) -> Evaluation {
        let columns = &self.columns;
        self.batches.iter_mut().fold(Evaluation::default(), |total, b| total.merge(b.linearize(columns, to)))
    }

    /// Evaluates the cost at the estimate, over the factors that were active at the last linearization.
    pub(crate) fn cost(&self) -> Evaluation {
        self.cost_at(&self.columns)
    }

    fn cost_at(&self, columns: &Columns) -> Evaluation {
        self.batches.iter().map(|b| b.cost(columns)).fold(Evaluation::default(), Evaluation::merge)
    }

    /// Sets the trial to `estimate ⊞ step`.
    pub(crate) fn retract(&mut self, step: &[f64]) {
        for (i, starts) in self.starts.iter().enumerate() {
            self.trial.column_mut(i).retract_from(self.columns.column(i), starts, step);
        }
    }

    /// Moves the trial of a variable along one direction.
    pub(crate) fn move_trial(&mut self, variable: usize, direction: usize, by: f64) {
        let place = &self.variables[variable];
        let mut step = vec![0.0; place.tangent.len()];
        step[direction] = by;
        let column = self.trial.column_mut(place.column);
        if let Some(moved) = column.get(place.index).and_then(|value| value.erased().retract(&step)) {
            column.set(place.index, &*moved);
        }
    }

    /// Evaluates the cost at the trial; see [`cost`](Self::cost).
    pub(crate) fn trial_cost(&self) -> Evaluation {
        self.cost_at(&self.trial)
    }

    /// Makes the trial the estimate.
    pub(crate) fn accept(&mut self) {
        self.revision += 1;
        std::mem::swap(&mut self.columns, &mut self.trial);
    }

    /// Computes ½ρ of each factor at the estimate, without its weight; zero if it is undefined.
    pub(crate) fn factor_costs(&self, costs: &mut Vec<f64>) {
        self.factor_costs_at(&self.columns, costs);
    }

    /// Computes ½ρ of each factor at `estimate ⊞ step`, which becomes the trial.
    pub(crate) fn factor_costs_beside(&mut self, step: &[f64], costs: &mut Vec<f64>) {
        self.retract(step);
        self.factor_costs_at(&self.trial, costs);
    }

    fn factor_costs_at(&self, columns: &Columns, costs: &mut Vec<f64>) {
        costs.resize(self.factors.len(), 0.0);
        self.batches.iter().for_each(|b| b.costs(columns, costs));
    }

    /// Returns the state of each factor at the estimate, in the order of the graph.
    pub(crate) fn inspect(&self) -> Vec<FactorState> {
        let mut all: Vec<_> = self.batches.iter().flat_map(|b| b.inspect(&self.columns)).collect();
        all.sort_by_key(|f| f.entry);
        all
    }

    /// Visits the rows of the whitened and weighted Jacobian at the estimate, batch by batch.
    pub(crate) fn rows(&self, visit: &mut dyn FnMut(FactorRows<'_>)) {
        self.batches.iter().for_each(|b| b.rows(&self.columns, visit));
    }

    /// Returns the factor with a residual or a derivative that is not finite; if all are finite, the factor
    /// with the largest one. Visits the rows of all factors, so it is for failed solves only.
    pub(crate) fn not_finite_factor(&self) -> usize {
        let (mut factor, mut largest) = (0, f64::NEG_INFINITY);
        self.rows(&mut |rows| {
            let size = size(&rows);
            if size > largest {
                (factor, largest) = (rows.entry, size);
            }
        });
        factor
    }
}

/// Returns the largest entry of a factor's rows; infinite if an entry is NaN.
fn size(rows: &FactorRows<'_>) -> f64 {
    let entries = rows.residual.iter().chain(rows.blocks.iter().flat_map(|(_, block)| block));
    entries.fold(0.0, |most, x| if x.is_nan() { f64::INFINITY } else { f64::max(most, x.abs()) })
}
