//! Documentation of the formula language for the catalogue.
use crate::resolve::is_word;
use manifactor_graph::quantity::{Function, functions};
use std::fmt::Write;

const MEANING: &str = "\
A formula of named variables: a factor in a config, without a compiler.

`variables` has a name and a type for each key of the factor, in the order of the keys. Each formula of `residual` is a \
number or a vector, one row or several. Numbers are `1`, `0.5`, `1e-3`; vectors `[0, 0, 1]`; operators `+ - * / ^`. The \
operator `^` has the highest precedence. Names are the variables, the `constants`, `pi`, and `up`, the world's up. If a \
semantic rule gives no `up`, the run's gravity defines it. A constant is a number, a vector, or a value with its `type`. \
`define` gives names to parts of formulas. The reader checks and compiles each formula once; derivatives are exact.

The factor is defined if all formulas of `domain` are positive, and everywhere without `domain`. Division by zero or the \
root of a negative number is no domain: a solve that meets one ends as not finite. Kinks come from the functions alone.

```toml
[[factors]]
keys   = [\"q3\"]
factor = { type = \"expression\", variables = { q = \"dual_quadric\" }, residual = [\"1 - abs(dot(major_axis(q), up))\"] }
noise  = { sigma = 0.1 }
```
";

/// Returns the page of the catalogue: the language and every linked function.
pub(crate) fn page() -> String {
    let all = functions();
    let (words, operators): (Vec<&Function>, Vec<&Function>) = all.into_iter().partition(|f| is_word(f.name));
    let mut text = String::from(MEANING);
    for (title, list) in [("Operators:", operators), ("Functions:", words)] {
        let lines: Vec<(String, &str)> = list.into_iter().map(|f| (written(f), f.summary.trim())).collect();
        let width = lines.iter().map(|(signature, _)| signature.chars().count()).max().unwrap_or(0);
        let _ = writeln!(text, "\n{title}\n\n```text");
        for (signature, summary) in lines {
            let _ = writeln!(text, "{signature:width$}  {summary}");
        }
        text += "```\n";
    }
    text.trim_end().to_owned()
}

/// Formats the signature of a function, for example `a * b: number * vector3 -> vector3` for an operator.
fn written(function: &Function) -> String {
    let types: Vec<&str> = function.arguments.iter().map(|(_, shape)| shape.name).collect();
    match (is_word(function.name), types.as_slice()) {
        (false, [a, b]) => format!("{a} {} {b} -> {}", function.name, function.result),
        (false, [a]) => format!("{}{a} -> {}", function.name, function.result),
        _ => function.signature(),
    }
}
