//! Report of a run with a prior map.
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::measurements::ObjectMeasurements;
use manifactor_mapping::settings::RunSettings;
use manifactor_online::Relocalization;
use manifactor_recording::sequence::ObjectId;
use serde::Serialize;
use std::path::PathBuf;

/// A run that began with a prior map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PriorMapReport {
    /// File of the map.
    pub file: PathBuf,
    /// True if the start in the map is known. Otherwise the run has made a new map.
    pub is_located: bool,
    /// Result of the relocalization, if the start was unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found: Option<FoundStart>,
    /// Number of objects in the map.
    pub objects: usize,
    /// Objects of the map that were detected again.
    pub seen: Vec<ObjectId>,
    /// Objects of the map that should have been detected, or detected again, but were not.
    pub gone: Vec<ObjectId>,
    /// New objects.
    pub added: Vec<ObjectId>,
}

/// A start that relocalization found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundStart {
    /// The frame after which it was found, from 0.
    pub frame: usize,
    /// Pose at the start of the run, and the evidence for it.
    #[serde(flatten)]
    pub located: Relocalization,
}

impl PriorMapReport {
    /// Creates the report, with the objects that are `gone`; `None` without a prior map.
    pub(crate) fn new(
        estimate: &Estimate,
        settings: &RunSettings,
        found: Option<FoundStart>,
        gone: &[ObjectId],
    ) -> Option<Self> {
        let prior = settings.prior_map.as_ref()?;
        let is_located = prior.start.is_some() || found.is_some();
        let all = &estimate.mapping.measurements.objects;
        let ids = |which: &dyn Fn(&ObjectMeasurements) -> bool| {
            all.iter().filter(|m| which(m)).map(|m| m.id).collect()
        };
        let mapped: Vec<ObjectId> = estimate.mapping.mapped().map(|object| object.id).collect();
        Some(Self {
            file: prior.file.clone(),
            is_located,
            found,
            objects: prior.map.objects.len(),
            seen: ids(&|measured| measured.prior.is_some() && !measured.views.is_empty()),
            gone: ids(&|measured| measured.prior.is_some() && gone.contains(&measured.id)),
            added: ids(&|measured| is_located && measured.prior.is_none() && mapped.contains(&measured.id)),
        })
    }
}
