//! The path of the camera so far, limited to the resolution of a screen.
use manifactor_geometry::Se3;
use manifactor_slam::record::FrameRecord;

/// Largest number of frames that are kept, besides the last one.
const MOST: usize = 1000;

/// A path that keeps every frame at first, then every second, fourth, … as it grows.
#[derive(Debug, Clone)]
pub(super) struct Path {
    every: usize,
    /// Frames 0, `every`, 2 `every`, …
    kept: Vec<FrameRecord>,
    /// The last frame, with its number.
    last: Option<(usize, FrameRecord)>,
    frames: usize,
}

impl Default for Path {
    fn default() -> Self {
        Self { every: 1, kept: vec![], last: None, frames: 0 }
    }
}

impl Path {
    /// Adds the next frame.
    pub(super) fn push(&mut self, frame: FrameRecord) {
        if self.frames.is_multiple_of(self.every) {
            if self.kept.len() == MOST {
                let mut place = 0;
                self.kept.retain(|_| {
                    place += 1;
                    place % 2 == 1
                });
                self.every *= 2;
            }
            self.kept.push(frame.clone());
        }
        self.last = Some((self.frames, frame));
        self.frames += 1;
    }

    /// Sets the poses to their current estimates, by frame number.
    pub(super) fn correct(&mut self, pose: impl Fn(usize) -> Option<Se3>) {
        let kept = self.kept.iter_mut().enumerate().map(|(place, frame)| (place * self.every, frame));
        let last = self.last.iter_mut().map(|(number, frame)| (*number, frame));
        for (number, frame) in kept.chain(last) {
            frame.estimate.pose = pose(number).unwrap_or(frame.estimate.pose);
        }
    }

    /// Moves the path of odometry rigidly, so that it begins at this pose.
    pub(super) fn begin_odometry_at(&mut self, start: &Se3) {
        let Some(first) = self.kept.first() else { return };
        let moved = start.compose(&first.odometry.pose.inverse());
        for frame in self.kept.iter_mut().chain(self.last.iter_mut().map(|(_, frame)| frame)) {
            frame.odometry.pose = moved.compose(&frame.odometry.pose);
        }
    }

    /// Returns the kept frames, then the last one.
    pub(super) fn frames(&self) -> impl Iterator<Item = &FrameRecord> {
        let last = self.last.iter().filter(|(number, _)| !number.is_multiple_of(self.every));
        self.kept.iter().chain(last.map(|(_, frame)| frame))
    }

    pub(super) fn every(&self) -> usize {
        self.every
    }

    pub(super) fn first(&self) -> Option<&Se3> {
        self.kept.first().map(|first| &first.estimate.pose)
    }

    /// Timestamp of the first frame.
    pub(super) fn start(&self) -> f64 {
        self.kept.first().map_or(0.0, |first| first.timestamp)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_slam::record::PoseRecord;

    fn path(frames: usize) -> Path {
        let mut path = Path::default();
        for i in 0..frames {
            let tracked = PoseRecord { pose: Se3::identity(), error: None, relative: None };
            let (odometry, estimate) = (tracked.clone(), tracked);
            path.push(FrameRecord { timestamp: i as f64, truth: None, odometry, estimate, boxes: vec![] });
        }
        path
    }

    #[test]
    fn a_long_path_has_its_ends_and_every_nth_frame() {
        for frames in [1, 2, 999, 1000, 1001, 2000, 2001, 12_345] {
            let path = path(frames);
            let times: Vec<usize> = path.frames().map(|frame| frame.timestamp as usize).collect();
            let mut expected: Vec<usize> = (0..frames).step_by(path.every()).collect();
            if (frames - 1) % path.every() != 0 {
                expected.push(frames - 1);
            }
            assert_eq!(times, expected);
            assert!(times.len() <= MOST + 1);
        }
    }

    #[test]
    fn odometry_moves_as_a_whole() {
        let at = |x: f64, turn: f64| {
            let turn = nalgebra::Vector3::new(0.0, 0.0, turn);
            Se3::new(manifactor_geometry::So3::exp(&turn), nalgebra::Vector3::new(x, 0.0, 0.0))
        };
        let mut path = path(3);
        path.begin_odometry_at(&at(1.0, 0.5));
        path.kept[2].odometry.pose = at(1.0, 0.5).compose(&at(2.0, 0.1));
        path.begin_odometry_at(&at(-3.0, 0.7));
        let between = path.kept[0].odometry.pose.between(&path.kept[2].odometry.pose);
        let error = [at(-3.0, 0.7).between(&path.kept[0].odometry.pose), at(2.0, 0.1).between(&between)];
        assert!(error.iter().all(|error| error.log().norm() < 1e-12), "{error:?}");
        assert_eq!(path.kept[1].estimate.pose, Se3::identity());
    }

    #[test]
    fn poses_are_corrected_by_the_numbers_of_their_frames() {
        let mut path = path(2500);
        path.correct(|frame| {
            let translation = nalgebra::Vector3::new(frame as f64, 0.0, 0.0);
            Some(Se3 { translation, ..Se3::identity() })
        });
        assert!(path.frames().all(|frame| frame.estimate.pose.translation.x == frame.timestamp));
    }
}
