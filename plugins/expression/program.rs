//! A compiled formula: calls over flat values.
use manifactor_graph::quantity::{Call, LANES, Lanes, VariableQuantity};
use manifactor_graph::{DynamicBlocks, DynamicResidual, Jet};
use std::any::{Any, TypeId};
use std::cell::RefCell;
use std::fmt;
use std::sync::Arc;

/// Formulas, compiled: each call writes its result behind all that was there before. Cheap to clone.
///
/// Jacobians come by forward differentiation, [`LANES`] directions of a variable at a time; what does not depend on
/// that variable is computed once, over plain numbers. Factors that differ in constants alone share their code: a thousand of
/// them fit into a processor's cache.
#[derive(Clone)]
pub struct Program {
    code: Arc<Code>,
    /// The values at the start: constants, what follows from them, and room for all else.
    values: Arc<[f64]>,
}

#[derive(Default)]
pub(crate) struct Code {
    pub types: Vec<TypeId>,
    pub dimensions: Vec<usize>,
    /// By variable, what it is and where its flat form begins.
    pub inputs: Vec<(&'static VariableQuantity, usize)>,
    /// Where the constants that have a name begin, in the order of their scope.
    pub constants: Vec<usize>,
    /// Calls that take constants alone: made once, for each set of constants.
    pub folded: Vec<Step>,
    pub calls: Vec<Step>,
    /// By variable, what it takes to differentiate by it.
    pub passes: Vec<Pass>,
    /// Where each row is.
    pub rows: Vec<usize>,
    /// Where those numbers are that have to be above zero.
    pub domain: Vec<usize>,
}

/// One call.
pub(crate) struct Step {
    pub numbers: Call<f64>,
    pub lanes: Call<Lanes>,
    pub at: Box<[u32]>,
    /// Where its result begins and ends.
    pub to: std::ops::Range<usize>,
}

/// What it takes to differentiate by one variable.
#[derive(Default)]
pub(crate) struct Pass {
    /// Calls that depend on it.
    pub calls: Vec<usize>,
    /// Values that those calls take and that do not depend on it.
    pub lifted: Vec<usize>,
    /// Of each row, whether it depends on it.
    pub rows: Vec<bool>,
}

/// Room to compute in. One for each thread: evaluating allocates nothing.
#[derive(Default)]
struct Room {
    numbers: Vec<f64>,
    lanes: Vec<Lanes>,
    gradients: Vec<f64>,
}

thread_local! {
    static ROOM: RefCell<Room> = RefCell::default();
}

impl Step {
    /// Makes the call; whether its result is finite.
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
    /// The same formulas with other constants, of the same shapes; `None` where something that follows from them is not finite.
    pub(crate) fn with<'c>(&self, constants: impl Iterator<Item = &'c [f64]>) -> Option<Self> {
        let mut values = self.values.to_vec();
        for (at, flat) in self.code.constants.iter().zip(constants) {
            values[*at..at + flat.len()].copy_from_slice(flat);
        }
        let finite = self.code.folded.iter().all(|step| step.run(&mut values));
        finite.then(|| Self { code: self.code.clone(), values: values.into() })
    }
    /// Number of calls.
    pub fn len(&self) -> usize {
        self.code.calls.len()
    }
    /// Returns whether it computes nothing.
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
    /// All values, over numbers.
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

    /// The block of a variable, where all values are known.
    fn differentiate(&self, variable: usize, x: &dyn Any, room: &mut Room, block: &mut [f64]) {
        let Room { numbers, lanes, gradients } = room;
        let (pass, (quantity, at), rows) = (&self.passes[variable], self.inputs[variable], self.rows.len());
        let (size, dimension) = (quantity.shape.size, quantity.dimension);
        if lanes.len() < numbers.len() {
            lanes.resize(numbers.len(), Lanes::from(0.0));
        }
        // lanes past the last direction hold anything: they are not looked at
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
            || ROOM.with_borrow_mut(|room| {
                self.code.run(&self.values, variables, &mut room.numbers);
                self.code.domain.iter().all(|slot| room.numbers[*slot] > 0.0)
            })
    }
    fn residual(&self, variables: &[&dyn Any], residual: &mut [f64]) {
        ROOM.with_borrow_mut(|room| {
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
        ROOM.with_borrow_mut(|room| {
            self.code.run(&self.values, variables, &mut room.numbers);
            residual.iter_mut().zip(&self.code.rows).for_each(|(r, slot)| *r = room.numbers[*slot]);
            for (variable, x) in variables.iter().enumerate().filter(|(variable, _)| free[*variable]) {
                self.code.differentiate(variable, *x, room, blocks.block_mut(variable));
            }
        });
    }
}
