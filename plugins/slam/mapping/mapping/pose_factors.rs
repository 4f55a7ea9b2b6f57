//! Factors on poses that arrived with frames.
use manifactor_graph::{Direction, FactorEntry, GraphError, Values};
use manifactor_recording::pose_graph::PoseFactor;
use manifactor_recording::sequence::{Frame, Sequence, UnusedInput};
use std::collections::HashMap;

/// Returns the factors between these variables, and those that do not fit, such as one that names a later frame. Of the
/// factors with one id, the last that fits counts.
pub(super) fn entries(
    sequence: &Sequence,
    values: &Values,
    up: Option<Direction>,
) -> (Vec<FactorEntry>, Vec<UnusedInput>) {
    let (mut entries, mut unused) = (vec![], vec![]);
    let mut places: HashMap<&str, usize> = HashMap::new();
    for (arrived, factor) in &sequence.pose_factors {
        let frames = sequence.frames.get(..=*arrived).unwrap_or(&sequence.frames);
        match entry(factor, frames, values, up) {
            Ok(entry) => {
                let next = entries.len();
                let place = factor.id.as_deref().map_or(next, |id| *places.entry(id).or_insert(next));
                match entries.get_mut(place) {
                    Some(replaced) => *replaced = entry,
                    None => entries.push(entry),
                }
            }
            Err(fault) => {
                let timestamp = sequence.frames.get(*arrived).map_or(f64::NAN, |frame| frame.timestamp);
                let field = format!("`{}`", factor.label());
                unused.push(UnusedInput::PoseGraph { timestamp, field, fault });
            }
        }
    }
    (entries, unused)
}

fn entry(
    factor: &PoseFactor,
    frames: &[Frame],
    values: &Values,
    up: Option<Direction>,
) -> Result<FactorEntry, String> {
    let find = |key: &str| {
        let (place, value) = values.find(key)?;
        Some((place, value.erased().type_id()))
    };
    let entry = factor.entry(frames, up).map_err(|error| error.to_string())?;
    let mut errors = vec![];
    match entry.resolve(0, find, &mut errors) {
        Some(_) => Ok(entry),
        None => Err(errors.first().map_or(String::new(), GraphError::to_string)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor_geometry::{Between, Se3};
    use manifactor_graph::Noise;
    use manifactor_quadric::Camera;
    use manifactor_recording::keys::pose_key;
    use manifactor_recording::pose_graph::{PoseFactorKey, PoseGraphChanges};
    use manifactor_recording::sequence::{Observation, SequenceHeader};
    use std::sync::Arc;

    /// Returns five frames, and the names and keys of the factors, each given with the frame it arrives with.
    fn names(changes: [PoseGraphChanges; 5]) -> (Vec<String>, Vec<String>) {
        let camera = Camera::new([500.0, 500.0, 320.0, 240.0], 640, 480).unwrap();
        let (mut sequence, mut values) = (SequenceHeader::new(camera).into_sequence(), Values::new());
        for (i, pose_graph) in changes.into_iter().enumerate() {
            let frame = Frame::new(i as f64, Se3::identity());
            sequence.push(Observation { pose_graph, ..Observation::new(frame) });
            values.insert(pose_key(i), Se3::identity());
        }
        let (entries, unused) = entries(&sequence, &values, None);
        let name = |entry: &FactorEntry| format!("{} {}", entry.name.clone().unwrap(), entry.keys[0].clone());
        let fault = |unused: &UnusedInput| format!("{unused:?}");
        (entries.iter().map(name).collect(), unused.iter().map(fault).collect())
    }

    fn closure(id: &str, from: f64, to: f64) -> PoseGraphChanges {
        let factor = PoseFactor {
            id: Some(id.into()),
            keys: [from, to].map(PoseFactorKey::Timestamp).into(),
            factor: Arc::new(Between { relative: Se3::identity() }),
            noise: Noise::default(),
            loss: None,
        };
        PoseGraphChanges { factors: vec![factor], ..Default::default() }
    }

    fn nothing() -> PoseGraphChanges {
        PoseGraphChanges::default()
    }

    #[test]
    fn a_replacement_that_does_not_fit_leaves_the_earlier_factor() {
        let (used, unused) =
            names([nothing(), closure("loop", 0.0, 1.0), closure("loop", 0.5, 2.0), nothing(), nothing()]);
        assert_eq!(used, ["loop x0"]);
        assert!(unused.len() == 1 && unused[0].contains("no frame at 0.5 s"), "{unused:?}");
        let (used, unused) =
            names([nothing(), closure("loop", 0.0, 1.0), closure("loop", 1.0, 2.0), nothing(), nothing()]);
        assert_eq!((used, unused.len()), (vec!["loop x1".into()], 0));
    }

    #[test]
    fn a_factor_with_a_later_frame_is_left_out_as_in_a_stream() {
        let (used, unused) =
            names([nothing(), closure("early", 1.0, 3.0), closure("now", 1.0, 2.0), nothing(), nothing()]);
        assert_eq!(used, ["now x1"]);
        assert!(unused.len() == 1 && unused[0].contains("no frame at 3 s"), "{unused:?}");
    }

    #[test]
    fn a_removed_factor_leaves_none_of_its_versions() {
        let removed = PoseGraphChanges { removed: vec!["loop".into()], ..Default::default() };
        let (used, unused) =
            names([nothing(), closure("loop", 0.0, 1.0), closure("loop", 1.0, 2.0), removed, nothing()]);
        assert_eq!((used.len(), unused.len()), (0, 0));
    }
}
