//! Application of rules to objects: the factors, each with its reason.
use super::{Rule, RuleError};
use manifactor_graph::{Direction, FactorEntry, Key};
use manifactor_quadric::DualQuadric;
use manifactor_recording::class::Aliases;
use manifactor_recording::fusion::FusedClass;
use serde::Serialize;
use std::collections::HashSet;

/// A mapped object that rules are applied to.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Key in the graph.
    pub key: Key,
    /// Class from all detections.
    pub class: Option<FusedClass>,
    /// Initial value.
    pub start: DualQuadric,
    /// True if a prior map contains the object. The map already includes the factors of the rules.
    pub known: bool,
}

impl Candidate {
    pub(super) fn class_name(&self) -> &str {
        self.class.as_ref().map_or("", |class| &class.name)
    }
}

/// A factor that a rule added.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Applied {
    /// Type of the factor.
    pub factor: String,
    /// Number of the rule in the document, from 1.
    pub rule: usize,
    /// Variables that the factor connects, the object first.
    pub keys: Vec<Key>,
    /// Reason in words.
    pub because: String,
}

/// A rule that names an object's class but does not apply to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// The type of the rule's factor.
    pub factor: String,
    /// Number of the rule in the document, from 1.
    pub rule: usize,
    /// Reason in words.
    pub because: String,
}

/// Result of all rules for one object.
#[derive(Debug, Clone, Default)]
pub struct Verdict {
    /// Factors to add.
    pub entries: Vec<FactorEntry>,
    /// The factors that were added, with reasons.
    pub applied: Vec<Applied>,
    /// Rules of the object's class that do not apply.
    pub left_out: Vec<LeftOut>,
}

/// Applies rules to one object after another.
#[derive(Debug)]
pub(crate) struct Judge<'a> {
    rules: &'a [Rule],
    aliases: &'a Aliases,
    up: Option<Direction>,
    /// All mapped objects.
    objects: Vec<Candidate>,
    connected: Connected,
}

/// Keys of the objects that a rule has connected, with the index of the rule. Two objects are near each other
/// from both sides, and this set prevents a second factor.
pub(crate) type Connected = HashSet<(usize, Vec<Key>)>;

impl<'a> Judge<'a> {
    /// Creates the judge for all mapped `objects`; `connected` contains those that rules have connected
    /// before.
    pub(crate) fn new(
        rules: &'a [Rule],
        aliases: &'a Aliases,
        up: Option<Direction>,
        objects: Vec<Candidate>,
        connected: Connected,
    ) -> Self {
        Self { rules, aliases, up, objects, connected }
    }

    /// Returns the objects that rules have connected.
    pub(crate) fn into_connected(self) -> Connected {
        self.connected
    }

    /// Applies all rules to an object.
    ///
    /// # Errors
    /// If a rule needs the up direction and it is unknown.
    pub(crate) fn judge(&mut self, object: &Candidate) -> Result<Verdict, RuleError> {
        let mut verdict = Verdict::default();
        for (i, rule) in self.rules.iter().enumerate() {
            let Some(share) = rule.share(object.class.as_ref(), self.aliases) else { continue };
            let factor = rule.factor.name().to_owned();
            if object.known {
                let because = "the prior map has it, with what rules said of it then".to_owned();
                verdict.left_out.push(LeftOut { factor, rule: i + 1, because });
                continue;
            }
            if self.up.is_none() && rule.near.as_ref().is_some_and(|near| near.below) {
                return Err(RuleError::NoUp { factor });
            }
            match self.keys(i, rule, object) {
                Ok((keys, mut because)) => {
                    because.insert(0, rule.class_in_words(object, share));
                    verdict.entries.push(rule.entry(keys.clone(), self.up, share)?);
                    verdict.applied.push(Applied { factor, rule: i + 1, keys, because: because.join(", ") });
                }
                Err(because) => verdict.left_out.push(LeftOut { factor, rule: i + 1, because }),
            }
        }
        Ok(verdict)
    }

    /// Returns the variables of a rule's factor with the reasons, or the reason why there is no factor.
    fn keys(&mut self, i: usize, rule: &Rule, object: &Candidate) -> Result<(Vec<Key>, Vec<String>), String> {
        let partners = rule.factor.partners();
        let met = rule.met(object, &self.objects, partners, self.up, self.aliases)?;
        let others: Vec<Key> = met.others.iter().take(partners).map(|other| other.key.clone()).collect();
        if partners > 0 {
            let mut all = others.clone();
            all.push(object.key.clone());
            all.sort();
            if !self.connected.insert((i, all)) {
                let others: Vec<_> = others.iter().map(Key::as_str).collect();
                return Err(format!("the rule connects it with {} already", others.join(" and ")));
            }
        }
        Ok((rule.factor.keys(&object.key, &others, &rule.with), met.because))
    }
}
