//! Detections in the formats of other programs.
use super::frames::{FrameTimes, Frames};
use super::{DetectionRow, coco, kitti, mot, yolo};
use crate::error::{FormatError, Mistake, ProblemList, io_error};
use crate::text::read_text;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// Share of boxes outside of the image above which the sides have probably a different meaning.
const MAX_OUTSIDE: f64 = 0.2;
/// Detectors may exceed the image by this much. Unit: pixels.
const MARGIN_PX: f64 = 3.0;

/// Detections in the format of another program. Paths are relative to the folder of the recording.
///
/// Ids of trackers are not read: data association finds the objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "format", rename_all = "snake_case", deny_unknown_fields)]
pub enum DetectionFormat {
    /// COCO: a file with `images`, `annotations` and `categories`, or a list of results. Annotations with `iscrowd` are no
    /// objects.
    Coco {
        /// The JSON file.
        file: PathBuf,
        /// For a list of results, the JSON file with `images` and `categories`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        images: Option<PathBuf>,
        /// Times of the images by the number in the name of their file. Default: the name is the time.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        frames: Option<FrameTimes>,
    },
    /// YOLO: a folder with a text file per image, and lines `class x y width height [score]` with the centre and the
    /// size as shares of the image, or `class x y x y x y …` with an outline. Keypoints after the box, `x y visibility` each,
    /// are not used.
    Yolo {
        /// Folder of the text files.
        folder: PathBuf,
        /// Text file with one class per line, in the order of their numbers.
        classes: PathBuf,
        /// Times of the images by the number in the name of their file. Default: the name is the time.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        frames: Option<FrameTimes>,
    },
    /// MOT challenge: lines `frame,id,left,top,width,height,score,…`. Of a ground truth, with nine fields, the rows that
    /// are not to be considered are no objects.
    Mot {
        /// The text file.
        file: PathBuf,
        /// Class of all boxes.
        class: String,
        /// Times of the frames.
        frames: FrameTimes,
    },
    /// Labels of KITTI's tracking benchmark: lines `frame track type truncated occluded alpha left top right bottom
    /// …`, with a score as the 18th field. Lines of type `DontCare` are no objects.
    Kitti {
        /// The text file.
        file: PathBuf,
        /// Times of the frames.
        frames: FrameTimes,
    },
}

/// A box before it is checked: the line or the number of the entry, the time, and the row.
pub(super) type Entry = (usize, Result<DetectionRow, Mistake>);

/// Form of a box in a format.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// Left, top, right, bottom.
    Corners,
    /// Left, top, width, height.
    Size,
    /// Centre and size.
    Centre,
}

impl DetectionFormat {
    /// Reads the boxes of an image with this width and height.
    ///
    /// # Errors
    /// Files that cannot be read; malformed entries, all listed; boxes whose form or unit does not fit the image.
    pub fn read(&self, folder: &Path, image: [u32; 2]) -> Result<Vec<DetectionRow>, FormatError> {
        match self {
            Self::Coco { file, images, frames } => {
                let frames = Frames::of(frames.as_ref(), folder, 0)?;
                let (file, images) = (folder.join(file), images.as_ref().map(|images| folder.join(images)));
                let text = read_text(&file)?;
                let entries = coco::entries(&file, &text, images.as_deref(), &frames, image)?;
                finish(&file, &text, entries, image, Form::Size)
            }
            Self::Yolo { folder: labels, classes, frames } => {
                let frames = Frames::of(frames.as_ref(), folder, 0)?;
                let file = folder.join(classes);
                let classes = read_text(&file)?;
                let classes = yolo::classes(&file, &classes)?;
                let labels = folder.join(labels);
                let mut rows = vec![];
                let files = text_files(&labels)?;
                let names: Vec<String> = files
                    .iter()
                    .map(|file| file.file_name().unwrap_or_default().to_string_lossy().into_owned())
                    .collect();
                frames
                    .one_time_each(names.iter().map(String::as_str))
                    .map_err(|text| ProblemList::single(&labels, "", 0, Mistake::Row(text)))?;
                for file in files {
                    let text = read_text(&file)?;
                    let entries = yolo::entries(&file, &text, &classes, &frames, image);
                    rows.extend(listed(&file, &text, entries)?);
                }
                check_form(&labels, "", &rows, image, Form::Centre).map(|()| rows)
            }
            Self::Mot { file, class, frames } => {
                let (frames, file) = (Frames::of(Some(frames), folder, 1)?, folder.join(file));
                let text = read_text(&file)?;
                finish(&file, &text, mot::entries(&text, class, &frames), image, Form::Size)
            }
            Self::Kitti { file, frames } => {
                let (frames, file) = (Frames::of(Some(frames), folder, 0)?, folder.join(file));
                let text = read_text(&file)?;
                finish(&file, &text, kitti::entries(&text, &frames), image, Form::Corners)
            }
        }
    }

    /// Returns the files and folders that have to exist.
    pub fn files(&self) -> Vec<&Path> {
        let (first, second, frames) = match self {
            Self::Coco { file, images, frames } => (file, images.as_ref(), frames.as_ref()),
            Self::Yolo { folder, classes, frames } => (folder, Some(classes), frames.as_ref()),
            Self::Mot { file, frames, .. } | Self::Kitti { file, frames } => (file, None, Some(frames)),
        };
        let times = frames.and_then(|frames| frames.times.as_ref());
        [Some(first), second, times].into_iter().flatten().map(PathBuf::as_path).collect()
    }
}

/// Returns the text files of a folder, sorted by name.
fn text_files(folder: &Path) -> Result<Vec<PathBuf>, FormatError> {
    let entries = std::fs::read_dir(folder).map_err(io_error(folder))?;
    let mut files = vec![];
    for entry in entries {
        let path = entry.map_err(io_error(folder))?.path();
        if path.extension().is_some_and(|extension| extension == "txt") {
            files.push(path);
        }
    }
    files.sort();
    Ok(files)
}

/// Returns the rows, or all mistakes.
fn listed(
    file: &Path,
    text: &str,
    entries: impl IntoIterator<Item = Entry>,
) -> Result<Vec<DetectionRow>, FormatError> {
    let mut problems = ProblemList::of(file, text);
    let mut rows = vec![];
    for (line, row) in entries {
        rows.extend(problems.ok(line, row.and_then(DetectionRow::check)));
    }
    problems.finish().map(|()| rows)
}

fn finish(
    file: &Path,
    text: &str,
    entries: impl IntoIterator<Item = Entry>,
    image: [u32; 2],
    form: Form,
) -> Result<Vec<DetectionRow>, FormatError> {
    let rows = listed(file, text, entries)?;
    check_form(file, text, &rows, image, form).map(|()| rows)
}

/// Checks that the boxes have the expected form and unit, from all boxes together.
fn check_form(
    file: &Path,
    text: &str,
    rows: &[DetectionRow],
    [width, height]: [u32; 2],
    form: Form,
) -> Result<(), FormatError> {
    let [width, height] = [width, height].map(f64::from);
    let is_inside = |[xmin, ymin, xmax, ymax]: [f64; 4]| {
        let low = xmin.min(ymin) >= -MARGIN_PX;
        low && xmax <= width + MARGIN_PX && ymax <= height + MARGIN_PX && xmin <= xmax && ymin <= ymax
    };
    let sides = |row: &DetectionRow| [row.xmin, row.ymin, row.xmax, row.ymax];
    // the sides if the last two numbers are the right and lower sides and not a size
    let as_corners = |row: &DetectionRow| {
        let [xmin, ymin, xmax, ymax] = sides(row);
        match form {
            Form::Corners => [xmin, ymin, xmax, ymax],
            Form::Size => [xmin, ymin, xmax - xmin, ymax - ymin],
            Form::Centre => [0.5 * (xmin + xmax), 0.5 * (ymin + ymax), xmax - xmin, ymax - ymin],
        }
    };
    // the sides if the first two numbers are the centre and not the left upper corner
    let as_centre = |row: &DetectionRow| {
        let [xmin, ymin, xmax, ymax] = sides(row);
        let [x, y] = [0.5 * (xmax - xmin), 0.5 * (ymax - ymin)];
        [xmin - x, ymin - y, xmax - x, ymax - y]
    };
    let share = |inside: &dyn Fn(&DetectionRow) -> bool| {
        rows.iter().filter(|row| inside(row)).count() as f64 / rows.len().max(1) as f64
    };
    let are_relative = form != Form::Centre && rows.iter().all(|row| row.xmax <= 1.0 && row.ymax <= 1.0);
    let outside = 1.0 - share(&|row| is_inside(sides(row)));
    let fault = match () {
        () if rows.is_empty() => return Ok(()),
        () if are_relative => {
            "all coordinates are at most 1: expected pixels, not shares of the image".to_owned()
        }
        () if outside <= MAX_OUTSIDE => return Ok(()),
        () if form != Form::Corners && share(&|row| is_inside(as_corners(row))) > 1.0 - MAX_OUTSIDE => {
            format!(
                "{:.0} % of the boxes exceed the image, but not if their last two numbers are the right and lower sides: this \
             format has the width and height there",
                100.0 * outside
            )
        }
        () if form == Form::Size && share(&|row| is_inside(as_centre(row))) > 1.0 - MAX_OUTSIDE => format!(
            "{:.0} % of the boxes exceed the image, but not if their first two numbers are the centre: this format has \
             the left and upper sides there",
            100.0 * outside
        ),
        () => {
            let [x, y] = rows.iter().fold([0.0_f64; 2], |[x, y], row| [x.max(row.xmax), y.max(row.ymax)]);
            format!(
                "{:.0} % of the boxes exceed the image of {width} × {height} pixels, up to x = {x:.0} and y = {y:.0}: check \
                 the width and height of `camera`",
                100.0 * outside
            )
        }
    };
    let mut problems = ProblemList::of(file, text);
    problems.push(0, Mistake::Row(fault));
    problems.finish()
}

#[cfg(test)]
mod tests;
