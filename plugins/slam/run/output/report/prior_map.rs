//! How a run went in a map that was made before.
use manifactor_mapping::estimate::Estimate;
use manifactor_mapping::mapping::measurements::Measured;
use manifactor_mapping::settings::Settings;
use manifactor_online::Located;
use manifactor_recording::sequence::ObjectId;
use serde::Serialize;
use std::path::PathBuf;

/// A run that began with a map.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PriorMapReport {
    /// Its file.
    pub file: PathBuf,
    /// Whether it is known where the run is in it; where it is not, the run has made a map of its own.
    pub is_located: bool,
    /// How that was found, where the start was unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub found: Option<Found>,
    /// Objects in it.
    pub objects: usize,
    /// Those that were seen again.
    pub seen: Vec<ObjectId>,
    /// Those that should have been seen, or seen again, and were not.
    pub gone: Vec<ObjectId>,
    /// Objects that are new.
    pub added: Vec<ObjectId>,
}

/// A start that was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Found {
    /// The frame after which it was, from 0.
    pub frame: usize,
    /// Where the run began, and by what that was found.
    #[serde(flatten)]
    pub located: Located,
}

impl PriorMapReport {
    /// The report, where these objects are `gone`; none, where there was no map before.
    pub(crate) fn new(
        estimate: &Estimate,
        settings: &Settings,
        found: Option<Found>,
        gone: &[ObjectId],
    ) -> Option<Self> {
        let prior = settings.prior_map.as_ref()?;
        let is_located = prior.start.is_some() || found.is_some();
        let all = &estimate.mapping.measurements.objects;
        let ids = |which: &dyn Fn(&Measured) -> bool| all.iter().filter(|m| which(m)).map(|m| m.id).collect();
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
