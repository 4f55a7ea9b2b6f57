//! Noise of one factor and of many.
use crate::errors;
use crate::input::{Numbers, array, numbers, to_array, to_python};
use manifactor::graph::Noise as Inner;
use manifactor::nalgebra::DMatrix;
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyFloat, PyInt};

/// Gaussian noise of a measurement. Default: a standard deviation of 1 in every row of the residual.
#[pyclass(module = "manifactor", frozen)]
pub(crate) struct Noise(pub Inner);

const FORMS: [&str; 4] = ["sigma", "sigmas", "covariance", "information"];

#[pymethods]
impl Noise {
    /// Takes one of `sigma` (a standard deviation for all rows), `sigmas` (one for each row, shape (m,)),
    /// `covariance` and `information` (shape (m, m), symmetric and positive definite), in the units of the
    /// residual's rows. `observed` marks the measured rows.
    #[new]
    #[pyo3(signature = (sigma = None, *, sigmas = None, covariance = None, information = None, observed = None))]
    fn new(
        sigma: Option<&Bound<'_, PyAny>>,
        sigmas: Option<&Bound<'_, PyAny>>,
        covariance: Option<&Bound<'_, PyAny>>,
        information: Option<&Bound<'_, PyAny>>,
        observed: Option<Vec<bool>>,
    ) -> PyResult<Self> {
        let given = FORMS.into_iter().zip([sigma, sigmas, covariance, information]);
        let given: Vec<_> = given.filter_map(|(name, value)| Some((name, value?))).collect();
        let noise = match given.as_slice() {
            [] => Inner::unit(),
            [(name, value)] => {
                let numbers = read("Noise", name, name, value, None)?;
                made("Noise", name, name, &numbers.values)?
            }
            [(first, _), (second, _), ..] => {
                let message = format!(
                    "expected one of sigma, sigmas, covariance, information; got {first} and {second}"
                );
                return Err(errors::argument("Noise", second, message));
            }
        };
        let Some(observed) = observed else { return Ok(Self(noise)) };
        if !observed.contains(&true) {
            let message = "expected a row that was measured: without any, leave the factor out";
            return Err(errors::argument("Noise", "observed", message));
        }
        let noise = noise.observing(&observed);
        // the size of the noise, if it has one, must match `observed`
        noise.whitener(observed.len()).map_err(|error| errors::argument("Noise", "observed", error))?;
        Ok(Self(noise))
    }

    /// Returns the information matrix of a residual with this number of rows, shape (rows, rows).
    fn information_matrix<'py>(&self, py: Python<'py>, rows: usize) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
        let matrix = self.0.information_matrix(rows).map_err(errors::graph)?;
        to_array(py, &[rows, rows], matrix.as_slice().to_vec())
    }

    /// Returns the noise as in a document.
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0)
    }

    pub(super) fn __repr__(&self) -> PyResult<String> {
        let json = serde_json::to_value(&self.0).map_err(errors::internal)?;
        let fields = json.as_object().into_iter().flatten();
        let fields: Vec<_> = fields.map(|(name, value)| format!("{name}={value}")).collect();
        Ok(format!("Noise({})", fields.join(", ")))
    }

    fn __eq__(&self, other: &Bound<'_, PyAny>) -> bool {
        other.cast::<Self>().is_ok_and(|other| other.get().0 == self.0)
    }

    fn __copy__<'py>(slf: &Bound<'py, Self>) -> Bound<'py, Self> {
        slf.clone()
    }

    fn __deepcopy__<'py>(slf: &Bound<'py, Self>, _memo: &Bound<'py, PyAny>) -> Bound<'py, Self> {
        slf.clone()
    }

    /// For `pickle`: the content, without rounding.
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        let text = serde_json::to_string(&slf.get().0).map_err(errors::internal)?;
        Ok((slf.get_type().getattr("_unpickle")?, (text,)))
    }

    #[staticmethod]
    #[pyo3(name = "_unpickle")]
    fn unpickle(text: &str) -> PyResult<Self> {
        serde_json::from_str(text).map(Self).map_err(|error| errors::argument("pickle", "noise", error))
    }

    fn __hash__(&self) -> isize {
        0
    }
}

/// Reads the numbers of one form, with one row for each factor if `rows` is given. Errors use the name
/// `name`.
fn read(
    what: &str,
    name: &str,
    form: &str,
    value: &Bound<'_, PyAny>,
    rows: Option<usize>,
) -> PyResult<Numbers> {
    let axes = match form {
        "sigma" => 0,
        "sigmas" => 1,
        _ => 2,
    };
    let shape: Vec<_> = rows.into_iter().map(Some).chain(std::iter::repeat_n(None, axes)).collect();
    let numbers = numbers(what, name, value, &shape)?;
    match numbers.shape.as_slice() {
        [.., 0] if axes > 0 => {
            Err(errors::argument(what, name, "expected a number for each row of the residual, got none"))
        }
        [.., r, c] if axes == 2 && r != c => Err(errors::argument(
            what,
            name,
            format!("expected a square matrix, got {r} rows and {c} columns"),
        )),
        _ => Ok(numbers),
    }
}

/// Returns the noise of one factor.
fn made(what: &str, name: &str, form: &str, values: &[f64]) -> PyResult<Inner> {
    let size = (values.len() as f64).sqrt().round() as usize;
    let matrix = || DMatrix::from_row_slice(size, size, values);
    let noise = match form {
        "sigma" => Inner::sigma(values.first().copied().unwrap_or(f64::NAN)),
        "sigmas" => Inner::sigmas(values),
        "covariance" => Inner::covariance(matrix()),
        _ => Inner::information(matrix()),
    };
    noise.map_err(|error| errors::argument(what, name, error))
}

/// Reads the arguments that give the noise of one factor: one of them, or none for unit noise.
pub(super) fn of_arguments(
    what: &str,
    noise: Option<&Bound<'_, PyAny>>,
    sigma: Option<&Bound<'_, PyAny>>,
    sigmas: Option<&Bound<'_, PyAny>>,
) -> PyResult<Inner> {
    let (form, value) = match (noise, sigma, sigmas) {
        (noise, None, None) => return one(what, noise),
        (None, Some(sigma), None) => ("sigma", sigma),
        (None, None, Some(sigmas)) => ("sigmas", sigmas),
        _ => return Err(errors::argument(what, "noise", "expected one of noise, sigma and sigmas")),
    };
    made(what, form, form, &read(what, form, form, value, None)?.values)
}

/// Reads the argument `noise` of one factor: a `Noise`, or a number, which is a sigma.
pub(super) fn one(what: &str, value: Option<&Bound<'_, PyAny>>) -> PyResult<Inner> {
    let Some(value) = value else { return Ok(Inner::unit()) };
    if let Ok(noise) = value.cast::<Noise>() {
        return Ok(noise.get().0.clone());
    }
    if value.is_instance_of::<PyFloat>() || value.is_instance_of::<PyInt>() {
        return made(what, "noise", "sigma", &[value.extract()?]);
    }
    // a number of NumPy; only float64 is a float
    if value.hasattr("dtype")? && array(what, "noise", value)?.shape().is_empty() {
        return made(what, "noise", "sigma", &read(what, "noise", "sigma", value, None)?.values);
    }
    let found = value.get_type().name()?;
    Err(PyTypeError::new_err(format!("noise: expected a Noise or a standard deviation, got {found}")))
}

/// The noise of many factors.
pub(super) enum Rows {
    Same(Inner),
    Each { form: &'static str, numbers: Numbers },
}

impl Rows {
    /// Reads the argument `noise`: as in [`one`], or a dict of one form, whose array has a row for each
    /// factor.
    pub(super) fn new(what: &str, rows: usize, value: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let Some(fields) = value.and_then(|value| value.cast::<PyDict>().ok()) else {
            return one(what, value).map(Self::Same);
        };
        let mut given = FORMS.into_iter().filter_map(|form| Some((form, fields.get_item(form).ok()??)));
        let (Some((form, value)), None, 1) = (given.next(), given.next(), fields.len()) else {
            let message = "expected a dict of one of sigma, sigmas, covariance, information with an array: a row for each factor";
            return Err(errors::argument(what, "noise", message));
        };
        let name = format!("noise.{form}");
        // check the length before copying
        let found = array(what, &name, &value)?.shape().first().copied();
        if found != Some(rows) {
            let found = found.map_or("no axis".to_owned(), |n| format!("{n} rows"));
            return Err(errors::argument(
                what,
                &name,
                format!("expected an array of {rows} rows, one for each, got {found}"),
            ));
        }
        let numbers = read(what, &name, form, &value, Some(rows))?;
        Ok(Self::Each { form, numbers })
    }

    pub(super) fn row(&mut self, row: usize) -> PyResult<Inner> {
        match self {
            Self::Same(noise) => Ok(noise.clone()),
            Self::Each { form, numbers } => {
                made("add_many", &format!("noise.{form}, row {row}"), form, numbers.row(row))
            }
        }
    }
}
