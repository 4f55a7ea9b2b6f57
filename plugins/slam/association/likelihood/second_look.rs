//! Frames are looked at once more, by what is known a while later.
use super::super::{Associator, Image, Map, Merge, Move};
use super::track::Seen;
use super::tracker::Tracker;
use manifactor_recording::sequence::{Detection, ObjectId};

/// A frame that is to be looked at once more, and what its boxes are called.
#[derive(Debug)]
pub(super) struct Past {
    frame: usize,
    timestamp: f64,
    /// Those boxes that have a name: a detector that has gone mad draws others without end.
    detections: Vec<Detection>,
    /// Their places in the frame.
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

    /// Takes note of a merge.
    pub(super) fn rename(&mut self, Merge { from, into }: Merge) {
        self.names.iter_mut().filter(|name| **name == Some(from)).for_each(|name| *name = Some(into));
    }

    /// Takes note of a move.
    pub(super) fn put(&mut self, moved: &Move) {
        if self.frame == moved.frame
            && let Ok(i) = self.places.binary_search(&moved.place)
        {
            self.names[i] = Some(moved.into);
        }
    }
}

impl Tracker {
    /// Looks once more at frames that are old enough by now, and moves boxes that turn out to show another object.
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

    /// Moves boxes of a frame, which may change places.
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

    /// Takes a box from its object; of twins, one was taken in.
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
