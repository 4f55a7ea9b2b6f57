//! Merging of two tracks that show one object.
use super::super::ObjectMerge;
use super::LikelihoodAssociation;
use super::fit::{FittedEllipsoid, fit, squared_error};
use super::posed_detections::{PosedDetection, PosedDetections};
use super::track::{Track, TrackBox};
use super::tracker::Tracker;
use manifactor_recording::sequence::ObjectId;

/// The result of merging two objects.
struct MergedTrack {
    track: Track,
    /// Mean squared residual of the box sides, in units of their variances: the larger of the values of both
    /// objects.
    error: f64,
}

/// Two objects visible in one image are distinct. This share of the images of the object with fewer boxes is
/// tolerated.
const MAX_SHARED_IMAGES: f64 = 0.05;
/// Distance of the centres at which two objects may still be one, in standard deviations. Their sizes are
/// added to it.
const MAX_CENTRE_DISTANCE_SIGMA: f64 = 3.0;
/// Similarity of classes below which the limit is divided by `DIFFERENT_CLASS_FACTOR`.
const DIFFERENT_CLASS_SIMILARITY: f64 = 0.1;
/// Divides `merge_error` for objects of different classes.
const DIFFERENT_CLASS_FACTOR: f64 = 1.4;
/// Similarity of classes above which the limit is multiplied by `SAME_CLASS_FACTOR`, if one object contains
/// the centre of the other and both places are known well enough.
const SAME_CLASS_SIMILARITY: f64 = 0.5;
/// Multiplies `merge_error` for objects of one class in one place: no ellipsoid explains all boxes of a
/// complex shape.
const SAME_CLASS_FACTOR: f64 = 2.0;

/// Objects per frame that are compared with their neighbours, at most.
const MERGE_CHECKS_PER_FRAME: usize = 20;
/// Nearest neighbours that each object is compared with.
const MAX_NEIGHBOURS: usize = 8;

impl Tracker {
    /// Merges objects that turn out to be one. Considers the objects that were seen in this frame and have
    /// many more boxes than at their last check.
    pub(super) fn merge_objects(&mut self, frame: usize) -> Vec<ObjectMerge> {
        let due = self.tracks.iter_mut().filter_map(|track| track.due_merge_check(frame));
        let due: Vec<ObjectId> = due.take(MERGE_CHECKS_PER_FRAME).collect();
        due.into_iter().filter_map(|id| self.merge_with_neighbour(id)).collect()
    }

    /// Merges all objects that turn out to be one.
    pub(super) fn merge_all_objects(&mut self) -> Vec<ObjectMerge> {
        let mut merges = vec![];
        loop {
            let due: Vec<ObjectId> = self.tracks.iter().map(|track| track.id).collect();
            let before = merges.len();
            merges.extend(due.into_iter().filter_map(|id| self.merge_with_neighbour(id)));
            if merges.len() == before {
                return merges;
            }
        }
    }

    /// Merges an object with the neighbour that fits best, if there is one.
    fn merge_with_neighbour(&mut self, id: ObjectId) -> Option<ObjectMerge> {
        // an earlier merge may have removed it
        let own = self.track_index(id)?;
        let merges = self.neighbours(own).into_iter().filter_map(|other| {
            let (one, two) = (&self.tracks[own], &self.tracks[other]);
            Some((other, try_merge(one, two, &self.settings)?))
        });
        let (other, merged) = merges.min_by(|(_, a), (_, b)| a.error.total_cmp(&b.error))?;
        let gone = if merged.track.id == id { other } else { own };
        let stays = own + other - gone;
        let merge = ObjectMerge { from: self.tracks[gone].id, into: merged.track.id };
        self.pending_frames.iter_mut().for_each(|past| past.apply_merge(merge));
        self.tracks[stays] = merged.track;
        self.tracks.remove(gone);
        Some(merge)
    }

    /// Returns the objects that may be merged with this one, nearest first.
    fn neighbours(&self, own: usize) -> Vec<usize> {
        // objects of a prior map are distinct: one of them is compared only with objects outside of that map
        let first = if self.tracks[own].is_known() { self.prior_object_count() } else { 0 };
        let others = (first..self.tracks.len()).filter(|other| *other != own);
        let near = others.filter_map(|other| Some((other, gap(&self.tracks[own], &self.tracks[other])?)));
        let mut near: Vec<(usize, f64)> = near.collect();
        near.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        near.into_iter().take(MAX_NEIGHBOURS).map(|(other, _)| other).collect()
    }
}

/// Returns the distance of two objects relative to their sizes and uncertainties; `None` if they are too far
/// apart or were visible side by side.
fn gap(one: &Track, two: &Track) -> Option<f64> {
    let apart = (one.fitted.quadric.centroid() - two.fitted.quadric.centroid()).norm();
    let gap = apart / (one.size_sum(two) + MAX_CENTRE_DISTANCE_SIGMA * one.offset_sigma(two));
    let together = || shared_images(&one.boxes, &two.boxes) as f64;
    (gap <= 1.0 && together() <= MAX_SHARED_IMAGES * one.boxes.len().min(two.boxes.len()) as f64)
        .then_some(gap)
}

/// Merges two objects if one ellipsoid explains all boxes. Keeps the id of the object from the prior map,
/// else of the one with more boxes.
fn try_merge(one: &Track, two: &Track, settings: &LikelihoodAssociation) -> Option<MergedTrack> {
    let rank = |track: &Track| (track.is_known(), track.boxes.len());
    let (more, fewer) = if rank(one) >= rank(two) { (one, two) } else { (two, one) };
    let (noise, mut detections) = (settings.noise(), more.detections.merged_with(&fewer.detections));
    // start from both ellipsoids, since boxes of one object may look like outliers from the other
    let starts = [more, fewer].into_iter().filter_map(|start| {
        let mut fitted = start.fitted;
        // the way from the ellipsoid of one object to the common one may be long
        for _ in 0..2 {
            fitted = fit(&more.belief, fitted.quadric, detections.all(), &noise)?;
        }
        Some(fitted)
    });
    let cost = |fitted: &FittedEllipsoid| -> f64 {
        detections.all().iter().map(|seen| squared_error(&fitted.quadric, seen, &noise)).sum()
    };
    let fitted = starts.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let error_of = |detections: &PosedDetections| {
        let error = |seen: &PosedDetection| squared_error(&fitted.quadric, seen, &noise);
        let all = detections.all();
        let rows: usize = all.iter().map(PosedDetection::rows).sum();
        all.iter().map(error).sum::<f64>() / rows.max(1) as f64
    };
    let error = error_of(&more.detections).max(error_of(&fewer.detections));
    let limit = match class_similarity(more, fewer) {
        alike if alike < DIFFERENT_CLASS_SIMILARITY => *settings.merge_error / DIFFERENT_CLASS_FACTOR,
        alike if alike > SAME_CLASS_SIMILARITY && more.overlaps(fewer) => {
            *settings.merge_error * SAME_CLASS_FACTOR
        }
        _ => *settings.merge_error,
    };
    if error > limit * limit {
        return None;
    }
    let mut track = more.clone();
    for (class, votes) in &fewer.votes {
        *track.votes.entry(class.clone()).or_default() += votes;
    }
    track.boxes.extend_from_slice(&fewer.boxes);
    track.boxes.sort_by_key(TrackBox::image);
    track.boxes.dedup_by_key(|seen| seen.image());
    track.last_seen_s = more.last_seen_s.into_iter().chain(fewer.last_seen_s).reduce(f64::max);
    track.next_merge_check = track.next_merge_check.max(fewer.next_merge_check);
    detections.thin(&fitted.quadric.centroid());
    track.fitted = fit(&more.belief, fitted.quadric, detections.all(), &noise)?;
    track.detections = detections;
    Some(MergedTrack { track, error })
}

/// Returns the similarity of the class distributions, from 0 to 1 (Bhattacharyya coefficient).
fn class_similarity(one: &Track, two: &Track) -> f64 {
    one.votes.keys().map(|class| (one.class_share(class) * two.class_share(class)).sqrt()).sum()
}

/// Returns the number of images that show both objects.
fn shared_images(one: &[TrackBox], two: &[TrackBox]) -> usize {
    let has = |seen: &&TrackBox| two.binary_search_by_key(&seen.image(), TrackBox::image).is_ok();
    one.iter().filter(has).count()
}
