//! Application of rules to objects: the factors, each with its reason.
use super::{RuleError, SemanticRule};
use manifactor_graph::{Direction, FactorEntry, Key};
use manifactor_quadric::DualQuadric;
use manifactor_recording::class::ClassAliases;
use manifactor_recording::fusion::FusedClass;
use serde::Serialize;
use std::collections::HashSet;

/// A mapped object that rules are applied to.
#[derive(Debug, Clone)]
pub struct RuleCandidate {
    /// Key in the graph.
    pub key: Key,
    /// Class from all detections.
    pub class: Option<FusedClass>,
    /// Initial value.
    pub start: DualQuadric,
    /// True if a prior map contains the object. The map already includes the factors of the rules.
    pub known: bool,
}

impl RuleCandidate {
    pub(super) fn class_name(&self) -> &str {
        self.class.as_ref().map_or("", |class| &class.name)
    }
}

/// A factor that a rule added.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct AppliedRule {
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
pub struct SkippedRule {
    /// The type of the rule's factor.
    pub factor: String,
    /// Number of the rule in the document, from 1.
    pub rule: usize,
    /// Reason in words.
    pub because: String,
}

/// Result of all rules for one object.
#[derive(Debug, Clone, Default)]
pub struct RuleVerdict {
    /// Factors to add.
    pub entries: Vec<FactorEntry>,
    /// The factors that were added, with reasons.
    pub applied: Vec<AppliedRule>,
    /// Rules of the object's class that do not apply.
    pub left_out: Vec<SkippedRule>,
}

/// Applies rules to one object after another.
#[derive(Debug)]
pub(crate) struct RuleEvaluator<'a> {
    rules: &'a [SemanticRule],
    aliases: &'a ClassAliases,
    up: Option<Direction>,
    /// All mapped objects.
    objects: Vec<RuleCandidate>,
    connected: ConnectedKeys,
}

/// Keys of the objects that a rule has connected, with the index of the rule. Two objects are near each other
/// from both sides, and this set prevents a second factor.
pub(crate) type ConnectedKeys = HashSet<(usize, Vec<Key>)>;

impl<'a> RuleEvaluator<'a> {
    /// Creates the judge for all mapped `objects`; `connected` contains those that rules have connected
    /// before.
    pub(crate) fn new(
        rules: &'a [SemanticRule],
        aliases: &'a ClassAliases,
        up: Option<Direction>,
        objects: Vec<RuleCandidate>,
        connected: ConnectedKeys,
    ) -> Self {
        Self { rules, aliases, up, objects, connected }
    }

    /// Returns the objects that rules have connected.
    pub(crate) fn into_connected(self) -> ConnectedKeys {
        self.connected
    }

    /// Applies all rules to an object.
    ///
    /// # Errors
    /// If a rule needs the up direction and it is unknown.
    pub(crate) fn evaluate_object(&mut self, object: &RuleCandidate) -> Result<RuleVerdict, RuleError> {
        let mut verdict = RuleVerdict::default();
        for (i, rule) in self.rules.iter().enumerate() {
            let Some(share) = rule.factor_probability(object.class.as_ref(), self.aliases) else { continue };
            let factor = rule.factor.factor_type().to_owned();
            if object.known {
                let because = "the prior map has it, with what rules said of it then".to_owned();
                verdict.left_out.push(SkippedRule { factor, rule: i + 1, because });
                continue;
            }
            if self.up.is_none() && rule.needs_up() {
                return Err(RuleError::NoUp { factor });
            }
            match self.keys(i, rule, object) {
                Ok((keys, mut because)) => {
                    because.insert(0, rule.class_in_words(object, share));
                    verdict.entries.push(rule.entry(keys.clone(), self.up, share)?);
                    verdict.applied.push(AppliedRule {
                        factor,
                        rule: i + 1,
                        keys,
                        because: because.join(", "),
                    });
                }
                Err(because) => verdict.left_out.push(SkippedRule { factor, rule: i + 1, because }),
            }
        }
        Ok(verdict)
    }

    /// Returns the variables of a rule's factor with the reasons, or the reason why there is no factor.
    fn keys(
        &mut self,
        i: usize,
        rule: &SemanticRule,
        object: &RuleCandidate,
    ) -> Result<(Vec<Key>, Vec<String>), String> {
        let partners = rule.factor.partners();
        let met = rule.check_conditions(object, &self.objects, partners, self.up, self.aliases)?;
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
