//! A sequence mapped and solved.
use crate::mapping::{MappedObject, Mapping, pose_key};
use crate::sequence::{Sequence, TrueObject};
use crate::settings::Settings;
use manifactor_formats::tum::StampedPose;
use manifactor_geometry::Se3;
use manifactor_graph::Values;
use manifactor_quadric::DualQuadric;
use manifactor_solve::{CompileError, Observer, Solution, solve};
use std::sync::Arc;

/// A map and a trajectory, with all that they were made of.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// The data.
    pub sequence: Arc<Sequence>,
    /// The graph, and where the solve began.
    pub mapping: Mapping,
    /// What the solver made of it.
    pub solution: Solution,
}

/// One object of the map.
#[derive(Debug, Clone, Copy)]
pub struct Landmark<'a> {
    /// What was detected of it.
    pub object: &'a MappedObject,
    /// What it is estimated to be, in the map's frame.
    pub quadric: &'a DualQuadric,
    /// What it is, where that is known; in the frame of the ground truth.
    pub truth: Option<&'a TrueObject>,
}

impl Estimate {
    /// Solves a graph that was made of a sequence.
    ///
    /// # Errors
    /// Where graph and values do not fit each other.
    pub fn solve(
        sequence: Arc<Sequence>,
        mapping: Mapping,
        settings: &Settings,
        observer: &mut dyn Observer,
    ) -> Result<Self, CompileError> {
        let solution = solve(&mapping.graph, &mapping.values, &*settings.solver, observer)?;
        Ok(Self { sequence, mapping, solution })
    }

    /// The estimated trajectory, in the map's frame.
    pub fn trajectory(&self) -> Vec<StampedPose> {
        self.poses(&self.solution.values)
    }

    /// The trajectory by odometry alone, in the map's frame.
    pub fn odometry(&self) -> Vec<StampedPose> {
        self.poses(&self.mapping.values)
    }

    fn poses(&self, values: &Values) -> Vec<StampedPose> {
        let frames = self.sequence.frames.iter().enumerate();
        let stamped = frames.filter_map(|(i, frame)| {
            let pose = *values.get::<Se3>(pose_key(i)).ok()?;
            Some(StampedPose { timestamp: frame.timestamp, pose })
        });
        stamped.collect()
    }

    /// The objects as they are estimated.
    pub fn landmarks(&self) -> Vec<Landmark<'_>> {
        self.landmarks_in(&self.solution.values)
    }

    /// The objects as they began.
    pub fn initial_landmarks(&self) -> Vec<Landmark<'_>> {
        self.landmarks_in(&self.mapping.values)
    }

    fn landmarks_in<'a>(&'a self, values: &'a Values) -> Vec<Landmark<'a>> {
        let truths = self.sequence.ground_truth.as_ref().map_or(&[][..], |truth| &truth.objects);
        let landmark = |object: &'a MappedObject| {
            let truth = truths.iter().find(|truth| truth.id == object.id);
            Some(Landmark { object, quadric: values.get(&object.key).ok()?, truth })
        };
        self.mapping.mapped().filter_map(landmark).collect()
    }
}
