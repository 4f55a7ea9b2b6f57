//! Reassociation: the detections of a frame are assigned a second time, with later knowledge.
use super::super::{Associator, DetectionMove, FrameDetections, MapEstimate, ObjectMerge};
use super::track::TrackBox;
use super::tracker::Tracker;
use manifactor_recording::sequence::{Detection, ObjectId};

/// A frame that waits for its reassociation, with the current objects of its detections.
#[derive(Debug)]
pub(super) struct PendingFrame {
    frame: usize,
    timestamp: f64,
    /// Only the detections with an object. This bounds the memory if a detector floods the frame.
    detections: Vec<Detection>,
    /// Their indices in the frame.
    indices: Vec<usize>,
    names: Vec<Option<ObjectId>>,
}

impl PendingFrame {
    pub(super) fn new(image: &FrameDetections<'_>, names: &[Option<ObjectId>]) -> Self {
        let FrameDetections { frame, timestamp, detections } = *image;
        let places: Vec<usize> = (0..names.len()).filter(|place| names[*place].is_some()).collect();
        let detections = places.iter().map(|place| detections[*place].clone()).collect();
        let names = places.iter().map(|place| names[*place]).collect();
        Self { frame, timestamp, detections, indices: places, names }
    }

    fn frame_detections(&self) -> FrameDetections<'_> {
        FrameDetections { frame: self.frame, timestamp: self.timestamp, detections: &self.detections }
    }

    /// Applies a merge.
    pub(super) fn apply_merge(&mut self, ObjectMerge { from, into }: ObjectMerge) {
        self.names.iter_mut().filter(|name| **name == Some(from)).for_each(|name| *name = Some(into));
    }
}

impl Tracker {
    /// Reassociates the detections of all frames that are old enough, and moves boxes that show a different object.
    pub(super) fn reassociate_old_frames(&mut self, now: f64, map: &dyn MapEstimate) -> Vec<DetectionMove> {
        let (mut all, until) = (vec![], now - *self.settings.second_look_s);
        while let Some(past) = self.pending_frames.pop_front_if(|past| past.timestamp <= until) {
            let again = self.reassociate(&past.frame_detections(), &past.names, map);
            let PendingFrame { frame, detections, indices: places, names, .. } = past;
            let before = all.len();
            for (((detection, place), from), into) in detections.into_iter().zip(places).zip(names).zip(again)
            {
                let (Some(from), Some(into)) = (from, into) else { continue };
                if from != into {
                    let detection = Detection { frame, object: Some(into), ..detection };
                    all.push(DetectionMove { frame, index: place, from, into, detection });
                }
            }
            self.move_boxes(&all[before..]);
        }
        all
    }

    /// Moves boxes of a frame. All are removed first, since two of them may swap objects.
    fn move_boxes(&mut self, all: &[DetectionMove]) {
        let taken: Vec<Option<TrackBox>> = all.iter().map(|moved| self.remove_box(moved)).collect();
        for (moved, taken) in all.iter().zip(taken) {
            let Some(track) = self.tracks.iter_mut().find(|track| track.id == moved.into) else { continue };
            track.add_class_vote(&moved.detection.scores, &self.aliases, 1.0);
            let image = (moved.frame, moved.detection.camera.index);
            let place = track.boxes.binary_search_by_key(&image, TrackBox::image);
            if let (Some(seen), Err(place)) = (taken, place) {
                track.boxes.insert(place, seen);
            }
        }
        let left = |id: ObjectId| all.iter().any(|moved| moved.from == id);
        self.tracks.retain(|track| !(left(track.id) && track.boxes.is_empty() && !track.is_known()));
    }

    /// Removes a box from its object. Returns `None` if the object did not keep the box, because it has a
    /// twin in the frame.
    fn remove_box(&mut self, moved: &DetectionMove) -> Option<TrackBox> {
        let track = self.tracks.iter_mut().find(|track| track.id == moved.from)?;
        track.add_class_vote(&moved.detection.scores, &self.aliases, -1.0);
        let is_it = |seen: &TrackBox| seen.frame() == moved.frame && seen.index == moved.index;
        let place = track.boxes.iter().position(is_it)?;
        let seen = track.boxes.remove(place);
        track.detections.remove(seen.image());
        track.refit(&self.settings.noise());
        Some(seen)
    }
}
