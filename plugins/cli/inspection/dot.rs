//! The graph as Graphviz.
use super::Inspection;
use crate::output::text::printable;
use std::fmt::Write;

/// Variables are ellipses, factors are boxes; the lines of expensive factors are wider.
pub(super) fn write(inspection: &Inspection) -> String {
    let mut out = String::from("graph factors {\n  layout = neato; overlap = false; splines = true;\n");
    for row in &inspection.variables {
        let style = if row.fixed.is_some() { ", style = filled" } else { "" };
        // writing to a String cannot fail
        let _ = writeln!(
            out,
            "  {} [label = {}{style}];",
            quoted(&row.key),
            quoted(&format!("{}\n{}", row.key, row.of_type))
        );
    }
    let largest =
        inspection.factors.iter().map(|f| f.after.as_ref().unwrap_or(&f.before).cost).fold(0.0, f64::max);
    for row in &inspection.factors {
        let last = row.after.as_ref().unwrap_or(&row.before);
        let label = match &row.after {
            Some(after) => {
                format!("{} {}\n{:.3} -> {:.3}", row.number, row.label(), row.before.cost, after.cost)
            }
            None => format!("{} {}\n{:.3}", row.number, row.label(), row.before.cost),
        };
        let name = format!("factor {}", row.number);
        let _ = writeln!(out, "  {} [label = {}, shape = box];", quoted(&name), quoted(&label));
        let width = if largest > 0.0 { 1.0 + 4.0 * last.cost / largest } else { 1.0 };
        for key in &row.keys {
            let _ = writeln!(out, "  {} -- {} [penwidth = {width:.2}];", quoted(&name), quoted(key));
        }
    }
    out + "}\n"
}

fn quoted(text: &str) -> String {
    format!("\"{}\"", printable(text).replace('\\', "\\\\").replace('"', "\\\"").replace('\n', "\\n"))
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn names_of_any_kind_stay_in_their_quotes() {
        assert_eq!(quoted("a \"b\" \\\n"), r#""a \"b\" \\\n""#);
        assert_eq!(quoted("\0\u{9b}"), r#""\\u{0}\\u{9b}""#);
    }
}
