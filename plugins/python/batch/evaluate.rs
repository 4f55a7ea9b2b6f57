//! Calls of a Python function, for many points at once.
use crate::errors;
use crate::input::{numbers_or_nan, to_array};
use crate::raised::{has_raised, store_exception};
use manifactor::graph::Variable;
use manifactor::graph::quantity::VariableQuantity;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use std::any::TypeId;
use std::fmt;
use std::sync::Arc;

/// Relative step of the central differences, about the cube root of the machine precision.
const STEP: f64 = 6e-6;
/// Smallest size of a coordinate for its step. A coordinate may be close to zero by chance, and with a smaller
/// step, rounding would be more than 1e-6 of a residual of size 1.
const SMALLEST: f64 = 1e-4;
/// Largest number of points in one call. More points need more memory and are not faster.
const MOST: usize = 1 << 15;

/// The residual of a factor as a Python function.
pub(super) struct Function {
    pub name: String,
    quantities: Vec<&'static VariableQuantity>,
    pub types: Vec<TypeId>,
    pub dimensions: Vec<usize>,
    pub rows: usize,
    /// Lengths of the constants.
    pub constants: Vec<usize>,
    evaluate: Py<PyAny>,
    has_jacobian: bool,
}

/// A point at which a factor is evaluated.
pub(super) struct Point {
    pub variables: Vec<Box<dyn Variable>>,
    pub constants: Arc<[f64]>,
}

/// The residuals of points, and for each variable the Jacobians in column-major order.
pub(super) type Linearized = (Vec<f64>, Vec<Vec<f64>>);

impl fmt::Debug for Function {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl Function {
    pub(super) fn new(
        name: String,
        quantities: Vec<&'static VariableQuantity>,
        rows: usize,
        constants: Vec<usize>,
        evaluate: Py<PyAny>,
        has_jacobian: bool,
    ) -> Self {
        let types = quantities.iter().map(|quantity| (quantity.type_id)()).collect();
        let dimensions = quantities.iter().map(|quantity| quantity.dimension).collect();
        Self { name, quantities, types, dimensions, rows, constants, evaluate, has_jacobian }
    }

    /// Returns the numbers of a point's variables, concatenated.
    pub(super) fn numbers(&self, point: &Point) -> Vec<f64> {
        Inputs::new(self, std::slice::from_ref(point)).variables.concat()
    }

    /// Returns the residuals of these points, concatenated; NaN if Python has raised an exception.
    pub(super) fn residuals(&self, points: &[Point]) -> Vec<f64> {
        let mut all = Vec::with_capacity(points.len() * self.rows);
        for points in points.chunks(MOST) {
            match unless_raised(|| self.call(Inputs::new(self, points), false)) {
                Some((residuals, _)) => all.extend(residuals),
                None => all.resize(all.len() + points.len() * self.rows, f64::NAN),
            }
        }
        all
    }

    /// Returns the residuals, and the Jacobian blocks with respect to each variable's tangent space.
    pub(super) fn linearized(&self, points: &[Point]) -> Linearized {
        let sizes = self.dimensions.iter().map(|n| self.rows * n);
        let mut all: Linearized =
            (vec![], sizes.clone().map(|size| Vec::with_capacity(size * points.len())).collect());
        let each = if self.has_jacobian { 1 } else { 1 + 2 * self.dimensions.iter().sum::<usize>() };
        for points in points.chunks((MOST / each).max(1)) {
            let done = unless_raised(|| match self.has_jacobian {
                true => self.by_python(points),
                false => self.by_differences(points),
            });
            let (residuals, blocks) = done.unwrap_or_else(|| {
                let nothing = |size: usize| vec![f64::NAN; size * points.len()];
                (nothing(self.rows), sizes.clone().map(nothing).collect())
            });
            all.0.extend(residuals);
            all.1.iter_mut().zip(blocks).for_each(|(all, some)| all.extend(some));
        }
        all
    }

    /// Python's Jacobians are with respect to the numbers of the variables; the chain rule converts them to
    /// the tangent space.
    fn by_python(&self, points: &[Point]) -> PyResult<Linearized> {
        let (residuals, jacobians) = self.call(Inputs::new(self, points), true)?;
        let mut blocks = vec![];
        for (v, (quantity, jacobian)) in self.quantities.iter().zip(&jacobians).enumerate() {
            let (size, n) = (quantity.shape.size, quantity.dimension);
            let mut gradients = vec![0.0; size * n];
            let mut of_variable = Vec::with_capacity(points.len() * self.rows * n);
            for (point, by_numbers) in points.iter().zip(jacobian.chunks_exact(self.rows * size)) {
                if let Some(x) = point.variables.get(v) {
                    (quantity.gradients)(x.erased().as_any(), &mut gradients);
                }
                for column in 0..n {
                    let entry = |row: &[f64]| {
                        row.iter()
                            .zip(gradients.iter().skip(column).step_by(n))
                            .map(|(a, b)| a * b)
                            .sum::<f64>()
                    };
                    of_variable.extend(by_numbers.chunks_exact(size).map(entry));
                }
            }
            blocks.push(of_variable);
        }
        Ok((residuals, blocks))
    }

    /// Evaluates the points and their neighbours for the central differences in one call.
    fn by_differences(&self, points: &[Point]) -> PyResult<Linearized> {
        let mut around = Inputs::new(self, points);
        for (v, n) in self.dimensions.iter().enumerate() {
            for direction in 0..*n {
                for sign in [1.0, -1.0] {
                    around.extend_moved(self, points, &Move { variable: v, direction, sign });
                }
            }
        }
        let (all, _) = self.call(around, false)?;
        let mut parts = all.chunks_exact((self.rows * points.len()).max(1));
        let residuals = parts.next().unwrap_or_default().to_vec();
        let mut blocks = vec![];
        for (v, n) in self.dimensions.iter().enumerate() {
            let size = self.rows * n;
            let mut of_variable = vec![0.0; size * points.len()];
            for direction in 0..*n {
                let (Some(ahead), Some(behind)) = (parts.next(), parts.next()) else { continue };
                let width = |point: &Point| {
                    point.variables.get(v).map_or(f64::NAN, |x| Step::of(&**x, direction).width())
                };
                let widths: Vec<f64> = points.iter().map(width).collect();
                for (i, (a, b)) in ahead.iter().zip(behind).enumerate() {
                    let (point, row) = (i / self.rows, i % self.rows);
                    let width = widths.get(point).copied().unwrap_or(f64::NAN);
                    if let Some(entry) = of_variable.get_mut(point * size + direction * self.rows + row) {
                        *entry = (a - b) / width;
                    }
                }
            }
            blocks.push(of_variable);
        }
        Ok((residuals, blocks))
    }

    /// Calls the function once. Returns the residuals, and the Jacobians if requested, in the memory order
    /// of Python's arrays.
    fn call(&self, inputs: Inputs, derivatives: bool) -> PyResult<(Vec<f64>, Vec<Vec<f64>>)> {
        let n = inputs.count;
        Python::attach(|py| {
            let array = |(width, values): (&usize, Vec<f64>)| to_array(py, &[n, *width], values);
            let sizes: Vec<usize> = self.quantities.iter().map(|quantity| quantity.shape.size).collect();
            let variables = sizes.iter().zip(inputs.variables).map(array).collect::<PyResult<Vec<_>>>()?;
            let constants = self.constants.iter().zip(inputs.constants).map(array);
            let constants = constants.collect::<PyResult<Vec<_>>>()?;
            let returned = self.evaluate.bind(py).call1((
                PyList::new(py, variables)?,
                PyList::new(py, constants)?,
                derivatives,
            ))?;
            let (residuals, jacobians): (Bound<'_, PyAny>, Bound<'_, PyAny>) =
                returned.cast::<PyTuple>()?.extract()?;
            let residuals = read(&self.name, "the residual", &residuals, &[n, self.rows])?;
            if !derivatives {
                return Ok((residuals, vec![]));
            }
            let jacobians = jacobians.try_iter()?.collect::<PyResult<Vec<_>>>()?;
            if jacobians.len() != sizes.len() {
                let (variables, found) = (sizes.len(), jacobians.len());
                let message = format!("expected a Jacobian for each of {variables} variables, got {found}");
                return Err(errors::argument(&self.name, "the Jacobian", message));
            }
            let block = |(size, jacobian): (&usize, &Bound<'_, PyAny>)| {
                read(&self.name, "the Jacobian", jacobian, &[n, self.rows, *size])
            };
            Ok((residuals, sizes.iter().zip(&jacobians).map(block).collect::<PyResult<_>>()?))
        })
    }
}

/// Calls a function unless an exception was raised before; an exception is stored.
fn unless_raised<T>(call: impl FnOnce() -> PyResult<T>) -> Option<T> {
    if has_raised() {
        return None;
    }
    call().map_err(store_exception).ok()
}

/// A step of the central differences along a direction.
struct Step {
    coordinate: f64,
    size: f64,
}

impl Step {
    /// The step is relative to a coordinate below 1, which may have a small unit. Above 1 it grows with the
    /// cube root, as rounding requires: a large coordinate, such as an easting, may have details of size 1.
    fn of(x: &dyn Variable, direction: usize) -> Self {
        let coordinate = x.erased().coordinate(direction).unwrap_or_default();
        let scale = match coordinate.abs() {
            // zero has no size
            0.0 => 1.0,
            large if large > 1.0 => large.cbrt(),
            small => small.max(SMALLEST),
        };
        Self { coordinate, size: STEP * scale }
    }

    /// Distance of the two points, as rounded.
    fn width(&self) -> f64 {
        (self.coordinate + self.size) - (self.coordinate - self.size)
    }
}

/// A move of one variable of each point, by a step of the central differences.
struct Move {
    variable: usize,
    direction: usize,
    sign: f64,
}

/// Reads numbers that a function has returned. Rows of NaN mean that the factor is undefined there.
fn read(what: &str, name: &str, value: &Bound<'_, PyAny>, shape: &[usize]) -> PyResult<Vec<f64>> {
    let shape: Vec<_> = shape.iter().copied().map(Some).collect();
    Ok(numbers_or_nan(what, name, value, &shape)?.values)
}

/// Arguments of a call: the numbers of all points, by variable and by constant.
struct Inputs {
    count: usize,
    variables: Vec<Vec<f64>>,
    constants: Vec<Vec<f64>>,
}

impl Inputs {
    fn new(function: &Function, points: &[Point]) -> Self {
        let (variables, constants) =
            (vec![vec![]; function.types.len()], vec![vec![]; function.constants.len()]);
        let mut inputs = Self { count: points.len(), variables, constants };
        for (v, to) in inputs.variables.iter_mut().enumerate() {
            extend(function, points, v, None, to);
        }
        for point in points {
            let mut rest = &*point.constants;
            for (width, to) in function.constants.iter().zip(&mut inputs.constants) {
                let (own, behind) = rest.split_at_checked(*width).unwrap_or_default();
                to.extend(own);
                rest = behind;
            }
        }
        inputs
    }

    /// Appends a copy of the initial points in which one variable is moved.
    fn extend_moved(&mut self, function: &Function, points: &[Point], by: &Move) {
        for (v, to) in self.variables.iter_mut().enumerate() {
            if v == by.variable {
                extend(function, points, v, Some(by), to);
            } else {
                to.extend_from_within(..to.len() / self.count * points.len());
            }
        }
        for to in &mut self.constants {
            to.extend_from_within(..to.len() / self.count * points.len());
        }
        self.count += points.len();
    }
}

/// Appends the numbers of one variable of all points, moved if `by` is given.
fn extend(function: &Function, points: &[Point], v: usize, by: Option<&Move>, to: &mut Vec<f64>) {
    let Some(quantity) = function.quantities.get(v) else { return };
    let mut delta = vec![0.0; quantity.dimension];
    for x in points.iter().filter_map(|point| point.variables.get(v)) {
        let at = to.len();
        to.resize(at + quantity.shape.size, 0.0);
        let to = to.get_mut(at..).unwrap_or_default();
        let moved = by.and_then(|by| {
            *delta.get_mut(by.direction)? = by.sign * Step::of(&**x, by.direction).size;
            x.erased().retract(&delta)
        });
        match moved {
            Some(moved) => (quantity.values)(moved.erased().as_any(), to),
            None => (quantity.values)(x.erased().as_any(), to),
        }
    }
}
