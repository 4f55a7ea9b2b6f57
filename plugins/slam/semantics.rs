//! Which classes of objects get which factors.
//!
//! ```toml
//! [[semantics]]
//! classes = ["bottle", "cup", "vase", "chair"]
//! factor = { type = "vertical_orientation" }
//! noise = { sigma = 0.1 }
//! loss = { type = "cauchy", scale = 1.0 }
//! ```
//! The class `"*"` stands for all. `semantics = "table_one"` stands for the rules of the paper's Table I.
use crate::class::Aliases;
use crate::settings::check_rows;
use manifactor_config::Section;
use manifactor_graph::loss::Loss;
use manifactor_graph::{Direction, FactorEntry, Key, Noise};
use serde::Serialize;
use std::sync::Arc;

mod read;
mod rule_factor;

pub(crate) use read::read_semantics;
pub use rule_factor::{RuleError, RuleFactor};

/// The paper's Table I.
pub const TABLE_ONE: &str = include_str!("semantics/table_one.toml");

/// Stands for all classes.
const ANY: &str = "*";

/// Objects of these classes get this factor.
#[derive(Debug, Clone, Serialize)]
pub struct Rule {
    /// Names of classes, as any detector spells them; `*` for all.
    pub classes: Vec<String>,
    /// A factor of one object.
    pub factor: RuleFactor,
    /// Its noise.
    #[serde(skip_serializing_if = "Noise::is_default")]
    pub noise: Noise,
    /// Its loss.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub loss: Option<Arc<dyn Loss>>,
    /// Whether it comes from a table that is shipped, and so names more classes than any one scene has.
    #[serde(skip)]
    pub shipped: bool,
}

impl Rule {
    /// Whether objects of a class, named as [`Aliases::canonical`] does, get this factor.
    pub fn applies(&self, class: &str, aliases: &Aliases) -> bool {
        self.classes.iter().any(|name| name == ANY || aliases.canonical(name) == class)
    }

    /// The factor for an object; `up` fills the field of that name where the rule leaves it open.
    ///
    /// # Errors
    /// Where the factor needs to know up, and nobody does.
    pub fn entry(&self, key: Key, up: Option<Direction>) -> Result<FactorEntry, RuleError> {
        let factor = Arc::from(self.factor.instantiate(up)?);
        Ok(FactorEntry { keys: vec![key], factor, noise: self.noise.clone(), loss: self.loss.clone() })
    }
}

/// The rules of a file that is shipped, by name.
pub(crate) fn shipped(name: &str) -> Option<&'static str> {
    (name == "table_one").then_some(TABLE_ONE)
}

/// Names of the files that are shipped.
pub(crate) const SHIPPED: [&str; 1] = ["table_one"];

/// The rules of the paper's Table I.
///
/// # Errors
/// Where the factors that it names are not linked.
pub fn table_one() -> Result<Vec<Rule>, manifactor_config::Diagnostics> {
    read::shipped_rules("table_one", TABLE_ONE)
}

/// Classes that a rule names and the data do not have.
pub fn unmatched<'a>(rule: &'a Rule, seen: &[String], aliases: &Aliases) -> Vec<&'a str> {
    let classes = rule.classes.iter().map(String::as_str);
    classes.filter(|name| *name != ANY && !seen.contains(&aliases.canonical(name))).collect()
}

/// One `[[semantics]]`.
fn read_rule(mut section: Section<'_>) -> Option<Rule> {
    let classes = section.required::<Vec<String>>("classes");
    let factor = section.take_required("factor").and_then(|node| RuleFactor::read(node, section.errors()));
    let noise = section.or_default::<Noise>("noise");
    if let Some(rows) = factor.as_ref().and_then(RuleFactor::rows) {
        check_rows(&section, Some(&noise), rows);
    }
    let loss = section.optional_registered::<dyn Loss>("loss").map(Arc::from);
    section.finish();
    Some(Rule { classes: classes?, factor: factor?, noise, loss, shipped: false })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn orientation(class: &str) -> Vec<String> {
        let aliases = Aliases::default();
        let class = aliases.canonical(class);
        let rules = table_one().unwrap();
        rules.iter().filter(|r| r.applies(&class, &aliases)).map(|r| r.factor.name().to_owned()).collect()
    }

    #[test]
    fn table_one_has_the_classes_of_the_paper() {
        let rules = table_one().unwrap();
        assert_eq!(rules.iter().map(|r| r.classes.len()).collect::<Vec<_>>(), [12, 9]);
        assert_eq!(orientation("tvmonitor"), ["horizontal_orientation"]);
        assert_eq!(orientation("pottedplant"), ["vertical_orientation"]);
        assert_eq!(orientation("sports ball"), [""; 0]);
    }

    #[test]
    fn a_star_is_for_all() {
        let rule = Rule { classes: vec!["*".into()], ..table_one().unwrap().swap_remove(0) };
        assert!(rule.applies("sports ball", &Aliases::default()) && rule.applies("", &Aliases::default()));
        assert_eq!(unmatched(&rule, &[], &Aliases::default()), [""; 0]);
    }

    #[test]
    fn classes_that_match_nothing_are_told() {
        let rules = table_one().unwrap();
        let seen = vec!["cup".to_owned(), "potted plant".to_owned()];
        let missing = unmatched(&rules[1], &seen, &Aliases::default());
        assert_eq!(missing.len(), 7);
        assert!(!missing.contains(&"cup"));
    }

    #[test]
    fn the_factor_gets_up_from_gravity() {
        let up = Direction::new([0.0, -2.0, 0.0].into()).unwrap();
        let rules = table_one().unwrap();
        let entry = rules[1].entry("q1".into(), Some(up)).unwrap();
        let text = serde_json::to_string(&entry.factor).unwrap();
        assert_eq!(text, r#"{"type":"vertical_orientation","up":[0.0,-1.0,0.0]}"#);
        assert!(matches!(rules[1].entry("q1".into(), None), Err(RuleError::NoUp { .. })));
    }
}
