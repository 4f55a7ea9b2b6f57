//! The noise of a stream, estimated from its first seconds.
use super::components::{MeasurementOf, measurement_of, replace_noise};
use super::cross_validation::has_unknown_noise;
use super::{BoxComponent, BoxGroups, MotionComponent, VarianceComponents, VarianceError, VarianceSettings};
use crate::estimate::{Estimate, EstimateError};
use crate::mapping::Mapping;
use crate::settings::RunSettings;
use manifactor_graph::checked::Positive;
use manifactor_graph::{FactorEntry, Noise};
use manifactor_recording::sequence::Sequence;
use manifactor_solve::Observer;
use serde::Serialize;
use std::fmt;
use std::num::NonZeroUsize;
use std::sync::Arc;

/// The noise of motions and boxes in a stream. The default is the noise that the settings give.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct StreamNoise {
    /// Noise of a motion; `None` if it stays as given.
    #[serde(skip_serializing_if = "Option::is_none")]
    odometry: Option<MotionComponent>,
    /// True if the odometry keeps its poses, because boxes do not improve it.
    keeps_odometry: bool,
    /// Noise of boxes; `None` if it stays as given.
    #[serde(skip_serializing_if = "Option::is_none")]
    boxes: Option<BoxComponent>,
    #[serde(skip)]
    of_motion: Option<Noise>,
    /// With the correlation time.
    #[serde(skip)]
    of_box: Option<(Noise, Positive)>,
}

impl fmt::Display for StreamNoise {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.odometry {
            _ if self.keeps_odometry => write!(f, "the odometry keeps its poses")?,
            None => write!(f, "the noise of the odometry stays as given")?,
            Some(MotionComponent { rotation, translation, .. }) => {
                write!(f, "odometry {rotation:.1e} rad and {translation:.1e} m")?;
            }
        }
        match &self.boxes {
            None => write!(f, "; that of boxes stays as given"),
            Some(boxes) => write!(f, "; boxes {:.1} px", boxes.effective_px),
        }
    }
}

/// Largest number of rounds. The noise of the final map is estimated from all data; a factor of √2 is
/// accurate enough here.
const MAX_ROUNDS: NonZeroUsize = NonZeroUsize::MIN.saturating_add(2);

impl StreamNoise {
    fn new(odometry: Option<MotionComponent>, boxes: Option<BoxComponent>) -> Result<Self, VarianceError> {
        let of_motion = odometry.map(|motion| motion.noise()).transpose()?;
        let of_box = boxes.map(|boxes| -> Result<_, VarianceError> {
            Ok((boxes.noise(None)?, Positive::new(boxes.correlation_time)?))
        });
        let keeps_odometry = odometry == Some(MotionComponent::UNCHANGED);
        Ok(Self { odometry, keeps_odometry, boxes, of_motion, of_box: of_box.transpose()? })
    }

    /// Returns the noise before any data. It does not depend on the run document. The odometry keeps its
    /// poses, because with few objects boxes rarely improve them.
    pub fn initial(settings: &VarianceSettings) -> Self {
        let boxes = (settings.boxes != BoxGroups::Given).then(VarianceComponents::initial_box_noise);
        let odometry = settings.odometry.then_some(MotionComponent::UNCHANGED);
        Self::new(odometry, boxes).unwrap_or_default()
    }

    /// Estimates the noise from the first frames of a stream. `None` if nothing is mapped yet, or too few
    /// objects for the noise of the odometry.
    ///
    /// # Errors
    /// If the map of these frames cannot be created or solved.
    pub fn estimate(
        first_frames: Sequence,
        settings: &RunSettings,
        observer: &mut dyn Observer,
    ) -> Result<Option<Self>, EstimateError> {
        let Some(variance) = &settings.variance_components else { return Ok(None) };
        let mut settings = settings.clone().for_stream();
        settings.completion.enabled = false;
        settings.objects.refinements = 0;
        // one noise for all boxes: there are too few for several
        let boxes = if variance.boxes == BoxGroups::Given { BoxGroups::Given } else { BoxGroups::All };
        let variance = VarianceSettings { rounds: MAX_ROUNDS, boxes, size: false, ..variance.clone() };
        let estimates_odometry = variance.odometry;
        settings.variance_components = Some(variance);
        let sequence = Arc::new(first_frames);
        let mapping = Mapping::new(&sequence, &settings)?;
        let estimate = Estimate::new(sequence, mapping, &settings, observer)?;
        let Some(found) = estimate.components.last() else { return Ok(None) };
        if estimates_odometry && found.odometry.is_none() && has_unknown_noise(&estimate.mapping) {
            return Ok(None);
        }
        let odometry = found.odometry.map(|choice| choice.smallest_noise);
        Ok(Some(Self::new(odometry, found.boxes.values().next().copied())?))
    }

    /// Returns a factor of a motion or a box with this noise, which `settings` have already; `None` for other
    /// factors.
    pub fn replace_noise_of(&self, entry: &FactorEntry, settings: &RunSettings) -> Option<FactorEntry> {
        let mut entry = entry.clone();
        let noise = match measurement_of(&entry) {
            MeasurementOf::Motion => self.of_motion.clone()?,
            MeasurementOf::Box { .. } => {
                let (noise, _) = self.of_box.clone()?;
                entry.loss.clone_from(&settings.detections.loss);
                noise
            }
            MeasurementOf::Other => return None,
        };
        replace_noise(&mut entry, noise);
        Some(entry)
    }

    /// Returns settings with this noise. The loss of boxes is tempered by their correlation time.
    pub fn apply_to(&self, settings: &RunSettings) -> RunSettings {
        let mut settings = settings.clone();
        if let Some(noise) = &self.of_motion {
            settings.odometry.noise = noise.clone();
        }
        if let Some((noise, correlation_time)) = &self.of_box {
            let loss = settings.detections.loss.take();
            settings.detections.loss = loss.map(|loss| loss.erased().tempered(*correlation_time));
            settings.detections.noise = noise.clone();
        }
        settings
    }
}
