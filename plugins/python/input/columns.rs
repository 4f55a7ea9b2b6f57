//! Fields of many factors or values at once: arrays have one row per item, everything else is shared.
use super::arrays::{Numbers, any_numbers, array_like};
use super::node::{array_node, node, number, within};
use crate::errors::{self, Mistake};
use manifactor::config::{Field, Node, Place, SourceText, Table, Value};
use numpy::{PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyMapping};

/// A document of one factor or value, with numbers that are filled in row by row. Only the parsed object is
/// created for each row.
pub(crate) struct Columns {
    document: Node,
    columns: Vec<Column>,
}

struct Column {
    /// Indices of the fields on the path to the number.
    path: Vec<usize>,
    numbers: Numbers,
}

impl Columns {
    /// Splits fields into columns; each array has to have `rows` rows.
    ///
    /// # Errors
    /// If an array has a different length, or if no document can hold a value.
    pub(crate) fn new(what: &str, rows: usize, fields: &Bound<'_, PyDict>) -> PyResult<Self> {
        let mut columns = vec![];
        let document = table(what, rows, "", fields, &mut vec![], &mut columns)?;
        Ok(Self { document, columns })
    }

    /// Returns true if all rows are equal.
    pub(crate) fn is_constant(&self) -> bool {
        self.columns.is_empty()
    }

    /// Returns the document of a row.
    pub(crate) fn row(&mut self, row: usize) -> &Node {
        for Column { path, numbers } in &self.columns {
            let target = path.iter().try_fold(&mut self.document, |node, step| match &mut node.value {
                Value::Table(table) => table.get_index_mut(*step).map(|(_, field)| &mut field.node),
                _ => None,
            });
            if let Some(target) = target {
                fill(target, &mut numbers.row(row).iter(), numbers.whole);
            }
        }
        &self.document
    }
}

/// Returns fields as a dict.
///
/// # Errors
/// If they are no mapping.
pub(crate) fn dict_of<'py>(fields: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyDict>> {
    if let Ok(dict) = fields.cast::<PyDict>() {
        return Ok(dict.clone());
    }
    let dict = PyDict::new(fields.py());
    dict.update(fields.cast::<PyMapping>()?)?;
    Ok(dict)
}

/// Replaces the numbers of a node.
fn fill(node: &mut Node, numbers: &mut std::slice::Iter<'_, f64>, whole: bool) {
    match &mut node.value {
        Value::Array(items) => items.iter_mut().for_each(|item| fill(item, numbers, whole)),
        value => {
            if let Some(x) = numbers.next() {
                *value = number(*x, whole);
            }
        }
    }
}

fn table(
    what: &str,
    rows: usize,
    path: &str,
    fields: &Bound<'_, PyDict>,
    steps: &mut Vec<usize>,
    columns: &mut Vec<Column>,
) -> PyResult<Node> {
    let place = |path: &str| -> Place { SourceText::new(path, "").place(0..0) };
    let mut table = Table::default();
    for (name, value) in fields {
        let Ok(name) = name.extract::<String>() else {
            return Err(errors::argument(what, path, format!("expected names as keys, got {name}")));
        };
        if value.is_none() {
            continue;
        }
        let inner = within(path, &name);
        steps.push(table.len());
        let node = if value.hasattr("__manifactor_columns__")? {
            // an array of values
            let fields = value.call_method0("__manifactor_columns__")?;
            self::table(what, rows, &inner, fields.cast()?, steps, columns)?
        } else if let Some(array) = array_like(what, &inner, &value)? {
            let numbers = column(what, rows, &inner, &array)?;
            let shape = numbers.shape.get(1..).unwrap_or_default();
            let node = array_node(&place(&inner), shape, numbers.row(0), numbers.whole);
            columns.push(Column { path: steps.clone(), numbers });
            node
        } else if let Ok(fields) = value.cast::<PyDict>() {
            self::table(what, rows, &inner, fields, steps, columns)?
        } else {
            node(what, &inner, &value)?
        };
        steps.pop();
        table.insert(name, Field { key: place(&inner), node });
    }
    Ok(Node::new(place(path), Value::Table(table)))
}

/// Reads an array with one row per item. The length is checked before the copy.
fn column(what: &str, rows: usize, name: &str, array: &Bound<'_, PyUntypedArray>) -> PyResult<Numbers> {
    if array.shape().first() != Some(&rows) {
        let found = array.shape().first().map_or("no axis".to_owned(), |n| format!("{n} rows"));
        let mistake =
            Mistake::at(name, format!("expected an array of {rows} rows, one for each, got {found}"));
        let help = "an array is a column; write what is the same for all as a number, a list or a tuple";
        return Err(errors::arguments(what, vec![mistake.help(help)]));
    }
    any_numbers(what, name, array)
}
