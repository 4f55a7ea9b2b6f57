//! Keys: texts, or whole numbers with a prefix.
use super::arrays::{any_numbers, array};
use crate::errors;
use manifactor::graph::Key;
use numpy::{PyArrayDescrMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyString, PyTuple};
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
    let whole = |value: &Bound<'_, PyAny>| match value.is_instance_of::<PyBool>() {
        true => None,
        false => value.extract::<i64>().ok(),
    };
    let Ok(pair) = value.cast::<PyTuple>() else { return Some(Key::indexed("x", whole(value)?)) };
    let [prefix, number] = pair.iter().collect::<Vec<_>>().try_into().ok()?;
    Some(Key::indexed(&prefix.cast::<PyString>().ok()?.to_cow().ok()?, whole(&number)?))
}

/// Reads the keys of one factor: one key or several.
pub(crate) fn keys(what: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Key>> {
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
    let of_texts = || {
        let items = value.try_iter().map_err(|_| {
            errors::argument(
                what,
                "keys",
                "expected texts by rows, or an array of whole numbers with `prefix`",
            )
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
    };
    let is_array = value.cast::<PyUntypedArray>().is_ok();
    if !is_array && prefix.is_none() {
        return of_texts();
    }
    let array = array(what, "keys", value)?;
    if array.dtype().kind() == b'U' || array.dtype().kind() == b'O' {
        let list = array.call_method0("tolist")?;
        return key_rows(what, &list, None);
    }
    let numbers = any_numbers(what, "keys", &array)?;
    let width = match numbers.shape.as_slice() {
        [_] => 1,
        [_, width] => *width,
        shape => {
            let message = format!("expected an array of one or two axes, got {}", shape.len());
            return Err(errors::argument(what, "keys", message));
        }
    };
    if !numbers.whole {
        return Err(errors::argument(
            what,
            "keys",
            "expected texts or whole numbers, got numbers with fractions",
        ));
    }
    let prefixes = match prefix {
        None => vec!["x".into()],
        Some(prefix) => prefixes_of(prefix).map_err(|_| {
            errors::argument(what, "prefix", "expected a text, or one for each column of `keys`")
        })?,
    };
    if prefixes.len() != 1 && prefixes.len() != width {
        let message =
            format!("expected a text, or {width}: one for each column of `keys`, got {}", prefixes.len());
        return Err(errors::argument(what, "prefix", message));
    }
    // many factors share a variable, so its key is created only once
    let mut made: HashMap<(usize, i64), Key> = HashMap::new();
    let all = numbers.values.iter().enumerate().map(|(i, number)| {
        let (column, number) = (i % width.max(1) % prefixes.len(), *number as i64);
        let prefix = prefixes.get(column).map_or("", |prefix| prefix.as_str());
        made.entry((column, number)).or_insert_with(|| Key::indexed(prefix, number)).clone()
    });
    Ok((all.collect(), width))
}
