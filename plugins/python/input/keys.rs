//! Keys: texts, or whole numbers with a prefix.
use super::arrays::{any_numbers, array};
use crate::errors;
use manifactor::graph::Key;
use numpy::{PyArrayDescrMethods, PyReadonlyArrayDyn, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFrozenSet, PySet, PyString, PyTuple};
use std::collections::HashMap;

/// Returns a key, which has at least one character, as in documents.
pub(crate) fn key(what: &str, text: &str) -> PyResult<Key> {
    match text.is_empty() {
        true => Err(errors::argument(what, "key", "a key needs at least one character, such as \"x0\"")),
        false => Ok(text.into()),
    }
}

/// Reads one key: a text, a whole number with the prefix `x`, or a pair of prefix and number.
pub(crate) fn key_of(what: &str, value: &Bound<'_, PyAny>) -> PyResult<Key> {
    if let Ok(text) = value.cast::<PyString>() {
        return key(what, &text.to_cow()?);
    }
    numbered(value).ok_or_else(|| {
        let message = "expected a text, a whole number, or both: \"x0\", 0 or (\"x\", 0)";
        errors::argument(what, "key", message)
    })
}

/// Returns the key of a whole number, or of a pair of prefix and number; `None` for everything else.
fn numbered(value: &Bound<'_, PyAny>) -> Option<Key> {
    let Ok(pair) = value.cast::<PyTuple>() else { return Some(Key::indexed("x", whole(value)?)) };
    let [prefix, number] = pair.iter().collect::<Vec<_>>().try_into().ok()?;
    Some(Key::indexed(&prefix.cast::<PyString>().ok()?.to_cow().ok()?, whole(&number)?))
}

/// Returns a whole number; `None` for everything else, also for truth values.
fn whole(value: &Bound<'_, PyAny>) -> Option<i64> {
    match value.is_instance_of::<PyBool>() {
        true => None,
        false => value.extract().ok(),
    }
}

/// Reads the keys of one factor: one key or several, in order.
pub(crate) fn keys(what: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Key>> {
    check_order(value)?;
    unordered_keys(what, value)
}

/// Reads one key or several, whose order does not matter.
pub(crate) fn unordered_keys(what: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Key>> {
    if let Ok(key) = value.cast::<PyString>() {
        return Ok(vec![self::key(what, &key.to_cow()?)?]);
    }
    if let Some(key) = numbered(value) {
        return Ok(vec![key]);
    }
    let expected = || {
        let message = "expected a key, or several: \"x0\", [\"x0\", \"x1\"] or [0, (\"p\", 1)]";
        errors::argument(what, "keys", message)
    };
    let items = value.try_iter().map_err(|_| expected())?;
    let one = |item: Bound<'_, PyAny>| match item.cast::<PyString>() {
        Ok(text) => key(what, &text.to_cow()?),
        Err(_) => numbered(&item).ok_or_else(expected),
    };
    items.map(|item| one(item?)).collect()
}

/// Reads one prefix or several. A prefix may be empty, because a number follows.
fn prefixes_of(value: &Bound<'_, PyAny>) -> PyResult<Vec<Key>> {
    let texts =
        value.extract::<String>().map(|text| vec![text]).or_else(|_| value.extract::<Vec<String>>())?;
    Ok(texts.iter().map(|text| text.as_str().into()).collect())
}

/// Reads the keys of many factors or values, and returns them by rows with the number of keys per row. The
/// input is an array of texts, or of integers, whose keys are `prefix` plus the number. There may be one
/// prefix per column.
pub(crate) fn key_rows(
    what: &str,
    value: &Bound<'_, PyAny>,
    prefix: Option<&Bound<'_, PyAny>>,
) -> PyResult<(Vec<Key>, usize)> {
    let wrong = |name, message: String| Err(errors::argument(what, name, message));
    check_order(value)?;
    if prefix.is_none() && !value.hasattr("__array__")? {
        return text_rows(what, value);
    }
    let array = array(what, "keys", value)?;
    let kind = array.dtype().kind();
    if matches!(kind, b'U' | b'O') && prefix.is_none() {
        return text_rows(what, &array.call_method0("tolist")?);
    }
    if kind == b'U' {
        let message = "expected whole numbers, got texts, which have no `prefix`";
        return wrong("keys", message.to_owned());
    }
    let width = match array.shape() {
        [_] => 1,
        [_, width] => *width,
        shape => return wrong("keys", format!("expected an array of one or two axes, got {}", shape.len())),
    };
    let prefixes = match prefix {
        None => vec!["x".into()],
        Some(prefix) => prefixes_of(prefix).map_err(|_| {
            errors::argument(what, "prefix", "expected a text, or one for each column of `keys`")
        })?,
    };
    if prefixes.len() != 1 && prefixes.len() != width {
        let found = prefixes.len();
        return wrong(
            "prefix",
            format!("expected a text, or {width}: one for each column of `keys`, got {found}"),
        );
    }
    // many factors share a variable, so its key is created only once
    let mut made: HashMap<(usize, i64), Key> = HashMap::new();
    let all = whole_numbers(what, &array)?.into_iter().enumerate().map(|(i, number)| {
        let column = i % width.max(1) % prefixes.len();
        let prefix = prefixes.get(column).map_or("", |prefix| prefix.as_str());
        made.entry((column, number)).or_insert_with(|| Key::indexed(prefix, number)).clone()
    });
    Ok((all.collect(), width))
}

/// Refuses sets, because the order of keys is the order of a factor's variables.
fn check_order(value: &Bound<'_, PyAny>) -> PyResult<()> {
    if value.is_instance_of::<PySet>() || value.is_instance_of::<PyFrozenSet>() {
        return Err(PyTypeError::new_err("keys: expected a list or a tuple, got a set, which has no order"));
    }
    Ok(())
}

/// Reads keys by rows from an iterable.
fn text_rows(what: &str, value: &Bound<'_, PyAny>) -> PyResult<(Vec<Key>, usize)> {
    let items = value.try_iter().map_err(|_| {
        let message = "expected texts by rows, or an array of whole numbers with `prefix`";
        errors::argument(what, "keys", message)
    })?;
    let (mut all, mut width) = (vec![], None);
    for (row, item) in items.enumerate() {
        let of_row = keys(what, &item?)?;
        let width = *width.get_or_insert(of_row.len());
        if of_row.len() != width {
            let message = format!("row {row} has {} keys, those before it {width}", of_row.len());
            return Err(errors::argument(what, "keys", message));
        }
        all.extend(of_row);
    }
    Ok((all, width.unwrap_or(1)))
}

/// Reads an array of whole numbers in row-major order, without rounding.
fn whole_numbers(what: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<Vec<i64>> {
    let wrong = |message: String| Err(errors::argument(what, "keys", message));
    let kind = array.dtype().kind();
    let has_large = kind == b'u' && array.dtype().itemsize() == size_of::<u64>();
    if array.len() == 0 {
        return Ok(vec![]);
    }
    match kind {
        b'i' | b'u' if !has_large => {
            let numpy = array.py().import("numpy")?;
            let plain = numpy.call_method1("require", (array, "int64", ("C", "A")))?;
            let plain: PyReadonlyArrayDyn<'_, i64> = plain.extract().map_err(errors::internal)?;
            Ok(plain.as_slice().map_err(errors::internal)?.to_vec())
        }
        b'u' | b'O' => {
            let flat = array.call_method0("ravel")?.call_method0("tolist")?;
            let mut numbers = vec![];
            for item in flat.try_iter()? {
                let item = item?;
                match whole(&item) {
                    Some(number) => numbers.push(number),
                    None => return wrong(format!("expected whole numbers below 2^63, got {}", item.repr()?)),
                }
            }
            Ok(numbers)
        }
        b'f' => {
            any_numbers(what, "keys", array)?;
            wrong("expected texts or whole numbers, got numbers with fractions".to_owned())
        }
        _ => wrong(format!("expected texts or whole numbers, got an array of the type {}", array.dtype())),
    }
}
