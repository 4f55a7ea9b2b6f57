//! Splitting: one object that is two.
use super::super::{DetectionMove, MapEstimate};
use super::LikelihoodAssociation;
use super::fit::{FittedEllipsoid, ObjectPrior, fit, squared_error};
use super::sightings::{Sighting, Sightings};
use super::track::{Track, TrackBox};
use super::tracker::{CONFIRMED_TRACK_BOXES, Tracker};
use super::union::{SAME_CLASS_FACTOR, SAME_CLASS_SIMILARITY, class_similarity};
use manifactor_quadric::Camera;
use manifactor_recording::class::ClassAliases;
use manifactor_recording::sequence::ObjectId;

/// Objects that are checked per frame, at most.
const SPLIT_CHECKS_PER_FRAME: usize = 4;
/// Rounds that alternate between assigning boxes to two ellipsoids and fitting both.
const ASSIGNMENT_ROUNDS: usize = 6;

/// One half of an object that may be two: an ellipsoid and the sightings that it explains better.
struct ObjectHalf {
    belief: ObjectPrior,
    fitted: FittedEllipsoid,
    sightings: Vec<Sighting>,
}

/// Camera, class aliases and settings for fits.
struct Fitter<'a> {
    camera: &'a Camera,
    aliases: &'a ClassAliases,
    settings: &'a LikelihoodAssociation,
}

impl Tracker {
    /// Splits objects that turn out to be two. Checks the objects that were seen in this frame and have many
    /// more boxes than at their last check.
    pub(super) fn split_objects(&mut self, frame: usize, map: &dyn MapEstimate) -> Vec<DetectionMove> {
        let due = self.tracks.iter_mut().enumerate();
        let due = due.filter_map(|(t, track)| track.is_split_check_due(frame).then_some(t));
        let due: Vec<usize> = due.take(SPLIT_CHECKS_PER_FRAME).collect();
        let mut all = vec![];
        for t in due {
            let Self { camera, aliases, settings, .. } = &*self;
            let fitter = Fitter { camera, aliases, settings };
            let Some(parts) = fitter.split_in_two(&self.tracks[t]) else { continue };
            let Some([stays, mut goes]) = fitter.split_tracks(&self.tracks[t], parts, map) else { continue };
            goes.id = ObjectId(self.next);
            self.next += 1;
            all.extend(goes.boxes.iter_mut().map(|seen| {
                seen.detection.object = Some(goes.id);
                let TrackBox { index: place, detection, .. } = seen.clone();
                DetectionMove {
                    frame: detection.frame,
                    index: place,
                    from: stays.id,
                    into: goes.id,
                    detection,
                }
            }));
            self.tracks[t] = stays;
            self.tracks.push(goes);
        }
        for past in &mut self.pending_frames {
            all.iter().for_each(|moved| past.apply_move(moved));
        }
        all
    }
}

impl Fitter<'_> {
    /// Returns two parts if one ellipsoid does not explain the boxes of the object, two do, and these are not
    /// in one place.
    fn split_in_two(&self, track: &Track) -> Option<[ObjectHalf; 2]> {
        let all = track.sightings.all();
        if self.explains(&track.fitted, all, 1.0) {
            return None;
        }
        let error = |seen: &&Sighting| self.squared_error(&track.fitted, seen);
        let worst = all.iter().max_by(|a, b| error(a).total_cmp(&error(b)))?;
        let mut parts = [
            ObjectHalf { belief: track.belief.clone(), fitted: track.fitted, sightings: all.to_vec() },
            self.fit_half(&track.fitted, None, vec![worst.clone()])?,
        ];
        for _ in 0..ASSIGNMENT_ROUNDS {
            let [a, b] = &parts;
            let is_of_first =
                |seen: &Sighting| self.squared_error(&a.fitted, seen) <= self.squared_error(&b.fitted, seen);
            let (of_a, of_b): (Vec<Sighting>, Vec<Sighting>) = all.iter().cloned().partition(is_of_first);
            if of_a.len() < CONFIRMED_TRACK_BOXES || of_b.len() < CONFIRMED_TRACK_BOXES {
                return None;
            }
            let is_done = of_b.len() == b.sightings.len();
            let start = |part: &ObjectHalf| Some(part.fitted);
            parts = [self.fit_half(&a.fitted, start(a), of_a)?, self.fit_half(&b.fitted, start(b), of_b)?];
            if is_done {
                break;
            }
        }
        let [a, b] = &parts;
        let are_good = parts.iter().all(|part| self.explains(&part.fitted, &part.sightings, 1.0));
        (are_good && !a.fitted.overlaps(&b.fitted)).then_some(parts)
    }

    /// Assigns all boxes of an object to one of two parts. For an object of a prior map, the half nearest to
    /// it there comes first, otherwise the half with more boxes. `None` if one half has too few boxes, or
    /// both belong to one object of a complex shape.
    fn split_tracks(
        &self,
        track: &Track,
        [a, b]: [ObjectHalf; 2],
        map: &dyn MapEstimate,
    ) -> Option<[Track; 2]> {
        let is_of_first = |seen: &TrackBox| {
            let seen = map.pose(seen.frame()).map(|pose| seen.from(pose));
            seen.is_none_or(|seen| {
                self.squared_error(&a.fitted, &seen) <= self.squared_error(&b.fitted, &seen)
            })
        };
        let (of_a, of_b): (Vec<TrackBox>, Vec<TrackBox>) = track.boxes.iter().cloned().partition(is_of_first);
        let mut halves = [a.into_track(track, of_a, self.aliases), b.into_track(track, of_b, self.aliases)];
        if let ObjectPrior::Known { quadric, .. } = &track.belief {
            let away = |half: &Track| (half.fitted.quadric.centroid() - quadric.centroid()).norm();
            if away(&halves[1]) < away(&halves[0]) {
                halves.swap(0, 1);
            }
            halves[0].belief = track.belief.clone();
        } else if halves[1].boxes.len() > halves[0].boxes.len() {
            halves.swap(0, 1);
        }
        let is_firm = halves.iter().all(|half| half.boxes.len() >= CONFIRMED_TRACK_BOXES);
        // merging tolerates more for a complex shape: do not split halves that it would unite at once
        let factor = if class_similarity(&halves[0], &halves[1]) > SAME_CLASS_SIMILARITY {
            SAME_CLASS_FACTOR
        } else {
            1.0
        };
        (is_firm && !self.explains(&track.fitted, track.sightings.all(), factor)).then_some(halves)
    }

    /// Fits an ellipsoid to some sightings, from `start` or from the first of them. The assumed distance is
    /// that of `like`.
    fn fit_half(
        &self,
        like: &FittedEllipsoid,
        start: Option<FittedEllipsoid>,
        sightings: Vec<Sighting>,
    ) -> Option<ObjectHalf> {
        let first = sightings.first()?;
        let depth = (like.quadric.centroid() - first.world_from_camera.translation).norm();
        let belief = ObjectPrior::new(first, self.camera, depth, *self.settings.depth_spread);
        let start = start.map_or_else(|| belief.initial_quadric(), |start| start.quadric);
        let fitted = fit(&belief, start, &sightings, self.camera, &self.settings.noise())?;
        Some(ObjectHalf { belief, fitted, sightings })
    }

    fn squared_error(&self, fitted: &FittedEllipsoid, seen: &Sighting) -> f64 {
        squared_error(&fitted.quadric, seen, self.camera, &self.settings.noise())
    }

    /// Returns whether an ellipsoid explains boxes within the limit of merging, multiplied by `times`.
    fn explains(&self, fitted: &FittedEllipsoid, sightings: &[Sighting], times: f64) -> bool {
        let rows: usize = sightings.iter().map(Sighting::rows).sum();
        let errors: f64 = sightings.iter().map(|seen| self.squared_error(fitted, seen)).sum();
        errors <= (times * *self.settings.merge_error).powi(2) * rows as f64
    }
}

impl ObjectHalf {
    /// Creates a track from the boxes of one half. It keeps the id and the schedule of the original track.
    fn into_track(self, of: &Track, boxes: Vec<TrackBox>, aliases: &ClassAliases) -> Track {
        let mut track = Track {
            sightings: Sightings::from_sorted(self.sightings),
            last_seen_s: boxes.last().map(|seen| seen.timestamp),
            next_merge_check: of.next_merge_check,
            next_split_check: of.next_split_check,
            ..Track::without_boxes(of.id, self.belief, self.fitted)
        };
        boxes.iter().for_each(|seen| track.add_class_vote(&seen.detection.scores, aliases, 1.0));
        Track { boxes, ..track }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Association, FrameDetections};
    use super::super::rail::{CAMERA, RailCamera, detection_at};
    use super::*;
    use manifactor_graph::checked::Positive;
    use std::collections::BTreeSet;

    /// Feeds a tracker with boxes of one object: every third box is at `x`, the rest in the middle. Returns
    /// the frames of moved boxes, and the ids of one box at each place.
    fn move_every_third_box(x: f64) -> (BTreeSet<usize>, Vec<Option<ObjectId>>) {
        // no frame is old enough for a second look
        let settings = LikelihoodAssociation {
            second_look_s: Positive::literal(1e9),
            ..LikelihoodAssociation::default()
        };
        let mut tracker = settings.create_associator(CAMERA, &ClassAliases::default(), &[]);
        let mut all = vec![];
        for frame in 0..40 {
            let boxes = [if frame % 3 == 0 {
                detection_at(frame, x, "cup")
            } else {
                detection_at(frame, 0.0, "bowl")
            }];
            let image = FrameDetections { frame, timestamp: 0.1 * frame as f64, detections: &boxes };
            all.extend(tracker.learn_from_frame(&image, &[Some(ObjectId(7))], &RailCamera).moved);
        }
        assert!(all.iter().all(|moved| moved.from == ObjectId(7) && moved.index == 0));
        let both = [detection_at(40, 0.0, "bowl"), detection_at(40, x, "cup")];
        let image = FrameDetections { frame: 40, timestamp: 4.0, detections: &both };
        (all.iter().map(|moved| moved.frame).collect(), tracker.associate(&image, &RailCamera))
    }

    #[test]
    fn an_object_that_is_two_becomes_two() {
        let (moved, names) = move_every_third_box(0.5);
        assert!(
            moved.len() >= CONFIRMED_TRACK_BOXES && moved.iter().all(|frame| frame % 3 == 0),
            "{moved:?}"
        );
        assert!(names[0] == Some(ObjectId(7)) && names[1].is_some_and(|id| id != ObjectId(7)), "{names:?}");
    }

    #[test]
    fn one_object_stays_one() {
        let (moved, names) = move_every_third_box(0.0);
        assert_eq!((moved.len(), names[0]), (0, Some(ObjectId(7))));
    }
}
