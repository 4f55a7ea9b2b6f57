//! Arrays of numbers, copied from and to Python.
use crate::errors;
use numpy::ndarray::{ArrayD, IxDyn};
use numpy::{
    PyArrayDescrMethods, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyFloat;

/// Finite numbers of an array, in row-major order.
pub(crate) struct Numbers {
    pub shape: Vec<usize>,
    pub values: Vec<f64>,
    /// True if the array's type is an integer type.
    pub whole: bool,
}

impl Numbers {
    /// Number of entries per row.
    pub(crate) fn width(&self) -> usize {
        self.shape.iter().skip(1).product()
    }

    pub(crate) fn row(&self, index: usize) -> &[f64] {
        let width = self.width();
        self.values.get(index * width..(index + 1) * width).unwrap_or_default()
    }
}

/// Formats a shape, such as `(100, 3)`.
fn in_words(shape: &[usize]) -> String {
    let sizes: Vec<_> = shape.iter().map(ToString::to_string).collect();
    if sizes.len() == 1 { format!("({},)", sizes.concat()) } else { format!("({})", sizes.join(", ")) }
}

/// Converts an argument to a NumPy array; an existing array is not copied.
pub(crate) fn array<'py>(
    what: &str,
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyUntypedArray>> {
    if let Ok(array) = value.cast::<PyUntypedArray>() {
        check_mask(what, name, array)?;
        return Ok(array.clone());
    }
    let made = value.py().import("numpy")?.call_method1("asarray", (value,));
    let made =
        made.map_err(|error| errors::argument(what, name, format!("expected an array of numbers: {error}")))?;
    Ok(made.cast_into::<PyUntypedArray>()?)
}

/// Refuses masked entries, because a conversion to numbers would lose the mask.
fn check_mask(what: &str, name: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<()> {
    let py = array.py();
    if array.get_type().is(py.get_type::<PyUntypedArray>()) || !array.hasattr("mask")? {
        return Ok(());
    }
    if py.import("numpy")?.getattr("ma")?.call_method1("is_masked", (array,))?.is_truthy()? {
        let message = "expected an array without masked entries; `numpy.ma.filled` replaces them";
        return Err(errors::argument(what, name, message));
    }
    Ok(())
}

/// Converts an object with axes that NumPy converts to an array, such as a `pandas.Series`; `None` for
/// everything else. A NumPy array without axes is an array, but a number of NumPy is not.
pub(crate) fn array_like<'py>(
    what: &str,
    name: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Option<Bound<'py, PyUntypedArray>>> {
    if value.cast::<PyUntypedArray>().is_ok() {
        return array(what, name, value).map(Some);
    }
    if !is_array_like(value)? {
        return Ok(None);
    }
    let array = array(what, name, value)?;
    Ok(Some(array).filter(|array| !array.shape().is_empty()))
}

/// Returns true for objects that NumPy converts to an array. NumPy converts points too, but documents have
/// their fields.
pub(crate) fn is_array_like(value: &Bound<'_, PyAny>) -> PyResult<bool> {
    Ok(value.hasattr("__array__")? && !value.hasattr("TANGENT")?)
}

/// Reads an argument as finite numbers. `None` in `shape` accepts any length. An array with different axes,
/// with an unsupported type or with non-finite numbers is an error.
pub(crate) fn numbers(
    what: &str,
    name: &str,
    value: &Bound<'_, PyAny>,
    shape: &[Option<usize>],
) -> PyResult<Numbers> {
    // fast path without a call into NumPy
    if let ([], Ok(x)) = (shape, value.cast::<PyFloat>()) {
        return finite(what, name, Numbers { shape: vec![], values: vec![x.value()], whole: false });
    }
    let array = shaped(what, name, value, shape)?;
    any_numbers(what, name, &array)
}

/// Reads an argument as an array of this shape.
fn shaped<'py>(
    what: &str,
    name: &str,
    value: &Bound<'py, PyAny>,
    shape: &[Option<usize>],
) -> PyResult<Bound<'py, PyUntypedArray>> {
    let array = array(what, name, value)?;
    let fits = array.shape().len() == shape.len()
        && array.shape().iter().zip(shape).all(|(found, expected)| expected.is_none_or(|n| n == *found));
    if !fits {
        let sizes: Vec<_> = shape.iter().map(|n| n.map_or("any".to_owned(), |n| n.to_string())).collect();
        let comma = if sizes.len() == 1 { "," } else { "" };
        let message = format!(
            "expected an array of shape ({}{comma}), got {}",
            sizes.join(", "),
            in_words(array.shape())
        );
        return Err(errors::argument(what, name, message));
    }
    Ok(array)
}

/// Reads an argument as numbers, some of which may be non-finite.
pub(crate) fn numbers_or_nan(
    what: &str,
    name: &str,
    value: &Bound<'_, PyAny>,
    shape: &[Option<usize>],
) -> PyResult<Numbers> {
    let array = shaped(what, name, value, shape)?;
    copied(what, name, &array)
}

/// Reads finite numbers of any shape.
pub(crate) fn any_numbers(what: &str, name: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<Numbers> {
    finite(what, name, copied(what, name, array)?)
}

/// Checks that all numbers are finite.
fn finite(what: &str, name: &str, numbers: Numbers) -> PyResult<Numbers> {
    let Some(at) = numbers.values.iter().position(|x| !x.is_finite()) else { return Ok(numbers) };
    let found = numbers.values.get(at).copied().unwrap_or_default();
    let place =
        if numbers.shape.is_empty() { String::new() } else { format!(" at {}", index(at, &numbers.shape)) };
    let message = format!("expected finite numbers, got {found}{place}");
    Err(errors::argument(what, name, message))
}

/// Copies the real numbers of an array, in its order.
fn copied(what: &str, name: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<Numbers> {
    let py = array.py();
    // fast path without a call into NumPy
    if let Ok(plain) = array.cast::<PyArrayDyn<f64>>()
        && array.is_c_contiguous()
        && let Ok(plain) = plain.try_readonly()
        && let Ok(values) = plain.as_slice()
    {
        return Ok(Numbers { shape: array.shape().to_vec(), values: values.to_vec(), whole: false });
    }
    let kind = array.dtype().kind();
    if !matches!(kind, b'f' | b'i' | b'u') {
        let dtype = array.dtype();
        let message = format!("expected an array of real numbers, got one of the type {dtype}");
        return Err(errors::argument(what, name, message));
    }
    let plain = py.import("numpy")?.call_method1("require", (array, "float64", ("C", "A")))?;
    let plain: PyReadonlyArrayDyn<'_, f64> = plain.extract().map_err(errors::internal)?;
    let values = plain.as_slice().map_err(errors::internal)?.to_vec();
    // an array without axes gets one
    let shape = array.shape().to_vec();
    Ok(Numbers { shape, values, whole: kind != b'f' })
}

/// Formats the index of an entry in an array of this shape, such as `[3, 1]`.
fn index(mut at: usize, shape: &[usize]) -> String {
    let mut indices: Vec<usize> = vec![];
    for n in shape.iter().rev() {
        indices.push(at % n);
        at /= n;
    }
    indices.reverse();
    format!("{indices:?}")
}

/// Converts numbers in row-major order to an array.
pub(crate) fn to_array<'py>(
    py: Python<'py>,
    shape: &[usize],
    values: Vec<f64>,
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let array = ArrayD::from_shape_vec(IxDyn(shape), values).map_err(errors::internal)?;
    Ok(PyArrayDyn::from_owned_array(py, array))
}

/// Makes an array read-only.
pub(crate) fn frozen<'py, T>(array: Bound<'py, T>) -> PyResult<Bound<'py, T>> {
    array.as_any().call_method1("setflags", (false,))?;
    Ok(array)
}
