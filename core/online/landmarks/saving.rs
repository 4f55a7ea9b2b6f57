//! Landmarks that go on after a restart, beside their session.
use super::{Known, LandmarkSettings, Landmarks};
use crate::factor_id::FactorId;
use crate::saved::{Form, LoadError, SaveError};
use crate::session::Session;
use manifactor_graph::Key;
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

const LANDMARKS: Form = Form { what: "landmarks", version: 1 };

/// What is saved.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    prefix: String,
    settings: LandmarkSettings,
    born: usize,
    /// The oldest first.
    known: Vec<SavedLandmark>,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct SavedLandmark {
    key: Key,
    /// The bits of its entries, column by column.
    covariance: Option<Vec<u64>>,
    sightings: Vec<u32>,
    poses: Vec<Key>,
}

impl Landmarks {
    /// The landmarks as text, to be kept beside that of their session, which is [saved](Session::save) between the same two calls of
    /// [`see`](Self::see), after the update. [`load`](Self::load) makes landmarks of it that give the same names.
    ///
    /// # Errors
    /// Where something has no text.
    pub fn save(&self) -> Result<String, SaveError> {
        let landmark = |known: &Known| SavedLandmark {
            key: known.key.clone(),
            covariance: known.covariance.as_ref().map(|s| s.iter().map(|x| x.to_bits()).collect()),
            sightings: known.sightings.iter().map(|id| id.0).collect(),
            poses: known.poses.clone(),
        };
        LANDMARKS.write(&Saved {
            prefix: self.prefix.clone(),
            settings: self.settings.clone(),
            born: self.born,
            known: self.known.iter().map(landmark).collect(),
        })
    }

    /// Landmarks as they were [saved](Self::save), in their session as it was loaded.
    ///
    /// # Errors
    /// Where the text is none, is damaged, or is of another version; where the landmarks are not those of this session at this time.
    pub fn load(text: &str, session: &Session) -> Result<Self, LoadError> {
        let Saved { prefix, settings, born, known } = LANDMARKS.read(text)?;
        let mut landmarks = Self::new(&prefix, settings);
        if session.has_had(Key::indexed(&prefix, born).as_str()) {
            return Err(LoadError::Landmarks("it has more of them"));
        }
        let number = |key: &Key| key.as_str().strip_prefix(&prefix)?.parse::<usize>().ok();
        let numbers: Option<Vec<usize>> = known.iter().map(|landmark| number(&landmark.key)).collect();
        let fits = |numbers: &Vec<usize>| {
            // a counter that goes on from there must not wrap around
            let is_young = (born as u64) < 1 << 62;
            numbers.is_sorted_by(|a, b| a < b) && numbers.last().is_none_or(|last| *last < born) && is_young
        };
        numbers.filter(fits).ok_or(LoadError::Landmarks("their names"))?;
        landmarks.born = born;
        landmarks.known = known.into_iter().map(|known| known.of(session)).collect::<Result<_, _>>()?;
        Ok(landmarks)
    }
}

impl SavedLandmark {
    fn of(self, session: &Session) -> Result<Known, LoadError> {
        let Self { key, covariance, sightings, poses } = self;
        if !session.has_had(key.as_str()) {
            return Err(LoadError::Landmarks("it has never had one of them"));
        }
        let sightings: Vec<FactorId> = sightings.into_iter().map(FactorId).collect();
        let is_own = |(id, pose): (&FactorId, &Key)| {
            let own = session.entry(*id).is_none_or(|entry| entry.keys == [pose.clone(), key.clone()]);
            own && session.has_given(*id)
        };
        if sightings.len() != poses.len() || !sightings.iter().zip(&poses).all(is_own) {
            return Err(LoadError::Landmarks("its factors are not their sightings"));
        }
        // of one that has left, nothing looks at it any more
        let dim = session.estimate(key.as_str()).map(|variable| variable.erased().dim());
        let covariance = covariance.zip(dim).map(|(bits, dim)| {
            let entries: Vec<f64> = bits.into_iter().map(f64::from_bits).collect();
            let fits = entries.len() == dim * dim && entries.iter().all(|x| x.is_finite());
            fits.then(|| DMatrix::from_vec(dim, dim, entries)).ok_or(LoadError::Landmarks("a covariance"))
        });
        Ok(Known { covariance: covariance.transpose()?, key, sightings, poses })
    }
}
