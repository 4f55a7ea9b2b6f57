//! By the joint likelihood of box and class.
mod fit;
mod sightings;
mod track;
mod union;

use super::{Association, Associator, Image, Learned, Map, Merge, assignment};
use crate::input::class::Aliases;
use crate::input::sequence::{Detection, ObjectId};
use fit::{Belief, BoxNoise};
use manifactor_geometry::Se3;
use manifactor_graph::checked::{positive, within};
use manifactor_graph::register;
use manifactor_quadric::Camera;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sightings::Sighting;
use track::Track;

/// By the likelihood of box and class, under what each object is expected to look like.
///
/// Each object has an ellipsoid of its own from its first box on, fitted to its boxes from all sides, with a covariance: one box says
/// where it is but for its depth. The next box is expected with S = J Σ Jᵀ + D + R: Σ of the ellipsoid, D of the camera's drift since
/// the object was seen, R of the detector. A box costs d² + ln det 2πS - 2 ln p(class), d its distance by S; to be a new object
/// costs what a box anywhere in the image does. The cheapest assignment of all boxes of a frame wins (Hungarian method). A box that
/// is nearly another's twin shows the same object: detectors draw a box for each class.
///
/// An object that was lost begins again under another name. Where one ellipsoid explains the boxes of two objects that
/// are not seen side by side, they become one.
///
/// Chosen on fr1/desk, fr1/desk2 and simulated desks: see the page on association in `docs/decisions`.
///
/// ```toml
/// association = { type = "likelihood", box_sigma = 4.0, box_sigma_of_size = 0.06 }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Likelihood {
    /// Standard deviation of a box's sides, in pixels.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub box_sigma: f64,
    /// The same as a part of its width and height; the two add up as squares.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub box_sigma_of_size: f64,
    /// How many times as far off a box may be as one of many that are averaged: a detector's errors last for many frames.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub lasting: f64,
    /// How far away a new object is believed to be, in metres, until there are others to go by.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub depth: f64,
    /// Standard deviation of the logarithm of that.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub depth_spread: f64,
    /// How far the camera drifts in a second, as standard deviations of a random walk: radians.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub drift_rad: f64,
    /// The same in metres.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub drift_m: f64,
    /// The share of boxes that have a class which is not their object's.
    #[serde(deserialize_with = "within::<0, 1, _>")]
    #[schemars(range(min = 0, max = 1))]
    pub class_error: f64,
    /// New objects in a frame, on average.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub new_objects: f64,
    /// Boxes in a frame with this intersection over union show one object.
    #[serde(deserialize_with = "within::<0, 1, _>")]
    #[schemars(range(min = 0, max = 1))]
    pub twin_iou: f64,
    /// Two objects are one where its boxes' sides are off by this many standard deviations at most, as a root of the mean square.
    #[serde(deserialize_with = "positive")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub merge_error: f64,
}

impl Default for Likelihood {
    fn default() -> Self {
        Self {
            box_sigma: 4.0,
            box_sigma_of_size: 0.06,
            lasting: 2.5,
            depth: 1.5,
            depth_spread: 0.6,
            drift_rad: 0.016,
            drift_m: 0.016,
            class_error: 0.1,
            new_objects: 0.05,
            twin_iou: 0.7,
            merge_error: 1.2,
        }
    }
}

#[typetag::serialize(name = "likelihood")]
impl Association for Likelihood {
    fn begin(&self, camera: Camera, aliases: &Aliases) -> Box<dyn Associator> {
        let (settings, aliases) = (self.clone(), aliases.clone());
        Box::new(Tracker { settings, camera, aliases, tracks: vec![], next: 1 })
    }
}
register!(dyn Association, "likelihood", Likelihood);

impl Likelihood {
    fn noise(&self) -> BoxNoise {
        BoxNoise { px: self.box_sigma, of_size: self.box_sigma_of_size }
    }

    /// The likelihood of a class for an object that has this share of it.
    fn likelihood(&self, share: f64) -> f64 {
        (1.0 - self.class_error) * share + self.class_error / CLASSES
    }

    /// What a box costs that shows a new object: it is anywhere in the image, of any size and class.
    fn cost_of_new(&self, camera: &Camera) -> f64 {
        let area = camera.size().product();
        -2.0 * (self.new_objects / (area * area / 4.0) / CLASSES).ln()
    }
}

/// Classes that a box may have by mistake: it makes next to no difference.
const CLASSES: f64 = 20.0;
/// Boxes of a frame that are looked at, those of the highest scores: a detector that draws more has gone mad.
const BOXES: usize = 200;
/// An object of fewer boxes is forgotten when it was not seen for a while.
const FIRM: usize = 3;
/// That while, in seconds.
const PATIENCE: f64 = 10.0;
/// So many such objects are kept at most.
const WAITING: usize = 500;
/// Objects whose depth is known to this part tell how far away things are.
const KNOWN_DEPTH: f64 = 0.15;

/// All objects.
#[derive(Debug)]
struct Tracker {
    settings: Likelihood,
    camera: Camera,
    aliases: Aliases,
    tracks: Vec<Track>,
    next: u32,
}

impl Associator for Tracker {
    fn associate(&self, image: &Image<'_>, map: &dyn Map) -> Vec<Option<ObjectId>> {
        let mut names = self.put(image, &[], map);
        let mut next = (self.next..).map(ObjectId);
        for i in best_scores(image.detections) {
            if names[i].is_none() {
                // new ones have twins as well
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
        let again = self.put(image, names, map);
        again.into_iter().zip(names).map(|(again, before)| again.or(*before)).collect()
    }

    fn learn(&mut self, image: &Image<'_>, names: &[Option<ObjectId>], map: &dyn Map) -> Learned {
        let Some(pose) = map.pose(image.frame) else { return Learned::default() };
        let usual = self.usual_depth(&pose);
        let mut seen = vec![];
        for (detection, id) in image.detections.iter().zip(names) {
            let Some(id) = *id else { continue };
            self.next = self.next.max(id.0.saturating_add(1));
            let sighting = Sighting {
                frame: image.frame,
                world_from_camera: pose,
                bounding_box: detection.bounding_box,
            };
            let Some(t) = self.track(id, &sighting, usual) else { continue };
            self.tracks[t].vote(&detection.scores, &self.aliases);
            seen.push((t, sighting));
        }
        // of twins the one that fits best
        seen.sort_by(|(a, x), (b, y)| {
            let fits = |t: usize, sighting: &Sighting| self.tracks[t].overlap(sighting, &self.camera);
            a.cmp(b).then(fits(*b, y).total_cmp(&fits(*a, x)))
        });
        seen.dedup_by_key(|(t, _)| *t);
        let noise = self.settings.noise();
        for (t, sighting) in &seen {
            self.tracks[*t].see(*sighting, image.timestamp, map, &self.camera, &noise);
        }
        let forgotten = self.forget(image.timestamp);
        Learned { merged: self.merge(image.frame), forgotten }
    }
}

impl Tracker {
    /// The known objects of boxes, some of which had names before.
    fn put(&self, image: &Image<'_>, before: &[Option<ObjectId>], map: &dyn Map) -> Vec<Option<ObjectId>> {
        let mut names = vec![None; image.detections.len()];
        let Some(pose) = map.pose(image.frame) else { return names };
        let looked_at = best_scores(image.detections);
        let (mut gains, tracks) = self.gains(image, &looked_at, &pose);
        for (row, column, gain) in &mut gains {
            let before = before.get(looked_at[*row]).copied().flatten();
            if before == Some(self.tracks[tracks[*column]].id) {
                *gain += STAY;
            }
        }
        let matched = assignment::best(looked_at.len(), tracks.len(), &gains);
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

    /// What there is to gain by putting boxes to objects instead of new ones, as (row, column, gain), and the objects of
    /// the columns.
    fn gains(
        &self,
        image: &Image<'_>,
        boxes: &[usize],
        pose: &Se3,
    ) -> (Vec<(usize, usize, f64)>, Vec<usize>) {
        let new = self.settings.cost_of_new(&self.camera);
        let class =
            |i: &usize| image.detections[*i].scores.best().map(|(class, _)| self.aliases.canonical(class));
        let classes: Vec<Option<String>> = boxes.iter().map(class).collect();
        let (mut gains, mut tracks) = (vec![], vec![]);
        for (t, track) in self.tracks.iter().enumerate() {
            let Some(expected) = track.expect(image.timestamp, pose, &self.camera, &self.settings) else {
                continue;
            };
            let before = gains.len();
            for (row, i) in boxes.iter().enumerate() {
                let b = &image.detections[*i].bounding_box;
                if !b.intersects(&expected.bounding_box) {
                    continue;
                }
                let share = classes[row].as_deref().map_or(1.0, |class| track.share(class));
                let cost = expected.cost(b) - 2.0 * self.settings.likelihood(share).ln();
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

    /// The name of the box that is nearly the same, if there is one.
    fn twin(&self, detections: &[Detection], names: &[Option<ObjectId>], i: usize) -> Option<ObjectId> {
        let own = &detections[i].bounding_box;
        let named = detections
            .iter()
            .zip(names)
            .filter_map(|(other, name)| Some((own.iou(&other.bounding_box), (*name)?)));
        let near = named.filter(|(iou, _)| *iou >= self.settings.twin_iou);
        near.max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, name)| name)
    }

    /// The place of an object, which may begin with this sighting.
    fn track(&mut self, id: ObjectId, first: &Sighting, depth: f64) -> Option<usize> {
        let known = self.tracks.iter().position(|track| track.id == id);
        known.or_else(|| {
            let belief = Belief::new(first, &self.camera, depth, self.settings.depth_spread);
            self.tracks.push(Track::new(id, belief, first, &self.camera, &self.settings.noise())?);
            Some(self.tracks.len() - 1)
        })
    }

    /// How far away objects are from here, as far as is known: the median.
    fn usual_depth(&self, pose: &Se3) -> f64 {
        let known = self.tracks.iter().filter(|track| track.depth_spread() < KNOWN_DEPTH);
        let mut depths: Vec<f64> = known.map(|track| track.distance(pose)).collect();
        depths.sort_by(f64::total_cmp);
        if depths.len() < FIRM { self.settings.depth } else { depths[depths.len() / 2] }
    }

    /// Forgets objects that are seen too rarely, and those that are seen least lately where there are too many such.
    fn forget(&mut self, now: f64) -> Vec<ObjectId> {
        let is_firm = |track: &Track| track.boxes() >= FIRM;
        let mut seen: Vec<f64> =
            self.tracks.iter().filter(|track| !is_firm(track)).map(|track| track.seen_at).collect();
        seen.sort_by(|a, b| b.total_cmp(a));
        let since = seen.get(WAITING).copied().unwrap_or(f64::NEG_INFINITY).max(now - PATIENCE);
        let stays = |track: &mut Track| is_firm(track) || track.seen_at > since;
        self.tracks.extract_if(.., |track| !stays(track)).map(|track| track.id).collect()
    }

    /// Makes one of objects that turn out to be one: looks at those that were seen in this frame and have many more boxes than when
    /// they were looked at last.
    fn merge(&mut self, frame: usize) -> Vec<Merge> {
        let mut merges = vec![];
        let due = self.tracks.iter_mut().filter_map(|track| track.is_due(frame));
        let due: Vec<ObjectId> = due.take(LOOKS).collect();
        for id in due {
            // it may be gone by now
            let Some(own) = self.tracks.iter().position(|track| track.id == id) else { continue };
            let unions = self.neighbours(own).into_iter().filter_map(|other| {
                let (one, two) = (&self.tracks[own], &self.tracks[other]);
                Some((other, union::of(one, two, &self.camera, &self.settings)?))
            });
            let best = unions.min_by(|(_, a), (_, b)| a.error.total_cmp(&b.error));
            if let Some((other, union)) = best {
                let gone = if union.track.id == id { other } else { own };
                let stays = own + other - gone;
                merges.push(Merge { from: self.tracks[gone].id, into: union.track.id });
                self.tracks[stays] = union.track;
                self.tracks.remove(gone);
            }
        }
        merges
    }

    /// The objects that may be the same as this one, the nearest first.
    fn neighbours(&self, own: usize) -> Vec<usize> {
        let others = (0..self.tracks.len()).filter(|other| *other != own);
        let near =
            others.filter_map(|other| Some((other, union::gap(&self.tracks[own], &self.tracks[other])?)));
        let mut near: Vec<(usize, f64)> = near.collect();
        near.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        near.into_iter().take(NEIGHBOURS).map(|(other, _)| other).collect()
    }
}

/// What a box gains by the object that it had before: another has to be ten times as likely.
const STAY: f64 = 4.6;
/// Of so many objects it is asked in a frame, at most, whether they are the same as others,
const LOOKS: usize = 20;
/// of which so many are looked at, those that are nearest.
const NEIGHBOURS: usize = 8;

/// The boxes that are looked at, in order.
fn best_scores(detections: &[Detection]) -> Vec<usize> {
    let mut all: Vec<usize> = (0..detections.len()).collect();
    if all.len() > BOXES {
        let score = |i: &usize| detections[*i].scores.best().map_or(0.0, |(_, score)| score);
        all.sort_by(|a, b| score(b).total_cmp(&score(a)));
        all.truncate(BOXES);
        all.sort_unstable();
    }
    all
}
