//! The tracker of all objects: assigns detections, and learns from them.
use super::super::{Associator, Image, Learned, Map, best_assignment};
use super::Likelihood;
use super::fit::Belief;
use super::second_look::Past;
use super::sightings::Sighting;
use super::track::{Seen, Track};
use manifactor_geometry::Se3;
use manifactor_quadric::Camera;
use manifactor_recording::class::Aliases;
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::{Detection, ObjectId};
use std::collections::VecDeque;
use std::sync::Arc;

/// Maximum number of boxes per frame; those with the highest scores are used. It bounds the time if a
/// detector floods the frame.
const BOXES: usize = 200;
/// Number of boxes below which an object is forgotten when it is not seen for `PATIENCE`.
pub(super) const FIRM: usize = 3;
/// Time without a sighting after which such an object is forgotten, in seconds.
const PATIENCE: f64 = 10.0;
/// Maximum number of such objects.
const WAITING: usize = 500;
/// Age of the last sighting of prior objects at the start of a run, in seconds. It sets the uncertainty of
/// the start pose in the prior map.
const AT_LARGE: f64 = 30.0;
/// Relative uncertainty of the place, below which an object contributes to the usual depth.
const KNOWN: f64 = 0.15;

/// The models of all objects.
#[derive(Debug)]
pub(super) struct Tracker {
    pub settings: Likelihood,
    pub camera: Camera,
    pub aliases: Aliases,
    /// Sorted by id at the front: the objects of a prior map.
    pub tracks: Vec<Track>,
    pub next: u32,
    /// Nominal time of the last sighting of prior objects, in seconds.
    began: Option<f64>,
    /// Frames that wait for their second look.
    pub past: VecDeque<Past>,
}

impl Associator for Tracker {
    fn associate(&self, image: &Image<'_>, map: &dyn Map) -> Vec<Option<ObjectId>> {
        let mut names = self.put(image, map);
        let mut next = (self.next..).map(ObjectId);
        for i in best_scores(image.detections) {
            if names[i].is_none() {
                // new objects have twins too
                names[i] = self.twin(image.detections, &names, i).or_else(|| next.next());
            }
        }
        names
    }

    fn reconsider(
        &self,
        image: &Image<'_>,
        names: &[Option<ObjectId>],
        map: &dyn Map,
    ) -> Vec<Option<ObjectId>> {
        let again = self.put(image, map);
        let is_free = |before: &ObjectId| !again.contains(&Some(*before));
        let keep = |(now, before): (&Option<ObjectId>, &Option<ObjectId>)| now.or(before.filter(is_free));
        again.iter().zip(names).map(keep).collect()
    }

    fn learn(&mut self, image: &Image<'_>, names: &[Option<ObjectId>], map: &dyn Map) -> Learned {
        let Some(pose) = map.pose(image.frame) else { return Learned::default() };
        self.began.get_or_insert(image.timestamp - AT_LARGE);
        let usual = self.usual_depth(&pose);
        let mut seen = vec![];
        for (place, (detection, id)) in image.detections.iter().zip(names).enumerate() {
            let Some(id) = *id else { continue };
            self.next = self.next.max(id.0.saturating_add(1));
            let detection = Detection { frame: image.frame, object: Some(id), ..detection.clone() };
            let one = Seen { timestamp: image.timestamp, place, detection };
            let Some(t) = self.track(id, &one.from(pose), usual) else { continue };
            self.tracks[t].vote(&one.detection.scores, &self.aliases, 1.0);
            seen.push((t, one));
        }
        // keep the twin that fits best
        seen.sort_by(|(a, x), (b, y)| {
            let fits = |t: usize, seen: &Seen| self.tracks[t].overlap(&seen.from(pose), &self.camera);
            a.cmp(b).then_with(|| fits(*b, y).total_cmp(&fits(*a, x)))
        });
        seen.dedup_by_key(|(t, _)| *t);
        let noise = self.settings.noise();
        for (t, one) in seen {
            self.tracks[t].see(one, pose, map, &self.camera, &noise);
        }
        let forgotten = self.forget(image.timestamp);
        self.past.push_back(Past::new(image, names));
        let moved = self.look_again(image.timestamp, map);
        Learned { moved, merged: self.merge(image.frame), forgotten }
    }

    fn settle(&mut self, map: &dyn Map) -> Learned {
        let moved = self.look_again(f64::INFINITY, map);
        Learned { moved, merged: self.merge_all(), forgotten: vec![] }
    }
}

impl Tracker {
    /// Creates a tracker with the objects of the prior map.
    pub(super) fn new(
        settings: Likelihood,
        camera: Camera,
        aliases: Aliases,
        known: &[Arc<PriorObject>],
    ) -> Self {
        let mut tracks: Vec<Track> = known.iter().map(|object| Track::known(object)).collect();
        tracks.sort_by_key(|track| track.id);
        let next = tracks.iter().map(|track| track.id.0.saturating_add(1)).max().unwrap_or(1);
        Self { settings, camera, aliases, tracks, next, began: None, past: VecDeque::new() }
    }

    /// Returns the number of objects of the prior map.
    pub(super) fn known(&self) -> usize {
        self.tracks.partition_point(Track::is_known)
    }

    /// Returns the index of an object.
    pub(super) fn place(&self, id: ObjectId) -> Option<usize> {
        // binary search, because a prior map may be large
        let (known, own) = self.tracks.split_at(self.known());
        let of_map = known.binary_search_by_key(&id, |track| track.id).ok();
        of_map.or_else(|| Some(known.len() + own.iter().position(|track| track.id == id)?))
    }

    /// Assigns known objects to the boxes of a frame.
    fn put(&self, image: &Image<'_>, map: &dyn Map) -> Vec<Option<ObjectId>> {
        let mut names = vec![None; image.detections.len()];
        let Some(pose) = map.pose(image.frame) else { return names };
        let looked_at = best_scores(image.detections);
        let (gains, tracks) = self.gains(image, &looked_at, &pose);
        let matched = best_assignment(looked_at.len(), tracks.len(), &gains);
        for (i, column) in looked_at.iter().zip(matched) {
            names[*i] = column.map(|column| self.tracks[tracks[column]].id);
        }
        for i in looked_at {
            if names[i].is_none() {
                names[i] = self.twin(image.detections, &names, i);
            }
        }
        names
    }

    /// Returns the gain of each known object over a new one, as (row, column, gain), and the objects of the
    /// columns.
    pub(super) fn gains(
        &self,
        image: &Image<'_>,
        boxes: &[usize],
        pose: &Se3,
    ) -> (Vec<(usize, usize, f64)>, Vec<usize>) {
        let usual = self.usual_depth(pose);
        let classes: Vec<Option<String>> = boxes.iter().map(|i| self.class(&image.detections[*i])).collect();
        let began = self.began.unwrap_or(image.timestamp - AT_LARGE);
        let (mut gains, mut tracks) = (vec![], vec![]);
        for (t, track) in self.tracks.iter().enumerate() {
            let since = track.seen_at.unwrap_or(began);
            let unseen = (image.timestamp - since).max(0.0);
            let Some(expected) = track.expected(unseen, pose, &self.camera, &self.settings) else {
                continue;
            };
            let before = gains.len();
            for (row, i) in boxes.iter().enumerate() {
                let detection = &image.detections[*i];
                if !detection.bounding_box.intersects(expected.bounding_box()) {
                    continue;
                }
                let new = self.settings.cost_of_new(&self.camera, &detection.quantities, usual);
                let cost = expected.cost(&detection.bounding_box, &detection.quantities)
                    - 2.0 * self.class_likelihood(track, classes[row].as_deref()).ln();
                if cost < new {
                    gains.push((row, tracks.len(), new - cost));
                }
            }
            if gains.len() > before {
                tracks.push(t);
            }
        }
        (gains, tracks)
    }

    /// Returns the class of a box.
    pub(super) fn class(&self, detection: &Detection) -> Option<String> {
        detection.scores.best().map(|(class, _)| self.aliases.canonical(class))
    }

    /// Returns the likelihood that a box of an object has a class.
    pub(super) fn class_likelihood(&self, track: &Track, class: Option<&str>) -> f64 {
        self.settings.likelihood(class.map_or(1.0, |class| track.share(class)))
    }

    /// Returns the object of the most similar box with an object, if the overlap is large enough.
    fn twin(&self, detections: &[Detection], names: &[Option<ObjectId>], i: usize) -> Option<ObjectId> {
        let own = &detections[i].bounding_box;
        let named = detections
            .iter()
            .zip(names)
            .filter_map(|(other, name)| Some((own.iou(&other.bounding_box), (*name)?)));
        let near = named.filter(|(iou, _)| *iou >= *self.settings.twin_iou);
        near.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
    }

    /// Returns the index of an object, and creates it from this sighting if it is new.
    fn track(&mut self, id: ObjectId, first: &Sighting, depth: f64) -> Option<usize> {
        self.place(id).or_else(|| {
            // the sighting carries the uncertainty of a measured depth
            let depth = first.quantities.depth().unwrap_or(depth);
            let belief = Belief::new(first, &self.camera, depth, *self.settings.depth_spread);
            self.tracks.push(Track::new(id, belief, first, &self.camera, &self.settings.noise())?);
            Some(self.tracks.len() - 1)
        })
    }

    /// Returns the median distance of the objects whose place is known; the setting `depth` while there are
    /// too few.
    fn usual_depth(&self, pose: &Se3) -> f64 {
        let known = self.tracks.iter().filter(|track| track.place_spread() < KNOWN);
        let mut depths: Vec<f64> = known.map(|track| track.distance(pose)).collect();
        depths.sort_by(f64::total_cmp);
        if depths.len() < FIRM { *self.settings.depth } else { depths[depths.len() / 2] }
    }

    /// Forgets objects with too few boxes that were not seen for a while, and the longest unseen if there are
    /// too many.
    fn forget(&mut self, now: f64) -> Vec<ObjectId> {
        let is_firm = |track: &Track| track.boxes.len() >= FIRM || track.is_known();
        let doubtful = self.tracks.iter().filter(|track| !is_firm(track));
        let mut seen: Vec<f64> = doubtful.filter_map(|track| track.seen_at).collect();
        seen.sort_by(|a, b| b.total_cmp(a));
        let since = seen.get(WAITING).copied().unwrap_or(f64::NEG_INFINITY).max(now - PATIENCE);
        let stays = |track: &mut Track| is_firm(track) || track.seen_at.is_some_and(|at| at > since);
        self.tracks.extract_if(.., |track| !stays(track)).map(|track| track.id).collect()
    }
}

/// Returns the indices of the boxes that are used, in order.
pub(super) fn best_scores(detections: &[Detection]) -> Vec<usize> {
    let mut all: Vec<usize> =
        (0..detections.len()).filter(|i| detections[*i].bounding_box.has_area()).collect();
    if all.len() > BOXES {
        let score = |i: &usize| detections[*i].scores.best().map_or(0.0, |(_, score)| score);
        all.sort_by(|a, b| score(b).total_cmp(&score(a)));
        all.truncate(BOXES);
        all.sort_unstable();
    }
    all
}
