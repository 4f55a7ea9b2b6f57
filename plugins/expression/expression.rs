//! The factor `expression`.
use crate::cache::program;
use crate::constant::Constant;
use crate::language::page;
use crate::program::Program;
use crate::scope::Scope;
use indexmap::IndexMap;
use manifactor_document::{ReadError, deserialize_with};
use manifactor_graph::{Direction, Dynamic, ErasedResidual, Factor, TextError, Up, WrongRows, register};
use schemars::JsonSchema;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// A factor whose residual is given by formulas. `manifactor explain expression` documents the language and
/// lists every linked function.
#[derive(Debug, Clone, Serialize, JsonSchema)]
#[serde(into = "Document")]
#[schemars(with = "Document", description = page())]
pub struct Expression {
    document: Document,
    program: Dynamic<Program>,
}

#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Expression")]
struct Document {
    /// Names of the variables, in the order of the factor's keys, with the type of each.
    #[schemars(with = "std::collections::BTreeMap<String, String>")]
    variables: IndexMap<String, String>,
    /// Formulas of the residual. Each gives one row, or several if it is a vector.
    residual: Vec<String>,
    /// Named parts of formulas, usable in all formulas and in later parts.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    #[schemars(with = "std::collections::BTreeMap<String, String>")]
    define: IndexMap<String, String>,
    /// Numbers, vectors and other values that formulas refer to by name.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    #[schemars(with = "std::collections::BTreeMap<String, Constant>")]
    constants: IndexMap<String, Constant>,
    /// The world's up direction, of any length but zero. Default: z.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    up: Option<Up>,
    /// Formulas that must be positive for the factor to be defined.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    domain: Vec<String>,
}

/// The reason why formulas do not form a factor.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExpressionError {
    /// There is no formula.
    #[error("`residual` is empty: expected at least one formula, such as \"norm(position(x)) - 1\"")]
    NoResidual,
    /// There are no variables, or too many.
    #[error("expected 1 to {most} variables, such as variables = {{ q = \"dual_quadric\" }}, found {0}", most = MAX_VARIABLES)]
    WrongVariables(usize),
    /// A formula, a name or a type is invalid.
    #[error(transparent)]
    Text(#[from] TextError),
    /// The residual has more rows than a factor may have.
    #[error("`residual`: {0}")]
    WrongRows(#[from] WrongRows),
}

/// Maximum number of variables of a factor.
const MAX_VARIABLES: usize = 32;

impl TryFrom<Document> for Expression {
    type Error = ExpressionError;
    fn try_from(mut document: Document) -> Result<Self, ExpressionError> {
        let Document { variables, residual, define, constants, up, domain } = &document;
        if residual.is_empty() {
            return Err(ExpressionError::NoResidual);
        }
        if variables.is_empty() || variables.len() > MAX_VARIABLES {
            return Err(ExpressionError::WrongVariables(variables.len()));
        }
        let scope = Scope::new(variables, constants, *up.unwrap_or_default())?;
        let (program, uses_up) = program(&scope, define, residual, domain)?;
        let program = Dynamic::new(program)?;
        // Store the `up` that the formulas use, so that the written document is complete.
        document.up = document.up.or(uses_up.then(Up::default));
        Ok(Self { document, program })
    }
}

/// Deserializes from the document's node, so that an error in a formula keeps its position.
impl<'de> Deserialize<'de> for Expression {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserialize_with(deserializer, |node| {
            let mut fields = node.clone();
            fields.retain(|field| field != TAG);
            let expression = Self::try_from(fields.try_read::<Document>()?);
            Ok(Box::new(expression.map_err(|error| match error {
                ExpressionError::Text(error) => ReadError::from(error),
                other => ReadError::custom(other),
            })?))
        })
    }
}

/// Name of the field with the type of a factor.
const TAG: &str = "type";

impl From<Expression> for Document {
    fn from(expression: Expression) -> Self {
        expression.document
    }
}

impl Expression {
    /// Compiles formulas of variables, given as pairs of name and type.
    ///
    /// # Errors
    /// If a formula is invalid; the error contains the position.
    pub fn new<'a>(
        variables: impl IntoIterator<Item = (&'a str, &'a str)>,
        residual: impl IntoIterator<Item = &'a str>,
    ) -> Result<Self, ExpressionError> {
        Self::with_constants(variables, [], residual)
    }
    /// Compiles formulas of variables, given as pairs of name and type, with named constants.
    ///
    /// # Errors
    /// If a formula is invalid; the error contains the position.
    pub fn with_constants<'a>(
        variables: impl IntoIterator<Item = (&'a str, &'a str)>,
        constants: impl IntoIterator<Item = (&'a str, Constant)>,
        residual: impl IntoIterator<Item = &'a str>,
    ) -> Result<Self, ExpressionError> {
        let variables = variables.into_iter().map(|(name, of)| (name.to_owned(), of.to_owned())).collect();
        let constants = constants.into_iter().map(|(name, is)| (name.to_owned(), is)).collect();
        let residual = residual.into_iter().map(str::to_owned).collect();
        Document { variables, residual, define: IndexMap::new(), constants, up: None, domain: vec![] }
            .try_into()
    }
    /// Sets a different up direction.
    ///
    /// # Errors
    /// As [`Expression::new`].
    pub fn with_up(mut self, up: Direction) -> Result<Self, ExpressionError> {
        self.document.up = Some(up.into());
        self.document.try_into()
    }
    /// Returns the compiled program.
    pub fn program(&self) -> &Program {
        self.program.get()
    }
}

#[typetag::serialize(name = "expression")]
impl Factor for Expression {
    fn erased(&self) -> &dyn ErasedResidual {
        &self.program
    }
    fn with_up(&self, up: Direction) -> Option<Box<dyn Factor>> {
        // The document was read successfully before, so compiling it again cannot fail.
        let is_open = self.document.up.is_some_and(|mut open| open.fill(up));
        let filled = is_open.then(|| self.clone().with_up(up).ok()).flatten()?;
        Some(Box::new(filled))
    }
}
register!(dyn Factor, "expression", Expression);
