//! The dynamic view of a graph, for building, editing, reading and writing.
mod fixed;
mod version;

use crate::factor::{Factor, FactorEntry};
use crate::noise::{Noise, NoiseError, Whitener};
use crate::variable::Key;
use crate::variable::Values;
use crate::variable::Variable;
use crate::variable::manifold_name;
use crate::variable::{Bounds, Interval, OutOfBounds};
use indexmap::IndexMap;
use nalgebra::DVector;
use serde::{Deserialize, Serialize};
use smallvec::SmallVec;
use std::any::TypeId;
use std::sync::Arc;

pub use fixed::Fixed;
pub use version::Version;

/// Factors between named variables, the fixed variables, and the bounds of variables.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Graph {
    factors: Vec<FactorEntry>,
    #[serde(skip_serializing_if = "IndexMap::is_empty")]
    fixed: IndexMap<Key, Fixed>,
    #[serde(skip_serializing_if = "IndexMap::is_empty")]
    bounds: IndexMap<Key, Bounds>,
    /// Renewed by every method that gives mutable access to the content.
    #[serde(skip)]
    version: Version,
}

/// An error between a graph and its values. `factor` is the index in the graph, from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GraphError {
    /// A factor on a variable that has no value.
    #[error("factor {factor} ({name}): there is no variable `{key}`")]
    MissingVariable {
        /// The factor.
        factor: usize,
        /// Name of its type.
        name: &'static str,
        /// Index among the factor's keys, from 0.
        position: usize,
        /// The key.
        key: Key,
    },
    /// A factor with more or fewer keys than its residual has variables.
    #[error("factor {factor} ({name}) connects {expected} variables, got {found} keys")]
    WrongArity {
        /// The factor.
        factor: usize,
        /// Name of its type.
        name: &'static str,
        /// Number of variables of its residual.
        expected: usize,
        /// Number of its keys.
        found: usize,
    },
    /// A factor on a variable of the wrong type.
    #[error("factor {factor} ({name}): variable `{key}` is of type {found}, expected {expected}")]
    WrongType {
        /// The factor.
        factor: usize,
        /// Name of its type.
        name: &'static str,
        /// Index among the factor's keys, from 0.
        position: usize,
        /// The key.
        key: Key,
        /// The type that the residual requires.
        expected: &'static str,
        /// The type of the variable.
        found: &'static str,
    },
    /// A factor that names a variable twice.
    #[error("factor {factor} ({name}) names the variable `{key}` twice")]
    RepeatedVariable {
        /// The factor.
        factor: usize,
        /// Name of its type.
        name: &'static str,
        /// Index among the factor's keys, from 0.
        position: usize,
        /// The key.
        key: Key,
    },
    /// A noise that does not fit the residual.
    #[error("factor {factor} ({name}): {source}")]
    Noise {
        /// The factor.
        factor: usize,
        /// Name of its type.
        name: &'static str,
        /// The error of the noise.
        source: NoiseError,
    },
    /// A fixed variable that does not exist.
    #[error("`{key}` is to be held fixed, but there is no such variable")]
    MissingFixed {
        /// The key.
        key: Key,
    },
    /// A direction that the variable's tangent space does not have.
    #[error("`{key}` has no direction `{direction}`; its directions are {}", tangent.join(", "))]
    UnknownDirection {
        /// The key.
        key: Key,
        /// The requested direction.
        direction: String,
        /// The directions of the variable.
        tangent: &'static [&'static str],
    },
    /// Bounds of a variable that does not exist.
    #[error("`{key}` is to have bounds, but there is no such variable")]
    MissingBounded {
        /// The key.
        key: Key,
    },
    /// Bounds of a direction along which steps do not add to a coordinate.
    #[error(
        "`{key}` ({found}) cannot have bounds along `{direction}`: bounds are for coordinates to which steps add, such as \
         those of a point3"
    )]
    NoCoordinate {
        /// The key.
        key: Key,
        /// The requested direction.
        direction: String,
        /// The type of the variable.
        found: &'static str,
    },
    /// An initial value that is out of its bounds.
    #[error(transparent)]
    OutOfBounds(OutOfBounds),
    /// A value with a coordinate that is not finite.
    #[error("the value of `{key}` is not finite")]
    NotFinite {
        /// The key.
        key: Key,
    },
}

impl GraphError {
    /// Formats the first errors, one per line, and the number of the remaining ones.
    pub fn list(errors: &[Self]) -> String {
        const MAX_LISTED: usize = 20;
        let mut text: String = errors.iter().take(MAX_LISTED).map(|e| format!("\n  {e}")).collect();
        if errors.len() > MAX_LISTED {
            text += &format!("\n  and {} more", errors.len() - MAX_LISTED);
        }
        text
    }
}

impl GraphError {
    /// Returns an error for each fixed direction that a variable does not have.
    pub fn unknown_directions<'a>(
        key: &'a Key,
        fixed: &'a Fixed,
        tangent: &'static [&'static str],
    ) -> impl Iterator<Item = Self> + 'a {
        let unknown = fixed.unknown_directions(tangent);
        unknown.map(move |direction| {
            let direction = direction.to_owned();
            Self::UnknownDirection { key: key.clone(), direction, tangent }
        })
    }
}

impl Graph {
    /// Makes an empty graph.
    pub fn new() -> Self {
        Self::default()
    }
    /// Adds a factor between variables, with unit noise and no loss until those are set:
    /// `graph.add(["x0", "x1"], between).noise(Noise::sigma(0.1)?).loss(Cauchy::default())`.
    pub fn add<K: Into<Key>>(
        &mut self,
        keys: impl IntoIterator<Item = K>,
        factor: impl Factor + 'static,
    ) -> &mut FactorEntry {
        let keys = keys.into_iter().map(Into::into).collect();
        self.push(FactorEntry {
            keys,
            name: None,
            factor: Arc::new(factor),
            noise: Noise::unit(),
            loss: None,
        })
    }
    /// Adds a factor.
    pub fn push(&mut self, entry: FactorEntry) -> &mut FactorEntry {
        self.version = Version::default();
        self.factors.push(entry);
        let last = self.factors.len() - 1;
        &mut self.factors[last]
    }
    /// Returns the factors, in order.
    pub fn factors(&self) -> &[FactorEntry] {
        &self.factors
    }
    /// Returns the factors for modification.
    pub fn factors_mut(&mut self) -> &mut Vec<FactorEntry> {
        self.version = Version::default();
        &mut self.factors
    }
    /// Fixes a variable at its initial value.
    pub fn fix(&mut self, key: impl Into<Key>) {
        self.set_fixed(key, Fixed::Whole(true));
    }
    /// Fixes some directions of a variable's tangent space, by name, in addition to those that are fixed. The directions
    /// are those at the current estimate of the variable.
    pub fn fix_directions(&mut self, key: impl Into<Key>, directions: &[&str]) {
        let key = key.into();
        let before = self.fixed.get(&key).cloned().unwrap_or_default();
        self.set_fixed(key, before.with_directions(directions));
    }
    /// Sets the fixed part of a variable.
    pub fn set_fixed(&mut self, key: impl Into<Key>, fixed: Fixed) {
        self.version = Version::default();
        match fixed {
            Fixed::Whole(false) => self.fixed.shift_remove(&key.into()),
            fixed => self.fixed.insert(key.into(), fixed),
        };
    }
    /// Returns the variables that are fixed, completely or in part.
    pub fn fixed(&self) -> &IndexMap<Key, Fixed> {
        &self.fixed
    }
    /// Bounds a coordinate of a variable, by the name of its direction:
    /// `graph.bound("camera", "f", Interval::new(400.0..=600.0)?)`. Steps stop at the bounds. A limit that the interval
    /// does not have stays as it is. Limits that exclude each other are an error at the solve.
    pub fn bound(&mut self, key: impl Into<Key>, direction: impl Into<String>, interval: Interval) {
        self.version = Version::default();
        self.bounds.entry(key.into()).or_default().insert(direction, interval);
    }
    /// Sets all bounds of a variable.
    pub fn set_bounds(&mut self, key: impl Into<Key>, bounds: Bounds) {
        self.version = Version::default();
        match bounds.is_empty() {
            true => self.bounds.shift_remove(&key.into()),
            false => self.bounds.insert(key.into(), bounds),
        };
    }
    /// Returns the bounds of variables.
    pub fn bounds(&self) -> &IndexMap<Key, Bounds> {
        &self.bounds
    }
    /// Adds the factors of another graph, its fixed variables and its bounds.
    pub fn extend(&mut self, other: &Self) {
        self.factors_mut().extend(other.factors.iter().cloned());
        self.hold_all_like(other);
    }
    /// Fixes and bounds a variable as another graph does, in addition to what is fixed and bounded here.
    pub fn hold_like(&mut self, other: &Self, key: &Key) {
        match other.fixed.get(key) {
            Some(Fixed::Directions(names)) => {
                self.fix_directions(key.clone(), &names.iter().map(String::as_str).collect::<Vec<_>>());
            }
            Some(whole) => self.set_fixed(key.clone(), whole.clone()),
            None => {}
        }
        for (direction, interval) in other.bounds.get(key).into_iter().flat_map(Bounds::iter) {
            self.version = Version::default();
            self.bounds.entry(key.clone()).or_default().restrict(direction, interval);
        }
    }
    /// Fixes and bounds variables as another graph does.
    pub fn hold_all_like(&mut self, other: &Self) {
        other.fixed.keys().chain(other.bounds.keys()).for_each(|key| self.hold_like(other, key));
    }
    /// Returns the first coordinate that is out of its bounds.
    pub fn out_of_bounds(&self, values: &Values) -> Option<OutOfBounds> {
        self.bounds
            .iter()
            .find_map(|(key, bounds)| bounds.out_of_bounds(key, values.variable(key.as_str())?).next())
    }
    /// Returns the values with the coordinates that are out of bounds moved to them.
    #[must_use]
    pub fn within_bounds(&self, mut values: Values) -> Values {
        // a long step to a narrow interval may miss it by rounding, and a second one does not
        for (key, bounds) in self.bounds.iter().chain(&self.bounds) {
            let Some(value) = values.variable(key.as_str()) else { continue };
            let mut step = vec![0.0; value.erased().dim()];
            for (direction, interval, x) in bounds.of(value) {
                step[direction] = interval.clip(x, 0.0);
            }
            if step.iter().any(|x| *x != 0.0)
                && let Some(moved) = value.erased().retract(&step)
            {
                values.insert_boxed(key.clone(), moved);
            }
        }
        values
    }
    /// Returns the version, which changes with the graph: see [`Version`].
    pub fn version(&self) -> Version {
        self.version
    }

    /// Returns all errors between this graph and `values`; empty if the graph can be compiled.
    pub fn check(&self, values: &Values) -> Vec<GraphError> {
        self.resolve(values).err().unwrap_or_default()
    }

    /// Returns the cost ½ Σ ρ(‖r‖²) at `values`. Factors that are undefined there do not count, and neither do
    /// constraints.
    ///
    /// # Errors
    /// All errors between this graph and `values`.
    pub fn cost(&self, values: &Values) -> Result<f64, Vec<GraphError>> {
        self.resolve(values)?;
        let cost = |entry: &FactorEntry| {
            let points: Vec<_> =
                entry.keys.iter().map(|key| values.variable(key.as_str())).collect::<Option<_>>()?;
            let squared = entry.squared_at(&points)?;
            Some(0.5 * entry.loss.as_ref().map_or(squared, |loss| loss.erased().rho(squared).0))
        };
        Ok(self.factors.iter().filter(|entry| !entry.is_constraint()).filter_map(cost).sum())
    }

    /// Looks up the variables of every factor, and checks that all of them fit.
    ///
    /// # Errors
    /// All errors between this graph and `values`.
    pub fn resolve(&self, values: &Values) -> Result<Vec<Resolved>, Vec<GraphError>> {
        let mut errors = vec![];
        let mut resolved = Vec::with_capacity(self.factors.len());
        for (i, entry) in self.factors.iter().enumerate() {
            let find = |key: &str| values.find(key).map(|(place, v)| (place, v.erased().type_id()));
            resolved.extend(entry.resolve(i, find, &mut errors));
        }
        for (key, fixed) in &self.fixed {
            let Some(value) = values.variable(key.as_str()) else {
                errors.push(GraphError::MissingFixed { key: key.clone() });
                continue;
            };
            errors.extend(GraphError::unknown_directions(key, fixed, value.erased().tangent()));
        }
        for (key, bounds) in &self.bounds {
            match values.variable(key.as_str()) {
                Some(value) => check_bounds(key, bounds, value, &mut errors),
                None => errors.push(GraphError::MissingBounded { key: key.clone() }),
            }
        }
        let bad = values.iter().filter(|(_, v)| !v.erased().is_finite());
        errors.extend(bad.map(|(key, _)| GraphError::NotFinite { key: key.clone() }));
        if errors.is_empty() { Ok(resolved) } else { Err(errors) }
    }
}

/// Reports directions that cannot be bounded, and coordinates that are out of bounds.
fn check_bounds(key: &Key, bounds: &Bounds, value: &dyn Variable, errors: &mut Vec<GraphError>) {
    let tangent = value.erased().tangent();
    for (direction, _) in bounds.iter() {
        let (key, direction) = (key.clone(), direction.to_owned());
        match tangent.iter().position(|name| *name == direction) {
            None => errors.push(GraphError::UnknownDirection { key, direction, tangent }),
            Some(index) if value.erased().coordinate(index).is_none() => {
                errors.push(GraphError::NoCoordinate { key, direction, found: value.typetag_name() });
            }
            Some(_) => {}
        }
    }
    errors.extend(bounds.out_of_bounds(key, value).map(GraphError::OutOfBounds));
}

/// Indices of a factor's variables among the values. Up to four need no allocation.
pub type VariableIndices = SmallVec<[u32; 4]>;

/// A factor's variables and noise, looked up and checked.
#[derive(Debug, Clone)]
pub struct Resolved {
    /// Indices of its variables among the values.
    pub variables: VariableIndices,
    /// Its noise.
    pub whitener: Whitener,
}

impl FactorEntry {
    /// Returns the squared norm of the whitened residual at the values from `point`, without the loss.
    /// `None` if a variable is missing or has the wrong type, or if the factor is undefined there.
    pub fn squared(&self, point: impl Fn(&Key) -> Option<Box<dyn Variable>>) -> Option<f64> {
        let points: Vec<Box<dyn Variable>> = self.keys.iter().map(point).collect::<Option<_>>()?;
        self.squared_at(&points.iter().map(|point| &**point).collect::<Vec<_>>())
    }

    /// Returns the squared norm of the whitened residual at these values of its variables, as
    /// [`squared`](Self::squared).
    fn squared_at(&self, points: &[&dyn Variable]) -> Option<f64> {
        let residual = self.factor.erased();
        residual.is_defined(points).filter(|is_defined| *is_defined)?;
        let r = residual.residual(points)?;
        let whitener = self.noise.whitener(r.len()).ok()?.matrix(r.len());
        Some((whitener * DVector::from_vec(r)).norm_squared())
    }

    /// Looks up the variables, and checks that they fit. `find` returns the index and the type of a key.
    /// `factor` is the index in the graph for error messages. Adds each error to `errors`, and then returns
    /// `None`.
    pub fn resolve(
        &self,
        factor: usize,
        find: impl Fn(&str) -> Option<(usize, TypeId)>,
        errors: &mut Vec<GraphError>,
    ) -> Option<Resolved> {
        let mut variables = VariableIndices::new();
        let before = errors.len();
        let name = self.factor.typetag_name();
        let signature = self.factor.erased().signature();
        let (found, expected) = (self.keys.len(), signature.variables.len());
        if (signature.many && found == 0) || (!signature.many && found != expected) {
            errors.push(GraphError::WrongArity { factor, name, expected, found });
        } else {
            let types = signature.variables.iter().cycle();
            for (position, (key, expected)) in self.keys.iter().zip(types).enumerate() {
                match find(key.as_str()) {
                    None => {
                        let key = key.clone();
                        errors.push(GraphError::MissingVariable { factor, name, position, key });
                    }
                    Some((_, id)) if id != *expected => {
                        let (expected, found) = (manifold_name(*expected), manifold_name(id));
                        let key = key.clone();
                        errors.push(GraphError::WrongType { factor, name, position, key, expected, found });
                    }
                    Some((place, _)) if variables.contains(&(place as u32)) => {
                        let key = key.clone();
                        errors.push(GraphError::RepeatedVariable { factor, name, position, key });
                    }
                    Some((place, _)) => variables.push(place as u32),
                }
            }
        }
        let whitener = self.noise.whitener(signature.rows.unwrap_or(0));
        match whitener.map_err(|error| error.with_names(signature.row_names)) {
            Ok(whitener) => (errors.len() == before).then_some(Resolved { variables, whitener }),
            Err(source) => {
                errors.push(GraphError::Noise { factor, name, source });
                None
            }
        }
    }
}
