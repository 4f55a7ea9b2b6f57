use super::Holdout;
use manifactor_graph::checked::NotNegative;
use manifactor_metrics::Alignment;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::num::NonZeroUsize;

/// `[evaluation]`: compares the trajectory with ground truth, and the map with boxes that the estimate did
/// not use.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct EvaluationSettings {
    /// Alignments of the estimate to the ground truth. All of them are reported; tables use the first.
    pub alignments: Vec<Alignment>,
    /// Largest time difference between a pose and its ground truth. Unit: seconds.
    pub max_time_difference: NotNegative,
    /// Number of frames that relative errors span.
    pub relative_over: NonZeroUsize,
    /// Boxes that `manifactor run` withholds from the estimate and then predicts: `{ share = 0.2 }` of all
    /// boxes at random, all boxes of an object except its `{ first = 0.05 }`, all boxes of the
    /// `{ last = 0.2 }` of the frames at the end, or the last `{ block = 30 }` frames of every 150. Default:
    /// none.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub holdout: Option<Holdout>,
}

impl Default for EvaluationSettings {
    fn default() -> Self {
        Self {
            alignments: vec![Alignment::Se3],
            max_time_difference: NotNegative::literal(0.02),
            relative_over: NonZeroUsize::MIN,
            holdout: None,
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::settings::run_document::RunDocument;
    use manifactor_config::{Document, Format};

    /// Returns the errors of a run with this line.
    fn refused(line: &str) -> String {
        let source = if line.starts_with("source") { "" } else { "source = { type = 'simulated' }" };
        let document = Document::parse("run.toml", format!("{source}\n{line}\n"), Format::Toml).unwrap();
        RunDocument::read(&document).err().map_or_else(String::new, |e| e.to_string())
    }

    #[test]
    fn numbers_that_make_no_sense_are_refused_at_their_place() {
        let not_negative = "expected a finite number, 0 or more, got -1";
        let count = "expected a whole number, 1 or more, found the number 0";
        for (table, field, expected) in [
            ("evaluation = {", "max_time_difference = -1", not_negative),
            ("evaluation = {", "relative_over = 0", count),
            ("evaluation = { holdout = {", "block = 0 }", count),
            ("variance_components = {", "tolerance = -1", not_negative),
            ("variance_components = {", "rounds = 0", count),
            ("gravity = { type = 'accelerometer',", "window = -1", not_negative),
            ("gravity = { type = 'ground_truth',", "max_time_difference = -1", not_negative),
            (
                "source = { type = 'tum', sequence = 'a', odometry = 'b',",
                "max_time_difference = -1",
                not_negative,
            ),
            (
                "source = { type = 'recorded', folder = 'a', camera = 'freiburg1',",
                "max_time_difference = -1",
                not_negative,
            ),
            ("objects = { initialiser = { type = 'rays',", "min_parallax = -1 }", not_negative),
        ] {
            let told = refused(&format!("{table} {field} }}"));
            let column = table.chars().count() + 2 + field.find('=').unwrap() + 2;
            assert_eq!(told, format!("run.toml:2:{column}: {expected}"), "{table} {field}");
        }
    }

    #[test]
    fn zero_seconds_are_the_same_time() {
        assert_eq!(refused("evaluation = { max_time_difference = 0.0 }"), "");
    }
}
