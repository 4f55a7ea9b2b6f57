use manifactor_config::{Errors, Node, Problem, Value as NodeValue};
use manifactor_graph::catalogue::{Kind, ParseError, find, manifold_name};
use manifactor_graph::{Direction, Factor};
use manifactor_quadric::DualQuadric;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::any::TypeId;

/// The field that gravity fills.
const UP: &str = "up";

/// A factor of one object, whose `up` is open until gravity is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RuleFactor {
    #[serde(rename = "type")]
    name: String,
    #[serde(flatten)]
    fields: Map<String, Value>,
    /// Whether it has a field `up` that the config leaves open.
    #[serde(skip)]
    wants_up: bool,
    /// Of its residual, where they are known by its type.
    #[serde(skip)]
    rows: Option<usize>,
}

/// Why a rule's factor could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RuleError {
    /// It needs to know up, and nobody does.
    #[error(
        "the semantic factor `{factor}` needs to know which way is up, and the data source does not say: \
         set `[gravity]`, for example gravity = {{ type = \"vector\", up = [0.0, 0.0, 1.0] }}"
    )]
    NoUp {
        /// The factor's type.
        factor: String,
    },
    /// Its type is not linked any more.
    #[error("the factor `{factor}` is not registered")]
    NotRegistered {
        /// The factor's type.
        factor: String,
    },
    /// It does not take the direction that it gets.
    #[error("the semantic factor `{factor}`: {source}")]
    Fields {
        /// The factor's type.
        factor: String,
        /// What is wrong with its fields.
        source: ParseError,
    },
}

impl RuleFactor {
    /// Reads and checks a factor; what is wrong is reported.
    pub(super) fn read(node: Node, errors: &Errors) -> Option<Self> {
        let (place, json) = (node.place.clone(), node.to_json());
        let name = match &node.value {
            NodeValue::Table(table) => match table.get("type").map(|field| &field.node.value) {
                Some(NodeValue::String(name)) => name.clone(),
                _ => String::new(),
            },
            _ => String::new(),
        };
        let factor = node.read_registered::<dyn Factor>(errors)?;
        let (variables, rows) = {
            let signature = factor.erased().signature();
            (signature.variables, signature.rows)
        };
        if variables != [TypeId::of::<DualQuadric>()] {
            let names: Vec<_> = variables.iter().map(|id| manifold_name(*id)).collect();
            let message = format!("`{name}` connects {}", names.join(" and "));
            let help = "a semantic rule adds a factor of one dual_quadric, such as `vertical_orientation`";
            errors.report(place, Problem::with_help(message, help));
            return None;
        }
        let Ok(Value::Object(mut fields)) = json else { return None };
        fields.shift_remove("type");
        // a factor that uses up writes the one that it has
        let written = serde_json::to_value(&factor).ok()?;
        let has_up = written.get(UP).is_some();
        Some(Self { name, wants_up: has_up && !fields.contains_key(UP), rows, fields })
    }

    /// Its type.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Rows of its residual, where they are known.
    pub fn rows(&self) -> Option<usize> {
        self.rows
    }

    /// Whether it waits for gravity.
    pub fn wants_up(&self) -> bool {
        self.wants_up
    }

    /// The factor itself.
    ///
    /// # Errors
    /// Where it needs to know up, and nobody does.
    pub fn instantiate(&self, up: Option<Direction>) -> Result<Box<dyn Factor>, RuleError> {
        let factor = || self.name.clone();
        let mut fields = self.fields.clone();
        if self.wants_up {
            let up = up.ok_or_else(|| RuleError::NoUp { factor: factor() })?;
            fields.insert(UP.to_owned(), json!([up.x, up.y, up.z]));
        }
        let entry = find(<dyn Factor as Kind>::NAME, &self.name);
        let entry = entry.ok_or_else(|| RuleError::NotRegistered { factor: factor() })?;
        let parsed = entry.parse::<dyn Factor>(Value::Object(fields));
        parsed.map_err(|source| RuleError::Fields { factor: factor(), source })
    }
}
