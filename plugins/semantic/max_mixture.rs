//! An object that may be one thing or another: the best of several factors.
use manifactor_graph::catalogue::{self, Kind, Signature};
use manifactor_graph::checked::Positive;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{
    AsVariable, Direction, Dynamic, DynamicBlocks, DynamicResidual, ErasedResidual, Factor, Noise, Variable,
    WrongRows, as_variable, register,
};
use nalgebra::{DMatrix, DVector};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::any::{Any, TypeId};
use std::sync::Arc;

/// The factor that fits best, of several: ½|r|² = minₖ ½|Wₖ rₖ|² + ln(w_max / wₖ)   (Olson and Agarwal 2013).
///
/// A detection that may be a chair or a box brings the factors of both, weighted by the detector's scores; the estimate
/// decides, and decides again at each step. A component without a factor means none of them, at a price: an outlier. wₖ is the factor before
/// exp(-½|Wₖ rₖ|²), so components of different dimensions are compared by what they cost, not by how narrow they are. Rows: √(2 ln(w_max/wₖ)),
/// then the whitened rows of the component; zeros, where it has fewer than another.
///
/// Components may be over different variables: `over` says which of the mixture's, as a box may show the one object or the other.
///
/// The cost is continuous; where the best component changes, the rows jump. A component that is not defined takes no
/// part; where none is, the mixture is not defined. It has noise of its own in each component: leave out `noise` beside it.
/// Evaluating allocates a little for each component: it is for priors on objects, and for some boxes, not for each measurement.
///
/// ```toml
/// [[factors]]
/// keys   = ["q0"]
///
/// [factors.factor]
/// type = "max_mixture"
/// components = [
///     { weight = 0.6, factor = { type = "vertical_orientation_smooth" }, noise = { sigma = 0.1 } },
///     { weight = 0.3, factor = { type = "horizontal_orientation_smooth" }, noise = { sigma = 0.1 } },
///     { weight = 0.1 },
/// ]
/// ```
///
/// A box from x0 that shows q0, or q1 half as likely:
///
/// ```toml
/// [[factors]]
/// keys = ["x0", "q0", "q1"]
///
/// [factors.factor]
/// type = "max_mixture"
/// components = [
///     { weight = 2.0, over = [0, 1], factor = { type = "centroid_depth", depth = 1.5 }, noise = { sigma = 0.05 } },
///     { weight = 1.0, over = [0, 2], factor = { type = "centroid_depth", depth = 1.5 }, noise = { sigma = 0.05 } },
/// ]
/// ```
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "Document", into = "Document")]
#[schemars(with = "Document")]
pub struct MaxMixture {
    document: Document,
    mixture: Dynamic<Mixture>,
}

#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "MaxMixture")]
struct Document {
    /// What it may be: two or more.
    components: Vec<Component>,
}

/// One of the things that it may be.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// How likely it is, relative to the others.
    pub weight: Positive,
    /// The factor that holds then. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<Arc<dyn Factor>>,
    /// Which of the mixture's variables the factor is over, in its order: places among `keys`, from 0. Default: all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over: Option<Vec<usize>>,
    /// What the factor's residual is measured in.
    #[serde(default, skip_serializing_if = "Noise::is_default")]
    pub noise: Noise,
}

/// Why components make no mixture.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MixtureError {
    /// Nothing to choose from.
    #[error("expected two components or more, got {0}; one alone is a factor")]
    TooFew(usize),
    /// None of them says anything.
    #[error("none of the components has a factor")]
    NoFactor,
    /// Components that do not agree what a variable is.
    #[error(
        "component {component} has a {found} at place {place}, where another one has a {expected}: `over` says which variables a component is over"
    )]
    Variables {
        /// Which one, from 0.
        component: usize,
        /// Of the mixture's variables, from 0.
        place: usize,
        /// What it has there.
        found: &'static str,
        /// What another one has.
        expected: &'static str,
    },
    /// A component whose factor is not over as many variables as it says, or over one of them twice.
    #[error(
        "component {component}: its factor is over {found}; expected as many different places in `over`, got {over:?}"
    )]
    Over {
        /// Which one, from 0.
        component: usize,
        /// Its variables.
        found: String,
        /// What it says.
        over: Vec<usize>,
    },
    /// A variable that no component is over.
    #[error("no component is over variable {place}, but there is one at a later place")]
    Unused {
        /// From 0.
        place: usize,
    },
    /// Noise of another size than its factor.
    #[error("component {component}: {error}")]
    Noise {
        /// Which one, from 0.
        component: usize,
        /// What is wrong.
        error: NoiseError,
    },
    /// Too many rows.
    #[error("{0}; a mixture has one row more than its longest component")]
    Rows(#[from] WrongRows),
}

impl MaxMixture {
    /// # Errors
    /// If the components do not fit together.
    pub fn new(components: Vec<Component>) -> Result<Self, MixtureError> {
        let mixture = Dynamic::new(Mixture::new(&components)?)?;
        Ok(Self { document: Document { components }, mixture })
    }
}

impl TryFrom<Document> for MaxMixture {
    type Error = MixtureError;
    fn try_from(document: Document) -> Result<Self, MixtureError> {
        Self::new(document.components)
    }
}

impl From<MaxMixture> for Document {
    fn from(mixture: MaxMixture) -> Self {
        mixture.document
    }
}

#[typetag::serialize(name = "max_mixture")]
impl Factor for MaxMixture {
    // inlined, the loops over its factors would be compiled again in each crate that makes one
    #[inline(never)]
    fn erased(&self) -> &dyn ErasedResidual {
        &self.mixture
    }
    fn with_up(&self, up: Direction) -> Option<Box<dyn Factor>> {
        let mut components = self.document.components.clone();
        let mut is_open = false;
        for factor in components.iter_mut().filter_map(|component| component.factor.as_mut()) {
            if let Some(filled) = factor.with_up(up) {
                (*factor, is_open) = (filled.into(), true);
            }
        }
        let filled = is_open.then(|| Self::new(components).ok()).flatten()?;
        Some(Box::new(filled))
    }
}
register!(dyn Factor, "max_mixture", MaxMixture);

/// What runs.
#[derive(Debug, Clone)]
struct Mixture {
    parts: Arc<[Part]>,
    types: Vec<TypeId>,
    dimensions: Vec<usize>,
    casts: Vec<&'static AsVariable>,
    rows: usize,
}

#[derive(Debug)]
struct Part {
    /// √(2 ln(w_max / w)).
    price: f64,
    factor: Option<Weighted>,
}

/// A component's factor, its whitening, and which of the mixture's variables it is over.
#[derive(Debug)]
struct Weighted {
    factor: Arc<dyn Factor>,
    whitening: DMatrix<f64>,
    over: Vec<usize>,
}

impl Weighted {
    fn of<'a>(&self, all: &[&'a dyn Variable]) -> Vec<&'a dyn Variable> {
        self.over.iter().map(|place| all[*place]).collect()
    }
}

impl Mixture {
    fn new(components: &[Component]) -> Result<Self, MixtureError> {
        if components.len() < 2 {
            return Err(MixtureError::TooFew(components.len()));
        }
        let mut types: Vec<Option<TypeId>> = vec![];
        let mut parts = vec![];
        let largest = components.iter().map(|c| c.weight.get()).fold(0.0, f64::max);
        for (component, of) in components.iter().enumerate() {
            let factor = of.factor.as_ref().map(|factor| {
                let signature = factor.erased().signature();
                let over = places(component, of.over.as_deref(), &signature)?;
                for (place, id) in over.iter().zip(&signature.variables) {
                    types.resize(types.len().max(place + 1), None);
                    let known = *types[*place].get_or_insert(*id);
                    if known != *id {
                        let [found, expected] = [*id, known].map(manifactor_graph::manifold_name);
                        return Err(MixtureError::Variables { component, place: *place, found, expected });
                    }
                }
                let rows = signature.rows.unwrap_or(0);
                let whitener = of.noise.whitener(rows);
                let whitener = whitener.map_err(|error| MixtureError::Noise { component, error })?;
                Ok(Weighted { factor: factor.clone(), whitening: whitener.matrix(rows), over })
            });
            let price = (2.0 * (largest / of.weight.get()).ln()).sqrt();
            parts.push(Part { price, factor: factor.transpose()? });
        }
        if types.is_empty() {
            return Err(MixtureError::NoFactor);
        }
        let known = |(place, id): (usize, Option<TypeId>)| id.ok_or(MixtureError::Unused { place });
        let types = types.into_iter().enumerate().map(known).collect::<Result<Vec<_>, _>>()?;
        let manifolds = catalogue::entries(<dyn Variable as Kind>::NAME);
        let dimension = |id: &TypeId| {
            let entry = manifolds.iter().find(|entry| (entry.type_id)() == *id)?;
            Some(((entry.signature)().tangent.len(), as_variable(*id)?))
        };
        let known: Option<Vec<_>> = types.iter().map(dimension).collect();
        // what is registered as a factor is over registered manifolds
        let (dimensions, casts) = known.unwrap_or_default().into_iter().unzip();
        let rows = parts.iter().filter_map(|part| part.factor.as_ref()).map(|of| of.whitening.nrows());
        let rows = 1 + rows.max().unwrap_or(0);
        Ok(Self { parts: parts.into(), types, dimensions, casts, rows })
    }

    fn variables<'a>(&self, variables: &[&'a dyn Any]) -> Vec<&'a dyn Variable> {
        variables.iter().zip(&self.casts).filter_map(|(x, to)| (to.cast)(*x)).collect()
    }

    /// The component that costs the least, with its whitened residual; `None` where none is defined.
    fn best(&self, x: &[&dyn Variable]) -> Option<(&Part, DVector<f64>)> {
        let costs = self.parts.iter().filter_map(|part| {
            let residual = match &part.factor {
                None => DVector::zeros(0),
                Some(of) => {
                    let (factor, x) = (of.factor.erased(), of.of(x));
                    let defined = factor.is_defined(&x)?;
                    &of.whitening * DVector::from(factor.residual(&x).filter(|_| defined)?)
                }
            };
            Some((part, residual))
        });
        let cost = |(part, r): &(&Part, DVector<f64>)| part.price * part.price + r.norm_squared();
        costs.min_by(|a, b| cost(a).total_cmp(&cost(b)))
    }

    fn write(&self, (part, rows): (&Part, &DVector<f64>), residual: &mut [f64]) {
        residual.fill(0.0);
        residual[0] = part.price;
        residual[1..=rows.len()].copy_from_slice(rows.as_slice());
    }
}

impl DynamicResidual for Mixture {
    fn rows(&self) -> usize {
        self.rows
    }
    fn variables(&self) -> &[TypeId] {
        &self.types
    }
    fn dimensions(&self) -> &[usize] {
        &self.dimensions
    }
    fn is_defined(&self, variables: &[&dyn Any]) -> bool {
        self.best(&self.variables(variables)).is_some()
    }
    fn residual(&self, variables: &[&dyn Any], residual: &mut [f64]) {
        match self.best(&self.variables(variables)) {
            Some((part, rows)) => self.write((part, &rows), residual),
            None => residual.fill(0.0),
        }
    }
    fn linearize(
        &self,
        variables: &[&dyn Any],
        free: &[bool],
        residual: &mut [f64],
        blocks: &mut DynamicBlocks,
    ) {
        for variable in (0..self.types.len()).filter(|v| free[*v]) {
            blocks.block_mut(variable).fill(0.0);
        }
        let x = self.variables(variables);
        let Some((part, rows)) = self.best(&x) else { return residual.fill(0.0) };
        self.write((part, &rows), residual);
        let Some(of) = &part.factor else { return };
        let Some(linearization) = of.factor.erased().linearize(&of.of(&x)) else { return };
        let over = of.over.iter().copied().zip(&linearization.jacobians);
        for (variable, jacobian) in over.filter(|(v, _)| free[*v]) {
            let whitened = &of.whitening * jacobian;
            let block = blocks.block_mut(variable);
            for (column, of) in whitened.column_iter().enumerate() {
                for (row, entry) in of.iter().enumerate() {
                    block[column * self.rows + 1 + row] = *entry;
                }
            }
        }
    }
}

/// Which of a mixture's variables a component's factor is over.
fn places(
    component: usize,
    over: Option<&[usize]>,
    signature: &Signature,
) -> Result<Vec<usize>, MixtureError> {
    let n = signature.variables.len();
    let over: Vec<usize> = over.map_or_else(|| (0..n).collect(), <[usize]>::to_vec);
    let is_once = |(i, place): (usize, &usize)| *place < PLACES && !over[..i].contains(place);
    if signature.many || over.len() != n || !over.iter().enumerate().all(is_once) {
        let names = signature.variables.iter().map(|id| manifactor_graph::manifold_name(*id));
        let found = names.collect::<Vec<_>>().join(", ") + if signature.many { ", …" } else { "" };
        return Err(MixtureError::Over { component, found, over });
    }
    Ok(over)
}

/// Variables that a mixture may have.
const PLACES: usize = 64;

#[cfg(test)]
mod tests;
