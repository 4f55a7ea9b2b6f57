//! Which objects get which factors.
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
//! The class `"*"` stands for all. `semantics = "table_one"` stands for the rules of the paper's Table I. All rules that are
//! for an object apply to it.
use manifactor_graph::checked::{Positive, Share};
use manifactor_graph::loss::Loss;
use manifactor_graph::{Direction, Factor, FactorEntry, Key, Noise};
use manifactor_recording::class::Aliases;
use manifactor_recording::fusion::FusedClass;
use manifactor_semantic::{Component, MaxMixture};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

mod apply;
mod condition;
mod read;
mod rule_factor;
#[cfg(test)]
mod tests;

pub use apply::{Applied, Candidate, LeftOut};
pub(crate) use apply::{Connected, Judge, Verdict};
pub use condition::Near;
pub(crate) use read::read_semantics;
pub use read::{RulesDocument, SemanticsDocument};
pub use rule_factor::{RuleError, RuleFactor};

/// The paper's Table I.
pub(crate) const TABLE_ONE: &str = include_str!("semantics/table_one.toml");

/// The rule of streams for the shapes of objects.
const WEAK_SHAPE: &str = include_str!("semantics/weak_shape.toml");

/// Stands for all classes.
const ANY: &str = "*";
/// A class with a smaller share of an object's scores is no alternative.
const LEAST_SHARE: f64 = 0.05;
/// In a mixture, the alternative that no factor holds is as likely as a residual of this many σ.
const DOUBT: f64 = 3.0;

/// Objects of these classes get this factor. All rules that are for an object apply to it.
#[derive(Debug, Clone, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rule {
    /// Names of classes, as any detector spells them; `*` for all.
    pub classes: Vec<String>,
    /// The score of its class, averaged over its detections, is at least this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_score: Option<Share>,
    /// It is at least this long, twice its longest semi-axis, where the solve begins, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub min_size_m: Option<Positive>,
    /// It is at most this long, in metres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_size_m: Option<Positive>,
    /// Another object is near.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub near: Option<Near>,
    /// Whether the factor holds only as likely as the object is of these classes, as one component of a `max_mixture` whose
    /// other one is nothing; and then for all objects that may be of them.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub mixture: bool,
    /// Keys of the document's own `variables` that the factor connects besides objects.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub with: Vec<Key>,
    /// A factor of one object, or of several that are near each other. Where its `up` is left open, it gets the run's gravity.
    #[schemars(with = "Box<dyn Factor>")]
    pub factor: RuleFactor,
    /// Its noise.
    #[serde(default, skip_serializing_if = "Noise::is_default")]
    pub noise: Noise,
    /// Its loss. Default: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
    /// Whether it comes from a table that is shipped, and so names more classes than any one scene has.
    #[serde(skip)]
    pub shipped: bool,
}

/// Returns whether a list of classes has this one, named as [`Aliases::canonical`] does.
fn names(classes: &[String], class: &str, aliases: &Aliases) -> bool {
    classes.iter().any(|name| name == ANY || aliases.canonical(name) == class)
}

impl Rule {
    /// Returns whether objects of a class, named as [`Aliases::canonical`] does, get this factor.
    pub fn applies(&self, class: &str, aliases: &Aliases) -> bool {
        names(&self.classes, class, aliases)
    }

    /// How likely the factor holds for an object of that class: 1, or in a mixture the share of its scores that these
    /// classes have. `None`, where the rule is not for it.
    fn share(&self, class: Option<&FusedClass>, aliases: &Aliases) -> Option<f64> {
        let best = class.map_or("", |class| class.name.as_str());
        if !self.mixture || class.is_none() {
            return self.applies(best, aliases).then_some(1.0);
        }
        let shares = class.into_iter().flat_map(FusedClass::shares);
        let share: f64 = shares.filter(|(name, _)| self.applies(name, aliases)).map(|(_, share)| share).sum();
        (share >= LEAST_SHARE).then_some(share.min(1.0))
    }

    fn class_in_words(&self, object: &Candidate, share: f64) -> String {
        match object.class_name() {
            name if self.mixture => format!("{:.0} % of its scores, most for {name}", 100.0 * share),
            "" => "any class".into(),
            name => name.to_owned(),
        }
    }

    /// The factor between these variables; `up` is for what takes the world's up and leaves it open. In a mixture, it
    /// is the one or nothing, by `share`: w = p for the factor, (1 - p) exp(-3²/2) for nothing.
    ///
    /// # Errors
    /// If the factor needs to know up and up is unknown.
    pub fn entry(&self, keys: Vec<Key>, up: Option<Direction>, share: f64) -> Result<FactorEntry, RuleError> {
        let factor = self.factor.instantiate(up)?;
        let (noise, loss) = (self.noise.clone(), self.loss.clone());
        let nothing = (1.0 - share) * (-0.5 * DOUBT * DOUBT).exp();
        match (Positive::new(share), Positive::new(nothing)) {
            (Ok(weight), Ok(nothing)) if self.mixture => {
                let holds = Component { weight, factor: Some(factor), over: None, noise };
                let nothing =
                    Component { weight: nothing, factor: None, over: None, noise: Noise::default() };
                let mixture = MaxMixture::new(vec![holds, nothing]);
                let name = || self.factor.name().to_owned();
                let mixture = mixture.map_err(|source| RuleError::Mixture { factor: name(), source })?;
                Ok(FactorEntry { keys, name: None, factor: Arc::new(mixture), noise: Noise::default(), loss })
            }
            _ => Ok(FactorEntry { keys, name: None, factor, noise, loss }),
        }
    }
}

/// The rules of a file that is shipped, by name.
pub fn shipped(name: &str) -> Option<&'static str> {
    (name == "table_one").then_some(TABLE_ONE)
}

/// Names of the files that are shipped.
pub(crate) const SHIPPED: [&str; 1] = ["table_one"];

/// The rules of the paper's Table I.
///
/// # Errors
/// If the factors that it names are not linked.
pub fn table_one() -> Result<Vec<Rule>, manifactor_config::Diagnostics> {
    read::shipped_rules("table_one", TABLE_ONE)
}

/// Adds the weak `shape_prior` of streams, unless there is a rule with one.
pub(crate) fn add_weak_shape(rules: &mut Vec<Rule>) {
    // the crate links its factor
    let weak = read::shipped_rules("weak_shape", WEAK_SHAPE).unwrap_or_default();
    let is_there = weak.iter().any(|weak| rules.iter().any(|rule| rule.factor.name() == weak.factor.name()));
    if !is_there {
        rules.extend(weak);
    }
}

/// Classes that a rule names and the data do not have, each once.
pub fn unmatched<'a>(rule: &'a Rule, seen: &[String], aliases: &Aliases) -> Vec<&'a str> {
    let near = rule.near.iter().flat_map(|near| &near.classes);
    let mut missing: Vec<&str> = vec![];
    for name in rule.classes.iter().chain(near).map(String::as_str) {
        if name != ANY && !seen.contains(&aliases.canonical(name)) && !missing.contains(&name) {
            missing.push(name);
        }
    }
    missing
}
