//! Cache of compiled formulas; factors that differ only in constants share a program.
use crate::compile::compile;
use crate::program::Program;
use crate::scope::{NameMeaning, Scope};
use indexmap::IndexMap;
use manifactor_graph::TextError;
use std::any::TypeId;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// Maximum number of cached formulas. A typical process has a few; if it is full, the cache is cleared.
const MAX_CACHED: usize = 256;

/// Inputs that determine a program, except for the values of its constants.
#[derive(PartialEq, Eq, Hash)]
struct Formulas {
    /// Names with their shapes, and the types of the variables.
    names: Vec<(String, &'static str, Option<TypeId>)>,
    define: Vec<(String, String)>,
    residual: Vec<String>,
    domain: Vec<String>,
}

/// Compiled programs, with a flag that is true if they use `up`.
static COMPILED: Mutex<Option<HashMap<Formulas, (Program, bool)>>> = Mutex::new(None);

/// Returns the program of formulas, and whether they use `up`.
pub(crate) fn program(
    scope: &Scope,
    define: &IndexMap<String, String>,
    residual: &[String],
    domain: &[String],
) -> Result<(Program, bool), TextError> {
    let names = scope.names.iter().map(|(name, named)| match named {
        // Several types of variables may have equal shapes.
        NameMeaning::Variable(quantity) => (name.clone(), quantity.shape.name, Some((quantity.type_id)())),
        NameMeaning::Constant(shape, _) => (name.clone(), shape.name, None),
    });
    let define_pairs = define.iter().map(|(name, text)| (name.clone(), text.clone()));
    let formulas = Formulas {
        names: names.collect(),
        define: define_pairs.collect(),
        residual: residual.to_vec(),
        domain: domain.to_vec(),
    };
    let known = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    let found = known.as_ref().and_then(|all| all.get(&formulas)).cloned();
    drop(known);
    if let Some((program, uses_up)) = found {
        let constants = scope.names.values().filter_map(|named| match named {
            NameMeaning::Constant(_, flat) => Some(flat.as_slice()),
            NameMeaning::Variable(_) => None,
        });
        if let Some(program) = program.with(constants) {
            return Ok((program, uses_up));
        }
        // Compiled again, for a message that points to the value that is not finite.
    }
    let compiled = compile(scope, define, residual, domain)?;
    let mut known = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    let all = known.get_or_insert_default();
    if all.len() >= MAX_CACHED {
        all.clear();
    }
    all.insert(formulas, compiled.clone());
    Ok(compiled)
}
