//! A compiled formula: calls over flat values.
use manifactor_graph::quantity::{Call, LANES, Lanes, VariableQuantity};
use manifactor_graph::{DynamicBlocks, DynamicResidual, Jet};
use std::any::{Any, TypeId};
use std::cell::RefCell;
use std::fmt;
use std::sync::Arc;

/// Compiled formulas: each call appends its result to the values before it. Cheap to clone.
///
/// Jacobians are computed by forward differentiation, [`LANES`] directions of a variable at a time. Values
/// that do not depend on the variable are computed once, over plain numbers. Factors that differ only in
/// constants share their code, so a thousand of them fit into the cache of a processor.
#[derive(Clone)]
pub struct Program {
    code: Arc<Code>,
    /// Initial values: constants, values computed from constants only, and space for all remaining values.
    values: Arc<[f64]>,
}

#[derive(Default)]
pub(crate) struct Code {
    pub types: Vec<TypeId>,
    pub dimensions: Vec<usize>,
    /// For each variable, its type and the index at which its flat form begins.
    pub inputs: Vec<(&'static VariableQuantity, usize)>,
    /// Indices of the named constants, in the order of their scope.
    pub constants: Vec<usize>,
    /// Calls with constant arguments only, evaluated once per set of constants.
    pub folded: Vec<Step>,
    pub calls: Vec<Step>,
    /// For each variable, the steps that differentiate with respect to it.
    pub passes: Vec<Pass>,
    /// Index of each row.
    pub rows: Vec<usize>,
    /// Indices of the numbers that must be positive.
    pub domain: Vec<usize>,
}

/// A single function call.
pub(crate) struct Step {
    pub numbers: Call<f64>,
    pub lanes: Call<Lanes>,
    pub at: Box<[u32]>,
    /// Index range of the result.
    pub to: std::ops::Range<usize>,
}

/// The steps that differentiate with respect to one variable.
#[derive(Default)]
pub(crate) struct Pass {
    /// Calls that depend on the variable.
    pub calls: Vec<usize>,
    /// Arguments of those calls that do not depend on the variable.
    pub lifted: Vec<usize>,
    /// Whether each row depends on the variable.
    pub rows: Vec<bool>,
}

/// Work space, one per thread, so that evaluation allocates nothing.
#[derive(Default)]
struct Workspace {
    numbers: Vec<f64>,
    lanes: Vec<Lanes>,
    gradients: Vec<f64>,
}

thread_local! {
    static WORKSPACE: RefCell<Workspace> = RefCell::default();
}

impl Step {
    /// Runs the call, and returns whether its result is finite.
    pub(crate) fn run(&self, values: &mut [f64]) -> bool {
        let (from, to) = values.split_at_mut(self.to.start);
        let to = &mut to[..self.to.len()];
        (self.numbers)(from, &self.at, to);
        to.iter().all(|x| x.is_finite())
    }
}

impl Program {
    pub(crate) fn new(code: Code, values: Vec<f64>) -> Self {
        Self { code: Arc::new(code), values: values.into() }
    }
    /// Returns the program with different constants of equal shapes; `None` if a value computed from them is
    /// not finite.
    pub(crate) fn with<'c>(&self, constants: impl Iterator<Item = &'c [f64]>) -> Option<Self> {
        let mut values = self.values.to_vec();
        for (at, flat) in self.code.constants.iter().zip(constants) {
            values[*at..at + flat.len()].copy_from_slice(flat);
        }
        let finite = self.code.folded.iter().all(|step| step.run(&mut values));
        finite.then(|| Self { code: self.code.clone(), values: values.into() })
    }
    /// Returns the number of calls.
    pub fn len(&self) -> usize {
        self.code.calls.len()
    }
    /// Returns whether the program computes nothing.
    pub fn is_empty(&self) -> bool {
        self.code.calls.is_empty()
    }
}

impl fmt::Debug for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Program({} calls)", self.len())
    }
}

impl Code {
    /// Computes all values over plain numbers.
    fn run(&self, values: &[f64], variables: &[&dyn Any], numbers: &mut Vec<f64>) {
        numbers.clear();
        numbers.extend_from_slice(values);
        for ((quantity, at), x) in self.inputs.iter().zip(variables) {
            (quantity.values)(*x, &mut numbers[*at..at + quantity.shape.size]);
        }
        for step in &self.calls {
            let (from, to) = numbers.split_at_mut(step.to.start);
            (step.numbers)(from, &step.at, &mut to[..step.to.len()]);
        }
    }

    /// Computes the Jacobian block of a variable, once all values are known.
    fn differentiate(&self, variable: usize, x: &dyn Any, room: &mut Workspace, block: &mut [f64]) {
        let Workspace { numbers, lanes, gradients } = room;
        let (pass, (quantity, at), rows) = (&self.passes[variable], self.inputs[variable], self.rows.len());
        let (size, dimension) = (quantity.shape.size, quantity.dimension);
        if lanes.len() < numbers.len() {
            lanes.resize(numbers.len(), Lanes::from(0.0));
        }
        // Lanes past the last direction are arbitrary and never read.
        gradients.resize(size * dimension + LANES, 0.0);
        (quantity.gradients)(x, &mut gradients[..size * dimension]);
        for slot in &pass.lifted {
            lanes[*slot] = Lanes::from(numbers[*slot]);
        }
        for first in (0..dimension).step_by(LANES) {
            for i in 0..size {
                let gradient = &gradients[i * dimension + first..][..LANES];
                lanes[at + i] = Lanes::with_gradient(numbers[at + i], gradient);
            }
            for step in pass.calls.iter().map(|call| &self.calls[*call]) {
                let (from, to) = lanes.split_at_mut(step.to.start);
                (step.lanes)(from, &step.at, &mut to[..step.to.len()]);
            }
            for (row, slot) in self.rows.iter().enumerate() {
                let gradient = if pass.rows[row] { lanes[*slot].gradient() } else { None };
                for lane in 0..LANES.min(dimension - first) {
                    block[row + (first + lane) * rows] = gradient.map_or(0.0, |g| g[lane]);
                }
            }
        }
    }
}

impl DynamicResidual for Program {
    fn rows(&self) -> usize {
        self.code.rows.len()
    }
    fn variables(&self) -> &[TypeId] {
        &self.code.types
    }
    fn dimensions(&self) -> &[usize] {
        &self.code.dimensions
    }
    fn is_defined(&self, variables: &[&dyn Any]) -> bool {
        self.code.domain.is_empty()
            || WORKSPACE.with_borrow_mut(|room| {
                self.code.run(&self.values, variables, &mut room.numbers);
                self.code.domain.iter().all(|slot| room.numbers[*slot] > 0.0)
            })
    }
    fn residual(&self, variables: &[&dyn Any], residual: &mut [f64]) {
        WORKSPACE.with_borrow_mut(|room| {
            self.code.run(&self.values, variables, &mut room.numbers);
            residual.iter_mut().zip(&self.code.rows).for_each(|(r, slot)| *r = room.numbers[*slot]);
        });
    }
    fn linearize(
        &self,
        variables: &[&dyn Any],
        free: &[bool],
        residual: &mut [f64],
        blocks: &mut DynamicBlocks,
    ) {
        WORKSPACE.with_borrow_mut(|room| {
            self.code.run(&self.values, variables, &mut room.numbers);
            residual.iter_mut().zip(&self.code.rows).for_each(|(r, slot)| *r = room.numbers[*slot]);
            for (variable, x) in variables.iter().enumerate().filter(|(variable, _)| free[*variable]) {
                self.code.differentiate(variable, *x, room, blocks.block_mut(variable));
            }
        });
    }
}
