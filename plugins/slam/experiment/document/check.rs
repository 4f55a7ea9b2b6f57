//! Checks for mistakes in axes that would make an experiment misleading.
use super::axis::{Axis, AxisChoice, Column};
use crate::measures::measure_names;
use indexmap::IndexMap;
use manifactor_config::{Diagnostic, Errors, Fault, Node, Place, Value};
use manifactor_metrics::Alignment;
use std::collections::{HashMap, HashSet};

/// Columns of the tables besides axes and measures.
const RESERVED_COLUMNS: [&str; 15] = [
    "status",
    "reason",
    "seconds",
    "metric",
    "trials",
    "failed",
    "not converged",
    "mean",
    "low",
    "high",
    "pairs",
    "difference_mean",
    "difference_low",
    "difference_high",
    "relative",
];

/// Checks that each column has a unique name, that the choices of an axis differ, and that only one column
/// varies a setting.
pub(super) fn check_axes(axes: &[Axis], errors: &Errors) {
    check_columns(axes, errors);
    axes.iter().for_each(|axis| report_repeated_choices(axis, errors));
    report_overlapping_columns(axes, errors);
}

fn check_columns(axes: &[Axis], errors: &Errors) {
    let measures = measure_names(&Alignment::ALL);
    let mut first: HashMap<&str, &Place> = HashMap::new();
    for Column { name, place } in axes.iter().flat_map(|axis| &axis.columns) {
        if RESERVED_COLUMNS.contains(&name.as_str()) || measures.contains(name) {
            let message = format!("the tables have a column `{name}` of their own");
            errors.report(place.clone(), Fault::with_help(message, "give this one another name"));
        }
        if let Some(first) = first.insert(name, place) {
            errors.push(Diagnostic::duplicate("column", name, place.clone(), first.clone()));
        }
    }
}

/// Reports equal choices: their trials are one trial, but would be counted twice.
fn report_repeated_choices(axis: &Axis, errors: &Errors) {
    let (mut values, mut labels) = (HashMap::new(), HashMap::new());
    for choice in &axis.options {
        let value: String = choice.sets.iter().map(canonical).collect();
        if let Some(first) = values.insert(value, choice) {
            let words = |choice: &AxisChoice| choice.labels.join(", ");
            let message = format!("`{}` sets the same as `{}`", words(choice), words(first));
            let help = "leave one of them out: their trials would be the same, and not independent";
            let related = Some((first.place.clone(), "first given here".to_owned()));
            let problem = Fault::with_help(message, help);
            errors.push(Diagnostic { related, ..Diagnostic::new(choice.place.clone(), problem) });
        } else if let Some(first) = labels.insert(&choice.labels, choice) {
            let (name, place) = (choice.labels.join(", "), choice.place.clone());
            errors.push(Diagnostic::duplicate("value", &name, place, first.place.clone()));
        }
    }
}

/// Returns equal text for equal values: `1`, `0x1` and `1.0`.
fn canonical(node: &Node) -> String {
    // below this limit every whole f64 is an i64
    const MAX_EXACT_INTEGER: f64 = 9e18;
    match &node.value {
        Value::Null => "null".to_owned(),
        Value::Bool(value) => value.to_string(),
        Value::Integer(value) => value.to_string(),
        Value::Unsigned(value) => value.to_string(),
        Value::Float(value) if value.fract() == 0.0 && value.abs() < MAX_EXACT_INTEGER => {
            (*value as i64).to_string()
        }
        Value::Float(value) => value.to_string(),
        Value::String(value) => format!("{value:?}"),
        Value::Array(items) => {
            format!("[{}]", items.iter().map(canonical).collect::<Vec<_>>().join(","))
        }
        Value::Table(table) => {
            let mut fields: Vec<String> =
                table.iter().map(|(key, field)| format!("{key:?}:{}", canonical(&field.node))).collect();
            fields.sort();
            format!("{{{}}}", fields.join(","))
        }
    }
}

/// A column, by its axis and its index in the axis. A later column replaces settings of an earlier one.
type ColumnIndex = (usize, usize);

/// Reports two columns that set one key, because the first has no effect.
fn report_overlapping_columns(axes: &[Axis], errors: &Errors) {
    let mut keys: IndexMap<(Vec<&str>, ColumnIndex), &Place> = IndexMap::new();
    for (i, axis) in axes.iter().enumerate() {
        for choice in &axis.options {
            for (j, set) in choice.sets.iter().enumerate() {
                visit_leaves(set, &mut vec![], &mut |path, place| {
                    keys.entry((path.to_vec(), (i, j))).or_insert(place);
                });
            }
        }
    }
    keys.sort_unstable_keys();
    let name = |(i, j): ColumnIndex| {
        axes.get(i).and_then(|axis| axis.columns.get(j)).map_or("", |column| &column.name)
    };
    let mut told: HashSet<[ColumnIndex; 2]> = HashSet::new();
    let mut above: Option<(&[&str], ColumnIndex, &Place)> = None;
    for ((path, owner), place) in &keys {
        // keys are sorted: a key is followed by the keys within it
        match above.filter(|(outer, ..)| path.starts_with(outer)) {
            None => above = Some((path, *owner, place)),
            Some((_, other, _)) if other == *owner => {}
            Some((_, other, outer)) => {
                let mut both = [(other, outer), (*owner, *place)];
                both.sort_by_key(|(owner, _)| *owner);
                let [(first, before), (second, place)] = both;
                if told.insert([first, second]) {
                    let (path, first, second) = (path.join("."), name(first), name(second));
                    let message = format!(
                        "`{path}` is set by `{first}` and by `{second}`: there `{first}` has no effect"
                    );
                    let problem = Fault::with_help(message, "vary it in one column only");
                    let related = Some((before.clone(), "first set here".to_owned()));
                    errors.push(Diagnostic { related, ..Diagnostic::new(place.clone(), problem) });
                }
            }
        }
    }
}

/// Visits the paths of all values that are not tables.
fn visit_leaves<'a>(node: &'a Node, path: &mut Vec<&'a str>, visit: &mut impl FnMut(&[&'a str], &'a Place)) {
    let Value::Table(table) = &node.value else { return visit(path, &node.place) };
    for (key, field) in table.iter() {
        path.push(key);
        visit_leaves(&field.node, path, visit);
        path.pop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_config::{Document, Format};

    /// Returns the errors of these axes; empty if they are valid.
    fn wrong(text: &str) -> String {
        let document = Document::parse("sweep.toml", text, Format::Toml).unwrap();
        let errors = Errors::new();
        let read = document.section(&errors).map(|mut section| {
            let read = |axis: &Node| Axis::read(axis.read(&errors)?, &errors);
            let all: Vec<Axis> = section.nodes("axes").iter().filter_map(read).collect();
            check_axes(&all, &errors);
            section.finish();
        });
        errors.finish(read).map_or_else(|e| e.to_string(), |()| String::new())
    }

    fn rows(rows: &str) -> String {
        wrong(&format!("axes = [{{ columns = {{ seed = 'source.seed' }}, rows = {rows} }}]"))
    }

    #[test]
    fn values_that_are_the_same_are_refused_however_they_are_written() {
        assert_eq!(rows("[1, 2, 1.5, -1, 1e300, [1], 'one']"), "");
        let three = rows("[7, 2, 7, 7]");
        assert!(
            three.starts_with("sweep.toml:1:61: `7` sets the same as `7`; first given here: sweep.toml:1:55"),
            "{three}"
        );
        assert_eq!(three.lines().count(), 2, "{three}");
        for (same, second) in
            [("[1, 0x1]", "0x1"), ("[1, 1.0]", "1.0"), ("[[0.1, 2], [1e-1, 2.0]]", "[1e-1, 2.0]")]
        {
            let told = rows(same);
            assert!(told.contains(&format!("`{second}` sets the same as")), "{told}");
        }
        assert!(rows("[1, '1']").contains("value `1` is given twice"));
        let options = |second: &str| {
            wrong(&format!(
                "axes = [{{ name = 'model', options = [{{ name = 'a', set = {{ x = {{ y = 1, z = 2 }} }} }}, {second}] }}]"
            ))
        };
        assert_eq!(options("{ name = 'b', set = { x = { y = 1 } } }"), "");
        assert!(
            options("{ name = 'b', set = { x = { z = 2.0, y = 1 } } }").contains("`b` sets the same as `a`")
        );
        assert!(options("{ name = 'a' }").contains("value `a` is given twice"));
    }

    #[test]
    fn two_columns_that_set_one_key_are_refused() {
        let told = wrong(
            "[[axes]]\ncolumns = { first = 'source.seed' }\nrows = [1, 2]\n\
             [[axes]]\ncolumns = { second = 'source.seed' }\nrows = [3, 4]",
        );
        let expected =
            "sweep.toml:6:9: `source.seed` is set by `first` and by `second`: there `first` has no effect";
        assert!(told.starts_with(expected) && told.contains("first set here: sweep.toml:3:9"), "{told}");
        let within = wrong(
            "[[axes]]\nname = 'noise'\noptions = [{ name = 'a', set = { odometry = 1 } }]\n\
             [[axes]]\ncolumns = { sigma = 'odometry.noise.sigma' }\nrows = [3, 4]",
        );
        assert!(within.contains("`odometry.noise.sigma` is set by `noise` and by `sigma`"), "{within}");
        let one = wrong("[[axes]]\ncolumns = { a = 'x.y', b = 'x.y' }\nrows = [[1, 2], [3, 4]]");
        assert!(one.contains("`x.y` is set by `a` and by `b`") && one.lines().count() == 1, "{one}");
        let apart = wrong("[[axes]]\ncolumns = { a = 'x.y', b = 'x.z' }\nrows = [[1, 2], [3, 4]]");
        assert_eq!(apart, "");
    }

    #[test]
    fn a_column_has_a_name_of_its_own() {
        let named = |name: &str| wrong(&format!("axes = [{{ columns = {{ '{name}' = 'a' }}, rows = [1] }}]"));
        for name in ["status", "seconds", "objects", "ate_se3", "relative", "not converged"] {
            let told = named(name);
            assert!(told.contains(&format!("the tables have a column `{name}` of their own")), "{told}");
        }
        let axis = "[[axes]]\nname = 'a'\noptions = [{ name = 'b' }]\n";
        assert!(wrong(&axis.repeat(2)).contains("column `a` is given twice"));
    }
}
