//! Initialisers tried one after another.
use super::{InitialiseError, Initialiser, ObjectView};
use crate::shapes::DualQuadric;
use manifactor_graph::register;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The first of several initialisers that succeeds.
///
/// If none succeeds, the error lists the error of each.
///
/// ```toml
/// initialiser = { type = "first_of", initialisers = [{ type = "svd" }, { type = "rays" }] }
/// ```
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "FirstOf")]
pub struct FirstOfInitialiser {
    /// Initialisers to try, in this order.
    #[schemars(length(min = 1))]
    pub initialisers: Vec<Box<dyn Initialiser>>,
}

#[typetag::serialize(name = "first_of")]
impl Initialiser for FirstOfInitialiser {
    fn initialise(&self, views: &[ObjectView]) -> Result<DualQuadric, InitialiseError> {
        let mut errors = vec![];
        for initialiser in &self.initialisers {
            match initialiser.initialise(views) {
                Ok(quadric) => return Ok(quadric),
                Err(error) => errors.push((initialiser.typetag_name(), error)),
            }
        }
        Err(InitialiseError::All(errors))
    }
}
register!(dyn Initialiser, "first_of", FirstOfInitialiser);
