//! Splitting: one object that is two.
use super::super::{Map, Move};
use super::Likelihood;
use super::fit::{Belief, Fitted, fit, squared_error};
use super::sightings::{Sighting, Sightings};
use super::track::{Seen, Track};
use super::tracker::{FIRM, Tracker};
use super::union::{LOOSER, SAME, alike};
use manifactor_quadric::Camera;
use manifactor_recording::class::Aliases;
use manifactor_recording::sequence::ObjectId;

/// Objects that are checked per frame, at most.
const LOOKS: usize = 4;
/// Rounds that alternate between assigning boxes to two ellipsoids and fitting both.
const ROUNDS: usize = 6;

/// One half of an object that may be two: an ellipsoid and the sightings that it explains better.
struct Part {
    belief: Belief,
    fitted: Fitted,
    sightings: Vec<Sighting>,
}

/// Camera, class aliases and settings for fits.
struct Fitter<'a> {
    camera: &'a Camera,
    aliases: &'a Aliases,
    settings: &'a Likelihood,
}

impl Tracker {
    /// Splits objects that turn out to be two. Checks the objects that were seen in this frame and have many
    /// more boxes than at their last check.
    pub(super) fn divide(&mut self, frame: usize, map: &dyn Map) -> Vec<Move> {
        let due = self.tracks.iter_mut().enumerate();
        let due = due.filter_map(|(t, track)| track.is_doubtful(frame).then_some(t));
        let due: Vec<usize> = due.take(LOOKS).collect();
        let mut all = vec![];
        for t in due {
            let Self { camera, aliases, settings, .. } = &*self;
            let fitter = Fitter { camera, aliases, settings };
            let Some(parts) = fitter.parts(&self.tracks[t]) else { continue };
            let Some([stays, mut goes]) = fitter.halves(&self.tracks[t], parts, map) else { continue };
            goes.id = ObjectId(self.next);
            self.next += 1;
            all.extend(goes.boxes.iter_mut().map(|seen| {
                seen.detection.object = Some(goes.id);
                let Seen { place, detection, .. } = seen.clone();
                Move { frame: detection.frame, place, from: stays.id, into: goes.id, detection }
            }));
            self.tracks[t] = stays;
            self.tracks.push(goes);
        }
        for past in &mut self.past {
            all.iter().for_each(|moved| past.put(moved));
        }
        all
    }
}

impl Fitter<'_> {
    /// Returns two parts if one ellipsoid does not explain the boxes of the object, two do, and these are not
    /// in one place.
    fn parts(&self, track: &Track) -> Option<[Part; 2]> {
        let all = track.sightings.all();
        if self.is_good(&track.fitted, all, 1.0) {
            return None;
        }
        let error = |seen: &&Sighting| self.error(&track.fitted, seen);
        let worst = all.iter().max_by(|a, b| error(a).total_cmp(&error(b)))?;
        let mut parts = [
            Part { belief: track.belief.clone(), fitted: track.fitted, sightings: all.to_vec() },
            self.part(&track.fitted, None, vec![worst.clone()])?,
        ];
        for _ in 0..ROUNDS {
            let [a, b] = &parts;
            let is_of_first = |seen: &Sighting| self.error(&a.fitted, seen) <= self.error(&b.fitted, seen);
            let (of_a, of_b): (Vec<Sighting>, Vec<Sighting>) = all.iter().cloned().partition(is_of_first);
            if of_a.len() < FIRM || of_b.len() < FIRM {
                return None;
            }
            let is_done = of_b.len() == b.sightings.len();
            let start = |part: &Part| Some(part.fitted);
            parts = [self.part(&a.fitted, start(a), of_a)?, self.part(&b.fitted, start(b), of_b)?];
            if is_done {
                break;
            }
        }
        let [a, b] = &parts;
        let are_good = parts.iter().all(|part| self.is_good(&part.fitted, &part.sightings, 1.0));
        (are_good && !a.fitted.is_where(&b.fitted)).then_some(parts)
    }

    /// Assigns all boxes of an object to one of two parts. For an object of a prior map, the half nearest to
    /// it there comes first, otherwise the half with more boxes. `None` if one half has too few boxes, or
    /// both belong to one object of a complex shape.
    fn halves(&self, track: &Track, [a, b]: [Part; 2], map: &dyn Map) -> Option<[Track; 2]> {
        let is_of_first = |seen: &Seen| {
            let seen = map.pose(seen.frame()).map(|pose| seen.from(pose));
            seen.is_none_or(|seen| self.error(&a.fitted, &seen) <= self.error(&b.fitted, &seen))
        };
        let (of_a, of_b): (Vec<Seen>, Vec<Seen>) = track.boxes.iter().cloned().partition(is_of_first);
        let mut halves = [a.track(track, of_a, self.aliases), b.track(track, of_b, self.aliases)];
        if let Belief::Known { quadric, .. } = &track.belief {
            let away = |half: &Track| (half.fitted.quadric.centroid() - quadric.centroid()).norm();
            if away(&halves[1]) < away(&halves[0]) {
                halves.swap(0, 1);
            }
            halves[0].belief = track.belief.clone();
        } else if halves[1].boxes.len() > halves[0].boxes.len() {
            halves.swap(0, 1);
        }
        let is_firm = halves.iter().all(|half| half.boxes.len() >= FIRM);
        // merging tolerates more for a complex shape: do not split halves that it would unite at once
        let factor = if alike(&halves[0], &halves[1]) > SAME { LOOSER } else { 1.0 };
        (is_firm && !self.is_good(&track.fitted, track.sightings.all(), factor)).then_some(halves)
    }

    /// Fits an ellipsoid to some sightings, from `start` or from the first of them. The assumed distance is
    /// that of `like`.
    fn part(&self, like: &Fitted, start: Option<Fitted>, sightings: Vec<Sighting>) -> Option<Part> {
        let first = sightings.first()?;
        let depth = (like.quadric.centroid() - first.world_from_camera.translation).norm();
        let belief = Belief::new(first, self.camera, depth, *self.settings.depth_spread);
        let start = start.map_or_else(|| belief.first(), |start| start.quadric);
        let fitted = fit(&belief, start, &sightings, self.camera, &self.settings.noise())?;
        Some(Part { belief, fitted, sightings })
    }

    fn error(&self, fitted: &Fitted, seen: &Sighting) -> f64 {
        squared_error(&fitted.quadric, seen, self.camera, &self.settings.noise())
    }

    /// Returns whether an ellipsoid explains boxes within the limit of merging, multiplied by `times`.
    fn is_good(&self, fitted: &Fitted, sightings: &[Sighting], times: f64) -> bool {
        let rows: usize = sightings.iter().map(Sighting::rows).sum();
        let errors: f64 = sightings.iter().map(|seen| self.error(fitted, seen)).sum();
        errors <= (times * *self.settings.merge_error).powi(2) * rows as f64
    }
}

impl Part {
    /// Creates a track from the boxes of one half. It keeps the id and the schedule of the original track.
    fn track(self, of: &Track, boxes: Vec<Seen>, aliases: &Aliases) -> Track {
        let mut track = Track {
            sightings: Sightings::of(self.sightings),
            seen_at: boxes.last().map(|seen| seen.timestamp),
            next_look: of.next_look,
            next_doubt: of.next_doubt,
            ..Track::bare(of.id, self.belief, self.fitted)
        };
        boxes.iter().for_each(|seen| track.vote(&seen.detection.scores, aliases, 1.0));
        Track { boxes, ..track }
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::{Association, Image};
    use super::super::rail::{CAMERA, Rail, seen};
    use super::*;
    use manifactor_graph::checked::Positive;
    use std::collections::BTreeSet;

    /// Feeds a tracker with boxes of one object: every third box is at `x`, the rest in the middle. Returns
    /// the frames of moved boxes, and the ids of one box at each place.
    fn moved(x: f64) -> (BTreeSet<usize>, Vec<Option<ObjectId>>) {
        // no frame is old enough for a second look
        let settings = Likelihood { second_look_s: Positive::literal(1e9), ..Likelihood::default() };
        let mut tracker = settings.begin(CAMERA, &Aliases::default(), &[]);
        let mut all = vec![];
        for frame in 0..40 {
            let boxes = [if frame % 3 == 0 { seen(frame, x, "cup") } else { seen(frame, 0.0, "bowl") }];
            let image = Image { frame, timestamp: 0.1 * frame as f64, detections: &boxes };
            all.extend(tracker.learn(&image, &[Some(ObjectId(7))], &Rail).moved);
        }
        assert!(all.iter().all(|moved| moved.from == ObjectId(7) && moved.place == 0));
        let both = [seen(40, 0.0, "bowl"), seen(40, x, "cup")];
        let image = Image { frame: 40, timestamp: 4.0, detections: &both };
        (all.iter().map(|moved| moved.frame).collect(), tracker.associate(&image, &Rail))
    }

    #[test]
    fn an_object_that_is_two_becomes_two() {
        let (moved, names) = moved(0.5);
        assert!(moved.len() >= FIRM && moved.iter().all(|frame| frame % 3 == 0), "{moved:?}");
        assert!(names[0] == Some(ObjectId(7)) && names[1].is_some_and(|id| id != ObjectId(7)), "{names:?}");
    }

    #[test]
    fn one_object_stays_one() {
        let (moved, names) = moved(0.0);
        assert_eq!((moved.len(), names[0]), (0, Some(ObjectId(7))));
    }
}
