//! Times of images that a file of detections names or numbers.
use crate::error::{FormatError, Mistake, ProblemList};
use crate::lines::{lines, number};
use crate::text::read_text;
use manifactor_graph::checked::Positive;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// A name that is a number above this is a time in nanoseconds: in seconds it would be three million years.
const NANOSECONDS: f64 = 1e14;

/// Times of numbered images: a rate, or a file of times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FrameTimes {
    /// Images per second.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<Positive>,
    /// Time of the first image, for `rate`. Unit: seconds.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub start: f64,
    /// File with the time of one image per line, in seconds; further columns are ignored.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub times: Option<PathBuf>,
    /// Number of the first image. Default: 1 for `mot`, 0 for other formats.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first: Option<u64>,
}

#[allow(clippy::trivially_copy_pass_by_ref, reason = "serde passes references")]
fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

/// Times of images, read from a file if necessary.
pub(super) enum Frames {
    /// The name of an image is its time.
    Names,
    /// Equal intervals.
    Rate { rate: f64, start: f64, first: u64 },
    /// A list.
    List { times: Vec<f64>, first: u64, file: PathBuf },
}

impl Frames {
    /// Reads the file of times, if there is one. `first` is the usual number of the first image.
    pub(super) fn of(times: Option<&FrameTimes>, folder: &Path, first: u64) -> Result<Self, FormatError> {
        let Some(FrameTimes { rate, start, times, first: given }) = times else { return Ok(Self::Names) };
        let first = given.unwrap_or(first);
        match (rate, times) {
            (Some(rate), None) => Ok(Self::Rate { rate: rate.get(), start: *start, first }),
            (None, Some(file)) => {
                let file = folder.join(file);
                let text = read_text(&file)?;
                let mut problems = ProblemList::of(&file, &text);
                let mut times: Vec<f64> = vec![];
                for (line, text) in lines(&text) {
                    let time = number(text.split([' ', ',', '\t']).next().unwrap_or_default());
                    let time = time.and_then(|time| match times.last() {
                        Some(last) if time <= *last => Err(Mistake::Row(format!(
                            "expected a time after that of the image before, {last} s, got {time} s"
                        ))),
                        _ => Ok(time),
                    });
                    times.extend(problems.ok(line, time));
                }
                problems.finish()?;
                Ok(Self::List { times, first, file })
            }
            _ => {
                let text = "`frames` needs either `rate` or `times`";
                Err(ProblemList::single(folder, "", 0, Mistake::Row(text.into())))
            }
        }
    }

    /// Returns the time of an image by its number.
    pub(super) fn time(&self, number: u64) -> Result<f64, Mistake> {
        match self {
            Self::Names => {
                Err(Mistake::Row("the images are numbered: set `frames`, with `rate` or `times`".into()))
            }
            Self::Rate { rate, start, first } => match number.checked_sub(*first) {
                Some(index) => Ok(start + index as f64 / rate),
                None => Err(before_first(number, *first)),
            },
            Self::List { times, first, file } => {
                let index = number.checked_sub(*first).ok_or_else(|| before_first(number, *first))?;
                times.get(index as usize).copied().ok_or_else(|| {
                    let hint = if index as usize == times.len() && *first == 0 {
                        "; if images are numbered from 1, set `frames.first = 1`"
                    } else {
                        ""
                    };
                    Mistake::Row(format!(
                        "{} has no time for image {number}: it has {} times, from image {first}{hint}",
                        file.display(),
                        times.len()
                    ))
                })
            }
        }
    }

    /// Checks that images with different names have different times.
    ///
    /// # Errors
    /// Two names with one time.
    pub(super) fn one_time_each<'a>(&self, names: impl IntoIterator<Item = &'a str>) -> Result<(), String> {
        let mut known = HashMap::new();
        for name in names {
            // a name without a time is reported with its boxes
            let Ok(time) = self.time_of_name(name) else { continue };
            match known.insert(time.to_bits(), name) {
                Some(other) if other != name => {
                    return Err(format!(
                        "the images `{other}` and `{name}` have the same number, the last one in their names: rename them so that \
                         the number of the image is last, such as `left2_0012.jpg`"
                    ));
                }
                _ => {}
            }
        }
        Ok(())
    }

    /// Returns the time of an image by the name of its file.
    pub(super) fn time_of_name(&self, name: &str) -> Result<f64, Mistake> {
        let stem = Path::new(name).file_name().unwrap_or_default().to_string_lossy();
        let stem = match stem.rsplit_once('.') {
            Some((stem, extension)) if !extension.chars().all(|c| c.is_ascii_digit()) => stem,
            _ => &*stem,
        };
        let stem = without_export(stem);
        if let Self::Names = self {
            let time = stem.parse::<f64>().ok().filter(|time| time.is_finite());
            let time = time.ok_or_else(|| {
                Mistake::Row(format!(
                    "the name of the image `{name}` is no time in seconds or nanoseconds: set `frames`, with `rate` or `times`"
                ))
            })?;
            return Ok(if time > NANOSECONDS { 1e-9 * time } else { time });
        }
        self.time(
            number_of_name(stem)
                .map_err(|fault| Mistake::Row(format!("the name of the image `{name}` {fault}")))?,
        )
    }
}

/// Returns a name without the suffix of an export by Roboflow: `frame_0012` for `frame_0012_jpg.rf.3f2c…`.
fn without_export(stem: &str) -> &str {
    let Some((exported, hash)) = stem.rsplit_once(".rf.") else { return stem };
    if !hash.chars().all(|c| c.is_ascii_alphanumeric()) {
        return stem;
    }
    exported.rsplit_once('_').map_or(exported, |(name, _extension)| name)
}

/// Returns the last number in the name of an image.
fn number_of_name(stem: &str) -> Result<u64, String> {
    let digits = stem.rsplit(|c: char| !c.is_ascii_digit()).find(|digits| !digits.is_empty());
    let digits = digits.ok_or("has no number")?;
    digits.parse().map_err(|_| format!("has the number {digits}, which is too large"))
}

fn before_first(number: u64, first: u64) -> Mistake {
    Mistake::Row(format!(
        "image {number} comes before the first one, {first}: `frames.first` sets its number"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_times_or_numbers() {
        let names = Frames::Names;
        assert_eq!(names.time_of_name("rgb/1305031102.175304.png").unwrap(), 1_305_031_102.175_304);
        let nanoseconds = names.time_of_name("1403636579763555584.png").unwrap();
        assert!((nanoseconds - 1_403_636_579.763_555_6).abs() < 1e-6, "{nanoseconds}");
        assert_eq!(names.time_of_name("12.5").unwrap(), 12.5);
        assert!(names.time_of_name("left.png").unwrap_err().to_string().contains("set `frames`"));
        let rate = Frames::Rate { rate: 10.0, start: 5.0, first: 1 };
        assert_eq!(rate.time_of_name("cam0/frame_000003.jpg").unwrap(), 5.2);
        let exported = "frame_0007_jpg.rf.0d9c5b3f8e7a4421a1f3b5c7d9e0f102.jpg";
        assert_eq!(rate.time_of_name(exported).unwrap(), 5.6);
        assert_eq!(rate.time_of_name("cam12_3.png").unwrap(), 5.2);
        assert!(rate.one_time_each(["frame_0003.png", "frame_0004.png"]).is_ok());
        let one = rate.one_time_each(["frame_0003_left2.png", "frame_0004_left2.png"]).unwrap_err();
        assert!(one.contains("`frame_0003_left2.png` and `frame_0004_left2.png`"), "{one}");
        assert!(rate.time_of_name("left.png").unwrap_err().to_string().contains("has no number"));
        assert!(rate.time(0).unwrap_err().to_string().contains("`frames.first`"));
        let list = Frames::List { times: vec![1.0, 2.0], first: 0, file: "times.txt".into() };
        assert_eq!(list.time(1).unwrap(), 2.0);
        assert!(list.time(2).unwrap_err().to_string().contains("set `frames.first = 1`"));
    }
}
