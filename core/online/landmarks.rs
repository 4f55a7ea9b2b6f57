//! Landmarks that nobody has named: what is seen is put to what is known, by the joint likelihood.
mod candidates;
mod hypotheses;
mod saving;

use crate::error::ChangeError;
use crate::factor_id::FactorId;
use crate::session::{CovarianceError, InnovationError, Session};
use candidates::{Candidates, Choice};
use manifactor_graph::checked::{OneOrMore, Positive};
use manifactor_graph::loss::Loss;
use manifactor_graph::{Factor, FactorEntry, Graph, Key, Noise, Values, Variable};
use nalgebra::DMatrix;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::sync::Arc;

/// What a sensor sees of a landmark, whichever that is. One sighting has to determine where the landmark is: a bearing alone does not.
#[derive(Debug, Clone)]
pub struct Sighting {
    /// The measurement, between a pose and a landmark.
    pub factor: Arc<dyn Factor>,
    /// Its noise: that of the sensor, or what is near is taken for one, and what comes again for new.
    pub noise: Noise,
    /// How much of a large residual counts, once it is in the graph.
    pub loss: Option<Arc<dyn Loss>>,
    /// Where the landmark is, if it is a new one.
    pub landmark: Box<dyn Variable>,
}

/// How sightings are put to landmarks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct LandmarkSettings {
    /// New landmarks that a pose sees on average, for each unit of the volume that its sensor measures in: for each metre and radian
    /// of range and bearing, say. A sighting that is less likely of every landmark is of a new one. Default: 0.001.
    pub density: Positive,
    /// A sighting that is not so many times as likely of one landmark as of another, or of a new one, is left out. 1 takes all of
    /// them. Default: 3.
    pub odds: OneOrMore,
}

impl Default for LandmarkSettings {
    fn default() -> Self {
        Self { density: Positive::literal(0.001), odds: OneOrMore::literal(3.0) }
    }
}

/// Why sightings are not put to landmarks. Nothing is pushed then.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SightingError {
    /// A sighting that is not between the pose and a landmark.
    #[error("sighting {sighting}: {error}")]
    Sighting {
        /// Its place in the list.
        sighting: usize,
        /// What is wrong.
        error: InnovationError,
    },
    /// A pose or a landmark without a covariance.
    #[error(transparent)]
    Covariance(#[from] CovarianceError),
    /// What the session refuses.
    #[error(transparent)]
    Change(#[from] ChangeError),
}

/// What sightings are of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Named {
    /// By sighting, the key of its landmark; `None` where that is unclear, and the sighting was left out.
    pub names: Vec<Option<Key>>,
    /// Landmarks that turned out to be one: the key that is gone, and the one that has its sightings now. These come after
    /// `names`, and may change them.
    pub merged: Vec<(Key, Key)>,
}

/// Landmarks that nobody has named, with a key for each.
///
/// The sightings of a pose are put to landmarks all together, by the hypothesis that costs least: d² + ln det 2πS of all that it
/// takes for known, S the joint covariance of their innovations, and -2 ln `density` for each that it takes for new. S is
/// of the session's own joint covariance of pose and landmarks: after a long way, all that is seen again is off by
/// one and the same drift. Two landmarks that were never seen from one pose, and that one sighting is of both, become one.
///
/// ```
/// # use manifactor_online::{LandmarkSettings, Landmarks, Session, Sighting};
/// # fn example(mut session: Session, pose: manifactor_graph::Key, seen: Vec<Sighting>) -> Result<(), Box<dyn std::error::Error>> {
/// let mut landmarks = Landmarks::new("l", LandmarkSettings::default());
/// // for each pose, when it is in the session with its odometry:
/// session.update()?;
/// let named = landmarks.see(&mut session, &pose, &seen)?;
/// session.update()?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct Landmarks {
    prefix: String,
    settings: LandmarkSettings,
    known: Vec<Known>,
    /// Landmarks that there ever were.
    born: usize,
}

/// A landmark.
#[derive(Debug, Clone)]
struct Known {
    key: Key,
    /// Its covariance when it was last looked at: what came later says more.
    covariance: Option<DMatrix<f64>>,
    /// Its sightings, and the poses that they are from.
    sightings: Vec<FactorId>,
    poses: Vec<Key>,
}

impl Landmarks {
    /// None yet. Their keys are to be `prefix0`, `prefix1` and so on.
    pub fn new(prefix: &str, settings: LandmarkSettings) -> Self {
        Self { prefix: prefix.to_owned(), settings, known: vec![], born: 0 }
    }

    /// The keys of all landmarks, the oldest first.
    pub fn keys(&self) -> impl Iterator<Item = &Key> {
        self.known.iter().map(|known| &known.key)
    }

    /// Puts what is seen from a pose to landmarks, and pushes it. Pose and landmarks are as of the last update, so
    /// that there has to be one between two calls, and the next takes the sightings in; where that fails, go back to a clone of the landmarks.
    ///
    /// # Errors
    /// Where a sighting does not fit, or the pose has no covariance. Nothing is pushed then.
    pub fn see(
        &mut self,
        session: &mut Session,
        pose: &Key,
        seen: &[Sighting],
    ) -> Result<Named, SightingError> {
        let Candidates { choices, same } = self.candidates(session, pose, seen)?;
        let (mut graph, mut values, mut new, mut owners) = (Graph::new(), Values::new(), vec![], vec![]);
        for (choice, sighting) in choices.iter().zip(seen) {
            let key = match choice {
                Choice::Landmark(landmark) => {
                    owners.push(Some(*landmark));
                    self.known[*landmark].key.clone()
                }
                Choice::New => {
                    owners.push(Some(self.known.len() + new.len()));
                    let key = Key::indexed(&self.prefix, self.born + new.len());
                    values.insert_boxed(key.clone(), sighting.landmark.clone());
                    new.push(Known { key: key.clone(), covariance: None, sightings: vec![], poses: vec![] });
                    key
                }
                Choice::Unclear => {
                    owners.push(None);
                    continue;
                }
            };
            graph.push(sighting.of(pose, &key));
        }
        let ids = session.push(&graph, &values)?;
        self.born += new.len();
        self.known.extend(new);
        for (owner, id) in owners.iter().flatten().zip(ids) {
            self.known[*owner].sightings.push(id);
            self.known[*owner].poses.push(pose.clone());
        }
        let name = |owner: Option<usize>| owner.map(|owner| self.known[owner].key.clone());
        let names = owners.into_iter().map(name).collect();
        Ok(Named { names, merged: self.merge(session, same)? })
    }

    /// Makes one of pairs of landmarks, the older first, unless they were seen from one pose.
    fn merge(
        &mut self,
        session: &mut Session,
        same: Vec<(usize, usize)>,
    ) -> Result<Vec<(Key, Key)>, SightingError> {
        let (mut merged, mut gone) = (vec![], BTreeSet::new());
        for (into, from) in same {
            let (a, b) = (&self.known[into], &self.known[from]);
            let are_two = a.poses.iter().any(|pose| b.poses.contains(pose));
            // what has left with its pose cannot be given to another
            let is_whole = b.sightings.iter().all(|id| session.entry(*id).is_some());
            if are_two || !is_whole || gone.contains(&into) || gone.contains(&from) {
                continue;
            }
            let mut graph = Graph::new();
            for entry in b.sightings.iter().filter_map(|id| session.entry(*id)) {
                let keys = vec![entry.keys[0].clone(), a.key.clone()];
                graph.push(FactorEntry { keys, ..entry.clone() });
            }
            session.remove(&b.sightings)?;
            let ids = session.push(&graph, &Values::new())?;
            session.marginalize(&[&b.key])?;
            merged.push((b.key.clone(), a.key.clone()));
            gone.insert(from);
            let poses = std::mem::take(&mut self.known[from].poses);
            self.known[into].sightings.extend(ids);
            self.known[into].poses.extend(poses);
        }
        for from in gone.into_iter().rev() {
            self.known.remove(from);
        }
        Ok(merged)
    }
}

impl Sighting {
    /// As a factor to this landmark.
    fn of(&self, pose: &Key, landmark: &Key) -> FactorEntry {
        FactorEntry {
            keys: vec![pose.clone(), landmark.clone()],
            name: None,
            factor: self.factor.clone(),
            noise: self.noise.clone(),
            loss: self.loss.clone(),
        }
    }
}
