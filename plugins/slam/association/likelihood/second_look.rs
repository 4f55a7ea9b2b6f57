//! Second look: frames are assigned once more with later knowledge.
use super::super::{Associator, Image, Map, Merge, Move};
use super::track::Seen;
use super::tracker::Tracker;
use manifactor_recording::sequence::{Detection, ObjectId};

/// A frame that waits for its second look, with the current objects of its detections.
#[derive(Debug)]
pub(super) struct Past {
    frame: usize,
    timestamp: f64,
    /// Only the detections with an object. This bounds the memory if a detector floods the frame.
    detections: Vec<Detection>,
    /// Their indices in the frame.
    places: Vec<usize>,
    names: Vec<Option<ObjectId>>,
}

impl Past {
    pub(super) fn new(image: &Image<'_>, names: &[Option<ObjectId>]) -> Self {
        let Image { frame, timestamp, detections } = *image;
        let places: Vec<usize> = (0..names.len()).filter(|place| names[*place].is_some()).collect();
        let detections = places.iter().map(|place| detections[*place].clone()).collect();
        let names = places.iter().map(|place| names[*place]).collect();
        Self { frame, timestamp, detections, places, names }
    }

    fn image(&self) -> Image<'_> {
        Image { frame: self.frame, timestamp: self.timestamp, detections: &self.detections }
    }

    /// Applies a merge.
    pub(super) fn rename(&mut self, Merge { from, into }: Merge) {
        self.names.iter_mut().filter(|name| **name == Some(from)).for_each(|name| *name = Some(into));
    }

    /// Applies a move.
    pub(super) fn put(&mut self, moved: &Move) {
        if self.frame == moved.frame
            && let Ok(i) = self.places.binary_search(&moved.place)
        {
            self.names[i] = Some(moved.into);
        }
    }
}

impl Tracker {
    /// Takes a second look at all frames that are old enough, and moves boxes that show a different object.
    pub(super) fn look_again(&mut self, now: f64, map: &dyn Map) -> Vec<Move> {
        let (mut all, until) = (vec![], now - *self.settings.second_look_s);
        while let Some(past) = self.past.pop_front_if(|past| past.timestamp <= until) {
            let again = self.reconsider(&past.image(), &past.names, map);
            let Past { frame, detections, places, names, .. } = past;
            let before = all.len();
            for (((detection, place), from), into) in detections.into_iter().zip(places).zip(names).zip(again)
            {
                let (Some(from), Some(into)) = (from, into) else { continue };
                if from != into {
                    let detection = Detection { frame, object: Some(into), ..detection };
                    all.push(Move { frame, place, from, into, detection });
                }
            }
            self.move_boxes(&all[before..]);
        }
        all
    }

    /// Moves boxes of a frame. All are removed first, since two of them may swap objects.
    fn move_boxes(&mut self, all: &[Move]) {
        let taken: Vec<Option<Seen>> = all.iter().map(|moved| self.take_box(moved)).collect();
        for (moved, taken) in all.iter().zip(taken) {
            let Some(track) = self.tracks.iter_mut().find(|track| track.id == moved.into) else { continue };
            track.vote(&moved.detection.scores, &self.aliases, 1.0);
            let place = track.boxes.binary_search_by_key(&moved.frame, Seen::frame);
            if let (Some(seen), Err(place)) = (taken, place) {
                track.boxes.insert(place, seen);
            }
        }
        let left = |id: ObjectId| all.iter().any(|moved| moved.from == id);
        self.tracks.retain(|track| !(left(track.id) && track.boxes.is_empty() && !track.is_known()));
    }

    /// Removes a box from its object. Returns `None` if the object did not keep the box, because it has a
    /// twin in the frame.
    fn take_box(&mut self, moved: &Move) -> Option<Seen> {
        let track = self.tracks.iter_mut().find(|track| track.id == moved.from)?;
        track.vote(&moved.detection.scores, &self.aliases, -1.0);
        let is_it = |seen: &Seen| seen.frame() == moved.frame && seen.place == moved.place;
        let place = track.boxes.iter().position(is_it)?;
        let seen = track.boxes.remove(place);
        track.sightings.remove(moved.frame);
        track.fit_again(&self.camera, &self.settings.noise());
        Some(seen)
    }
}
