//! Fusion of an object's detections into one class.
use crate::class::ClassAliases;
use crate::sequence::ClassScores;
use indexmap::IndexMap;
use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize};

/// Class scores of an object, averaged over its detections.
///
/// The class is the arg max of the averaged score vectors (Jablonsky et al., section V). If a detector
/// reports only its best class, the average is a vote weighted by the scores.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ClassFusion {
    /// Scores, summed over the detections.
    #[serde(rename = "scores", deserialize_with = "sums")]
    sums: IndexMap<String, f64>,
    /// Number of detections.
    detections: usize,
}

/// Class of an object, with its score.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FusedClass {
    /// Name after aliases.
    pub name: String,
    /// Score, averaged over the detections.
    pub score: f64,
    /// Share of the sum of all scores, from 0 to 1.
    pub share: f64,
    /// Alternative classes with their shares of the sum of all scores, the largest first.
    #[serde(skip_serializing_if = "IndexMap::is_empty")]
    pub others: IndexMap<String, f64>,
}

fn sums<'de, D: Deserializer<'de>>(from: D) -> Result<IndexMap<String, f64>, D::Error> {
    let sums = IndexMap::<String, f64>::deserialize(from)?;
    match sums.iter().find(|(_, sum)| !(sum.is_finite() && **sum >= 0.0)) {
        None => Ok(sums),
        Some((class, sum)) => {
            Err(D::Error::custom(format!("a score of 0 or more is expected for `{class}`, got {sum}")))
        }
    }
}

/// Smallest similarity of the classes of one object in two runs.
const MIN_CLASS_SIMILARITY: f64 = 0.3;
/// Classes with a smaller share of the sum of all scores are not listed.
const LEAST_SHARE: f64 = 0.01;

impl FusedClass {
    /// Returns all possible classes with their shares of the sum of all scores.
    pub fn shares(&self) -> impl Iterator<Item = (&str, f64)> {
        let others = self.others.iter().map(|(name, share)| (name.as_str(), *share));
        std::iter::once((self.name.as_str(), self.share)).chain(others)
    }
}

impl ClassFusion {
    /// Adds a detection.
    pub fn add(&mut self, scores: &ClassScores, aliases: &ClassAliases) {
        self.detections += 1;
        for (class, score) in scores.iter() {
            *self.sums.entry(aliases.canonical(class)).or_default() += score;
        }
    }

    /// Removes a detection that was added before.
    pub fn remove(&mut self, scores: &ClassScores, aliases: &ClassAliases) {
        self.detections = self.detections.saturating_sub(1);
        for (class, score) in scores.iter() {
            if let Some(sum) = self.sums.get_mut(&*aliases.canonical(class)) {
                *sum = (*sum - score).max(0.0);
            }
        }
    }

    /// Adds all detections of `other`.
    pub fn add_all(&mut self, other: Self) {
        self.detections += other.detections;
        for (class, sum) in other.sums {
            *self.sums.entry(class).or_default() += sum;
        }
    }

    /// Returns the number of detections.
    pub fn detections(&self) -> usize {
        self.detections
    }

    /// Returns whether no detection had a class.
    pub fn is_nameless(&self) -> bool {
        self.sums.is_empty()
    }

    /// Returns the share of a class in the sum of all scores.
    pub fn share(&self, class: &str) -> f64 {
        self.shares().find(|(name, _)| *name == class).map_or(0.0, |(_, share)| share)
    }

    /// Returns whether two objects may be the same one by their classes: the Bhattacharyya coefficient is at
    /// least 0.3. An object without a class may be any object.
    pub fn is_compatible(&self, other: &Self) -> bool {
        let similarity =
            || self.shares().map(|(class, share)| (share * other.share(class)).sqrt()).sum::<f64>();
        self.is_nameless() || other.is_nameless() || similarity() >= MIN_CLASS_SIMILARITY
    }

    /// Returns the scores under the canonical names of `aliases`; scores of synonyms are added up.
    pub fn canonical(&self, aliases: &ClassAliases) -> Self {
        let mut sums = IndexMap::new();
        for (class, sum) in &self.sums {
            *sums.entry(aliases.canonical(class)).or_default() += sum;
        }
        Self { sums, detections: self.detections }
    }

    /// Returns the detected classes, each with its share of the sum of all scores. Empty without detections.
    pub fn shares(&self) -> impl Iterator<Item = (&str, f64)> {
        let all: f64 = self.sums.values().sum();
        let share = move |sum: f64| if all > 0.0 { sum / all } else { 0.0 };
        self.sums.iter().map(move |(class, sum)| (class.as_str(), share(*sum)))
    }

    /// Returns the detected classes, each with the sum of its scores.
    pub fn sums(&self) -> &IndexMap<String, f64> {
        &self.sums
    }

    /// Returns the class with the largest sum of scores, and this sum. The first detected class wins ties.
    pub fn leading(&self) -> Option<(&str, f64)> {
        let best = self.sums.iter().reduce(|best, next| if next.1 > best.1 { next } else { best });
        best.map(|(name, sum)| (name.as_str(), *sum))
    }

    /// Returns the best class; the first detected class wins ties. `None` if no detection has a class.
    pub fn best(&self) -> Option<FusedClass> {
        let total: f64 = self.sums.values().sum();
        let share = |sum: f64| if total > 0.0 { sum / total } else { 0.0 };
        self.leading().map(|(name, sum)| {
            let others =
                self.sums.iter().filter(|(other, sum)| *other != name && share(**sum) >= LEAST_SHARE);
            let mut others: IndexMap<_, _> =
                others.map(|(other, sum)| (other.clone(), share(*sum))).collect();
            others.sort_by(|_, a, _, b| b.total_cmp(a));
            let score = sum / self.detections.max(1) as f64;
            FusedClass { name: name.to_owned(), score, share: share(sum), others }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fuse(detections: &[&[(&str, f64)]]) -> FusedClass {
        let mut fusion = ClassFusion::default();
        for scores in detections {
            let scores = scores.iter().map(|(class, score)| ((*class).to_owned(), *score)).collect();
            fusion.add(&scores, &ClassAliases::default());
        }
        fusion.best().unwrap()
    }

    #[test]
    fn the_average_decides_and_not_the_majority() {
        let class = fuse(&[&[("cup", 0.4)], &[("cup", 0.3)], &[("bottle", 0.9)]]);
        assert_eq!(class.name, "bottle");
        assert!((class.score - 0.3).abs() < 1e-15);
        assert!((class.share - 0.9 / 1.6).abs() < 1e-15);
        assert!((class.others["cup"] - 0.7 / 1.6).abs() < 1e-15 && class.others.len() == 1);
    }

    #[test]
    fn second_best_classes_count() {
        let class = fuse(&[&[("cup", 0.5), ("vase", 0.45)], &[("bowl", 0.5), ("vase", 0.45)]]);
        assert_eq!(class.name, "vase");
    }

    #[test]
    fn spellings_are_counted_together() {
        let class = fuse(&[&[("tvmonitor", 0.4)], &[("laptop", 0.7)], &[("tv", 0.5)]]);
        assert_eq!(class.name, "tv monitor");
    }

    #[test]
    fn no_detection_has_no_class() {
        assert_eq!(ClassFusion::default().best(), None);
    }
}
