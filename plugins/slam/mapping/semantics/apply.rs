//! From rules and objects to factors, each with its reason.
use super::{Rule, RuleError};
use manifactor_graph::{Direction, FactorEntry, Key};
use manifactor_quadric::DualQuadric;
use manifactor_recording::class::Aliases;
use manifactor_recording::fusion::FusedClass;
use serde::Serialize;
use std::collections::HashSet;

/// An object that rules look at: one that is mapped.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Its key in the graph.
    pub key: Key,
    /// What it is taken for.
    pub class: Option<FusedClass>,
    /// Where it begins.
    pub start: DualQuadric,
    /// Whether an earlier map has it, with what rules said of it then.
    pub known: bool,
}

impl Candidate {
    pub(super) fn class_name(&self) -> &str {
        self.class.as_ref().map_or("", |class| &class.name)
    }
}

/// A factor that a rule brought.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Applied {
    /// Its type.
    pub factor: String,
    /// The rule, from 1, in the order of the document.
    pub rule: usize,
    /// The variables that it connects, the object first.
    pub keys: Vec<Key>,
    /// Why, in words.
    pub because: String,
}

/// A rule that is for an object's class, and does not apply to it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LeftOut {
    /// The type of the rule's factor.
    pub factor: String,
    /// The rule, from 1, in the order of the document.
    pub rule: usize,
    /// Why not, in words.
    pub because: String,
}

/// What the rules have for one object.
#[derive(Debug, Clone, Default)]
pub struct Verdict {
    /// The factors.
    pub entries: Vec<FactorEntry>,
    /// The same, with reasons.
    pub applied: Vec<Applied>,
    /// Rules that might have applied.
    pub left_out: Vec<LeftOut>,
}

/// Applies rules to one object after the other.
#[derive(Debug)]
pub(crate) struct Judge<'a> {
    rules: &'a [Rule],
    aliases: &'a Aliases,
    up: Option<Direction>,
    /// All objects that are mapped.
    objects: Vec<Candidate>,
    connected: Connected,
}

/// Which objects a rule has connected, by the rule's place: two that are near each other are so from both sides.
pub(crate) type Connected = HashSet<(usize, Vec<Key>)>;

impl<'a> Judge<'a> {
    /// Over all objects that are mapped; `connected` are those that rules have connected before.
    pub(crate) fn new(
        rules: &'a [Rule],
        aliases: &'a Aliases,
        up: Option<Direction>,
        objects: Vec<Candidate>,
        connected: Connected,
    ) -> Self {
        Self { rules, aliases, up, objects, connected }
    }

    /// What it has connected.
    pub(crate) fn into_connected(self) -> Connected {
        self.connected
    }

    /// What all rules have for an object.
    ///
    /// # Errors
    /// If a rule needs to know up and up is unknown.
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

    /// The variables of a rule's factor, with reasons; `Err` has the reason why there are none.
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
