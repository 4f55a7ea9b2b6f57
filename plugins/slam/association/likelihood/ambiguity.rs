//! Boxes that are nearly as likely of another object.
use super::super::{Ambiguity, Image};
use super::tracker::{Tracker, best_scores};
use crate::input::sequence::ObjectId;
use manifactor_geometry::Se3;
use manifactor_graph::checked::Positive;
use std::collections::BTreeMap;

impl Tracker {
    /// The boxes of a frame with these names that are less than `odds` times as likely of their object as of another one. Where the other
    /// object has a box in the frame, the two boxes change places.
    pub(super) fn ambiguous(
        &self,
        image: &Image<'_>,
        names: &[Option<ObjectId>],
        pose: &Se3,
        odds: f64,
    ) -> Vec<Ambiguity> {
        let places = best_scores(image.detections);
        let (gains, tracks) = self.gains(image, &places, pose);
        let gains: BTreeMap<(usize, ObjectId), f64> = gains
            .into_iter()
            .map(|(row, column, gain)| ((places[row], self.tracks[tracks[column]].id), gain))
            .collect();
        let gain = |place: usize, id: ObjectId| gains.get(&(place, id)).copied();
        let ambiguity = |place: &usize| {
            let own = names[*place]?;
            // of twins it is not known which is mapped
            if places.iter().filter(|twin| names[**twin] == Some(own)).count() > 1 {
                return None;
            }
            let now = gain(*place, own)?;
            // twice the logarithm of how many times as likely the box, or the two boxes, are as they are
            let lost = |other: ObjectId, then: f64| {
                let holder = places.iter().find(|holder| names[**holder] == Some(other));
                let swapped = match holder {
                    Some(holder) => gain(*holder, other)? - gain(*holder, own).unwrap_or(0.0),
                    None => 0.0,
                };
                Some((other, now - then + swapped))
            };
            let others = gains.range((*place, ObjectId(0))..=(*place, ObjectId(u32::MAX)));
            let others = others.filter(|((_, id), _)| *id != own);
            let nearest = others.filter_map(|((_, id), then)| lost(*id, *then));
            let (other, lost) = nearest.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
            let class = self.class(&image.detections[*place]);
            let of =
                |id| Some(self.class_likelihood(self.tracks.iter().find(|t| t.id == id)?, class.as_deref()));
            let class_ratio = Positive::new(of(other)? / of(own)?).ok()?;
            (lost < 2.0 * odds.ln()).then_some(Ambiguity {
                frame: image.frame,
                object: own,
                other,
                class_ratio,
            })
        };
        places.iter().filter_map(ambiguity).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Association, Image};
    use super::super::Likelihood;
    use super::super::rail::{CAMERA, Rail, seen};
    use super::*;
    use crate::input::class::Aliases;

    /// The ambiguities of a box at `x` that was put to the left one of two cups, at 0 and at 0.2 m.
    fn ambiguities(x: f64, odds: Option<f64>) -> Vec<Ambiguity> {
        let mixture_odds = odds.map(|odds| Positive::new(odds).unwrap());
        let settings = Likelihood { mixture_odds, ..Likelihood::default() };
        let mut associator = settings.begin(CAMERA, &Aliases::default(), &[]);
        let names = [Some(ObjectId(1)), Some(ObjectId(2))];
        for frame in 0..40 {
            let detections = [seen(frame, 0.0, "cup"), seen(frame, 0.2, "cup")];
            let image = Image { frame, timestamp: 0.1 * frame as f64, detections: &detections };
            associator.learn(&image, &names, &Rail);
        }
        let detections = [seen(40, x, "cup")];
        let image = Image { frame: 40, timestamp: 4.0, detections: &detections };
        associator.ambiguities(&image, &names[..1], &Rail)
    }

    #[test]
    fn a_box_between_two_objects_may_show_either() {
        let [found] = ambiguities(0.1, Some(10.0))[..] else { panic!("one box may show another object") };
        assert_eq!((found.frame, found.object, found.other), (40, ObjectId(1), ObjectId(2)));
        assert!((found.class_ratio.get() - 1.0).abs() < 1e-9, "both are cups: {found:?}");
    }

    #[test]
    fn a_box_of_one_object_is_not_ambiguous() {
        assert_eq!(ambiguities(0.0, Some(10.0)), []);
    }

    #[test]
    fn nothing_is_ambiguous_without_odds() {
        assert_eq!(ambiguities(0.1, None), []);
    }
}
