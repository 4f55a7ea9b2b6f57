//! The result of a solve as text.
use crate::output::text::{self, Table, count, list, seconds};
use manifactor::graph::{Values, Variable};
use manifactor::solve::{
    Diagnosis, FactorCost, InactiveFactor, Marginal, Outcome, StartDiagnosis, WeakDirection,
};
use serde_json::Value;

/// Maximum number of constraints that are listed.
const MAX_CONSTRAINTS: usize = 10;

/// The outcome in a few lines: termination, cost and time. `details` adds the time of each stage.
pub(crate) fn outcome(outcome: &Outcome, details: bool) -> String {
    let times = &outcome.times;
    let mut out = format!("{}\n", outcome.termination);
    out += &format!(
        "cost {:.9} -> {:.9} in {}\n",
        outcome.initial_cost,
        outcome.final_cost,
        count(outcome.iterations, "iteration")
    );
    if outcome.inactive > 0 {
        out += &inactive(outcome.inactive, outcome.factors, &outcome.inactive_factors);
        out += "\n";
    }
    if let Some(moving) = &outcome.moving {
        out += &format!("{moving}\n");
    }
    for bound in &outcome.active_bounds {
        out += &format!("{bound}\n");
    }
    for constraint in outcome.constraints.iter().take(MAX_CONSTRAINTS) {
        out += &format!("{constraint}\n");
    }
    if outcome.constraints.len() > MAX_CONSTRAINTS {
        out += &format!("and {} more constraints\n", outcome.constraints.len() - MAX_CONSTRAINTS);
    }
    if let Some(undetermined) = &outcome.undetermined {
        out += &format!("warning: {undetermined}\n");
    }
    if !outcome.rejected.is_empty() {
        let (rejected, all) = (outcome.rejected.len(), count(outcome.factors, "factor"));
        let keys = outcome.rejected.iter().map(|r| format!("{} ({})", r.factor, text::keys(&r.keys)));
        out += &format!("{rejected} of {all} rejected as outliers: {}\n", list(keys));
    }
    if !details {
        return out + &format!("{}\n", seconds(times.total));
    }
    out += &format!(
        "{}: compile {}, linearize {}, factorize {}, solve {}, evaluate {}, other {}\n",
        seconds(times.total),
        seconds(times.compile),
        seconds(times.linearize),
        seconds(times.factorize),
        seconds(times.solve),
        seconds(times.evaluate),
        seconds(times.diagnose + times.other)
    );
    out
}

/// Undefined factors, the first of them with their names.
fn inactive(inactive: usize, factors: usize, first: &[InactiveFactor]) -> String {
    let named: Vec<_> = first.iter().map(factor).collect();
    let more = if inactive > named.len() { ", …" } else { "" };
    let (all, named) = (count(factors, "factor"), named.join(", "));
    format!("{inactive} of {all} are undefined at these values and are left out: {named}{more}")
}

/// `3 between_se2 (x0, x1)`: index, type and variables of a factor.
fn factor(factor: &InactiveFactor) -> String {
    format!("{} {} ({})", factor.factor, factor.name, text::keys(&factor.keys))
}

/// Findings at the initial values, one per line.
pub(crate) fn at_start(found: &StartDiagnosis, factors: usize) -> Vec<String> {
    let mut lines = vec![];
    if let Some(bad) = &found.not_finite {
        lines.push(format!(
            "factor {} is not finite at these values: choose other initial values",
            factor(bad)
        ));
    }
    if found.inactive > 0 {
        lines.push(inactive(found.inactive, factors, &found.inactive_factors));
    }
    lines.extend(found.unconstrained.iter().map(ToString::to_string));
    lines.extend(found.undetermined.iter().map(|open| format!("at these values, {open}")));
    if let Some(WeakDirection { condition, direction }) = &found.weak {
        lines.push(format!(
            "at these values, almost {direction}: the condition number is {condition:.0e}, so about {:.0} of 16 \
             digits are lost",
            condition.log10()
        ));
    }
    lines
}

/// A warning about undetermined directions at the estimate, unless the outcome has one already. `details`
/// adds the condition number and the factors with the largest cost.
pub(crate) fn diagnosis(diagnosis: &Diagnosis, outcome: &Outcome, details: bool) -> String {
    let open = diagnosis.undetermined.as_ref().filter(|_| outcome.undetermined.is_none());
    let open = open.map_or_else(String::new, |open| format!("warning: at the estimate {open}\n"));
    if !details {
        return open;
    }
    let condition = match diagnosis.condition {
        Some(condition) => format!("condition number {condition:.1e}"),
        None => {
            "condition number infinite, or not estimated because H is large or was not factorized".to_owned()
        }
    };
    let condition = format!("{open}{condition} (of H, scaled to a unit diagonal)\n");
    if diagnosis.worst.is_empty() {
        return condition;
    }
    let mut table = Table::of_numbers(&["largest costs", "cost", "weight", "residual"]);
    for FactorCost { factor, name, keys, residual, cost, weight } in &diagnosis.worst {
        let residual: Vec<_> = residual.iter().map(|x| format!("{x:.3}")).collect();
        let name = format!("{factor} {name} ({})", text::keys(keys));
        table.row([name, format!("{cost:.4}"), format!("{weight:.3}"), residual.join(" ")]);
    }
    format!("{condition}{}\n", table.text())
}

/// The estimate of the first variables, or of those whose covariance was requested, with standard deviations by
/// direction.
pub(crate) fn estimate(values: &Values, marginals: Option<&[Marginal]>) -> String {
    const MAX_LISTED: usize = 10;
    let Some(marginals) = marginals else {
        let mut table = Table::of_words(&["variable", "estimate"]);
        for (key, value) in values.iter().take(MAX_LISTED) {
            table.row([key.to_string(), fields(value)]);
        }
        let more = match values.len().saturating_sub(MAX_LISTED) {
            0 => String::new(),
            more => format!("and {more} more: --out FILE writes them, --json prints them\n"),
        };
        return format!("{}\n{more}", table.text());
    };
    let mut table = Table::of_words(&["variable", "estimate", "standard deviations"]);
    for Marginal { key, tangent, covariance } in marginals {
        let sigmas = covariance.diagonal().map(f64::sqrt);
        let parts: Vec<_> =
            tangent.iter().zip(&sigmas).map(|(name, sigma)| format!("{name} {sigma:.3e}")).collect();
        let value = values.variable(key.as_str()).map_or_else(String::new, fields);
        table.row([key.to_string(), value, parts.join("  ")]);
    }
    format!("{}\n", table.text())
}

/// The fields of a value with their numbers: `translation 1.000000 0.500000  angle 0.100000`.
fn fields(value: &dyn Variable) -> String {
    fn numbers(json: &Value, text: &mut String) {
        match json {
            Value::Number(number) if number.is_u64() => *text += &format!(" {number}"),
            Value::Number(number) => {
                let x = number.as_f64().unwrap_or(f64::NAN);
                let is_short = x == 0.0 || (1e-3..1e7).contains(&x.abs());
                *text += &if is_short { format!(" {x:.6}") } else { format!(" {x:.6e}") };
            }
            Value::Array(items) => items.iter().for_each(|item| numbers(item, text)),
            Value::Object(fields) => fields.values().for_each(|field| numbers(field, text)),
            _ => {}
        }
    }
    let Ok(Value::Object(json)) = serde_json::to_value(value) else { return String::new() };
    let shown = json.iter().filter(|(name, _)| *name != "type").map(|(name, json)| {
        let mut text = name.clone();
        numbers(json, &mut text);
        text
    });
    shown.collect::<Vec<_>>().join("  ")
}
