//! Semantic rules: factors that objects of certain classes get.
//!
//! ```toml
//! [[semantics]]
//! classes = ["bottle", "cup", "vase", "chair"]
//! factor = { type = "vertical_orientation" }
//! noise = { sigma = 0.1 }
//! loss = { type = "cauchy", scale = 1.0 }
//!
//! [[semantics]]                       # by score, by size, and by what is near: the second object of the factor
//! classes = ["keyboard"]
//! min_score = 0.5
//! max_size_m = 0.6
//! near = { classes = ["tv monitor"], within_m = 0.5 }
//! factor = { type = "beside" }
//! noise = { sigma = 0.05 }
//! ```
//! The class `"*"` matches all classes. `semantics = "resting"` lets all objects rest on one of their sides, and
//! `semantics = "table_one"` selects the rules of the paper's Table I.
//! All rules that match an object apply to it.
use manifactor_graph::checked::{Positive, Share};
use manifactor_graph::loss::Loss;
use manifactor_graph::{Direction, Factor, FactorEntry, Key, Noise};
use manifactor_recording::class::ClassAliases;
use manifactor_recording::fusion::FusedClass;
use manifactor_semantic::{Component, MaxMixture};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

mod apply;
mod condition;
pub mod learn;
mod read;
mod rule_factor;
mod sizes;
#[cfg(test)]
mod tests;

pub use apply::{AppliedRule, RuleCandidate, SkippedRule};
pub(crate) use apply::{ConnectedKeys, RuleEvaluator, RuleVerdict};
pub use condition::NearCondition;
pub use read::{RulesDocument, SemanticsDocument, SizesDocument};
pub(crate) use read::{read_semantics, read_sizes};
pub use rule_factor::{RuleError, RuleFactor};
pub use sizes::{ClassSize, Extent, Spread};

/// The paper's Table I.
const TABLE_ONE: &str = include_str!("semantics/table_one.toml");

/// All objects rest on one of their sides, and have similar semi-axes.
const RESTING: &str = include_str!("semantics/resting.toml");

/// Typical sizes of COCO's indoor classes and of cars.
const HOUSEHOLD: &str = include_str!("semantics/household.toml");

/// Name that matches all classes.
const ANY_CLASS: &str = "*";
/// Smallest share of an object's scores that makes a class an alternative.
const MIN_CLASS_SHARE: f64 = 0.05;
/// In a mixture, the alternative without a factor is as likely as a residual of this many σ.
const MIXTURE_SIGMAS: f64 = 3.0;

/// Objects of these classes get this factor. All rules that match an object apply to it.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Rule")]
pub struct SemanticRule {
    /// Class names, in the spelling of any detector; `*` for all classes.
    pub classes: Vec<String>,
    /// Class names that `*` leaves out.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub except: Vec<String>,
    /// Smallest score of the object's class, averaged over its detections.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_score: Option<Share>,
    /// Smallest length of the object, twice its longest semi-axis, at its initial value. Unit: metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_size_m: Option<Positive>,
    /// Largest length of the object, measured in the same way. Unit: metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_size_m: Option<Positive>,
    /// Second object that has to be near.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near: Option<NearCondition>,
    /// Weights the factor by the share of these classes in the object's scores: it becomes one component of a
    /// `max_mixture`, and the second component has no factor. The rule then applies to all objects that may
    /// be of these classes.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mixture: bool,
    /// Keys of the document's own `variables` that the factor connects with the objects.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub with: Vec<Key>,
    /// Factor of one object, or of several that are near each other. If its `up` is left open, it is set to
    /// the run's up direction.
    #[schemars(with = "Box<dyn Factor>")]
    pub factor: RuleFactor,
    /// Noise of the factor.
    #[serde(default, skip_serializing_if = "Noise::is_default")]
    pub noise: Noise,
    /// Robust loss of the factor. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
    /// Gives no warning if no object is of these classes, as in a table that names more classes than one scene
    /// contains.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub optional: bool,
}

/// Returns whether a list of classes contains this one, a name from [`ClassAliases::canonical`].
fn contains_class(classes: &[String], class: &str, aliases: &ClassAliases) -> bool {
    classes.iter().any(|name| name == ANY_CLASS || aliases.canonical(name) == class)
}

impl SemanticRule {
    /// Returns whether the rule needs the up direction of the map.
    pub fn needs_up(&self) -> bool {
        self.factor.wants_up() || self.near.as_ref().is_some_and(|near| near.below)
    }

    /// Returns whether objects of a class, a name from [`ClassAliases::canonical`], get this factor.
    pub fn applies(&self, class: &str, aliases: &ClassAliases) -> bool {
        contains_class(&self.classes, class, aliases) && !contains_class(&self.except, class, aliases)
    }

    /// Returns the probability that the factor holds for an object of that class: 1, or in a mixture the
    /// share of these classes in the object's scores. `None` if the rule does not apply.
    fn factor_probability(&self, class: Option<&FusedClass>, aliases: &ClassAliases) -> Option<f64> {
        let best = class.map_or("", |class| class.name.as_str());
        if !self.mixture || class.is_none() {
            return self.applies(best, aliases).then_some(1.0);
        }
        let shares = class.into_iter().flat_map(FusedClass::shares);
        let share: f64 = shares.filter(|(name, _)| self.applies(name, aliases)).map(|(_, share)| share).sum();
        (share >= MIN_CLASS_SHARE).then_some(share.min(1.0))
    }

    fn class_in_words(&self, object: &RuleCandidate, share: f64) -> String {
        match object.class_name() {
            name if self.mixture => format!("{:.0} % of its scores, most for {name}", 100.0 * share),
            "" => "any class".into(),
            name => name.to_owned(),
        }
    }

    /// Returns the factor between these variables. `up` is used if the factor needs the up direction and
    /// leaves it open. In a mixture with p = `share`, the factor has the weight p and its absence (1 - p)
    /// exp(-3²/2).
    ///
    /// # Errors
    /// If the factor needs the up direction and it is unknown.
    pub fn entry(&self, keys: Vec<Key>, up: Option<Direction>, share: f64) -> Result<FactorEntry, RuleError> {
        let factor = self.factor.instantiate(up)?;
        let (noise, loss) = (self.noise.clone(), self.loss.clone());
        let nothing = (1.0 - share) * (-0.5 * MIXTURE_SIGMAS * MIXTURE_SIGMAS).exp();
        match (Positive::new(share), Positive::new(nothing)) {
            (Ok(weight), Ok(nothing)) if self.mixture => {
                let holds = Component { weight, factor: Some(factor), over: None, noise };
                let nothing =
                    Component { weight: nothing, factor: None, over: None, noise: Noise::default() };
                let mixture = MaxMixture::new(vec![holds, nothing]);
                let name = || self.factor.factor_type().to_owned();
                let mixture = mixture.map_err(|source| RuleError::Mixture { factor: name(), source })?;
                Ok(FactorEntry { keys, name: None, factor: Arc::new(mixture), noise: Noise::default(), loss })
            }
            _ => Ok(FactorEntry { keys, name: None, factor, noise, loss }),
        }
    }
}

/// Names and texts of the shipped files of rules.
const SHIPPED_RULES: [(&str, &str); 2] = [("resting", RESTING), ("table_one", TABLE_ONE)];
/// Names and texts of the shipped tables of sizes.
const SHIPPED_SIZES: [(&str, &str); 1] = [("household", HOUSEHOLD)];

/// Returns the rules of the paper's Table I.
///
/// # Errors
/// If the factors in it are not linked.
pub fn table_one() -> Result<Vec<SemanticRule>, manifactor_config::Diagnostics> {
    read::shipped_rules("table_one")
}

/// Adds the `shape_prior` of the rules `resting`, unless a rule has one.
pub(crate) fn add_shape_prior(rules: &mut Vec<SemanticRule>) {
    let is_shape_prior = |rule: &SemanticRule| rule.factor.factor_type() == "shape_prior";
    if !rules.iter().any(is_shape_prior) {
        // cannot fail: this crate links the factors
        let shipped = read::shipped_rules("resting").unwrap_or_default();
        rules.extend(shipped.into_iter().filter(is_shape_prior));
    }
}

/// Returns the classes that a rule names and the data do not contain, each once.
pub fn unmatched<'a>(rule: &'a SemanticRule, seen: &[String], aliases: &ClassAliases) -> Vec<&'a str> {
    let near = rule.near.iter().flat_map(|near| &near.classes);
    let mut missing: Vec<&str> = vec![];
    for name in rule.classes.iter().chain(near).map(String::as_str) {
        if name != ANY_CLASS && !seen.contains(&aliases.canonical(name)) && !missing.contains(&name) {
            missing.push(name);
        }
    }
    missing
}
