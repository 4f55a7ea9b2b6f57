//! Report of a factor check, with the names of variables and directions.
use super::Subject;
use crate::error::LawError;
use crate::freedom::Freedom;
use crate::jacobian::JacobianEntry;
use crate::jacobian::Kink;
use crate::points::Drawn;
use manifactor_graph::Linearization;
use manifactor_graph::invariance::invariances;
use serde::Serialize;
use serde_json::Value;
use std::cmp::Ordering;
use std::collections::BTreeSet;
use std::fmt::{self, Display, Formatter};

/// Report of a factor check.
#[derive(Debug, Clone, Serialize)]
pub struct FactorReport {
    /// The factor as in a document.
    pub factor: Value,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of examined points.
    pub drawn: usize,
    /// Number of points at which the factor is defined.
    pub defined: usize,
    /// Number of defined points at or near a singular point of a manifold.
    pub singular: usize,
    /// The entry of the Jacobian with the largest accepted difference from numeric differentiation.
    pub worst: Option<NamedEntry>,
    /// Number of directions of all variables.
    pub directions: usize,
    /// Largest rank of the Jacobian at any point that is neither singular nor at a kink.
    pub rank: usize,
    /// Directions that do not change the residual, to first order.
    pub free: Vec<FreeDirections>,
    /// Points without a derivative of the residual, jumps first.
    pub kinks: Vec<NamedKink>,
    /// Stated invariances that held.
    pub unchanged: Vec<Unchanged>,
    /// The law that does not hold.
    pub broken: Option<Broken>,
}

/// An entry of a Jacobian, computed in two ways.
#[derive(Debug, Clone, Serialize)]
pub struct NamedEntry {
    /// Variable and direction: `q0.rx`.
    pub direction: String,
    /// The row, counted from 0.
    pub row: usize,
    /// Value by automatic differentiation.
    pub automatic: f64,
    /// Value by numeric differentiation.
    pub numeric: f64,
    /// Difference, relative to the largest entry of the block or to 1.
    pub error: f64,
    /// The point as a graph document that reproduces it.
    pub at: Value,
}

/// Free directions: single ones, and the number of combinations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FreeDirections {
    /// Number of free combinations.
    pub count: usize,
    /// Directions that are combined.
    pub among: Vec<String>,
}

/// A kink or a jump: entries of the Jacobian that have no derivative at common points.
#[derive(Debug, Clone, Serialize)]
pub struct NamedKink {
    /// Variables and directions: `q0.rx`.
    pub directions: Vec<String>,
    /// The rows, counted from 0.
    pub rows: Vec<usize>,
    /// Derivative from below, of the entry with the largest kink.
    pub before: f64,
    /// Derivative from above, of this entry.
    pub after: f64,
    /// Jump of the residual; 0 at a kink.
    pub jump: f64,
    /// Number of points with this kink.
    pub points: usize,
    /// The point with the largest kink, as a graph document.
    pub at: Value,
}

/// A motion that leaves the residual unchanged.
#[derive(Debug, Clone, Serialize)]
pub struct Unchanged {
    /// Description of the motion by the author of the factor.
    pub motion: &'static str,
    /// Number of points at which it was tested.
    pub points: usize,
}

/// A law that does not hold.
#[derive(Debug, Clone, Serialize)]
pub struct Broken {
    /// The error.
    pub message: String,
    /// The point as a graph document that reproduces it.
    pub at: Value,
}

impl FactorReport {
    /// Returns whether every law holds, and the factor is defined at one point at least.
    pub fn holds(&self) -> bool {
        self.broken.is_none() && self.defined > 0
    }
}

/// Kinks, or jumps, with common rows.
pub(super) struct KinkGroup {
    /// Variable, direction and row of each entry.
    entries: BTreeSet<(usize, usize, usize)>,
    largest: Kink,
    points: usize,
    at: Value,
}

impl KinkGroup {
    fn size(kink: &Kink) -> (f64, f64) {
        (kink.jump, kink.size())
    }
    fn is_jump(&self) -> bool {
        self.largest.jump != 0.0
    }
    fn has_row_of(&self, other: &Self) -> bool {
        self.entries.iter().any(|(.., row)| other.entries.iter().any(|(.., of_other)| of_other == row))
    }
    fn named(&self, subject: &Subject) -> NamedKink {
        let mut directions: Vec<String> =
            self.entries.iter().map(|(v, c, _)| subject.direction(*v, *c)).collect();
        directions.dedup();
        let rows: BTreeSet<usize> = self.entries.iter().map(|(.., row)| *row).collect();
        let Kink { before, after, jump, .. } = self.largest;
        let (rows, at) = (rows.into_iter().collect(), self.at.clone());
        NamedKink { directions, rows, before, after, jump, points: self.points, at }
    }
}

/// Results of a check so far.
pub(super) struct Gathered {
    pub seed: u64,
    pub drawn: usize,
    pub defined: usize,
    pub singular: usize,
    pub worst: Option<NamedEntry>,
    pub kinks: Vec<KinkGroup>,
    pub unchanged: Vec<Unchanged>,
    pub linearizations: Vec<Linearization>,
    pub freedom: Option<Freedom>,
}

impl Gathered {
    pub(super) fn new(subject: &Subject, seed: u64) -> Self {
        let stated = invariances(subject.factor.erased().as_any().type_id());
        let unchanged = stated.iter().map(|i| Unchanged { motion: i.motion, points: 0 }).collect();
        Self {
            seed,
            drawn: 0,
            defined: 0,
            singular: 0,
            worst: None,
            kinks: vec![],
            unchanged,
            linearizations: vec![],
            freedom: None,
        }
    }

    /// Keeps an entry if it is the worst so far.
    pub(super) fn entry(&mut self, subject: &Subject, entry: Option<JacobianEntry>, drawn: &Drawn) {
        let Some(JacobianEntry { variable, column, row, found, expected, error }) = entry else { return };
        if self.worst.as_ref().is_none_or(|worst| error > worst.error) {
            let direction = subject.direction(variable, column);
            let at = subject.graph(&drawn.variables);
            self.worst = Some(NamedEntry { direction, row, automatic: found, numeric: expected, error, at });
        }
    }

    /// Adds the kinks and jumps of one point. They are merged with known ones that have a row in common.
    pub(super) fn kinks(&mut self, subject: &Subject, kinks: &[Kink], drawn: &Drawn) {
        let (jumps, kinks): (Vec<&Kink>, Vec<&Kink>) = kinks.iter().partition(|kink| kink.jump != 0.0);
        for kinks in [jumps, kinks] {
            let by_size = |a: &&&Kink, b: &&&Kink| {
                KinkGroup::size(a).partial_cmp(&KinkGroup::size(b)).unwrap_or(Ordering::Equal)
            };
            let Some(&&largest) = kinks.iter().max_by(by_size) else { continue };
            let entries = kinks.iter().map(|kink| (kink.variable, kink.column, kink.row)).collect();
            let mut group = KinkGroup { entries, largest, points: 1, at: subject.graph(&drawn.variables) };
            let is_same =
                |other: &mut KinkGroup| other.is_jump() == group.is_jump() && other.has_row_of(&group);
            for other in self.kinks.extract_if(.., is_same).collect::<Vec<_>>() {
                group.entries.extend(other.entries);
                group.points += other.points;
                if KinkGroup::size(&other.largest) >= KinkGroup::size(&group.largest) {
                    (group.largest, group.at) = (other.largest, other.at);
                }
            }
            self.kinks.push(group);
        }
    }

    pub(super) fn broken(self, subject: &Subject, error: &LawError, at: &Drawn) -> FactorReport {
        let message = match error {
            LawError::Jacobian { law, row, variable, direction, found, expected, .. } => {
                let key = subject.keys.get(*variable).map_or("?", String::as_str);
                format!("{law}: row {row} by `{key}.{direction}` is {found} and should be {expected}")
            }
            LawError::Residual { law, row, found, expected, .. }
                if self.unchanged.iter().any(|u| u.motion == *law) =>
            {
                format!("not unchanged by {law}: row {row} is {found} after it, and was {expected}")
            }
            // the remaining lines are the point, which is shown in full
            other => other.to_string().lines().next().unwrap_or_default().to_owned(),
        };
        let broken = Some(Broken { message, at: subject.graph(&at.variables) });
        FactorReport { broken, ..self.finish(subject) }
    }

    pub(super) fn finish(self, subject: &Subject) -> FactorReport {
        let names = subject.directions();
        let freedom = self.freedom.unwrap_or(Freedom { directions: names.len(), rank: 0, free: vec![] });
        let named = |i: &usize| names.get(*i).cloned().unwrap_or_default();
        let free = freedom
            .free
            .iter()
            .map(|f| FreeDirections { count: f.count, among: f.among.iter().map(named).collect() });
        let (mut kinks, others): (Vec<_>, Vec<_>) =
            self.kinks.iter().map(|group| group.named(subject)).partition(|kink| kink.jump != 0.0);
        kinks.extend(others);
        FactorReport {
            factor: serde_json::to_value(&*subject.factor).unwrap_or_default(),
            seed: self.seed,
            drawn: self.drawn,
            defined: self.defined,
            singular: self.singular,
            worst: self.worst,
            directions: freedom.directions,
            rank: freedom.rank,
            free: free.collect(),
            kinks,
            unchanged: self.unchanged,
            broken: None,
        }
    }
}

impl Display for FactorReport {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let name = self.factor.get("type").and_then(Value::as_str).unwrap_or("?");
        if let Some(broken) = &self.broken {
            writeln!(f, "{name} is broken: {}", broken.message)?;
            return write!(f, "There (seed {}), as a graph:\n\n{}", self.seed, toml(&broken.at));
        }
        if self.defined == 0 {
            return write!(f, "{name} is defined at none of {} points: nothing was checked", self.drawn);
        }
        let Self { drawn, defined, singular, seed, .. } = self;
        writeln!(
            f,
            "{name}: defined at {defined} of {drawn} points, {singular} of them singular or nearly so (seed {seed})"
        )?;
        match &self.worst {
            Some(NamedEntry { direction, row, automatic, numeric, error, .. }) if *error > 0.0 => {
                let (found, expected) = (digits(*automatic), digits(*numeric));
                writeln!(
                    f,
                    "Jacobian: right; the worst entry, row {row} by {direction}, is {found} against {expected} ({error:.0e})"
                )?;
            }
            Some(_) => writeln!(f, "Jacobian: right; no entry differs")?,
            None => {}
        }
        let free: usize = self.free.iter().map(|f| f.count).sum();
        match self.rank {
            0 => writeln!(f, "Free: not known, as every point was singular or at a kink")?,
            _ => writeln!(f, "Free: {free} of {} directions{}", self.directions, list(&self.free))?,
        }
        for Unchanged { motion, points } in &self.unchanged {
            writeln!(f, "Unchanged by {motion}: at {}", points_in_words(*points))?;
        }
        for kink in &self.kinks {
            let NamedKink { directions, rows, before, after, jump, points, .. } = kink;
            let (row, rows) = (if rows.len() == 1 { "row" } else { "rows" }, and(rows));
            let (directions, points) = (by_variable(directions), points_in_words(*points));
            match *jump {
                0.0 => writeln!(
                    f,
                    "Kink: {row} {rows} by {directions}: the derivative goes from {before:.3} to {after:.3} (at {points})"
                )?,
                jump => writeln!(f, "Jump: {row} {rows} by {directions}: by {jump:.3} (at {points})")?,
            }
        }
        Ok(())
    }
}

fn points_in_words(n: usize) -> String {
    format!("{n} point{}", if n == 1 { "" } else { "s" })
}

/// Formats twelve digits, enough to see the difference of two numbers that agree to 1e-9.
fn digits(x: f64) -> String {
    let rounded: f64 = format!("{x:.11e}").parse().unwrap_or(x);
    rounded.to_string()
}

/// Formats a list of numbers: `0, 1 and 2`.
fn and(numbers: &[usize]) -> String {
    let words: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    match words.split_last() {
        Some((last, [])) => last.clone(),
        Some((last, first)) => format!("{} and {last}", first.join(", ")),
        None => String::new(),
    }
}

/// Groups `x0.rx, x0.ry, l0.x` by variable: `x0.(rx, ry), l0.x`.
fn by_variable(directions: &[String]) -> String {
    let parts = directions.iter().map(|direction| direction.rsplit_once('.').unwrap_or(("", direction)));
    let mut groups: Vec<(&str, Vec<&str>)> = vec![];
    for (key, name) in parts {
        match groups.last_mut().filter(|(last, _)| *last == key) {
            Some((_, names)) => names.push(name),
            None => groups.push((key, vec![name])),
        }
    }
    let group = |(key, names): &(&str, Vec<&str>)| match names.as_slice() {
        [name] => format!("{key}.{name}"),
        names => format!("{key}.({})", names.join(", ")),
    };
    groups.iter().map(group).collect::<Vec<_>>().join(", ")
}

/// Formats free directions: `: q0.(x, y), 2 combinations of q0.(rx, ry, rz)`.
fn list(free: &[FreeDirections]) -> String {
    let (alone, mixed): (Vec<_>, Vec<_>) = free.iter().partition(|f| f.count == f.among.len());
    let alone: Vec<String> = alone.iter().flat_map(|f| f.among.iter().cloned()).collect();
    let part = |f: &&FreeDirections| {
        let noun = if f.count == 1 { "combination" } else { "combinations" };
        format!("{} {noun} of {}", f.count, by_variable(&f.among))
    };
    let alone = (!alone.is_empty()).then(|| by_variable(&alone));
    let parts: Vec<_> = alone.into_iter().chain(mixed.iter().map(part)).collect();
    if parts.is_empty() { String::new() } else { format!(": {}", parts.join("; ")) }
}

/// Formats a graph document in TOML, to be pasted into a file.
fn toml(graph: &Value) -> String {
    let inline = |value: &Value| toml::Value::try_from(value).map(|v| v.to_string()).unwrap_or_default();
    let mut out = String::new();
    for table in ["variables", "factors"] {
        for item in graph.get(table).and_then(Value::as_array).into_iter().flatten() {
            out += &format!("[[{table}]]\n");
            for (key, value) in item.as_object().into_iter().flatten() {
                out += &format!("{key} = {}\n", inline(value));
            }
            out.push('\n');
        }
    }
    out
}
