//! Priors that are learned from maps: sizes and orientation of objects, by class.
//!
//! Sizes are log-normal, for each semi-axis from the shortest to the longest. A class is shrunk towards its row
//! of `sizes = "household"`, which counts as much as two objects; a class without a row is shrunk
//! towards all objects. Orientations are counted: the vertical axis of an object, and whether its longest axis
//! is horizontal. A class gets an orientation factor only if most of its objects agree.
use super::ClassSize;
use super::read::shipped_sizes;
use manifactor_config::nearest;
use manifactor_formats::words::count;
use manifactor_graph::{Direction, Residual, Up};
use manifactor_recording::class::ClassAliases;
use manifactor_recording::prior_map::{PriorMap, PriorObject};
use manifactor_semantic::Resting;
use nalgebra::Vector3;
use std::collections::BTreeMap;
use std::fmt;

/// Weight of the prior of a class, as a number of objects.
const PRIOR_OBJECTS: f64 = 2.0;
/// A rule is learned if at least this share of the objects obeys it.
const MIN_SHARE: f64 = 0.8;
/// Objects whose nearest axis leans further from the vertical have no vertical axis. Unit: radians.
const MAX_TILT: f64 = 20.0 * std::f64::consts::PI / 180.0;
/// An axis counts as the longest or the shortest if it differs from the next one by this factor.
const DISTINCT: f64 = 1.1;
/// Standard deviation of an axis rule without objects, as in the paper's Table I. Unit: radians.
const TILT_SIGMA: f64 = 0.1;
/// Standard deviation of `resting` without objects, as in the rules `resting`.
const RESTING_SIGMA: f64 = 0.01;

/// Error of maps that nothing can be learned from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("the maps have no object with a class, so there is nothing to learn")]
pub struct NothingToLearn;

/// Priors of all classes in some maps, and one for all other classes.
#[derive(Debug, Clone)]
pub struct LearnedPriors {
    /// Number of maps.
    pub maps: usize,
    /// Prior of all objects together, for classes that the maps do not have.
    pub pooled: ClassPrior,
    /// Priors by class.
    pub classes: BTreeMap<String, ClassPrior>,
}

/// Learned prior of a class.
#[derive(Debug, Clone)]
pub struct ClassPrior {
    /// Number of objects.
    pub objects: usize,
    /// Logarithms of the semi-axes, the shortest first.
    pub sizes: [LogNormal; 3],
    /// Counts of orientations.
    pub orientation: OrientationCounts,
    /// Class of the household table that the sizes are shrunk towards; `None` for all objects of the maps.
    pub household: bool,
}

/// Logarithm of a length in metres: mean and standard deviation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogNormal {
    /// Mean.
    pub mean: f64,
    /// Standard deviation.
    pub sigma: f64,
}

/// Numbers of objects by vertical axis, and the sums that give the spread.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct OrientationCounts {
    /// The longest axis is vertical.
    pub longest: usize,
    /// The shortest axis is vertical.
    pub shortest: usize,
    /// A different axis is vertical, or one that is about as long as another.
    pub other: usize,
    /// No axis is vertical.
    pub none: usize,
    /// The longest axis is horizontal; these objects are counted by their vertical axis as well.
    pub lying: usize,
    /// Sum of sin² of the tilt of vertical axes.
    tilt: f64,
    /// Sum of the squared residuals of `resting` of objects with a vertical axis.
    imbalance: f64,
}

/// The axis that is vertical in a class.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LearnedOrientation {
    /// The longest axis is vertical.
    Longest,
    /// The shortest axis is vertical.
    Shortest,
    /// The longest axis is horizontal, and any other axis vertical.
    Lying,
    /// Any axis is vertical.
    Resting,
    /// No rule.
    Free,
}

/// An object of a map, with its semi-axes in the order of their lengths.
struct LearnedObject {
    class: String,
    log_axes: [f64; 3],
    /// Variances of the logarithms.
    variances: [f64; 3],
    /// `None` if the map has no up direction.
    orientation: Option<OrientationCounts>,
}

impl LearnedPriors {
    /// Learns from maps. Flat objects have no size: boxes hardly determine their thickness.
    ///
    /// # Errors
    /// If no object has a class.
    pub fn learn(maps: &[PriorMap]) -> Result<Self, NothingToLearn> {
        let objects = || maps.iter().flat_map(|map| map.objects.iter().map(move |object| (object, map.up)));
        let learned = objects().filter_map(|(object, up)| LearnedObject::new(object, up));
        let mut by_class: BTreeMap<String, Vec<LearnedObject>> = BTreeMap::new();
        for object in learned {
            by_class.entry(object.class.clone()).or_default().push(object);
        }
        if by_class.is_empty() {
            return Err(NothingToLearn);
        }
        let table = household();
        let all: Vec<&LearnedObject> = by_class.values().flatten().collect();
        let pooled = ClassPrior::new(&all, overall(&table), false);
        let prior = |(class, objects): (&String, &Vec<LearnedObject>)| {
            let own = table.get(class).copied();
            let objects: Vec<&LearnedObject> = objects.iter().collect();
            (class.clone(), ClassPrior::new(&objects, own.unwrap_or(pooled.sizes), own.is_some()))
        };
        Ok(Self { maps: maps.len(), classes: by_class.iter().map(prior).collect(), pooled })
    }

    /// Returns the classes without a row in the household table, each with a similar name that has one.
    pub fn unknown_classes(&self) -> impl Iterator<Item = (&str, Option<String>)> {
        let table = household();
        let unknown = self.classes.iter().filter(|(_, prior)| !prior.household);
        unknown.map(move |(class, _)| {
            (class.as_str(), nearest(class, table.keys().map(String::as_str)).map(str::to_owned))
        })
    }
}

impl LearnedObject {
    /// `None` if the object has no class.
    fn new(object: &PriorObject, up: Option<Direction>) -> Option<Self> {
        let class = ClassAliases::default().canonical(object.classes.leading()?.0);
        let quadric = &object.quadric;
        let mut order = [0, 1, 2];
        order.sort_by(|a, b| quadric.semi_axes[*a].total_cmp(&quadric.semi_axes[*b]));
        let log_axes = order.map(|k| quadric.semi_axes[k].ln());
        // a flat object says nothing about sizes
        let unknown = if object.flat || quadric.is_flat() { f64::INFINITY } else { 0.0 };
        let variances = order.map(|k| object.covariance[6 + k][6 + k] + unknown);
        let orientation = up.and_then(|up| OrientationCounts::of(object, order, up));
        Some(Self { class, log_axes, variances, orientation })
    }
}

impl OrientationCounts {
    /// Counts one object; `None` if the map leaves its tilt open. `order` sorts its semi-axes.
    fn of(object: &PriorObject, order: [usize; 3], up: Direction) -> Option<Self> {
        let quadric = &object.quadric;
        let up_in_object: Vector3<f64> = quadric.pose.rotation.inverse().act(&up);
        let vertical = (0..3).max_by(|a, b| {
            let cosine = |rank: usize| up_in_object[order[rank]].abs();
            cosine(*a).total_cmp(&cosine(*b))
        })?;
        let axis = order[vertical];
        // turns about the vertical axis do not tilt it
        let variance: f64 = (0..3).filter(|k| *k != axis).map(|k| object.covariance[k][k]).sum();
        if variance.sqrt() > MAX_TILT {
            return None;
        }
        let length = |rank: usize| quadric.semi_axes[order[rank]];
        let sine = (1.0 - up_in_object[axis].powi(2)).max(0.0).sqrt();
        let mut counts = Self::default();
        if sine > MAX_TILT.sin() {
            counts.none = 1;
        } else {
            match vertical {
                2 if length(2) > DISTINCT * length(1) => counts.longest = 1,
                0 if DISTINCT * length(0) < length(1) => counts.shortest = 1,
                _ => counts.other = 1,
            }
            counts.tilt = sine * sine;
            let resting = Resting { up: Up::from(up) };
            counts.imbalance = resting.residual::<f64>((*quadric,)).norm_squared();
        }
        let is_level = up_in_object[order[2]].abs() < MAX_TILT.sin();
        counts.lying = usize::from(is_level && length(2) > DISTINCT * length(1));
        Some(counts)
    }

    fn plus(self, other: Self) -> Self {
        Self {
            longest: self.longest + other.longest,
            shortest: self.shortest + other.shortest,
            other: self.other + other.other,
            none: self.none + other.none,
            lying: self.lying + other.lying,
            tilt: self.tilt + other.tilt,
            imbalance: self.imbalance + other.imbalance,
        }
    }

    /// Returns the number of objects with a known orientation.
    pub fn objects(&self) -> usize {
        self.longest + self.shortest + self.other + self.none
    }

    /// Returns the rule that most objects obey. Shares are shrunk towards the shares of `pooled`, which counts as one
    /// object.
    pub fn orientation(&self, pooled: &Self) -> LearnedOrientation {
        let share = |of: fn(&Self) -> usize| {
            let prior = of(pooled) as f64 / pooled.objects().max(1) as f64;
            (of(self) as f64 + prior) / (self.objects() as f64 + 1.0)
        };
        match () {
            () if self.objects() == 0 => LearnedOrientation::Free,
            () if share(|counts| counts.longest) >= MIN_SHARE => LearnedOrientation::Longest,
            () if share(|counts| counts.shortest) >= MIN_SHARE => LearnedOrientation::Shortest,
            () if share(|counts| counts.none) > 1.0 - MIN_SHARE => LearnedOrientation::Free,
            () if share(|counts| counts.lying) >= MIN_SHARE => LearnedOrientation::Lying,
            () => LearnedOrientation::Resting,
        }
    }

    /// Returns the standard deviation of the tilt of vertical axes, in radians.
    pub fn tilt_sigma(&self) -> f64 {
        self.sigma(self.tilt, TILT_SIGMA)
    }

    /// Returns the standard deviation of the residual of `resting`.
    fn resting_sigma(&self) -> f64 {
        self.sigma(self.imbalance, RESTING_SIGMA)
    }

    fn sigma(&self, squares: f64, prior: f64) -> f64 {
        let upright = (self.objects() - self.none) as f64;
        ((PRIOR_OBJECTS * prior * prior + squares) / (PRIOR_OBJECTS + upright)).sqrt()
    }
}

impl ClassPrior {
    fn new(objects: &[&LearnedObject], prior: [LogNormal; 3], household: bool) -> Self {
        let size = |rank: usize| {
            let seen = objects.iter().map(|object| (object.log_axes[rank], object.variances[rank]));
            prior[rank].updated(&seen.collect::<Vec<_>>())
        };
        let orientations = objects.iter().filter_map(|object| object.orientation);
        Self {
            objects: objects.len(),
            sizes: [size(0), size(1), size(2)],
            orientation: orientations.fold(OrientationCounts::default(), OrientationCounts::plus),
            household,
        }
    }

    /// Returns the usual semi-axes in metres, the shortest first.
    pub fn semi_axes(&self) -> [f64; 3] {
        self.sizes.map(|size| size.mean.exp())
    }
}

impl LogNormal {
    /// Returns the distribution after measurements of objects, each with its variance. An object counts as
    /// much as its measurement is precise in comparison with the spread of the class.
    fn updated(self, objects: &[(f64, f64)]) -> Self {
        let spread = self.sigma * self.sigma;
        let weight = |variance: f64| spread / (spread + variance);
        let count: f64 = objects.iter().map(|(_, variance)| weight(*variance)).sum();
        let weighted = |of: &dyn Fn(f64) -> f64| -> f64 {
            objects.iter().map(|(y, variance)| weight(*variance) * of(*y)).sum()
        };
        let all = PRIOR_OBJECTS + count;
        let mean = (PRIOR_OBJECTS * self.mean + weighted(&|y| y)) / all;
        let scatter = weighted(&|y| (y - mean).powi(2)) + PRIOR_OBJECTS * (self.mean - mean).powi(2);
        Self { mean, sigma: ((PRIOR_OBJECTS * spread + scatter) / all).sqrt() }
    }
}

/// Returns the household table by class.
fn household() -> BTreeMap<String, [LogNormal; 3]> {
    let aliases = ClassAliases::default();
    let row = |size: ClassSize| {
        let mut axes = size.semi_axes();
        axes.as_mut_slice().sort_by(f64::total_cmp);
        let sizes = [0, 1, 2].map(|k| LogNormal { mean: axes[k].ln(), sigma: size.log_sigma() });
        let names: Vec<String> = size.classes.iter().map(|name| aliases.canonical(name)).collect();
        names.into_iter().map(move |name| (name, sizes))
    };
    // the shipped table can be read
    shipped_sizes("household").unwrap_or_default().into_iter().flat_map(row).collect()
}

/// Returns one distribution for all classes of a table.
fn overall(table: &BTreeMap<String, [LogNormal; 3]>) -> [LogNormal; 3] {
    [0, 1, 2].map(|k| {
        let n = table.len() as f64;
        let mean = table.values().map(|sizes| sizes[k].mean).sum::<f64>() / n;
        let square = |size: &LogNormal| (size.mean - mean).powi(2) + size.sigma * size.sigma;
        let variance = table.values().map(|sizes| square(&sizes[k])).sum::<f64>() / n;
        LogNormal { mean, sigma: variance.sqrt() }
    })
}

/// Writes a file of semantic rules.
impl fmt::Display for LearnedPriors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let classes = count(self.classes.len(), "class");
        let (maps, objects) = (count(self.maps, "map"), count(self.pooled.objects, "object"));
        writeln!(f, "# Priors of {classes}, learned by `manifactor learn` from {objects} of {maps}.")?;
        writeln!(f, "# A run reads this file with `semantics = \"FILE\"`.\n")?;
        let mut free = vec![];
        for (class, prior) in &self.classes {
            let name = quoted(class);
            writeln!(f, "# {name}, {}", prior.counts())?;
            write_rule(f, &format!("classes = [{name}]"), &prior.size_rule())?;
            let tilt = prior.orientation.tilt_sigma();
            match prior.orientation.orientation(&self.pooled.orientation) {
                LearnedOrientation::Longest => write_axis(f, &name, "upright", ", axis = \"longest\"", tilt)?,
                LearnedOrientation::Shortest => {
                    write_axis(f, &name, "upright", ", axis = \"shortest\"", tilt)?;
                }
                LearnedOrientation::Lying => write_axis(f, &name, "horizontal_orientation_smooth", "", tilt)?,
                LearnedOrientation::Resting => {}
                LearnedOrientation::Free => free.push(name),
            }
        }
        let seen: Vec<String> = self.classes.keys().map(|class| quoted(class)).collect();
        let others = format!("classes = [\"*\"]\nexcept = [{}]", seen.join(", "));
        writeln!(f, "# all other classes, {}", self.pooled.counts())?;
        write_rule(f, &others, &self.pooled.size_rule())?;
        let pooled = &self.pooled.orientation;
        let rests = pooled.orientation(pooled) != LearnedOrientation::Free;
        // classes that rest, although all objects together do not
        let of_classes = match (rests, free.is_empty()) {
            (true, true) => "classes = [\"*\"]".to_owned(),
            (true, false) => format!("classes = [\"*\"]\nexcept = [{}]", free.join(", ")),
            (false, _) => {
                let resting: Vec<_> = seen.into_iter().filter(|name| !free.contains(name)).collect();
                if resting.is_empty() {
                    return Ok(());
                }
                format!("classes = [{}]", resting.join(", "))
            }
        };
        writeln!(f, "# one axis is vertical, whichever it is")?;
        let sigma = number(pooled.resting_sigma());
        write_rule(
            f,
            &of_classes,
            &format!("factor = {{ type = \"resting\" }}\nnoise = {{ sigma = {sigma} }}"),
        )
    }
}

impl ClassPrior {
    fn counts(&self) -> String {
        let OrientationCounts { longest, shortest, other, none, lying, .. } = self.orientation;
        let objects = count(self.objects, "object");
        format!(
            "{objects}; vertical axis: longest {longest}, shortest {shortest}, other {other}, none {none}; longest axis horizontal: {lying}"
        )
    }

    fn size_rule(&self) -> String {
        let list = |numbers: [f64; 3]| numbers.map(number).join(", ");
        format!(
            "factor = {{ type = \"size_prior\", semi_axes = [{}] }}\nnoise = {{ sigmas = [{}] }}",
            list(self.semi_axes()),
            list(self.sizes.map(|size| size.sigma))
        )
    }
}

fn write_axis(f: &mut fmt::Formatter<'_>, name: &str, factor: &str, axis: &str, sigma: f64) -> fmt::Result {
    let sigma = number(sigma);
    let rule = format!("factor = {{ type = \"{factor}\"{axis} }}\nnoise = {{ sigma = {sigma} }}");
    write_rule(f, &format!("classes = [{name}]"), &rule)
}

fn write_rule(f: &mut fmt::Formatter<'_>, classes: &str, rule: &str) -> fmt::Result {
    writeln!(
        f,
        "[[semantics]]\n{classes}\n{rule}\nloss = {{ type = \"cauchy\", scale = 1.0 }}\noptional = true\n"
    )
}

/// Returns a string of TOML. JSON escapes the same characters, except for the delete character.
fn quoted(name: &str) -> String {
    serde_json::Value::from(name).to_string().replace('\u{7f}', "\\u007f")
}

/// Returns a number with three significant digits.
fn number(x: f64) -> String {
    let rounded = format!("{x:.2e}").parse().unwrap_or(x);
    format!("{rounded:?}")
}

#[cfg(test)]
mod tests;
