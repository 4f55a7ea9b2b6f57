//! Formulas that were compiled already: factors that differ in constants alone share them.
use crate::compile::compile;
use crate::program::Program;
use crate::scope::{Named, Scope};
use indexmap::IndexMap;
use manifactor_graph::TextError;
use std::any::TypeId;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

/// Formulas that are kept. A program has a few; what makes ever new ones begins anew.
const MOST: usize = 256;

/// What a program follows from, but for the values of its constants.
#[derive(PartialEq, Eq, Hash)]
struct Formulas {
    /// Names, types of the variables and shapes of the constants.
    names: Vec<(String, &'static str, Option<TypeId>)>,
    define: Vec<(String, String)>,
    residual: Vec<String>,
    domain: Vec<String>,
}

/// Programs, and whether they use `up`.
static COMPILED: Mutex<Option<HashMap<Formulas, (Program, bool)>>> = Mutex::new(None);

/// The program of formulas, and whether they use `up`.
pub(crate) fn program(
    scope: &Scope,
    define: &IndexMap<String, String>,
    residual: &[String],
    domain: &[String],
) -> Result<(Program, bool), TextError> {
    let names = scope.names.iter().map(|(name, named)| match named {
        // several types of variables may have one shape
        Named::Variable(quantity) => (name.clone(), quantity.shape.name, Some((quantity.type_id)())),
        Named::Constant(shape, _) => (name.clone(), shape.name, None),
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
            Named::Constant(_, flat) => Some(flat.as_slice()),
            Named::Variable(_) => None,
        });
        if let Some(program) = program.with(constants) {
            return Ok((program, uses_up));
        }
        // compiled again, for a message that points to what is not finite
    }
    let compiled = compile(scope, define, residual, domain)?;
    let mut known = COMPILED.lock().unwrap_or_else(PoisonError::into_inner);
    let all = known.get_or_insert_default();
    if all.len() >= MOST {
        all.clear();
    }
    all.insert(formulas, compiled.clone());
    Ok(compiled)
}
