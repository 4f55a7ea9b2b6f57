//! Whether an object is two.
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

/// Of so many objects it is asked in a frame, at most.
const LOOKS: usize = 4;
/// Rounds of putting boxes to the one or the other, and fitting both.
const ROUNDS: usize = 6;

/// One of two that an object may be: an ellipsoid, and the sightings that it explains better than the other.
struct Part {
    belief: Belief,
    fitted: Fitted,
    sightings: Vec<Sighting>,
}

/// What an ellipsoid is fitted with.
struct Fitter<'a> {
    camera: &'a Camera,
    aliases: &'a Aliases,
    settings: &'a Likelihood,
}

impl Tracker {
    /// Makes two of objects that turn out to be two: looks at those that were seen in this frame and have many more boxes than when they
    /// were looked at last.
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
    /// The two that an object is: one ellipsoid does not explain its boxes, two do, and these are not in one place.
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

    /// All boxes of an object, put to the one or the other of two: the one with more of them, or that an earlier map has, first. `None`, where
    /// one of them has too few, or both are one thing of no simple shape.
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
        // what would be united as one thing of no simple shape is not divided
        let factor = if alike(&halves[0], &halves[1]) > SAME { LOOSER } else { 1.0 };
        (is_firm && !self.is_good(&track.fitted, track.sightings.all(), factor)).then_some(halves)
    }

    /// An ellipsoid of its own for some sightings, about as far away as another, fitted from a start or from the first of them.
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

    /// Returns whether an ellipsoid explains boxes as well as merging asks for, or that many times less well.
    fn is_good(&self, fitted: &Fitted, sightings: &[Sighting], times: f64) -> bool {
        let rows: usize = sightings.iter().map(Sighting::rows).sum();
        let errors: f64 = sightings.iter().map(|seen| self.error(fitted, seen)).sum();
        errors <= (times * *self.settings.merge_error).powi(2) * rows as f64
    }
}

impl Part {
    /// What is of another now: an object of these boxes.
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

    /// Tells a tracker that all boxes are of one object: every third is at `x`, the others in the middle. Returns the boxes that were moved.
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
