//! Resolves calls to functions, with error messages for calls that match none.
use crate::mistake::Mistake;
use crate::scope::{NameMeaning, Scope};
use manifactor_config::nearest;
use manifactor_graph::quantity::{Function, Quantity, Shape, functions};
use std::ops::Range;
use std::sync::OnceLock;

/// Maximum number of signatures in a message.
const MAX_LISTED: usize = 6;

/// All linked functions.
pub(crate) struct Library {
    /// Functions sorted by name.
    functions: Vec<&'static Function>,
}

/// Arguments of a call, with the shape and the span of each.
type Arguments<'a> = &'a [(Shape, Range<usize>)];

impl Library {
    /// Returns the library; it is collected once for all formulas.
    pub(crate) fn linked() -> &'static Self {
        static LINKED: OnceLock<Library> = OnceLock::new();
        LINKED.get_or_init(|| Self { functions: functions() })
    }

    fn named(&self, name: &str) -> &[&'static Function] {
        let first = self.functions.partition_point(|f| f.name < name);
        let end = self.functions.partition_point(|f| f.name <= name);
        self.functions.get(first..end).unwrap_or_default()
    }

    /// Returns the function with this name and these argument types.
    pub(crate) fn resolve(
        &self,
        name: &str,
        at: &Range<usize>,
        whole: &Range<usize>,
        arguments: Arguments<'_>,
        scope: &Scope,
    ) -> Result<&'static Function, Mistake> {
        let named = self.named(name);
        let fits = |f: &&Function| {
            f.arguments.len() == arguments.len()
                && f.arguments.iter().zip(arguments).all(|((_, shape), (found, _))| shape == found)
        };
        if let Some(function) = named.iter().copied().find(fits) {
            return Ok(function);
        }
        if named.is_empty() {
            return Err(self.unknown_function(name, at.clone(), scope));
        }
        if !is_word(name) {
            return Err(no_operator(name, whole.clone(), arguments));
        }
        let of_arity: Vec<_> =
            named.iter().copied().filter(|f| f.arguments.len() == arguments.len()).collect();
        if of_arity.is_empty() {
            let message = format!("`{name}` takes {}, found {}", counts(named), arguments.len());
            return Err(Mistake::new(whole.clone(), message).help(signatures(named)));
        }
        // Find the first argument that no candidate accepts, given the arguments before it.
        let mut left = of_arity.clone();
        for (i, (found, span)) in arguments.iter().enumerate() {
            let taken: Vec<_> = left.iter().copied().filter(|f| argument(f, i) == Some(*found)).collect();
            if taken.is_empty() {
                let mut expected: Vec<&str> =
                    left.iter().filter_map(|f| Some(argument(f, i)?.name)).collect();
                expected.dedup();
                let message =
                    format!("`{name}` takes {} here, found {}", one_of(&expected), with_article(found.name));
                // Numbers and vectors need no explanation.
                let takers = match found.is_vector() || *found == f64::SHAPE {
                    true => String::new(),
                    false => format!("; {}", self.takers(*found)),
                };
                return Err(Mistake::new(span.clone(), message).help(signatures(&left) + &takers));
            }
            left = taken;
        }
        Err(Mistake::new(whole.clone(), format!("`{name}` does not take these together"))
            .help(signatures(&of_arity)))
    }

    fn unknown_function(&self, name: &str, at: Range<usize>, scope: &Scope) -> Mistake {
        let message = match scope.names.get(name) {
            Some(NameMeaning::Variable(_)) => format!("`{name}` is a variable, not a function"),
            Some(NameMeaning::Constant(..)) => format!("`{name}` is a constant, not a function"),
            None => format!("unknown function `{name}`"),
        };
        let meant = nearest(name, self.words()).map(|near| format!("did you mean `{near}`?"));
        let help = meant.unwrap_or_else(|| "`manifactor explain expression` lists all functions".into());
        Mistake::new(at, message).help(help)
    }

    /// Returns the error for a name that is neither a variable nor a constant.
    pub(crate) fn unknown_name<'n>(
        &self,
        name: &str,
        at: Range<usize>,
        known: impl Iterator<Item = &'n str>,
    ) -> Mistake {
        if let Some(function) = self.named(name).first() {
            let arguments: Vec<_> = function.arguments.iter().map(|(name, _)| *name).collect();
            let help = format!("write {name}({})", arguments.join(", "));
            return Mistake::new(at, format!("`{name}` is a function")).help(help);
        }
        let known: Vec<&str> = known.collect();
        let meant = nearest(name, known.iter().copied());
        let meant = meant.map_or(String::new(), |near| format!("did you mean `{near}`? "));
        let help = format!("{meant}there are {}", known.join(", "));
        Mistake::new(at, format!("unknown name `{name}`")).help(help)
    }

    /// Lists the functions that accept a value as first argument.
    pub(crate) fn takers(&self, shape: Shape) -> String {
        let takes =
            |f: &&&'static Function| is_word(f.name) && f.arguments.first().is_some_and(|(_, s)| *s == shape);
        let mut names: Vec<&str> = self.functions.iter().filter(takes).map(|f| f.name).collect();
        names.dedup();
        match names.is_empty() {
            true => format!("no function takes {}", with_article(shape.name)),
            false => format!("what takes {}: {}", with_article(shape.name), names.join(", ")),
        }
    }

    fn words(&self) -> impl Iterator<Item = &'static str> {
        self.functions.iter().map(|f| f.name).filter(|name| is_word(name))
    }
}

/// Returns whether the name belongs to a function rather than an operator.
pub(crate) fn is_word(name: &str) -> bool {
    name.starts_with(char::is_alphabetic)
}

/// Returns the type of the argument at an index, if there is one.
fn argument(function: &Function, place: usize) -> Option<Shape> {
    function.arguments.get(place).map(|(_, shape)| *shape)
}

fn no_operator(name: &str, whole: Range<usize>, arguments: Arguments<'_>) -> Mistake {
    let message = match arguments {
        [(a, _), (b, _)] => {
            format!("`{name}` is not defined between {} and {}", with_article(a.name), with_article(b.name))
        }
        [(a, _)] => format!("`{name}` is not defined for {}", with_article(a.name)),
        _ => format!("`{name}` is not defined here"),
    };
    let vectors = arguments.len() == 2 && arguments.iter().all(|(shape, _)| shape.is_vector());
    let help = match (name, vectors) {
        ("*", true) => "write dot(a, b), cross(a, b), or multiply(a, b) for component by component",
        ("/", true) => "write divide(a, b) for component by component",
        ("^", _) => "powers are of numbers; norm_squared(v) is the square of a length",
        _ => "a number goes with a number, a vector with a vector of the same length",
    };
    Mistake::new(whole, message).help(help)
}

fn counts(named: &[&Function]) -> String {
    let mut counts: Vec<usize> = named.iter().map(|f| f.arguments.len()).collect();
    counts.sort_unstable();
    counts.dedup();
    let words: Vec<String> = counts.iter().map(ToString::to_string).collect();
    let plural = if counts == [1] { "" } else { "s" };
    format!("{} argument{plural}", words.join(" or "))
}

fn signatures(named: &[&Function]) -> String {
    let listed: Vec<String> = named.iter().take(MAX_LISTED).map(|f| f.signature()).collect();
    let more = named.len().saturating_sub(MAX_LISTED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("there is {}{more}", listed.join(", "))
}

fn one_of(names: &[&str]) -> String {
    names.iter().map(|name| with_article(name)).collect::<Vec<_>>().join(" or ")
}

fn with_article(noun: &str) -> String {
    let vowel =
        noun.starts_with(['a', 'e', 'i', 'o', 'u']) || noun.starts_with("so") || noun.starts_with("se");
    format!("{} {noun}", if vowel { "an" } else { "a" })
}
