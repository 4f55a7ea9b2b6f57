use manifactor_graph::checked::Share;
use manifactor_recording::sequence::{Detection, ObjectId, Sequence};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::num::NonZeroUsize;

/// Boxes that the estimate does not use and then predicts. The prediction error measures the quality of a map
/// without ground truth.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Holdout {
    /// This share of all boxes, drawn at random. The remaining boxes of the same frames are used.
    Share(Share),
    /// All boxes of an object except its first ones, the used share. Measures maps of objects seen from few
    /// views. Boxes without an object are used.
    First(Share),
    /// All boxes of the last frames, this share of all frames.
    Last(Share),
    /// The boxes of the last `n` of every 5`n` frames. Choose `n` longer than a detector's errors last.
    Block(NonZeroUsize),
}

/// The last of this many consecutive blocks is held out.
const BLOCKS_PER_HOLDOUT: usize = 5;
/// Seed of the random draw.
const SEED: u64 = 1;

impl Holdout {
    /// Removes the held-out boxes from a sequence and returns them.
    pub fn take_from(self, sequence: &mut Sequence) -> Vec<Detection> {
        let mut rng = Pcg64::seed_from_u64(SEED);
        let frames = sequence.frames.len();
        let mut remaining = self.first_boxes(&sequence.detections);
        let mut is_held_out = |detection: &Detection| match self {
            Self::Share(share) => rng.random_bool(*share),
            Self::First(_) => match detection.object.and_then(|object| remaining.get_mut(&object)) {
                Some(0) => true,
                Some(left) => {
                    *left -= 1;
                    false
                }
                None => false,
            },
            Self::Last(share) => detection.frame as f64 >= (1.0 - *share) * frames as f64,
            Self::Block(length) => {
                detection.frame / length.get() % BLOCKS_PER_HOLDOUT == BLOCKS_PER_HOLDOUT - 1
            }
        };
        let all = std::mem::take(&mut sequence.detections);
        let (held_out, used) = all.into_iter().partition(|detection| is_held_out(detection));
        sequence.detections = used;
        held_out
    }

    /// Returns the number of used boxes of each object for [`First`](Self::First), rounded up.
    fn first_boxes(self, detections: &[Detection]) -> BTreeMap<ObjectId, usize> {
        let mut boxes: BTreeMap<ObjectId, usize> = BTreeMap::new();
        if let Self::First(share) = self {
            for object in detections.iter().filter_map(|detection| detection.object) {
                *boxes.entry(object).or_default() += 1;
            }
            boxes.values_mut().for_each(|n| *n = (*share * *n as f64).ceil() as usize);
        }
        boxes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_simulator::SimulatedSource;

    #[test]
    fn boxes_are_held_out_as_it_says_and_none_is_lost() {
        let whole = SimulatedSource::default().simulate().unwrap();
        let (boxes, frames) = (whole.detections.len(), whole.frames.len());
        let split = |holdout: Holdout| {
            let mut rest = whole.clone();
            let held_out = holdout.take_from(&mut rest);
            assert_eq!(held_out.len() + rest.detections.len(), boxes);
            (held_out, rest.detections)
        };
        let (held_out, _) = split(Holdout::Share(Share::literal(0.25)));
        assert!((held_out.len() as f64 / boxes as f64 - 0.25).abs() < 0.05);
        assert_eq!(
            split(Holdout::Share(Share::literal(0.0))).0.len()
                + split(Holdout::Share(Share::literal(1.0))).1.len(),
            0
        );
        let (held_out, rest) = split(Holdout::Last(Share::literal(0.2)));
        assert!(
            held_out.iter().all(|d| 5 * d.frame >= 4 * frames)
                && rest.iter().all(|d| 5 * d.frame < 4 * frames)
        );
        let (held_out, rest) = split(Holdout::First(Share::literal(0.1)));
        let last_used = |object| rest.iter().filter(|d| d.object == object).map(|d| d.frame).max().unwrap();
        assert!(held_out.iter().all(|d| d.frame > last_used(d.object)));
        assert!((rest.len() as f64 / boxes as f64 - 0.1).abs() < 0.03);
        let length = NonZeroUsize::new(3).unwrap();
        let (held_out, rest) = split(Holdout::Block(length));
        assert!(!held_out.is_empty() && held_out.iter().all(|d| d.frame % 15 >= 12));
        assert!(rest.iter().all(|d| d.frame % 15 < 12));
    }
}
