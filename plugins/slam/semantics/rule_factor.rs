use manifactor_config::{Errors, Node, Place, Problem, ReadError, Value as NodeValue};
use manifactor_graph::catalogue::{Kind, find};
use manifactor_graph::manifold_name;
use manifactor_graph::{Direction, Factor, Key, Values};
use manifactor_quadric::DualQuadric;
use manifactor_semantic::MixtureError;
use serde::Serialize;
use serde_json::{Map, Value, json};
use std::any::TypeId;

/// The field that gravity fills.
const UP: &str = "up";

/// A factor of an object, and perhaps of others, whose `up` is open until gravity is known.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RuleFactor {
    #[serde(rename = "type")]
    name: String,
    #[serde(flatten)]
    fields: Map<String, Value>,
    /// The factor as it writes itself, with the fields that the config leaves open.
    #[serde(skip)]
    written: Value,
    /// The types of its variables.
    #[serde(skip)]
    variables: Vec<TypeId>,
    /// Rows of its residual, where that is known.
    #[serde(skip)]
    pub(super) rows: Option<usize>,
}

/// Why a rule's factor could not be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RuleError {
    /// It needs to know up, and up is unknown.
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
        source: ReadError,
    },
    /// It cannot be one of two possibilities.
    #[error("the semantic factor `{factor}` as a mixture: {source}")]
    Mixture {
        /// The factor's type.
        factor: String,
        /// Why.
        source: MixtureError,
    },
}

impl RuleFactor {
    /// Reads and checks a factor; what is wrong is reported.
    pub(super) fn read(node: &Node, errors: &Errors) -> Option<Self> {
        let (place, json) = (node.place.clone(), node.to_json());
        let name = match &node.value {
            NodeValue::Table(table) => match table.get("type").map(|field| &field.node.value) {
                Some(NodeValue::String(name)) => name.clone(),
                _ => String::new(),
            },
            _ => String::new(),
        };
        let factor = node.read::<Box<dyn Factor>>(errors)?;
        let signature = factor.erased().signature();
        let variables = signature.variables;
        if signature.many || !variables.contains(&TypeId::of::<DualQuadric>()) {
            let names: Vec<_> = variables.iter().map(|id| manifold_name(*id)).collect();
            let message = format!("`{name}` connects {}", names.join(" and "));
            let help = "a semantic rule adds a factor of one dual_quadric, such as `vertical_orientation`, or of several, such \
                        as `beside`";
            errors.report(place, Problem::with_help(message, help));
            return None;
        }
        let Ok(Value::Object(mut fields)) = json else { return None };
        fields.shift_remove("type");
        let written = serde_json::to_value(&factor).ok()?;
        Some(Self { name, fields, written, variables, rows: signature.rows })
    }

    /// Its type.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Whether it waits for gravity.
    pub fn wants_up(&self) -> bool {
        let mut fields = Value::Object(self.fields.clone());
        fill(&mut fields, &self.written, &Value::Null)
    }

    /// How many objects it connects the object with.
    pub fn partners(&self) -> usize {
        self.variables.iter().filter(|id| **id == TypeId::of::<DualQuadric>()).count().saturating_sub(1)
    }

    /// Its keys: the object and its partners in the places of objects, `with` in those of other variables.
    pub(super) fn keys(&self, object: &Key, partners: &[Key], with: &[Key]) -> Vec<Key> {
        let mut objects = std::iter::once(object).chain(partners);
        let mut others = with.iter();
        let key = |id: &TypeId| {
            if *id == TypeId::of::<DualQuadric>() { objects.next() } else { others.next() }.cloned()
        };
        self.variables.iter().filter_map(key).collect()
    }

    /// Checks that `with` names a variable for each place that is not an object's.
    pub(super) fn check(
        &self,
        with: &[(Place, Key)],
        place: &Place,
        own: &Values,
        errors: &Errors,
    ) -> Option<()> {
        let wanted: Vec<_> = self.variables.iter().filter(|id| **id != TypeId::of::<DualQuadric>()).collect();
        if wanted.len() != with.len() {
            let types: Vec<_> = wanted.iter().map(|id| format!("a `{}`", manifold_name(**id))).collect();
            let types = if types.is_empty() { "nothing".into() } else { types.join(" and ") };
            let message =
                format!("besides objects `{}` connects {types}, found {} in `with`", self.name, with.len());
            let help =
                "declare such variables as `[[variables]]` and name them in their order: with = [\"table\"]";
            errors.report(place.clone(), Problem::with_help(message, help));
            return None;
        }
        for ((place, key), id) in with.iter().zip(wanted) {
            let expected = manifold_name(*id);
            match own.variable(key.as_str()) {
                Some(found) if found.typetag_name() == expected => {}
                Some(found) => {
                    let (name, found) = (&self.name, found.typetag_name());
                    let message = format!(
                        "`{name}` takes a variable of type `{expected}` here, `{key}` is of type `{found}`"
                    );
                    errors.report(place.clone(), Problem::invalid(message));
                    return None;
                }
                None => {
                    let known = own.iter().map(|(key, _)| key.to_string()).collect();
                    let (what, name) = ("variable".to_owned(), key.to_string());
                    errors.report(place.clone(), Problem::UnknownName { what, name, known });
                    return None;
                }
            }
        }
        Some(())
    }

    /// The factor itself.
    ///
    /// # Errors
    /// If it needs to know up and up is unknown.
    pub fn instantiate(&self, up: Option<Direction>) -> Result<Box<dyn Factor>, RuleError> {
        let factor = || self.name.clone();
        let mut fields = Value::Object(self.fields.clone());
        let known = up.map_or(Value::Null, |up| json!([up.x, up.y, up.z]));
        if fill(&mut fields, &self.written, &known) && up.is_none() {
            return Err(RuleError::NoUp { factor: factor() });
        }
        let entry = find(<dyn Factor as Kind>::NAME, &self.name);
        let entry = entry.ok_or_else(|| RuleError::NotRegistered { factor: factor() })?;
        let parsed = serde_json::from_value::<Node>(fields).map_err(serde::de::Error::custom);
        let parsed = parsed.and_then(|fields: Node| entry.read::<dyn Factor>(&fields));
        parsed.map_err(|source| RuleError::Fields { factor: factor(), source })
    }
}

/// Puts `up` into each factor that has a field of that name, and leaves it open: this one, or one within it, as in a
/// mixture. A factor that uses up writes the one that it has. Whether there was such a field.
fn fill(given: &mut Value, written: &Value, up: &Value) -> bool {
    match (given, written) {
        (Value::Object(given), Value::Object(written)) => {
            let open = written.contains_key("type") && written.contains_key(UP) && !given.contains_key(UP);
            if open {
                given.insert(UP.to_owned(), up.clone());
            }
            let within = written.iter().filter_map(|(name, w)| Some(fill(given.get_mut(name)?, w, up)));
            within.fold(open, |any, filled| any || filled)
        }
        (Value::Array(given), Value::Array(written)) => {
            let within = given.iter_mut().zip(written).map(|(g, w)| fill(g, w, up));
            within.filter(|filled| *filled).count() > 0
        }
        _ => false,
    }
}
