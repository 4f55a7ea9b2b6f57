//! Whether two objects are one.
use super::super::Merge;
use super::Likelihood;
use super::fit::{Fitted, fit, squared_error};
use super::sightings::{Sighting, Sightings};
use super::track::{Seen, Track};
use super::tracker::Tracker;
use manifactor_quadric::Camera;
use manifactor_recording::sequence::ObjectId;

/// Two objects that are one.
struct Union {
    track: Track,
    /// Mean square of the errors of its sides, in their standard deviations, of the worse of the two.
    error: f64,
}

/// Objects that are seen in one frame are two: of the frames of the one with fewer, this share is forgiven.
const TOGETHER: f64 = 0.05;
/// How many standard deviations the places of two that are one may lie apart, beyond their sizes.
const APART: f64 = 3.0;
/// Objects whose classes are less alike than this need to fit better,
const ALIKE: f64 = 0.1;
/// by this factor;
const STRICTER: f64 = 1.4;
/// those whose classes are more alike than this, and of which one has its centre in the other, where there is room for one, need to fit less well,
pub(super) const SAME: f64 = 0.5;
/// by this factor: what has no simple shape has boxes that no ellipsoid explains.
pub(super) const LOOSER: f64 = 2.0;

/// Of so many objects it is asked in a frame, at most, whether they are the same as others,
const LOOKS: usize = 20;
/// of which so many are looked at, those that are nearest.
const NEIGHBOURS: usize = 8;

impl Tracker {
    /// Makes one of objects that turn out to be one: looks at those that were seen in this frame and have many more boxes than when
    /// they were looked at last.
    pub(super) fn merge(&mut self, frame: usize) -> Vec<Merge> {
        let due = self.tracks.iter_mut().filter_map(|track| track.is_due(frame));
        let due: Vec<ObjectId> = due.take(LOOKS).collect();
        due.into_iter().filter_map(|id| self.merge_one(id)).collect()
    }

    /// Makes one of all objects that turn out to be one.
    pub(super) fn merge_all(&mut self) -> Vec<Merge> {
        let mut merges = vec![];
        loop {
            let due: Vec<ObjectId> = self.tracks.iter().map(|track| track.id).collect();
            let before = merges.len();
            merges.extend(due.into_iter().filter_map(|id| self.merge_one(id)));
            if merges.len() == before {
                return merges;
            }
        }
    }

    /// Makes one of an object and the one that it goes with best, if there is any.
    fn merge_one(&mut self, id: ObjectId) -> Option<Merge> {
        // it may be gone by now
        let own = self.place(id)?;
        let unions = self.neighbours(own).into_iter().filter_map(|other| {
            let (one, two) = (&self.tracks[own], &self.tracks[other]);
            Some((other, of(one, two, &self.camera, &self.settings)?))
        });
        let (other, union) = unions.min_by(|(_, a), (_, b)| a.error.total_cmp(&b.error))?;
        let gone = if union.track.id == id { other } else { own };
        let stays = own + other - gone;
        let merge = Merge { from: self.tracks[gone].id, into: union.track.id };
        self.past.iter_mut().for_each(|past| past.rename(merge));
        self.tracks[stays] = union.track;
        self.tracks.remove(gone);
        Some(merge)
    }

    /// The objects that may be the same as this one, the nearest first.
    fn neighbours(&self, own: usize) -> Vec<usize> {
        // two objects of an earlier map are two: only those that it does not have are compared with one of it
        let first = if self.tracks[own].is_known() { self.known() } else { 0 };
        let others = (first..self.tracks.len()).filter(|other| *other != own);
        let near = others.filter_map(|other| Some((other, gap(&self.tracks[own], &self.tracks[other])?)));
        let mut near: Vec<(usize, f64)> = near.collect();
        near.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        near.into_iter().take(NEIGHBOURS).map(|(other, _)| other).collect()
    }
}

/// How far apart two are that may be one, as a part of their sizes and of how well they are known; `None`, where they are too far apart,
/// or were seen side by side.
fn gap(one: &Track, two: &Track) -> Option<f64> {
    let apart = (one.fitted.quadric.centroid() - two.fitted.quadric.centroid()).norm();
    let gap = apart / (one.sizes(two) + APART * one.spread(two));
    let together = || common(&one.boxes, &two.boxes) as f64;
    (gap <= 1.0 && together() <= TOGETHER * one.boxes.len().min(two.boxes.len()) as f64).then_some(gap)
}

/// The object that two are, with the name of the one that an earlier map has, or that has more boxes, if one ellipsoid explains all boxes.
fn of(one: &Track, two: &Track, camera: &Camera, settings: &Likelihood) -> Option<Union> {
    let rank = |track: &Track| (track.is_known(), track.boxes.len());
    let (more, fewer) = if rank(one) >= rank(two) { (one, two) } else { (two, one) };
    let (noise, mut sightings) = (settings.noise(), more.sightings.and(&fewer.sightings));
    // the boxes of one may look like outliers from the other
    let starts = [more, fewer].into_iter().filter_map(|start| {
        let mut fitted = start.fitted;
        // from the ellipsoid of one it may be a long way to that of both
        for _ in 0..2 {
            fitted = fit(&more.belief, fitted.quadric, sightings.all(), camera, &noise)?;
        }
        Some(fitted)
    });
    let cost = |fitted: &Fitted| -> f64 {
        sightings.all().iter().map(|seen| squared_error(&fitted.quadric, seen, camera, &noise)).sum()
    };
    let fitted = starts.min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
    let error_of = |sightings: &Sightings| {
        let error = |seen: &Sighting| squared_error(&fitted.quadric, seen, camera, &noise);
        let all = sightings.all();
        let rows: usize = all.iter().map(Sighting::rows).sum();
        all.iter().map(error).sum::<f64>() / rows.max(1) as f64
    };
    let error = error_of(&more.sightings).max(error_of(&fewer.sightings));
    let limit = match alike(more, fewer) {
        alike if alike < ALIKE => *settings.merge_error / STRICTER,
        alike if alike > SAME && more.is_where(fewer) => *settings.merge_error * LOOSER,
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
    track.boxes.sort_by_key(Seen::frame);
    track.boxes.dedup_by_key(|seen| seen.frame());
    track.seen_at = more.seen_at.into_iter().chain(fewer.seen_at).reduce(f64::max);
    track.next_look = track.next_look.max(fewer.next_look);
    track.next_doubt = track.next_doubt.max(fewer.next_doubt);
    sightings.thin(&fitted.quadric.centroid());
    track.fitted = fit(&more.belief, fitted.quadric, sightings.all(), camera, &noise)?;
    track.sightings = sightings;
    Some(Union { track, error })
}

/// How much the classes of two have in common, from 0 to 1 (Bhattacharyya).
pub(super) fn alike(one: &Track, two: &Track) -> f64 {
    one.votes.keys().map(|class| (one.share(class) * two.share(class)).sqrt()).sum()
}

/// How many frames two have in common.
fn common(one: &[Seen], two: &[Seen]) -> usize {
    let has = |seen: &&Seen| two.binary_search_by_key(&seen.frame(), Seen::frame).is_ok();
    one.iter().filter(has).count()
}
