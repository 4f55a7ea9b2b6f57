//! Keys: texts, or integers with a prefix.
use super::arrays::{any_numbers, array};
use crate::errors;
use manifactor::graph::Key;
use numpy::{PyArrayDescrMethods, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyString;
use std::collections::HashMap;

/// Returns a key, which has at least one character, as in documents.
pub(crate) fn key(what: &str, text: &str) -> PyResult<Key> {
    match text.is_empty() {
        true => Err(errors::argument(what, "key", "a key needs at least one character, such as \"x0\"")),
        false => Ok(text.into()),
    }
}

/// Reads the keys of one factor: one text or several.
pub(crate) fn keys(what: &str, value: &Bound<'_, PyAny>) -> PyResult<Vec<Key>> {
    if let Ok(key) = value.cast::<PyString>() {
        return Ok(vec![self::key(what, &key.to_cow()?)?]);
    }
    let expected =
        || errors::argument(what, "keys", "expected a text, or several: \"x0\", or [\"x0\", \"x1\"]");
    let items = value.try_iter().map_err(|_| expected())?;
    let text = |item: PyResult<Bound<'_, PyAny>>| {
        key(what, &item?.cast::<PyString>().map_err(|_| expected())?.to_cow()?)
    };
    items.map(text).collect()
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
