//! Registered types as Python objects: factors, losses, solvers, starts and values of variables.
use crate::errors::{self, Mistake};
use crate::input::{
    Untagged, array, json_to_python, node, numbers, plain_node, to_array, to_python, unchangeable,
};
use crate::threads::detach;
use manifactor::config::{Errors, Field, Node, Place, Table, Value, nearest};
use manifactor::graph::catalogue::{Entry, entries, find};
use manifactor::graph::loss::Loss;
use manifactor::graph::{Factor, Variable};
use manifactor::solve::{Optimizer, Start};
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::{PyAttributeError, PyTypeError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use serde_json::Value as Json;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;

/// A NumPy array.
type Floats<'py> = Bound<'py, PyArrayDyn<f64>>;

/// An immutable object of a registered type. Python has one subclass for each kind.
#[pyclass(module = "manifactor._native", frozen, subclass)]
pub(crate) struct Chosen(pub What);

/// The object, by kind.
#[derive(Clone)]
pub(crate) enum What {
    Factor(Arc<dyn Factor>),
    Loss(Arc<dyn Loss>),
    Solver(Arc<dyn Optimizer>),
    Start(Arc<dyn Start>),
    Variable(Arc<dyn Variable>),
}

impl What {
    /// The kind, as in the catalogue, and the name in documents.
    pub(crate) fn names(&self) -> (&'static str, &'static str) {
        match self {
            Self::Factor(x) => ("factor", x.typetag_name()),
            Self::Loss(x) => ("loss", x.typetag_name()),
            Self::Solver(x) => ("solver", x.typetag_name()),
            Self::Start(x) => ("start", x.typetag_name()),
            Self::Variable(x) => ("variable", x.typetag_name()),
        }
    }

    /// Reads an object and adds all mistakes to `errors`. The node has the `type`.
    fn read(kind: &str, node: &Node, errors: &Errors) -> Option<Self> {
        match kind {
            "factor" => node.read::<Box<dyn Factor>>(errors).map(|x| Self::Factor(x.into())),
            "loss" => node.read::<Box<dyn Loss>>(errors).map(|x| Self::Loss(x.into())),
            "solver" => node.read::<Box<dyn Optimizer>>(errors).map(|x| Self::Solver(x.into())),
            "start" => node.read::<Box<dyn Start>>(errors).map(|x| Self::Start(x.into())),
            "variable" => node.read::<Box<dyn Variable>>(errors).map(|x| Self::Variable(x.into())),
            _ => None,
        }
    }

    /// Reads an object of a known type from fields without mistakes; `None` if there is one.
    fn of_entry(entry: &Entry, fields: &Node) -> Option<Self> {
        match entry.kind {
            "factor" => entry.read::<dyn Factor>(fields).ok().map(|x| Self::Factor(x.into())),
            "loss" => entry.read::<dyn Loss>(fields).ok().map(|x| Self::Loss(x.into())),
            "solver" => entry.read::<dyn Optimizer>(fields).ok().map(|x| Self::Solver(x.into())),
            "start" => entry.read::<dyn Start>(fields).ok().map(|x| Self::Start(x.into())),
            "variable" => entry.read::<dyn Variable>(fields).ok().map(|x| Self::Variable(x.into())),
            _ => None,
        }
    }

    fn json(&self) -> PyResult<Json> {
        let json = match self {
            Self::Factor(x) => serde_json::to_value(&**x),
            Self::Loss(x) => serde_json::to_value(&**x),
            Self::Solver(x) => serde_json::to_value(&**x),
            Self::Start(x) => serde_json::to_value(&**x),
            Self::Variable(x) => serde_json::to_value(&**x),
        };
        json.map_err(|error| errors::argument(self.names().1, "", error))
    }

    /// Returns whether both are equal; factors of Python functions are equal only to themselves.
    fn equals(&self, other: &Self) -> PyResult<bool> {
        match (self, other) {
            (Self::Factor(x), Self::Factor(y)) => Ok(same_factor(&**x, &**y)),
            _ => Ok(self.names() == other.names() && self.json()? == other.json()?),
        }
    }

    /// Converts it to an object of its Python class.
    pub(crate) fn into_python(self, py: Python<'_>) -> PyResult<Bound<'_, PyAny>> {
        let (kind, name) = self.names();
        let class = py.import("manifactor.chosen")?.call_method1("class_of", (kind, name))?;
        let made = Bound::new(py, Chosen(self))?;
        py.get_type::<Chosen>().call_method1("__new__", (class, made))
    }
}

#[pymethods]
impl Chosen {
    /// Creates an object from kind, name and fields, or copies an object into a subclass.
    #[new]
    #[pyo3(signature = (kind, name = None, fields = None))]
    fn new(
        kind: &Bound<'_, PyAny>,
        name: Option<&str>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Self> {
        if let Ok(other) = kind.cast::<Self>() {
            return Ok(Self(other.get().0.clone()));
        }
        read(kind.cast::<PyString>()?.to_str()?, name.unwrap_or_default(), fields).map(Self)
    }

    /// Kind of the object: `"factor"`, `"loss"`, `"solver"`, `"start"` or `"variable"`.
    #[getter]
    fn kind(&self) -> &'static str {
        self.0.names().0
    }

    /// Name of the type in documents.
    #[getter]
    fn r#type(&self) -> &'static str {
        self.0.names().1
    }

    /// Returns the fields and the `type`, as in a document.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        json_to_python(py, &self.json()?)
    }

    /// A field, read-only: numbers as an array, nested fields as a mapping.
    fn __getattr__<'py>(slf: &Bound<'py, Self>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let py = slf.py();
        let Ok(json) = slf.get().json() else {
            let message = format!("a factor of a Python function has no field `{name}`");
            return Err(PyAttributeError::new_err(message));
        };
        match json.get(name) {
            Some(value) => unchangeable(py, value),
            None => {
                let fields: Vec<&str> =
                    json.as_object().map(|o| o.keys().map(String::as_str).collect()).unwrap_or_default();
                let (_, of) = slf.get().0.names();
                Err(PyAttributeError::new_err(format!(
                    "`{of}` has no field `{name}`: there are {}",
                    fields.join(", ")
                )))
            }
        }
    }

    fn __setattr__(&self, name: &str, _value: &Bound<'_, PyAny>) -> PyResult<()> {
        self.unchanged(name)
    }

    fn __delattr__(&self, name: &str) -> PyResult<()> {
        self.unchanged(name)
    }

    /// The constructor with its arguments, as Python reads them.
    fn __repr__(slf: &Bound<'_, Self>) -> PyResult<String> {
        let (py, this) = (slf.py(), slf.get());
        let name = match &this.0 {
            What::Variable(_) => slf.get_type().name()?.to_string(),
            other => other.names().1.to_owned(),
        };
        // a Python function has no fields
        let Ok(json) = this.json() else { return Ok(format!("{name}(…)")) };
        let fields = json.as_object().into_iter().flatten().filter(|(name, _)| *name != "type");
        let field = |(name, value)| Ok(format!("{name}={}", json_to_python(py, value)?.repr()?));
        let fields = fields.map(field).collect::<PyResult<Vec<_>>>()?;
        Ok(format!("{name}({})", fields.join(", ")))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> PyResult<bool> {
        match other.cast::<Self>() {
            Ok(other) => self.0.equals(&other.get().0),
            Err(_) => Ok(false),
        }
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }

    /// For `pickle`: the kind and the fields, without rounding.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (&'static str, String))> {
        let read = py.import("manifactor._native")?.getattr("unpickle")?;
        Ok((read, (self.0.names().0, self.json()?.to_string())))
    }

    fn __hash__(&self) -> isize {
        let mut hasher = DefaultHasher::new();
        self.0.names().hash(&mut hasher);
        // a Python function has no fields
        if let Ok(json) = self.json() {
            hash_json(&json, &mut hasher);
        }
        hasher.finish() as isize
    }
}

impl Chosen {
    pub(crate) fn json(&self) -> PyResult<Json> {
        self.0.json()
    }

    /// The error of a change, which would be lost.
    fn unchanged(&self, name: &str) -> PyResult<()> {
        let (_, of) = self.0.names();
        Err(PyAttributeError::new_err(format!(
            "`{of}` does not change: create a new one with another `{name}`"
        )))
    }
}

/// Returns whether factors are equal; factors of Python functions are equal only to themselves.
pub(crate) fn same_factor(x: &dyn Factor, y: &dyn Factor) -> bool {
    match (serde_json::to_value(x), serde_json::to_value(y)) {
        (Ok(a), Ok(b)) => x.typetag_name() == y.typetag_name() && a == b,
        // a Python function cannot be written
        _ => std::ptr::addr_eq(x, y),
    }
}

/// Reads an object from its fields, as in a document.
fn read(kind: &str, name: &str, fields: Option<&Bound<'_, PyDict>>) -> PyResult<What> {
    let entry = known(kind, name)?;
    let given = || fields.into_iter().flatten().filter(|(_, value)| !value.is_none());
    // only messages need places, so the fields are read without them first
    let plain: Option<Table> = given()
        .map(|(field, value)| {
            let field = field.cast::<PyString>().ok()?.to_str().ok()?;
            let node = plain_node(&value).filter(|_| field != "type")?;
            Some((field.to_owned(), Field { key: Place::nowhere(), node }))
        })
        .collect::<Option<_>>()
        .map(Box::new);
    if let Some(what) = plain.and_then(|table| What::of_entry(entry, &nowhere(Value::Table(table)))) {
        return Ok(what);
    }
    let mut table = Table::default();
    let field = |node| Field { key: Place::nowhere(), node };
    table.insert("type".into(), field(nowhere(Value::String(name.to_owned()))));
    for (field_name, value) in given() {
        let field_name: String = field_name.extract()?;
        let value = node(name, &field_name, &value)?;
        table.insert(field_name, Field { key: value.place.clone(), node: value });
    }
    let (node, errors) = (nowhere(Value::Table(table)), Errors::new());
    let what = What::read(kind, &node, &errors);
    errors.finish(what).map_err(|diagnostics| errors::read(name, &diagnostics))
}

/// Makes a factor whose only field is a value.
pub(crate) fn factor_of_value(
    name: &str,
    field: &str,
    value: &Arc<dyn Variable>,
) -> PyResult<Arc<dyn Factor>> {
    let entry = known("factor", name)?;
    if !value.erased().is_finite() {
        return Err(errors::argument(name, field, "expected finite numbers"));
    }
    let node = Untagged(value.clone()).node(&Place::nowhere())?;
    let table = Table::new([(field.to_owned(), Field { key: Place::nowhere(), node })].into_iter().collect());
    let read = entry.read::<dyn Factor>(&nowhere(Value::Table(table)));
    read.map(Arc::from).map_err(|error| errors::argument(name, field, error.fault()))
}

fn nowhere(value: Value) -> Node {
    Node::new(Place::nowhere(), value)
}

/// Hashes JSON so that equal values have equal hashes.
fn hash_json(json: &Json, hasher: &mut impl Hasher) {
    match json {
        Json::Array(items) => items.iter().for_each(|item| hash_json(item, hasher)),
        // two tables are equal in any order of their fields
        Json::Object(fields) => {
            let hashes = fields.iter().map(|(name, value)| {
                let mut hasher = DefaultHasher::new();
                name.hash(&mut hasher);
                hash_json(value, &mut hasher);
                hasher.finish()
            });
            hashes.fold(0, u64::wrapping_add).hash(hasher);
        }
        // 0.0 and -0.0 are equal
        Json::Number(x) => (x.as_f64().unwrap_or_default() + 0.0).to_bits().hash(hasher),
        other => other.hash(hasher),
    }
}

/// Restores an object from the output of [`Chosen::__reduce__`].
#[pyfunction]
fn unpickle<'py>(py: Python<'py>, kind: &str, text: &str) -> PyResult<Bound<'py, PyAny>> {
    let read = match kind {
        "factor" => serde_json::from_str::<Box<dyn Factor>>(text).map(|x| What::Factor(x.into())),
        "loss" => serde_json::from_str::<Box<dyn Loss>>(text).map(|x| What::Loss(x.into())),
        "solver" => serde_json::from_str::<Box<dyn Optimizer>>(text).map(|x| What::Solver(x.into())),
        "start" => serde_json::from_str::<Box<dyn Start>>(text).map(|x| What::Start(x.into())),
        _ => serde_json::from_str::<Box<dyn Variable>>(text).map(|x| What::Variable(x.into())),
    };
    read.map_err(|error| errors::argument("pickle", kind, error))?.into_python(py)
}

/// Returns a value without the name of its type; any other object is returned unchanged.
#[pyfunction]
fn untagged<'py>(value: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    match value.cast::<Chosen>().map(|chosen| &chosen.get().0) {
        Ok(What::Variable(x)) => Ok(Bound::new(value.py(), Untagged(x.clone()))?.into_any()),
        _ => Ok(value.clone()),
    }
}

/// Returns the fields of a type with values that do not name their types; only constants of a formula do.
pub(crate) fn untagged_fields<'py>(name: &str, fields: &Bound<'py, PyDict>) -> PyResult<Bound<'py, PyDict>> {
    if name == "expression" {
        return Ok(fields.clone());
    }
    let plain = PyDict::new(fields.py());
    for (field, value) in fields {
        plain.set_item(field, untagged(&value)?)?;
    }
    Ok(plain)
}

/// Returns the type of this kind and name, or an error that names similar ones.
pub(crate) fn known(kind: &str, name: &str) -> PyResult<&'static Entry> {
    if let Some(entry) = find(kind, name) {
        return Ok(entry);
    }
    let names: Vec<&str> = entries(kind).iter().map(|entry| entry.name).collect();
    let mistake = Mistake::at("type", format!("unknown {kind} `{name}`"));
    let meant =
        nearest(name, names.iter().copied()).map_or(String::new(), |near| format!("did you mean `{near}`? "));
    Err(errors::arguments("", vec![mistake.help(format!("{meant}there are {}", names.join(", ")))]))
}

/// Defines the conversion of an argument of one kind.
macro_rules! argument {
    ($function:ident, $variant:ident, $type:ty, $noun:literal) => {
        #[doc = concat!("An argument that is ", $noun, ".")]
        pub(crate) fn $function(name: &str, value: &Bound<'_, PyAny>) -> PyResult<Arc<$type>> {
            match value.cast::<Chosen>().map(|chosen| &chosen.get().0) {
                Ok(What::$variant(x)) => Ok(x.clone()),
                _ => {
                    let found = value.get_type().name()?;
                    let mut message = format!("{name}: expected {}, got {found}", $noun);
                    // the user has passed a constructor, or a function under @mf.factor, instead of calling
                    // it
                    if value.is_callable()
                        && let Ok(called) = value.getattr("__name__")
                    {
                        message += &format!("; call it: {called}(…)");
                    }
                    Err(PyTypeError::new_err(message))
                }
            }
        }
    };
}
argument!(factor, Factor, dyn Factor, "a factor");
argument!(loss, Loss, dyn Loss, "a loss");
argument!(solver, Solver, dyn Optimizer, "a solver");
argument!(start, Start, dyn Start, "a start");
argument!(variable, Variable, dyn Variable, "a value such as Se3(…)");

fn variables(value: &Bound<'_, PyAny>) -> PyResult<Vec<Arc<dyn Variable>>> {
    value.try_iter()?.map(|item| variable("variables", &item?)).collect()
}

/// Returns the names of the tangent directions.
#[pyfunction]
fn tangent(x: &Bound<'_, PyAny>) -> PyResult<Vec<&'static str>> {
    Ok(variable("x", x)?.erased().tangent().to_vec())
}

/// Returns the residual of a factor and its Jacobian for each variable, not whitened.
#[pyfunction]
fn linearize<'py>(
    of: &Bound<'py, PyAny>,
    at: &Bound<'py, PyAny>,
) -> PyResult<(Floats<'py>, Vec<Floats<'py>>)> {
    let (py, of, at) = (of.py(), factor("factor", of)?, variables(at)?);
    let linearization = detach(py, || {
        let refs: Vec<&dyn Variable> = at.iter().map(|x| &**x).collect();
        of.erased().linearize(&refs)
    })?;
    let Some(linearization) = linearization else {
        let types: Vec<_> = at.iter().map(|x| x.typetag_name()).collect();
        let message = format!("`{}` does not take ({})", of.typetag_name(), types.join(", "));
        return Err(errors::argument("linearize", "variables", message));
    };
    let by_rows = |m: &manifactor::nalgebra::DMatrix<f64>| {
        to_array(py, &[m.nrows(), m.ncols()], m.transpose().as_slice().to_vec())
    };
    let rows = linearization.residual.len();
    let jacobians = linearization.jacobians.iter().map(by_rows).collect::<PyResult<_>>()?;
    Ok((to_array(py, &[rows], linearization.residual)?, jacobians))
}

/// Returns ρ and ρ' of a loss at squared norms of whitened residuals.
#[pyfunction]
fn rho<'py>(of: &Bound<'py, PyAny>, squared: &Bound<'py, PyAny>) -> PyResult<(Floats<'py>, Floats<'py>)> {
    let (py, of) = (of.py(), loss("loss", of)?);
    let axes = array("rho", "squared", squared)?.shape().len();
    let squared = numbers("rho", "squared", squared, &vec![None; axes])?;
    let (rho, weight) = squared.values.iter().map(|s| of.erased().rho(*s)).unzip();
    Ok((to_array(py, &squared.shape, rho)?, to_array(py, &squared.shape, weight)?))
}

/// Checks a factor at random points, like `manifactor check-factor`. Returns whether its laws hold, and the
/// report as text and as a dict.
#[pyfunction]
#[pyo3(signature = (of, around = None, names = None, points = 256, seed = 0))]
fn check_factor<'py>(
    of: &Bound<'py, PyAny>,
    around: Option<&Bound<'py, PyAny>>,
    names: Option<Vec<String>>,
    points: usize,
    seed: u64,
) -> PyResult<(bool, String, Bound<'py, PyAny>)> {
    use manifactor::testing::{FactorCheck, Subject};
    let (py, of) = (of.py(), factor("factor", of)?);
    // a Python function has no entry; any entry will do, because only the examples of the variables are
    // needed
    let entry = find("factor", of.typetag_name()).or_else(|| find("factor", "expression"));
    let entry = entry.ok_or_else(|| errors::internal("no entry `expression`"))?;
    let mut subject = Subject::around_examples(entry, of).map_err(errors::solve)?;
    if let Some(names) = names.filter(|names| names.len() == subject.keys.len()) {
        subject.keys = names;
    }
    if let Some(around) = around {
        let around = variables(around)?;
        if around.len() != subject.around.len() {
            let (expected, found) = (subject.around.len(), around.len());
            return Err(errors::argument(
                "check_factor",
                "around",
                format!("expected {expected} values, got {found}"),
            ));
        }
        subject.around = around.iter().map(|x| x.erased().clone_box()).collect();
    }
    let report = detach(py, || FactorCheck { points, seed, ..FactorCheck::default() }.run(&subject))?;
    Ok((report.holds(), report.to_string(), to_python(py, &report)?))
}

pub(crate) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(unpickle, module)?)?;
    module.add_function(wrap_pyfunction!(untagged, module)?)?;
    module.add_function(wrap_pyfunction!(tangent, module)?)?;
    module.add_function(wrap_pyfunction!(linearize, module)?)?;
    module.add_function(wrap_pyfunction!(rho, module)?)?;
    module.add_function(wrap_pyfunction!(check_factor, module)?)
}
