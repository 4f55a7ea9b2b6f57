//! Functions of formulas, over numbers: of values, arrays of values, and arrays.
use super::array::{Points, into_python};
use super::groups::group;
use crate::errors::{self, Mistake};
use crate::input::{Numbers, array, numbers, to_array};
use crate::threads::detach;
use manifactor::graph::quantity::{Function, Shape, functions, variable_quantity};
use numpy::PyUntypedArrayMethods;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::collections::HashMap;
use std::sync::OnceLock;

/// An argument of a function.
enum Argument {
    /// Values of a type that formulas know.
    Values { shape: Shape, rows: Option<usize>, flat: Vec<f64> },
    /// Numbers, whose type depends on the function: a number, a vector, or several of them.
    Numbers(Numbers),
}

impl Argument {
    fn read(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Some(points) = Points::of(value) else {
            let axes = array(name, "", value)?.shape().len();
            return Ok(Self::Numbers(numbers(name, "", value, &vec![None; axes])?));
        };
        let array = &points.array;
        let id = manifactor::graph::catalogue::find("variable", array.name).map(|entry| (entry.type_id)());
        let Some(quantity) = id.and_then(variable_quantity) else {
            let message = format!("formulas know nothing of the type `{}`", array.name);
            return Err(errors::argument(name, "", message));
        };
        let (shape, rows) = (quantity.shape, points.rows());
        let mut flat = vec![0.0; shape.size * array.values.len()];
        for (x, to) in array.values.iter().zip(flat.chunks_exact_mut(shape.size.max(1))) {
            (quantity.values)(x.erased().as_any(), to);
        }
        Ok(Self::Values { shape, rows, flat })
    }

    /// Returns the leading axes if this is an argument of the expected type. An array without axes is a
    /// number. An array is one of numbers only with `of_numbers`.
    fn leading(&self, expected: &Shape, of_numbers: bool) -> Option<Vec<usize>> {
        match self {
            Self::Values { shape, rows, .. } => (shape == expected).then(|| rows.iter().copied().collect()),
            Self::Numbers(Numbers { shape, .. }) if expected.is_vector() => {
                let (last, leading) = shape.split_last()?;
                (*last == expected.size).then(|| leading.to_vec())
            }
            Self::Numbers(Numbers { shape, .. }) => {
                (expected.name == "number" && (shape.is_empty() || of_numbers)).then(|| shape.clone())
            }
        }
    }

    fn flat(&self) -> &[f64] {
        match self {
            Self::Values { flat, .. } => flat,
            Self::Numbers(numbers) => &numbers.values,
        }
    }

    /// Formats the type for errors.
    fn in_words(&self) -> String {
        match self {
            Self::Values { shape, .. } => shape.name.to_owned(),
            Self::Numbers(Numbers { shape, .. }) if shape.is_empty() => "a number".to_owned(),
            Self::Numbers(Numbers { shape, .. }) => {
                let sizes: Vec<_> = shape.iter().map(ToString::to_string).collect();
                let comma = if sizes.len() == 1 { "," } else { "" };
                format!("an array of shape ({}{comma})", sizes.join(", "))
            }
        }
    }
}

/// A function with the leading axes of each argument.
type Overload = (&'static Function, Vec<Vec<usize>>);

/// Returns all functions of a name.
fn overloads(name: &str) -> &'static [&'static Function] {
    // a search among all functions would take longer than most calls
    static BY_NAME: OnceLock<HashMap<&str, Vec<&Function>>> = OnceLock::new();
    let by_name = BY_NAME.get_or_init(|| {
        let mut by_name: HashMap<_, Vec<_>> = HashMap::new();
        functions().into_iter().for_each(|function| by_name.entry(function.name).or_default().push(function));
        by_name
    });
    by_name.get(name).map_or(&[], Vec::as_slice)
}

fn overload(name: &str, arguments: &[Argument]) -> PyResult<Overload> {
    let all = overloads(name);
    for of_numbers in [false, true] {
        for function in all.iter().copied().filter(|function| function.arguments.len() == arguments.len()) {
            let expected = function.arguments.iter().zip(arguments);
            let leading = expected.map(|((_, shape), argument)| argument.leading(shape, of_numbers));
            if let Some(leading) = leading.collect::<Option<Vec<_>>>() {
                return Ok((function, leading));
            }
        }
    }
    let found: Vec<_> = arguments.iter().map(Argument::in_words).collect();
    let mistake = Mistake::at("", format!("`{name}` does not take {}", found.join(" and ")));
    let first = arguments.first();
    let takes = |function: &&&Function| match (first, function.arguments.first()) {
        (Some(Argument::Values { shape, .. }), Some((_, expected))) => shape == expected,
        _ => true,
    };
    let there_are: Vec<_> = all.iter().filter(takes).map(|function| function.signature()).take(6).collect();
    let help = match there_are.as_slice() {
        [] => "no function of this name takes the first argument".to_owned(),
        there_are => format!("there is {}", there_are.join("; ")),
    };
    Err(errors::arguments("", vec![mistake.help(help)]))
}

/// Calls a function of formulas by its name. Arguments are values, arrays of values, numbers and arrays of
/// numbers or of vectors, whose last axis is the vector. All arrays have equal numbers of rows; everything
/// else applies to all rows.
#[pyfunction]
#[pyo3(signature = (name, *arguments))]
fn call<'py>(name: &str, arguments: &Bound<'py, PyTuple>) -> PyResult<Bound<'py, PyAny>> {
    let py = arguments.py();
    let given = arguments.iter().map(|x| Argument::read(name, &x)).collect::<PyResult<Vec<_>>>()?;
    let (function, leading) = overload(name, &given)?;
    let is_array: Vec<bool> = leading.iter().map(|axes| !axes.is_empty()).collect();
    let axes = common_axes(name, leading)?;
    let flat = detach(py, || evaluated(function, &given, &is_array, axes.iter().product()))?;
    let result = function.result;
    if let Some(group) = group(result.name) {
        if axes.len() > 1 {
            let message = format!("expected an array of one axis besides the vector's, got {}", axes.len());
            return Err(errors::argument(name, "", message));
        }
        if flat.iter().any(|x| !x.is_finite()) {
            return Err(errors::argument(name, "", "the result is not finite"));
        }
        let values = flat.chunks_exact(result.size).map(group.read).collect();
        return into_python(py, result.name, values, !axes.is_empty());
    }
    if result.name == "number" && axes.is_empty() {
        return flat.first().copied().unwrap_or(f64::NAN).into_bound_py_any(py);
    }
    if result.name != "number" && !result.is_vector() {
        return Err(errors::internal(format!("a result of the type {result}")));
    }
    let shape: Vec<_> = axes.into_iter().chain(result.is_vector().then_some(result.size)).collect();
    Ok(to_array(py, &shape, flat)?.into_any())
}

/// Returns the leading axes of all arguments that have some.
fn common_axes(name: &str, leading: Vec<Vec<usize>>) -> PyResult<Vec<usize>> {
    let mut given = leading.into_iter().filter(|axes| !axes.is_empty());
    let first = given.next().unwrap_or_default();
    match given.find(|axes| *axes != first) {
        Some(other) => {
            let message = format!("expected arrays with equal leading axes, got {first:?} and {other:?}");
            Err(errors::argument(name, "", message))
        }
        None => Ok(first),
    }
}

/// Calls a function for each row.
fn evaluated(function: &Function, given: &[Argument], is_array: &[bool], count: usize) -> Vec<f64> {
    let mut at = vec![];
    let mut from = vec![];
    for (_, shape) in function.arguments {
        at.push(from.len() as u32);
        from.resize(from.len() + shape.size, 0.0);
    }
    let mut flat = vec![0.0; function.result.size * count];
    for (row, to) in flat.chunks_exact_mut(function.result.size.max(1)).enumerate() {
        let mut rest = from.as_mut_slice();
        for (((_, shape), argument), is_array) in function.arguments.iter().zip(given).zip(is_array) {
            let (own, behind) = rest.split_at_mut(shape.size);
            let first = if *is_array { row * shape.size } else { 0 };
            if let Some(numbers) = argument.flat().get(first..first + shape.size) {
                own.copy_from_slice(numbers);
            }
            rest = behind;
        }
        (function.over_numbers)(&from, &at, to);
    }
    flat
}

pub(super) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(call, module)?)
}
