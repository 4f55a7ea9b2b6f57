//! Compiles formulas to a program: resolves every call by its argument types, folds constants and shares
//! common subexpressions.
use crate::mistake::Mistake;
use crate::program::{Code, Pass, Program, Step};
use crate::resolve::Library;
use crate::scope::{NameMeaning, Scope, UP, check_name};
use crate::syntax::{Formula, Node, parse};
use indexmap::IndexMap;
use manifactor_graph::TextError;
use manifactor_graph::quantity::{Function, Quantity, Shape};
use std::collections::{BTreeSet, HashMap};
use std::ops::Range;

/// A value of the program under construction.
#[derive(Debug, Clone, Copy)]
struct Value {
    shape: Shape,
    at: usize,
    /// One bit per variable that the value depends on; zero for constants.
    depends: u32,
}

impl Value {
    fn range(&self) -> Range<usize> {
        self.at..self.at + self.shape.size
    }
}

/// Compiles formulas, and returns whether they use `up`.
pub(crate) fn compile(
    scope: &Scope,
    define: &IndexMap<String, String>,
    residual: &[String],
    domain: &[String],
) -> Result<(Program, bool), TextError> {
    let mut compiler = Compiler::new(scope);
    for (name, text) in define {
        compiler.define(name).map_err(|mistake| mistake.within(name))?;
        let value = parse(text).and_then(|formula| compiler.value(&formula));
        compiler.names.insert(name, value.map_err(|mistake| mistake.within(text))?);
    }
    for text in residual {
        compiler.residual(text).map_err(|mistake| mistake.within(text))?;
    }
    compiler.passes()?;
    for text in domain {
        compiler.condition(text).map_err(|mistake| mistake.within(text))?;
    }
    Ok((Program::new(compiler.code, compiler.values), compiler.uses_up))
}

struct Compiler<'a> {
    scope: &'a Scope,
    library: &'static Library,
    code: Code,
    /// Constants, values computed from constants only, and space for values that depend on variables.
    values: Vec<f64>,
    /// Names in the order of their definition, for messages.
    names: IndexMap<&'a str, Value>,
    uses_up: bool,
    /// Arguments and result of each call.
    calls: Vec<(Vec<Value>, Value)>,
    /// Dependencies of each row, one bit per variable.
    rows: Vec<u32>,
    /// Computed values, by function and indices of the arguments.
    known: HashMap<(*const Function, Vec<u32>), Value>,
}

impl<'a> Compiler<'a> {
    fn new(scope: &'a Scope) -> Self {
        let (mut code, mut values, mut names) = (Code::default(), vec![], IndexMap::new());
        for (name, what) in &scope.names {
            let at = values.len();
            let (shape, depends) = match what {
                NameMeaning::Constant(shape, flat) => {
                    values.extend_from_slice(flat);
                    code.constants.push(at);
                    (*shape, 0)
                }
                NameMeaning::Variable(quantity) => {
                    let number = code.inputs.len();
                    values.resize(at + quantity.shape.size, 0.0);
                    code.types.push((quantity.type_id)());
                    code.dimensions.push(quantity.dimension);
                    code.inputs.push((quantity, at));
                    (quantity.shape, 1 << number)
                }
            };
            names.insert(name.as_str(), Value { shape, at, depends });
        }
        let (library, calls, rows, known) = (Library::linked(), vec![], vec![], HashMap::new());
        Self { scope, library, code, values, names, uses_up: false, calls, rows, known }
    }

    /// Checks the name of a `define` entry.
    fn define(&self, name: &str) -> Result<(), Mistake> {
        check_name(name)?;
        match self.names.contains_key(name) {
            true => {
                let message = format!("`{name}` is a variable or a constant already: choose another name");
                Err(Mistake::new(0..name.len(), message))
            }
            false => Ok(()),
        }
    }

    /// Adds the rows of a residual formula.
    fn residual(&mut self, text: &str) -> Result<(), Mistake> {
        let formula = parse(text)?;
        let value = self.value(&formula)?;
        if value.shape != f64::SHAPE && !value.shape.is_vector() {
            let message = format!("a residual is a number or a vector, this is of the type {}", value.shape);
            return Err(Mistake::new(formula.span, message).help(self.library.takers(value.shape)));
        }
        if value.depends == 0 {
            let variables: Vec<_> = self.scope.variables().collect();
            let help = format!("a residual depends on variables: {}", variables.join(", "));
            return Err(Mistake::new(formula.span, "this formula is constant").help(help));
        }
        self.code.rows.extend(value.range());
        self.rows.resize(self.code.rows.len(), value.depends);
        Ok(())
    }

    /// Adds a condition: a number that must be positive.
    fn condition(&mut self, text: &str) -> Result<(), Mistake> {
        let formula = parse(text)?;
        let value = self.value(&formula)?;
        if value.shape != f64::SHAPE {
            let message = format!(
                "a condition is a number, above zero where the factor is defined; this is of the type {}",
                value.shape
            );
            return Err(Mistake::new(formula.span, message));
        }
        self.code.domain.push(value.at);
        Ok(())
    }

    fn value(&mut self, formula: &Formula) -> Result<Value, Mistake> {
        match &formula.node {
            Node::Number(x) => {
                self.values.push(*x);
                Ok(Value { shape: f64::SHAPE, at: self.values.len() - 1, depends: 0 })
            }
            Node::Name(name) => match self.names.get(name.as_str()) {
                Some(value) => {
                    self.uses_up |= name == UP;
                    Ok(*value)
                }
                None => {
                    let known = self.names.keys().copied();
                    Err(self.library.unknown_name(name, formula.span.clone(), known))
                }
            },
            Node::Call { name, at, arguments } => {
                let values: Vec<Value> = arguments.iter().map(|a| self.value(a)).collect::<Result<_, _>>()?;
                let shapes: Vec<(Shape, Range<usize>)> =
                    values.iter().zip(arguments).map(|(value, a)| (value.shape, a.span.clone())).collect();
                let function = self.library.resolve(name, at, &formula.span, &shapes, self.scope)?;
                if name == "^" && values.last().is_some_and(|exponent| exponent.depends != 0) {
                    let span = shapes.last().map_or(at.clone(), |(_, span)| span.clone());
                    let help = "with a variable exponent, write exp(b * ln(a))";
                    return Err(Mistake::new(span, "the exponent has to be constant").help(help));
                }
                self.call(function, values, &formula.span)
            }
        }
    }

    fn call(
        &mut self,
        function: &'static Function,
        arguments: Vec<Value>,
        span: &Range<usize>,
    ) -> Result<Value, Mistake> {
        let at: Vec<u32> = arguments.iter().map(|value| value.at as u32).collect();
        let key = (std::ptr::from_ref(function), at);
        if let Some(value) = self.known.get(&key) {
            return Ok(*value);
        }
        let depends = arguments.iter().fold(0, |all, value| all | value.depends);
        let value = Value { shape: function.result, at: self.values.len(), depends };
        self.values.resize(value.range().end, 0.0);
        let at = key.1.clone().into_boxed_slice();
        let (numbers, lanes) = (function.over_numbers, function.over_lanes);
        let step = Step { numbers, lanes, at, to: value.range() };
        if depends == 0 {
            if !step.run(&mut self.values) {
                return Err(Mistake::new(span.clone(), "this is not a finite number"));
            }
            self.code.folded.push(step);
        } else {
            self.code.calls.push(step);
            self.calls.push((arguments, value));
        }
        self.known.insert(key, value);
        Ok(value)
    }

    /// Collects the steps that differentiate the rows, for each variable.
    fn passes(&mut self) -> Result<(), TextError> {
        for (variable, name) in self.scope.variables().enumerate() {
            let depends = |on: u32| on >> variable & 1 == 1;
            let rows: Vec<bool> = self.rows.iter().map(|row| depends(*row)).collect();
            if !rows.contains(&true) {
                let mistake =
                    Mistake::new(0..name.len(), format!("the residual does not depend on `{name}`"));
                return Err(mistake.help("use it, or take it out of the variables").within(name));
            }
            let calls: Vec<usize> =
                (0..self.calls.len()).filter(|i| depends(self.calls[*i].1.depends)).collect();
            let arguments = calls.iter().flat_map(|i| &self.calls[*i].0);
            let lifted: BTreeSet<usize> =
                arguments.filter(|value| !depends(value.depends)).flat_map(Value::range).collect();
            self.code.passes.push(Pass { calls, lifted: lifted.into_iter().collect(), rows });
        }
        Ok(())
    }
}
