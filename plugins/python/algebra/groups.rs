//! Groups: the identity, matrices, and elements from their numbers.
use super::array::{Points, into_python};
use crate::errors::{self, Mistake};
use crate::input::{array, numbers, to_array};
use manifactor::geometry::{LieGroup, MatrixError, Se2, Se3, Sim3, So2, So3};
use manifactor::graph::Variable;
use manifactor::graph::quantity::Quantity;
use manifactor::nalgebra::SMatrix;
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::prelude::*;
use std::any::Any;
use std::sync::Arc;

type FromMatrix = Result<Arc<dyn Variable>, MatrixError>;

/// A group of matrices.
pub(super) struct Group {
    name: &'static str,
    /// Number of rows of its matrices.
    size: usize,
    identity: fn() -> Arc<dyn Variable>,
    /// Reads the flat form, and removes rounding errors.
    pub read: fn(&[f64]) -> Arc<dyn Variable>,
    /// Returns the matrix by rows.
    matrix: fn(&dyn Any) -> Option<Vec<f64>>,
    /// Reads a matrix by rows.
    from_matrix: fn(&[f64]) -> FromMatrix,
}

/// Defines a group from the type, the rows of its matrices, and the function that removes rounding errors.
macro_rules! group {
    ($type:ident, $size:literal, $normalized:expr) => {
        Group {
            name: <$type as LieGroup>::NAME,
            size: $size,
            identity: || Arc::new($type::<f64>::identity()),
            read: |flat| {
                let normalized: fn($type) -> $type = $normalized;
                Arc::new(normalized(<$type as Quantity>::read::<f64>(flat)))
            },
            matrix: |x| Some(x.downcast_ref::<$type>()?.matrix().transpose().as_slice().to_vec()),
            from_matrix: |rows| {
                let matrix = SMatrix::<f64, $size, $size>::from_row_iterator(rows.iter().copied());
                Ok(Arc::new($type::try_from_matrix(&matrix)?))
            },
        }
    };
}

/// A product with the identity is normalized again. The cosine and the sine follow from the angle.
static GROUPS: [Group; 5] = [
    group!(So2, 2, |x| So2::exp(x.angle())),
    group!(So3, 3, |x| LieGroup::compose(&So3::identity(), &x)),
    group!(Se2, 3, |x| Se2::new(So2::exp(x.rotation.angle()), x.translation)),
    group!(Se3, 4, |x| LieGroup::compose(&Se3::identity(), &x)),
    group!(Sim3, 4, |x| LieGroup::compose(&Sim3::identity(), &x)),
];

/// Returns the group of a type; `None` for a type that is none.
pub(super) fn group(name: &str) -> Option<&'static Group> {
    GROUPS.iter().find(|group| group.name == name)
}

fn known_group(what: &str, name: &str) -> PyResult<&'static Group> {
    group(name).ok_or_else(|| {
        let names: Vec<_> = GROUPS.iter().map(|group| group.name).collect();
        let mistake = Mistake::at("type", format!("`{name}` has no matrices"));
        errors::arguments(what, vec![mistake.help(format!("there are {}", names.join(", ")))])
    })
}

/// Returns the identity of a group.
#[pyfunction]
fn identity<'py>(py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
    into_python(py, name, vec![(known_group("identity", name)?.identity)()], false)
}

/// Returns the matrices of group elements.
#[pyfunction]
fn matrix<'py>(x: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let points = Points::read("matrix", "x", x)?;
    let group = known_group("matrix", points.array.name)?;
    let mut entries = vec![];
    for x in &*points.array.values {
        entries.extend((group.matrix)(x.erased().as_any()).ok_or_else(|| errors::internal("matrix"))?);
    }
    let shape: Vec<_> = points.rows().into_iter().chain([group.size; 2]).collect();
    to_array(x.py(), &shape, entries)
}

/// Returns the group elements of matrices: one, or one for each matrix of an array.
#[pyfunction]
fn from_matrix<'py>(name: &str, matrix: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
    let group = known_group("from_matrix", name)?;
    let is_array = array("from_matrix", "matrix", matrix)?.shape().len() == 3;
    let one = [Some(group.size); 2];
    let expected = if is_array { [&[None][..], &one[..]].concat() } else { one.to_vec() };
    let read = numbers("from_matrix", "matrix", matrix, &expected)?;
    let mut values = vec![];
    for (row, entries) in read.values.chunks_exact(group.size * group.size).enumerate() {
        values.push((group.from_matrix)(entries).map_err(|error| {
            let place = if is_array { format!("matrix[{row}]") } else { "matrix".to_owned() };
            errors::arguments("from_matrix", vec![Mistake::at(place, error).help(remedy(&error))])
        })?);
    }
    into_python(matrix.py(), name, values, is_array)
}

fn remedy(error: &MatrixError) -> &'static str {
    match error {
        MatrixError::NotOrthonormal { .. } => {
            "remove scale and shear; the nearest rotation is u @ vt of u, _, vt = numpy.linalg.svd(R)"
        }
        MatrixError::Reflection { .. } => "negate one axis: the axes have to be right-handed",
        MatrixError::LastRow { .. } => {
            "the translation is the last column; transpose a matrix of row vectors"
        }
        MatrixError::NotSimilar { .. } => {
            "the determinant is the cube of the scale; if it is negative, negate one axis"
        }
        _ => "leave such entries out",
    }
}

pub(super) fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(identity, module)?)?;
    module.add_function(wrap_pyfunction!(matrix, module)?)?;
    module.add_function(wrap_pyfunction!(from_matrix, module)?)
}
