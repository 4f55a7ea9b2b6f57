//! Overrides of single values, such as `--set solver.max_iterations=50`.
use crate::format::toml::parse_value;
use crate::format::too_deep;
use manifactor_document::Errors;
use manifactor_document::Fault;
use manifactor_document::{Field, MAX_DEPTH, Node, Table, Value};
use manifactor_document::{Place, SourceText};
use std::ops::Range;

/// One step of a path.
#[derive(Debug, Clone, PartialEq)]
enum Step {
    Key(String, Range<usize>),
    Index(usize, Range<usize>),
}

/// Applies `path=value` to a document. Errors are reported at the override.
pub(crate) fn apply(root: &mut Node, text: &str, errors: &Errors) {
    let source = SourceText::argument("--set", text);
    match split(text) {
        Ok((steps, _)) if steps.len() > MAX_DEPTH => errors.push(too_deep(source.place(0..text.len()))),
        Ok((steps, value)) => {
            let Some(value) = read(&source, value, errors) else { return };
            if let Err((place, problem)) = set_value(root, &steps, value, &source) {
                errors.report(place, problem);
            }
        }
        Err((at, message)) => {
            let help = "write it as `solver.stop.max_iterations=50` or `factors[2].noise.sigma=0.1`";
            errors.report(source.place(at..at), Fault::with_help(message, help));
        }
    }
}

/// Parses the value as TOML, or returns it as a string.
fn read(source: &SourceText, span: Range<usize>, errors: &Errors) -> Option<Node> {
    let text = source.text().get(span.clone()).unwrap_or_default();
    match parse_value(source, span.clone()) {
        Some(Ok(node)) => Some(node),
        Some(Err(list)) => {
            errors.extend(list);
            None
        }
        None => Some(Node::new(source.place(span), Value::String(text.to_owned()))),
    }
}

/// Splits `a.b[2]."c d" = value` into its steps and the range of the value.
fn split(text: &str) -> Result<(Vec<Step>, Range<usize>), (usize, String)> {
    let mut steps = Vec::new();
    let mut at = 0;
    loop {
        let rest = text.get(at..).unwrap_or_default();
        let Some(first) = rest.chars().next() else {
            return Err((at, "an override needs a `=` and a value".into()));
        };
        match first {
            '=' if !steps.is_empty() => {
                let value = rest.get(1..).unwrap_or_default();
                let start = at + 1 + (value.len() - value.trim_start().len());
                return Ok((steps, start..start + value.trim().len()));
            }
            '.' if !steps.is_empty() => at += 1,
            c if c.is_whitespace() => at += c.len_utf8(),
            '[' => {
                let end = rest.find(']').ok_or((at, "`[` without `]`".to_owned()))?;
                let digits = rest.get(1..end).unwrap_or_default().trim();
                let index = digits.parse().map_err(|_| (at, format!("`{digits}` is not an index")))?;
                steps.push(Step::Index(index, at..at + end + 1));
                at += end + 1;
            }
            quote @ ('"' | '\'') => {
                let end = rest
                    .get(1..)
                    .and_then(|r| r.find(quote))
                    .ok_or((at, "a quote without end".to_owned()))?;
                let key = rest.get(1..=end).unwrap_or_default();
                steps.push(Step::Key(key.to_owned(), at..at + end + 2));
                at += end + 2;
            }
            _ => {
                let end = rest.find(['.', '[', '=']).unwrap_or(rest.len());
                let key = rest.get(..end).unwrap_or_default().trim_end();
                if key.is_empty() {
                    return Err((at, "a key is missing".into()));
                }
                steps.push(Step::Key(key.to_owned(), at..at + key.len()));
                at += end;
            }
        }
    }
}

/// Walks to the last step and sets the value there.
fn set_value(
    root: &mut Node,
    steps: &[Step],
    value: Node,
    source: &SourceText,
) -> Result<(), (Place, Fault)> {
    let mut node = root;
    let mut done = 0;
    for step in steps {
        node = match step {
            Step::Key(key, span) => {
                let place = source.place(span.clone());
                if node.value == Value::Null {
                    *node = Node::new(place.clone(), Value::Table(Table::default()));
                }
                let path = source.text().get(..done).unwrap_or_default();
                let words = node.in_words();
                let Value::Table(table) = &mut node.value else {
                    return Err((place, Fault::invalid(format!("`{path}` is not a table but {words}"))));
                };
                let empty = || Field { key: place.clone(), node: Node::new(place.clone(), Value::Null) };
                done = span.end;
                &mut table.entry(key.clone()).or_insert_with(empty).node
            }
            Step::Index(index, span) => {
                let place = source.place(span.clone());
                let path = source.text().get(..done).unwrap_or_default();
                let words = node.in_words();
                let Value::Array(items) = &mut node.value else {
                    return Err((place, Fault::invalid(format!("`{path}` is not an array but {words}"))));
                };
                let length = items.len();
                done = span.end;
                items.get_mut(*index).ok_or_else(|| {
                    let message =
                        format!("`{path}` has {length} elements, counted from 0: there is no {index}");
                    (place, Fault::invalid(message))
                })?
            }
        };
    }
    *node = value;
    Ok(())
}
