//! The tracker of all objects: assigns detections, and learns from them.
use super::super::{Associator, Corrections, FrameDetections, MapEstimate, best_assignment};
use super::LikelihoodAssociation;
use super::fit::ObjectPrior;
use super::posed_detections::PosedDetection;
use super::reassociation::PendingFrame;
use super::track::{Track, TrackBox};
use manifactor_geometry::Se3;
use manifactor_recording::class::ClassAliases;
use manifactor_recording::prior_map::PriorObject;
use manifactor_recording::sequence::{Detection, ObjectId};
use std::collections::VecDeque;
use std::sync::Arc;

/// Maximum number of boxes per frame; those with the highest scores are used. It bounds the time if a
/// detector floods the frame.
const MAX_BOXES_PER_FRAME: usize = 200;
/// Number of boxes below which an object is forgotten when it is not seen for `TENTATIVE_TIMEOUT_S`.
pub(super) const CONFIRMED_TRACK_BOXES: usize = 3;
/// Time without a detection after which such an object is forgotten, in seconds.
const TENTATIVE_TIMEOUT_S: f64 = 10.0;
/// Maximum number of such objects.
const MAX_TENTATIVE_TRACKS: usize = 500;
/// Age of the last detection of prior objects at the start of a run, in seconds. It sets the uncertainty of
/// the start pose in the prior map.
const PRIOR_OBJECT_AGE_S: f64 = 30.0;
/// Relative uncertainty of the place, below which an object contributes to the usual depth.
const KNOWN_RELATIVE_SIGMA: f64 = 0.15;

/// The models of all objects.
#[derive(Debug)]
pub(super) struct Tracker {
    pub settings: LikelihoodAssociation,
    pub aliases: ClassAliases,
    /// Sorted by id at the front: the objects of a prior map.
    pub tracks: Vec<Track>,
    pub next: u32,
    /// Nominal time of the last detection of prior objects, in seconds.
    start_time: Option<f64>,
    /// Frames that wait for their reassociation.
    pub pending_frames: VecDeque<PendingFrame>,
}

impl Associator for Tracker {
    fn associate(&self, image: &FrameDetections<'_>, map: &dyn MapEstimate) -> Vec<Option<ObjectId>> {
        let mut names = self.assign_known(image, map);
        let mut next = (self.next..).map(ObjectId);
        for i in best_scores(image.detections) {
            if names[i].is_none() {
                // new objects have twins too
                names[i] = self.twin_object(image.detections, &names, i).or_else(|| next.next());
            }
        }
        names
    }

    fn reassociate(
        &self,
        image: &FrameDetections<'_>,
        names: &[Option<ObjectId>],
        map: &dyn MapEstimate,
    ) -> Vec<Option<ObjectId>> {
        let again = self.assign_known(image, map);
        let camera = |i: usize| image.detections[i].camera.index;
        let is_free = |i: usize, before: ObjectId| {
            (0..again.len()).all(|j| again[j] != Some(before) || camera(j) != camera(i))
        };
        let keep = |i: usize| again[i].or(names[i].filter(|before| is_free(i, *before)));
        (0..again.len()).map(keep).collect()
    }

    fn learn_from_frame(
        &mut self,
        image: &FrameDetections<'_>,
        names: &[Option<ObjectId>],
        map: &dyn MapEstimate,
    ) -> Corrections {
        let Some(pose) = map.pose(image.frame) else { return Corrections::default() };
        self.start_time.get_or_insert(image.timestamp - PRIOR_OBJECT_AGE_S);
        let usual = self.usual_depth(&pose);
        let mut seen = vec![];
        for (place, (detection, id)) in image.detections.iter().zip(names).enumerate() {
            let Some(id) = *id else { continue };
            self.next = self.next.max(id.0.saturating_add(1));
            let detection = Detection { frame: image.frame, object: Some(id), ..detection.clone() };
            let one = TrackBox { timestamp: image.timestamp, index: place, detection };
            let Some(t) = self.find_or_create_track(id, &one.from(&pose), usual) else { continue };
            self.tracks[t].add_class_vote(&one.detection.scores, &self.aliases, 1.0);
            seen.push((t, one));
        }
        // keep the twin that fits best
        seen.sort_by(|(a, x), (b, y)| {
            let fits = |t: usize, seen: &TrackBox| self.tracks[t].overlap(&seen.from(&pose));
            let image = |t: usize, seen: &TrackBox| (t, seen.image());
            image(*a, x).cmp(&image(*b, y)).then_with(|| fits(*b, y).total_cmp(&fits(*a, x)))
        });
        seen.dedup_by_key(|(t, seen)| (*t, seen.image()));
        let noise = self.settings.noise();
        for (t, one) in seen {
            self.tracks[t].add_box(one, pose, map, &noise);
        }
        let forgotten = self.forget_tentative_tracks(image.timestamp);
        self.pending_frames.push_back(PendingFrame::new(image, names));
        let moved = self.reassociate_old_frames(image.timestamp, map);
        Corrections { moved, merged: self.merge_objects(image.frame), forgotten }
    }

    fn finish_association(&mut self, map: &dyn MapEstimate) -> Corrections {
        let moved = self.reassociate_old_frames(f64::INFINITY, map);
        Corrections { moved, merged: self.merge_all_objects(), forgotten: vec![] }
    }
}

impl Tracker {
    /// Creates a tracker with the objects of the prior map.
    pub(super) fn new(
        settings: LikelihoodAssociation,
        aliases: ClassAliases,
        known: &[Arc<PriorObject>],
    ) -> Self {
        let mut tracks: Vec<Track> = known.iter().map(|object| Track::of_prior_object(object)).collect();
        tracks.sort_by_key(|track| track.id);
        let next = tracks.iter().map(|track| track.id.0.saturating_add(1)).max().unwrap_or(1);
        Self { settings, aliases, tracks, next, start_time: None, pending_frames: VecDeque::new() }
    }

    /// Returns the number of objects of the prior map.
    pub(super) fn prior_object_count(&self) -> usize {
        self.tracks.partition_point(Track::is_known)
    }

    /// Returns the index of an object.
    pub(super) fn track_index(&self, id: ObjectId) -> Option<usize> {
        // binary search, because a prior map may be large
        let (known, own) = self.tracks.split_at(self.prior_object_count());
        let of_map = known.binary_search_by_key(&id, |track| track.id).ok();
        of_map.or_else(|| Some(known.len() + own.iter().position(|track| track.id == id)?))
    }

    /// Assigns known objects to the boxes of a frame.
    fn assign_known(&self, image: &FrameDetections<'_>, map: &dyn MapEstimate) -> Vec<Option<ObjectId>> {
        let mut names = vec![None; image.detections.len()];
        let Some(pose) = map.pose(image.frame) else { return names };
        let scored = best_scores(image.detections);
        let camera = |i: &usize| image.detections[*i].camera.index;
        let mut by_camera = scored.clone();
        by_camera.sort_by_key(camera);
        for own in by_camera.chunk_by(|a, b| camera(a) == camera(b)) {
            let (gains, tracks) = self.gains(image, own, &pose);
            let matched = best_assignment(own.len(), tracks.len(), &gains);
            for (i, column) in own.iter().zip(matched) {
                names[*i] = column.map(|column| self.tracks[tracks[column]].id);
            }
        }
        for i in scored {
            if names[i].is_none() {
                names[i] = self.twin_object(image.detections, &names, i);
            }
        }
        names
    }

    /// Returns the gain of each known object over a new one, as (row, column, gain), and the objects of the
    /// columns. The boxes are those of one camera.
    pub(super) fn gains(
        &self,
        image: &FrameDetections<'_>,
        boxes: &[usize],
        pose: &Se3,
    ) -> (Vec<(usize, usize, f64)>, Vec<usize>) {
        let boxes: Vec<(usize, &Detection)> =
            boxes.iter().map(|i| &image.detections[*i]).enumerate().collect();
        let Some((_, first)) = boxes.first() else { return Default::default() };
        // views of one lens differ by their rotations
        let usual = self.usual_depth(&first.camera.pose(pose));
        // one group, unless a wide lens has a view around each box
        let groups = boxes.chunk_by(|(_, a), (_, b)| a.camera == b.camera);
        let views: Vec<_> =
            groups.map(|own| (own[0].1.camera.pose(pose), &own[0].1.camera.model, own)).collect();
        let classes: Vec<Option<String>> =
            boxes.iter().map(|(_, detection)| self.best_class(detection)).collect();
        let began = self.start_time.unwrap_or(image.timestamp - PRIOR_OBJECT_AGE_S);
        let (mut gains, mut tracks) = (vec![], vec![]);
        for (t, track) in self.tracks.iter().enumerate() {
            let since = track.last_seen_s.unwrap_or(began);
            let unseen = (image.timestamp - since).max(0.0);
            let before = gains.len();
            for (pose, camera, own) in &views {
                let Some(expected) = track.expected_box(unseen, pose, camera, &self.settings) else {
                    continue;
                };
                for (row, detection) in *own {
                    if !detection.bounding_box.intersects(expected.bounding_box()) {
                        continue;
                    }
                    let new = self.settings.cost_of_new(camera, &detection.quantities, usual);
                    let cost = expected.cost(&detection.bounding_box, &detection.quantities)
                        - 2.0 * self.class_likelihood(track, classes[*row].as_deref()).ln();
                    if cost < new {
                        gains.push((*row, tracks.len(), new - cost));
                    }
                }
            }
            if gains.len() > before {
                tracks.push(t);
            }
        }
        (gains, tracks)
    }

    /// Returns the class of a box.
    pub(super) fn best_class(&self, detection: &Detection) -> Option<String> {
        detection.scores.best().map(|(class, _)| self.aliases.canonical(class))
    }

    /// Returns the likelihood that a box of an object has a class.
    pub(super) fn class_likelihood(&self, track: &Track, class: Option<&str>) -> f64 {
        self.settings.class_likelihood(class.map_or(1.0, |class| track.class_share(class)))
    }

    /// Returns the object of the most similar box of the same camera with an object, if the overlap is large enough.
    fn twin_object(
        &self,
        detections: &[Detection],
        names: &[Option<ObjectId>],
        i: usize,
    ) -> Option<ObjectId> {
        let own = &detections[i];
        let others = detections.iter().zip(names).filter(|(other, _)| other.camera.index == own.camera.index);
        let named =
            others.filter_map(|(other, name)| Some((own.bounding_box.iou(&other.bounding_box), (*name)?)));
        let near = named.filter(|(iou, _)| *iou >= *self.settings.twin_iou);
        near.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
    }

    /// Returns the index of an object, and creates it from this detection if it is new.
    fn find_or_create_track(&mut self, id: ObjectId, first: &PosedDetection, depth: f64) -> Option<usize> {
        self.track_index(id).or_else(|| {
            // the detection carries the uncertainty of a measured depth
            let depth = first.quantities.depth().unwrap_or(depth);
            let belief = ObjectPrior::new(first, depth, *self.settings.depth_spread);
            self.tracks.push(Track::new(id, belief, first, &self.settings.noise())?);
            Some(self.tracks.len() - 1)
        })
    }

    /// Returns the median distance of the objects whose place is known; the setting `depth` while there are
    /// too few.
    fn usual_depth(&self, pose: &Se3) -> f64 {
        let known = self.tracks.iter().filter(|track| track.relative_centre_sigma() < KNOWN_RELATIVE_SIGMA);
        let mut depths: Vec<f64> = known.map(|track| track.distance(pose)).collect();
        depths.sort_by(f64::total_cmp);
        if depths.len() < CONFIRMED_TRACK_BOXES { *self.settings.depth } else { depths[depths.len() / 2] }
    }

    /// Forgets objects with too few boxes that were not seen for a while, and the longest unseen if there are
    /// too many.
    fn forget_tentative_tracks(&mut self, now: f64) -> Vec<ObjectId> {
        let is_firm = |track: &Track| track.boxes.len() >= CONFIRMED_TRACK_BOXES || track.is_known();
        let doubtful = self.tracks.iter().filter(|track| !is_firm(track));
        let mut seen: Vec<f64> = doubtful.filter_map(|track| track.last_seen_s).collect();
        seen.sort_by(|a, b| b.total_cmp(a));
        let since = seen
            .get(MAX_TENTATIVE_TRACKS)
            .copied()
            .unwrap_or(f64::NEG_INFINITY)
            .max(now - TENTATIVE_TIMEOUT_S);
        let stays = |track: &mut Track| is_firm(track) || track.last_seen_s.is_some_and(|at| at > since);
        self.tracks.extract_if(.., |track| !stays(track)).map(|track| track.id).collect()
    }
}

/// Returns the indices of the boxes that are used, in order.
pub(super) fn best_scores(detections: &[Detection]) -> Vec<usize> {
    let mut all: Vec<usize> =
        (0..detections.len()).filter(|i| detections[*i].bounding_box.has_area()).collect();
    if all.len() > MAX_BOXES_PER_FRAME {
        let score = |i: &usize| detections[*i].scores.best().map_or(0.0, |(_, score)| score);
        all.sort_by(|a, b| score(b).total_cmp(&score(a)));
        all.truncate(MAX_BOXES_PER_FRAME);
        all.sort_unstable();
    }
    all
}
