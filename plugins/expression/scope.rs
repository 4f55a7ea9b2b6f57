//! Names in formulas: variables, constants, `up` and `pi`.
use crate::constant::Constant;
use crate::mistake::Mistake;
use indexmap::IndexMap;
use manifactor_config::nearest;
use manifactor_graph::catalogue::{Kind, entries, find};
use manifactor_graph::quantity::{Quantity, Shape, VariableQuantity, variable_quantity};
use manifactor_graph::{Direction, TextError, Variable};
use nalgebra::Vector3;

/// Name of the world's up direction.
pub(crate) const UP: &str = "up";
/// Reserved names.
const RESERVED: [&str; 2] = [UP, "pi"];
/// Meaning of a name.
pub(crate) enum NameMeaning {
    Variable(&'static VariableQuantity),
    /// Shape and flat form of the value.
    Constant(Shape, Vec<f64>),
}

/// Names with their meaning; variables come first, in the order of a factor's keys.
#[derive(Default)]
pub(crate) struct Scope {
    pub names: IndexMap<String, NameMeaning>,
}

impl Scope {
    pub(crate) fn new(
        variables: &IndexMap<String, String>,
        constants: &IndexMap<String, Constant>,
        up: Direction,
    ) -> Result<Self, TextError> {
        let mut scope = Self::default();
        for (name, of) in variables {
            scope.add(name, NameMeaning::Variable(quantity_of(of)?))?;
        }
        for (name, constant) in constants {
            let flat = constant.flat().and_then(|(shape, flat)| match flat.iter().all(|x| x.is_finite()) {
                true => Ok((shape, flat)),
                false => Err("it is not finite".to_owned()),
            });
            let (shape, flat) = flat.map_err(|why| {
                Mistake::new(0..name.len(), format!("the constant `{name}`: {why}")).within(name)
            })?;
            scope.add(name, NameMeaning::Constant(shape, flat))?;
        }
        let always = [
            (UP, Vector3::<f64>::SHAPE, up.as_slice().to_vec()),
            ("pi", f64::SHAPE, vec![std::f64::consts::PI]),
        ];
        for (name, shape, flat) in always {
            scope.names.insert(name.to_owned(), NameMeaning::Constant(shape, flat));
        }
        Ok(scope)
    }

    /// Returns the names of the variables.
    pub(crate) fn variables(&self) -> impl Iterator<Item = &str> {
        let variables = self.names.iter().filter(|(_, named)| matches!(named, NameMeaning::Variable(_)));
        variables.map(|(name, _)| name.as_str())
    }

    fn add(&mut self, name: &str, named: NameMeaning) -> Result<(), TextError> {
        let wrong = |message: String| Mistake::new(0..name.len(), message).within(name);
        check_name(name).map_err(|mistake| mistake.within(name))?;
        match self.names.insert(name.to_owned(), named) {
            None => Ok(()),
            Some(_) => Err(wrong(format!("`{name}` is a variable and a constant: rename one of them"))),
        }
    }
}

/// Checks that a document may define a name.
pub(crate) fn check_name(name: &str) -> Result<(), Mistake> {
    let wrong = |message: String| Mistake::new(0..name.len(), message);
    let letter = |c: char| c.is_alphabetic() || c == '_';
    let plain = name.starts_with(letter) && name.chars().all(|c| letter(c) || c.is_numeric());
    if !plain {
        return Err(wrong(format!("`{name}` is not a name: expected letters, digits and `_`")));
    }
    if RESERVED.contains(&name) {
        return Err(wrong(format!("`{name}` means something already: choose another name")));
    }
    Ok(())
}

fn quantity_of(name: &str) -> Result<&'static VariableQuantity, TextError> {
    let kind = <dyn Variable as Kind>::NAME;
    let entry = find(kind, name);
    if let Some(quantity) = entry.and_then(|entry| variable_quantity((entry.type_id)())) {
        return Ok(quantity);
    }
    let known = entries(kind).into_iter().filter(|e| variable_quantity((e.type_id)()).is_some());
    let known: Vec<&str> = known.map(|e| e.name).collect();
    let message = match entry {
        None => format!("unknown type of variables `{name}`"),
        Some(_) => format!("formulas know nothing of variables of the type `{name}`"),
    };
    let meant =
        nearest(name, known.iter().copied()).map_or(String::new(), |n| format!("did you mean `{n}`? "));
    let help = format!("{meant}there are {}", known.join(", "));
    Err(Mistake::new(0..name.len(), message).help(help).within(name))
}
