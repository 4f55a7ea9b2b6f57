//! The factor of a semantic rule.
use manifactor_config::{Errors, Fault, Node, Place, ReadError, deserialize_with};
use manifactor_graph::manifold_name;
use manifactor_graph::{Direction, Factor, Key, Values};
use manifactor_quadric::DualQuadric;
use manifactor_semantic::MixtureError;
use serde::{Deserialize, Deserializer, Serialize};
use serde_json::Value;
use std::any::TypeId;
use std::sync::Arc;

/// A factor of one or several objects. Its `up` may stay open until gravity is known.
#[derive(Debug, Clone, Serialize)]
#[serde(transparent)]
pub struct RuleFactor {
    /// The factor as the document has it: if `up` is open, a written document leaves it open as well.
    document: Value,
    #[serde(skip)]
    factor: Arc<dyn Factor>,
    /// Types of the variables.
    #[serde(skip)]
    variables: Vec<TypeId>,
    /// Rows of the residual, if known.
    #[serde(skip)]
    pub(super) rows: Option<usize>,
}

/// Error while creating the factor of a rule.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RuleError {
    /// The factor needs the up direction, which is unknown.
    #[error(
        "a semantic rule with the factor `{factor}` needs the up direction of the map, which is unknown: set \
         `[gravity]`"
    )]
    NoUp {
        /// Type of the factor.
        factor: String,
    },
    /// The factor cannot be a component of a mixture.
    #[error("the semantic factor `{factor}` as a mixture: {source}")]
    Mixture {
        /// Type of the factor.
        factor: String,
        /// Reason.
        source: MixtureError,
    },
}

impl RuleFactor {
    /// Reads and checks a factor.
    fn read(node: &Node) -> Result<Self, ReadError> {
        let factor: Arc<dyn Factor> = node.try_read::<Box<dyn Factor>>()?.into();
        let name = factor.typetag_name();
        let many = factor.erased().signature().many;
        // the parser has already refused non-finite numbers
        let document = node.to_json().unwrap_or_default();
        let read = Self::new(factor, document);
        let variables = &read.variables;
        if many || !variables.contains(&TypeId::of::<DualQuadric>()) {
            let names: Vec<_> = variables.iter().map(|id| manifold_name(*id)).collect();
            let message = format!("`{name}` connects {}", names.join(" and "));
            let help = "a semantic rule adds a factor of one dual_quadric, such as `vertical_orientation`, or of several, such \
                        as `beside`";
            return Err(ReadError::new(node.place.clone(), Fault::with_help(message, help)));
        }
        Ok(read)
    }

    /// Wraps a factor of objects, with the form that a document has of it.
    pub(super) fn new(factor: Arc<dyn Factor>, document: Value) -> Self {
        let signature = factor.erased().signature();
        Self { document, factor, variables: signature.variables, rows: signature.rows }
    }

    /// Returns the type of the factor.
    pub fn factor_type(&self) -> &'static str {
        self.factor.typetag_name()
    }

    /// Returns whether the factor needs the up direction and leaves it open.
    pub fn wants_up(&self) -> bool {
        self.factor.with_up(Direction::Z).is_some()
    }

    /// Returns the number of further objects that the factor connects with the object.
    pub(crate) fn partners(&self) -> usize {
        self.variables.iter().filter(|id| **id == TypeId::of::<DualQuadric>()).count().saturating_sub(1)
    }

    /// Returns the keys in the factor's order: the object and its partners for variables that are objects,
    /// `with` for the remaining variables.
    pub(super) fn keys(&self, object: &Key, partners: &[Key], with: &[Key]) -> Vec<Key> {
        let mut objects = std::iter::once(object).chain(partners);
        let mut others = with.iter();
        let key = |id: &TypeId| {
            if *id == TypeId::of::<DualQuadric>() { objects.next() } else { others.next() }.cloned()
        };
        self.variables.iter().filter_map(key).collect()
    }

    /// Checks that `with` names a variable of the right type for each variable of the factor that is not an
    /// object.
    pub(super) fn check<'a>(
        &self,
        with: impl ExactSizeIterator<Item = (&'a Key, &'a Node)>,
        place: &Place,
        own: &Values,
        errors: &Errors,
    ) -> Option<()> {
        let wanted: Vec<_> = self.variables.iter().filter(|id| **id != TypeId::of::<DualQuadric>()).collect();
        if wanted.len() != with.len() {
            let types: Vec<_> = wanted.iter().map(|id| format!("a `{}`", manifold_name(**id))).collect();
            let types = if types.is_empty() { "nothing".into() } else { types.join(" and ") };
            let message = format!(
                "besides objects `{}` connects {types}, found {} in `with`",
                self.factor_type(),
                with.len()
            );
            let help =
                "declare such variables as `[[variables]]` and name them in their order: with = [\"table\"]";
            errors.report(place.clone(), Fault::with_help(message, help));
            return None;
        }
        for ((key, Node { place, .. }), id) in with.zip(wanted) {
            let expected = manifold_name(*id);
            match own.variable(key.as_str()) {
                Some(found) if found.typetag_name() == expected => {}
                Some(found) => {
                    let (name, found) = (self.factor_type(), found.typetag_name());
                    let message = format!(
                        "`{name}` takes a variable of type `{expected}` here, `{key}` is of type `{found}`"
                    );
                    errors.report(place.clone(), Fault::invalid(message));
                    return None;
                }
                None => {
                    let known = own.iter().map(|(key, _)| key.to_string()).collect();
                    let (what, name) = ("variable".to_owned(), key.to_string());
                    errors.report(place.clone(), Fault::UnknownName { what, name, known });
                    return None;
                }
            }
        }
        Some(())
    }

    /// Returns the factor with the up direction filled in.
    ///
    /// # Errors
    /// If the factor needs the up direction and it is unknown.
    pub fn instantiate(&self, up: Option<Direction>) -> Result<Arc<dyn Factor>, RuleError> {
        match (up, self.wants_up()) {
            (None, true) => Err(RuleError::NoUp { factor: self.factor_type().to_owned() }),
            (Some(up), true) => Ok(self.factor.with_up(up).map_or_else(|| self.factor.clone(), Arc::from)),
            (_, false) => Ok(self.factor.clone()),
        }
    }
}

impl<'de> Deserialize<'de> for RuleFactor {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize_with(deserializer, |node| Ok(Box::new(Self::read(node)?)))
    }
}
