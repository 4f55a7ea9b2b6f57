//! Mixtures: the best of several factors, for objects or data associations that are ambiguous.
use manifactor_graph::catalogue::Signature;
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

/// The best of several factors: ½|r|² = minₖ ½|Wₖ rₖ|² + ln(w_max / wₖ)   (Olson and Agarwal 2013).
///
/// A detection that may be a chair or a box adds the factors of both, weighted by the detector's scores. The
/// solver selects the best component again at each step. A component without a factor is the null hypothesis,
/// an outlier, at a fixed cost. wₖ is the weight in front of exp(-½|Wₖ rₖ|²), so components of different
/// dimensions are compared by their cost, not by their sigmas. Rows: √(2 ln(w_max/wₖ)), then the whitened
/// rows of the component, padded with zeros to the longest component.
///
/// Components may use different variables: `over` lists the variables of the mixture that a component uses.
/// An example is a box that may show either of two objects.
///
/// The cost is continuous; the rows jump when a different component becomes the best. A component that is not
/// defined is skipped; if none is defined, the mixture is not defined. Each component has a noise model, so
/// omit `noise` next to the mixture. Each evaluation allocates some memory per component. Use mixtures for
/// priors on objects and for ambiguous boxes, not for every measurement.
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
/// A box from x0 that shows either q0 or, half as likely, q1:
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
    /// Alternatives: two or more.
    components: Vec<Component>,
}

/// One alternative of a mixture.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Component {
    /// Likelihood relative to the remaining components.
    pub weight: Positive,
    /// Factor of this alternative. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub factor: Option<Arc<dyn Factor>>,
    /// Variables that the factor uses, as indices into `keys` from 0, in the order of the factor. Default:
    /// all of them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over: Option<Vec<usize>>,
    /// Noise model of the factor's residual.
    #[serde(default, skip_serializing_if = "Noise::is_default")]
    pub noise: Noise,
}

/// The reason why components do not form a mixture.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MixtureError {
    /// There are fewer than two components.
    #[error("expected two components or more, got {0}; one alone is a factor")]
    TooFew(usize),
    /// No component has a factor.
    #[error("none of the components has a factor")]
    NoFactor,
    /// Two components use one variable with different types.
    #[error(
        "component {component} has a {found} at place {place}, where another one has a {expected}: `over` says which variables a component is over"
    )]
    Variables {
        /// Index of the component, from 0.
        component: usize,
        /// Index among the mixture's variables, from 0.
        place: usize,
        /// Type in this component.
        found: &'static str,
        /// Type in another component.
        expected: &'static str,
    },
    /// The length of `over` differs from the number of the factor's variables, or an index occurs twice.
    #[error(
        "component {component}: its factor is over {found}; expected as many different places in `over`, got {over:?}"
    )]
    Over {
        /// Index of the component, from 0.
        component: usize,
        /// Types of the factor's variables.
        found: String,
        /// The given indices.
        over: Vec<usize>,
    },
    /// No component uses a variable.
    #[error("no component is over variable {place}, but there is one at a later place")]
    Unused {
        /// Index of the variable, from 0.
        place: usize,
    },
    /// The noise model does not match the rows of the factor.
    #[error("component {component}: {error}")]
    Noise {
        /// Index of the component, from 0.
        component: usize,
        /// The error of the noise model.
        error: NoiseError,
    },
    /// The mixture has too many rows.
    #[error("{0}; a mixture has one row more than its longest component")]
    Rows(#[from] WrongRows),
}

impl MaxMixture {
    /// Creates a mixture from its components.
    ///
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
    // Not inlined, as the loops over the factors would be compiled again in each crate that creates a
    // mixture.
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

/// The compiled mixture.
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
    /// First row of the residual if this component is selected: √(2 ln(w_max / w)).
    price: f64,
    factor: Option<Weighted>,
}

/// Factor of a component, its whitening matrix, and the indices of the variables that it uses.
#[derive(Debug)]
struct Weighted {
    factor: Arc<dyn Factor>,
    whitening: DMatrix<f64>,
    over: Vec<usize>,
}

impl Weighted {
    fn select_variables<'a>(&self, all: &[&'a dyn Variable]) -> Vec<&'a dyn Variable> {
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
        // A registered factor uses only registered manifolds.
        let casts: Vec<_> = types.iter().filter_map(|id| as_variable(*id)).collect();
        let dimensions = casts.iter().map(|cast| cast.dimension).collect();
        let rows = parts.iter().filter_map(|part| part.factor.as_ref()).map(|of| of.whitening.nrows());
        let rows = 1 + rows.max().unwrap_or(0);
        Ok(Self { parts: parts.into(), types, dimensions, casts, rows })
    }

    fn variables<'a>(&self, variables: &[&'a dyn Any]) -> Vec<&'a dyn Variable> {
        variables.iter().zip(&self.casts).filter_map(|(x, to)| (to.cast)(*x)).collect()
    }

    /// Returns the component with the lowest cost and its whitened residual; `None` if no component is
    /// defined.
    fn best(&self, x: &[&dyn Variable]) -> Option<(&Part, DVector<f64>)> {
        let costs = self.parts.iter().filter_map(|part| {
            let residual = match &part.factor {
                None => DVector::zeros(0),
                Some(of) => {
                    let (factor, x) = (of.factor.erased(), of.select_variables(x));
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
        let Some(linearization) = of.factor.erased().linearize(&of.select_variables(&x)) else { return };
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

/// Returns the indices of the mixture's variables that a component's factor uses.
fn places(
    component: usize,
    over: Option<&[usize]>,
    signature: &Signature,
) -> Result<Vec<usize>, MixtureError> {
    let n = signature.variables.len();
    let over: Vec<usize> = over.map_or_else(|| (0..n).collect(), <[usize]>::to_vec);
    let is_once = |(i, place): (usize, &usize)| *place < MAX_VARIABLES && !over[..i].contains(place);
    if signature.many || over.len() != n || !over.iter().enumerate().all(is_once) {
        let names = signature.variables.iter().map(|id| manifactor_graph::manifold_name(*id));
        let found = names.collect::<Vec<_>>().join(", ") + if signature.many { ", …" } else { "" };
        return Err(MixtureError::Over { component, found, over });
    }
    Ok(over)
}

/// Maximum number of variables of a mixture.
const MAX_VARIABLES: usize = 64;

#[cfg(test)]
mod tests;
