//! Bounding boxes from a detector: CSV with a header, one box per row.
//!
//! Columns in any order: `timestamp` (s), `class_name`, `score` (0 to 1), `xmin`, `ymin`, `xmax`, `ymax`
//! (px). Optional columns: `frame_idx`, `frame_idx_as_published`, `object_key` (0 if the box is associated
//! with no object), `class_id`, `scores` (all classes with a score, as `cup:0.7;bowl:0.2`), and `depth`
//! (depth of the object's centre along the optical axis, in m). A box without a class has an empty name and
//! the score 0.
use crate::error::{FormatError, Mistake, ProblemList, io_error};
use crate::text::read_text;
use crate::whole::write_whole;
use csv::{ReaderBuilder, StringRecord, Trim, Writer};
use serde::{Deserialize, Serialize};
use std::path::Path;

mod coco;
mod format;
mod frames;
mod kitti;
mod mot;
mod yolo;

pub use format::DetectionFormat;
pub use frames::FrameTimes;

/// A row: one bounding box in one image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DetectionRow {
    /// Index of the image, from 0.
    #[serde(default)]
    pub frame_idx: Option<u64>,
    /// Timestamp of the image, in seconds.
    pub timestamp: f64,
    /// Index of the image in the published detections.
    #[serde(default)]
    pub frame_idx_as_published: Option<u64>,
    /// Key of the associated object; 0 for none.
    #[serde(default)]
    pub object_key: Option<u32>,
    /// Index of the class in the detector's list.
    #[serde(default)]
    pub class_id: Option<u32>,
    /// Class with the highest score; empty for a box without a class.
    pub class_name: String,
    /// Score of the class, from 0 to 1.
    pub score: f64,
    /// Left side, in pixels.
    pub xmin: f64,
    /// Upper side, in pixels.
    pub ymin: f64,
    /// Right side, in pixels.
    pub xmax: f64,
    /// Lower side, in pixels.
    pub ymax: f64,
    /// Scores by class, if more than the best are known: `cup:0.7;bowl:0.2`.
    #[serde(default)]
    pub scores: Option<String>,
    /// Measured depth of the object's centre along the optical axis, in metres.
    #[serde(default)]
    pub depth: Option<f64>,
}

const REQUIRED: [&str; 7] = ["timestamp", "class_name", "score", "xmin", "ymin", "xmax", "ymax"];
const OPTIONAL: [&str; 6] =
    ["frame_idx", "frame_idx_as_published", "object_key", "class_id", "scores", "depth"];

impl DetectionRow {
    /// Creates a row with only the required columns.
    pub fn of_box(timestamp: f64, class: &str, score: f64, [xmin, ymin, xmax, ymax]: [f64; 4]) -> Self {
        Self {
            frame_idx: None,
            timestamp,
            frame_idx_as_published: None,
            object_key: None,
            class_id: None,
            class_name: class.to_owned(),
            score,
            xmin,
            ymin,
            xmax,
            ymax,
            scores: None,
            depth: None,
        }
    }

    /// Returns the classes with their scores: all of `scores`, otherwise the best alone. Empty for a box
    /// without a class.
    ///
    /// # Errors
    /// If `scores` is malformed.
    pub fn class_scores(&self) -> Result<Vec<(String, f64)>, Mistake> {
        let Some(scores) = self.scores.as_deref().filter(|s| !s.is_empty()) else {
            let named = Some(&self.class_name).filter(|name| !name.is_empty());
            return Ok(named.map(|name| (name.clone(), self.score)).into_iter().collect());
        };
        let one = |text: &str| {
            let (class, score) = text.rsplit_once(':')?;
            let score: f64 = score.parse().ok()?;
            (0.0..=1.0).contains(&score).then(|| (class.to_owned(), score))
        };
        let wrong = |text: &str| Mistake::Field {
            expected: "`class:score` with a score from 0 to 1, between semicolons",
            found: text.to_owned(),
        };
        scores.split(';').map(|text| one(text).ok_or_else(|| wrong(text))).collect()
    }

    fn check(self) -> Result<Self, Mistake> {
        let row = |text: String| Err(Mistake::Row(text));
        if !self.timestamp.is_finite() {
            return row(format!("expected a finite time stamp, got {}", self.timestamp));
        }
        if self.class_name.is_empty() && self.score != 0.0 {
            return row(format!(
                "the class has no name, and the score {}: expected a name, or the score 0",
                self.score
            ));
        }
        if !(0.0..=1.0).contains(&self.score) {
            return row(format!("expected a score from 0 to 1, got {}", self.score));
        }
        let sides = [self.xmin, self.ymin, self.xmax, self.ymax];
        let ordered = self.xmin <= self.xmax && self.ymin <= self.ymax;
        if !(ordered && sides.iter().all(|s| s.is_finite())) {
            return row(format!("expected a box with xmin ≤ xmax and ymin ≤ ymax, got {sides:?}"));
        }
        if let Some(depth) = self.depth.filter(|depth| !(*depth > 0.0 && depth.is_finite())) {
            return row(format!("expected a depth above 0 m, or none, got {depth}"));
        }
        self.class_scores().map(|_| self)
    }
}

/// Reads a file of detections, in file order.
///
/// # Errors
/// If a row is malformed or a column is missing; the error lists all such rows.
pub fn read(path: impl AsRef<Path>) -> Result<Vec<DetectionRow>, FormatError> {
    let path = path.as_ref();
    parse(&read_text(path)?, path)
}

/// Works like [`read`], for a given text; `path` is used only in errors.
///
/// # Errors
/// As [`read`].
pub fn parse(text: &str, path: impl AsRef<Path>) -> Result<Vec<DetectionRow>, FormatError> {
    let mut problems = ProblemList::of(path.as_ref(), text);
    let mut reader = ReaderBuilder::new().trim(Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers().cloned().unwrap_or_default();
    let mistakes = header_mistakes(&header);
    if !mistakes.is_empty() {
        let line = header.position().map_or(1, |p| p.line() as usize);
        for mistake in mistakes {
            problems.push(line, Mistake::Row(mistake));
        }
        return problems.finish().map(|()| vec![]);
    }
    let mut rows = vec![];
    for record in reader.records() {
        match record {
            Ok(record) => {
                let line = record.position().map_or(0, |p| line(text, p));
                rows.extend(problems.ok(line, row(&record, &header)));
            }
            Err(e) => {
                let line = e.position().map_or(0, |p| line(text, p));
                problems.push(line, Mistake::Row(reason(&e, &header)));
            }
        }
    }
    problems.finish().map(|()| rows)
}

/// Other names of required columns, in common exports of detectors.
const OTHER_NAMES: &[(&str, &[&str])] = &[
    ("timestamp", &["time", "stamp", "t"]),
    ("class_name", &["class", "label", "name", "category"]),
    ("score", &["confidence", "conf", "probability"]),
    ("xmin", &["x1", "left"]),
    ("ymin", &["y1", "top"]),
    ("xmax", &["x2", "right"]),
    ("ymax", &["y2", "bottom"]),
];

/// Names of the columns in which trackers write their ids.
const TRACK_IDS: [&str; 6] = ["track_id", "trackid", "tracker_id", "track", "object_id", "id"];

/// Describes the missing and the unknown columns of a header.
fn header_mistakes(header: &StringRecord) -> Vec<String> {
    let missing: Vec<_> = REQUIRED.into_iter().filter(|name| header.iter().all(|h| h != *name)).collect();
    if !missing.is_empty() {
        return vec![missing_columns(&missing, header)];
    }
    let is_known = |name: &str| REQUIRED.contains(&name) || OPTIONAL.contains(&name);
    header.iter().filter(|name| !is_known(name)).map(unknown_column).collect()
}

fn unknown_column(name: &str) -> String {
    let remedy = if TRACK_IDS.contains(&name.to_ascii_lowercase().as_str()) {
        "remove it, and data association finds the objects; if each object keeps its id in the whole recording, \
         rename the column to `object_key`"
            .to_owned()
    } else {
        format!("expected {}, and optionally {}", REQUIRED.join(", "), OPTIONAL.join(", "))
    };
    format!("the header has an unknown column `{name}`: {remedy}")
}

/// Names the missing columns, each with the column of the header that has probably the same meaning.
fn missing_columns(missing: &[&str], header: &StringRecord) -> String {
    let likely = |name: &str| {
        let others =
            OTHER_NAMES.iter().find(|(column, _)| *column == name).map_or(&[][..], |(_, others)| others);
        let plain = |h: &str| h.to_ascii_lowercase().replace(['_', '-', ' '], "");
        let found = header.iter().find(|h| plain(h) == plain(name) || others.contains(&plain(h).as_str()))?;
        Some(format!("rename `{found}` to `{name}`"))
    };
    let renamed: Vec<String> = missing.iter().filter_map(|name| likely(name)).collect();
    let message = format!("the header has no column {}", missing.join(", "));
    if renamed.is_empty() { message } else { format!("{message}: {}", renamed.join(", ")) }
}

fn row(record: &StringRecord, header: &StringRecord) -> Result<DetectionRow, Mistake> {
    record.deserialize::<DetectionRow>(Some(header)).map_err(|e| Mistake::Row(reason(&e, header)))?.check()
}

/// Returns the line of a record. csv counts blank lines and comments before a record as part of it.
pub(crate) fn line(text: &str, position: &csv::Position) -> usize {
    let rest = text.get(position.byte() as usize..).unwrap_or_default();
    let skipped = rest.lines().take_while(|line| line.is_empty() || line.starts_with('#'));
    position.line() as usize + skipped.count()
}

/// Returns the text of a csv error without csv's description of the position.
fn reason(e: &csv::Error, header: &StringRecord) -> String {
    match e.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("expected {expected_len} fields as in the header, got {len}")
        }
        csv::ErrorKind::Deserialize { err, .. } => match err.field() {
            Some(field) => {
                let column = header.get(field as usize).unwrap_or_default();
                format!("column `{column}`, the {}. of the row: {}", field + 1, err.kind())
            }
            None => err.kind().to_string(),
        },
        _ => e.to_string(),
    }
}

/// Writes detections with all columns.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: impl AsRef<Path>, detections: &[DetectionRow]) -> Result<(), FormatError> {
    let path = path.as_ref();
    let other = |e: csv::Error| FormatError::Io { path: path.to_owned(), source: e.into() };
    let mut writer = Writer::from_writer(vec![]);
    for detection in detections {
        writer.serialize(detection).map_err(other)?;
    }
    let bytes = writer.into_inner().map_err(|e| io_error(path)(e.into_error()))?;
    write_whole(path, &bytes).map_err(io_error(path))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEADER: &str = "timestamp,class_name,score,xmin,ymin,xmax,ymax,object_key\n";

    fn errors(rows: &str) -> String {
        parse(&format!("{HEADER}{rows}"), "d.csv").unwrap_err().to_string()
    }

    #[test]
    fn columns_are_found_by_name() {
        let text = format!("{HEADER}1.5, cell phone ,0.5,1,2,3,4,7\r\n2,cup,1,0,0,1,1,\n");
        let rows = parse(&text, "d.csv").unwrap();
        assert_eq!((rows[0].class_name.as_str(), rows[0].object_key), ("cell phone", Some(7)));
        assert_eq!((rows[1].timestamp, rows[1].object_key, rows[1].class_id), (2.0, None, None));
    }

    #[test]
    fn every_malformed_row_is_reported_with_its_place() {
        let text = errors("1,cup,0.5,1,2\n1,cup,x,1,2,3,4,1\n\n1,cup,1.5,1,2,3,4,1\n1,cup,1,4,2,3,4,1\n");
        assert_eq!(
            text,
            "d.csv:2: expected 8 fields as in the header, got 5\n\
             d.csv:3: column `score`, the 3. of the row: invalid float literal\n\
             d.csv:5: expected a score from 0 to 1, got 1.5\n\
             d.csv:6: expected a box with xmin ≤ xmax and ymin ≤ ymax, got [4.0, 2.0, 3.0, 4.0]"
        );
    }

    #[test]
    fn a_missing_column_is_named() {
        let text = parse("timestamp,score,xmin,ymin,xmax,ymax\n", "d.csv").unwrap_err().to_string();
        assert_eq!(text, "d.csv:1: the header has no column class_name");
        assert!(parse("", "d.csv").is_err());
        let text = parse("time,class,Score,x1,ymin,xmax,ymax\n", "d.csv").unwrap_err().to_string();
        let expected = "rename `time` to `timestamp`, rename `class` to `class_name`, rename `Score` to `score`, \
                        rename `x1` to `xmin`";
        assert!(text.ends_with(expected), "{text}");
    }

    #[test]
    fn an_unknown_column_is_an_error() {
        let rows = "red,1,cup,1,0,0,1,1,1\n".repeat(3);
        let text = parse(&format!("colour,{HEADER}{rows}"), "d.csv").unwrap_err().to_string();
        assert_eq!(
            text,
            "d.csv:1: the header has an unknown column `colour`: expected timestamp, class_name, score, xmin, ymin, \
             xmax, ymax, and optionally frame_idx, frame_idx_as_published, object_key, class_id, scores, depth"
        );
        let text = parse(&format!("Track_ID,{HEADER}{rows}"), "d.csv").unwrap_err().to_string();
        assert!(text.contains("rename the column to `object_key`"), "{text}");
    }

    #[test]
    fn the_lists_have_all_columns_of_a_row() {
        let row = parse(&format!("{HEADER}1,cup,0.5,1,2,3,4,7\n"), "d.csv").unwrap().remove(0);
        let mut writer = Writer::from_writer(vec![]);
        writer.serialize(row).unwrap();
        let text = String::from_utf8(writer.into_inner().unwrap()).unwrap();
        let mut written: Vec<&str> = text.lines().next().unwrap().split(',').collect();
        let mut listed = [&REQUIRED[..], &OPTIONAL[..]].concat();
        written.sort_unstable();
        listed.sort_unstable();
        assert_eq!(written, listed);
    }

    #[test]
    fn scores_of_several_classes_are_read() {
        let header = HEADER.replace("object_key", "scores");
        let read = |scores| parse(&format!("{header}1,cup,0.7,0,0,1,1,{scores}"), "d.csv");
        let rows = read("cup:0.7;cell phone:0.25").unwrap();
        let expected = vec![("cup".to_owned(), 0.7), ("cell phone".to_owned(), 0.25)];
        assert_eq!(rows[0].class_scores().unwrap(), expected);
        assert!(read("cup=0.7").unwrap_err().to_string().starts_with("d.csv:2: expected `class:score`"));
    }
}
