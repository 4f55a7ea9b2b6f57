//! Conditions of a rule besides the class: score, size and nearby objects.
use super::{ANY_CLASS, RuleCandidate, SemanticRule};
use manifactor_graph::Direction;
use manifactor_graph::checked::{Positive, Share};
use manifactor_quadric::DualQuadric;
use manifactor_recording::class::ClassAliases;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Second object near the object of a rule. If the rule's factor connects two objects, this is the second
/// one.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "Near")]
pub struct NearCondition {
    /// Classes of the second object. Default: any.
    #[serde(default = "any_class")]
    pub classes: Vec<String>,
    /// Largest gap between the two objects at their initial values, along the line through their centres.
    /// Unit: metres.
    pub within_m: Positive,
    /// Requires that the second object's centre is below the centre of the first.
    #[serde(default)]
    pub below: bool,
}

fn any_class() -> Vec<String> {
    vec![ANY_CLASS.to_owned()]
}

/// Reasons why a rule applies to an object, and the objects near it.
pub(super) struct MetConditions<'a> {
    pub because: Vec<String>,
    pub others: Vec<&'a RuleCandidate>,
}

impl SemanticRule {
    /// Checks the conditions for an object among all. `Err` describes the condition that fails.
    pub(super) fn check_conditions<'a>(
        &self,
        object: &RuleCandidate,
        all: &'a [RuleCandidate],
        wanted: usize,
        up: Option<Direction>,
        aliases: &ClassAliases,
    ) -> Result<MetConditions<'a>, String> {
        let (mut because, score) = (vec![], object.class.as_ref().map_or(0.0, |class| class.score));
        let mut require = |holds: bool, what: String, bound: String| {
            if holds {
                because.push(format!("{what} ({bound})"));
                return Ok(());
            }
            Err(format!("{what}, not {bound}"))
        };
        if let Some(least) = self.min_score.map(Share::get) {
            require(score >= least, format!("score {score:.2}"), format!("at least {least}"))?;
        }
        let size = 2.0 * object.start.semi_axes.max();
        if let Some(least) = self.min_size_m.map(Positive::get) {
            require(size >= least, format!("{size:.2} m long"), format!("at least {least} m"))?;
        }
        if let Some(most) = self.max_size_m.map(Positive::get) {
            require(size <= most, format!("{size:.2} m long"), format!("at most {most} m"))?;
        }
        let Some(near) = &self.near else { return Ok(MetConditions { because, others: vec![] }) };
        let found = near.near_objects(object, all, up, aliases);
        let within = found.iter().filter(|(gap, _)| *gap <= near.within_m.get()).count();
        if within < wanted.max(1) {
            return Err(near.failed_condition(&found, wanted.max(1)));
        }
        let chosen = found.into_iter().take(wanted.max(1));
        let others = chosen.map(|(gap, other)| {
            because.push(format!("{gap:.2} m from {} ({})", other.key, other.class_name()));
            other
        });
        let others = others.collect();
        Ok(MetConditions { because, others })
    }
}

impl NearCondition {
    /// Returns the objects of the required classes, and below if required, with their gaps. The nearest comes
    /// first.
    fn near_objects<'a>(
        &self,
        object: &RuleCandidate,
        all: &'a [RuleCandidate],
        up: Option<Direction>,
        aliases: &ClassAliases,
    ) -> Vec<(f64, &'a RuleCandidate)> {
        let fits = |other: &&RuleCandidate| {
            let lower =
                up.is_some_and(|up| (other.start.centroid() - object.start.centroid()).dot(&up) < 0.0);
            other.key != object.key
                && super::contains_class(&self.classes, other.class_name(), aliases)
                && (lower || !self.below)
        };
        let others = all.iter().filter(fits);
        let mut found: Vec<_> = others.map(|other| (gap(&object.start, &other.start), other)).collect();
        found.sort_by(|a, b| a.0.total_cmp(&b.0));
        found
    }

    fn failed_condition(&self, found: &[(f64, &RuleCandidate)], wanted: usize) -> String {
        let what = if self.classes.iter().any(|c| c == ANY_CLASS) {
            "object".into()
        } else {
            self.classes.join(" or ")
        };
        let lower = if self.below { " below" } else { "" };
        let nearest = match found.first() {
            Some((gap, other)) => format!("the nearest is {}, {gap:.2} m away", other.key),
            None => "none is mapped".into(),
        };
        let many = if wanted > 1 { format!("fewer than {wanted} of") } else { "no".into() };
        format!("{many} {what}{lower} within {} m: {nearest}", self.within_m.get())
    }
}

/// Returns the gap between two ellipsoids along the line through their centres; negative if they overlap.
fn gap(a: &DualQuadric, b: &DualQuadric) -> f64 {
    let way = b.centroid() - a.centroid();
    let Some(u) = way.try_normalize(1e-12) else { return -a.semi_axes.min() - b.semi_axes.min() };
    way.norm() - radius(a, &u) - radius(b, &u)
}

/// Returns the distance from the centre to the surface in a direction.
fn radius(quadric: &DualQuadric, u: &Vector3<f64>) -> f64 {
    quadric.pose.rotation.inverse().act(u).component_div(&quadric.semi_axes).norm().recip()
}
