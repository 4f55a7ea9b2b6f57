//! COCO: boxes as `[left, top, width, height]` in pixels.
use super::DetectionRow;
use super::format::Entry;
use super::frames::Frames;
use crate::error::{FormatError, Mistake, ProblemList};
use crate::text::read_text;
use serde::Deserialize;
use std::collections::HashMap;
use std::fmt;
use std::path::Path;

/// Number of an image or a category; some programs write texts.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Deserialize)]
#[serde(untagged)]
enum Id {
    Number(i64),
    Text(String),
}

impl fmt::Display for Id {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Text(text) => write!(f, "{text:?}"),
        }
    }
}

#[derive(Deserialize)]
struct Image {
    id: Id,
    file_name: String,
    width: Option<u32>,
    height: Option<u32>,
}

#[derive(Deserialize)]
struct Category {
    id: Id,
    name: String,
}

#[derive(Deserialize)]
struct Annotation {
    image_id: Id,
    category_id: Id,
    bbox: [f64; 4],
    score: Option<f64>,
    /// 1 if the box is around several objects.
    #[serde(default)]
    iscrowd: serde_json::Value,
}

impl Annotation {
    fn is_one_object(&self) -> bool {
        self.iscrowd != 1 && self.iscrowd != true
    }
}

#[derive(Deserialize)]
struct Images {
    images: Vec<Image>,
    categories: Vec<Category>,
}

#[derive(Deserialize)]
struct DataSet {
    annotations: Vec<Annotation>,
}

fn parse<T: serde::de::DeserializeOwned>(file: &Path, text: &str) -> Result<T, FormatError> {
    let fault = |error: serde_json::Error| {
        ProblemList::single(file, text, error.line(), Mistake::Row(error.to_string()))
    };
    serde_json::from_str(text).map_err(fault)
}

/// Returns the boxes of a file. `images` is the file with the images of a list of results.
pub(super) fn entries(
    file: &Path,
    text: &str,
    images: Option<&Path>,
    frames: &Frames,
    size: [u32; 2],
) -> Result<Vec<Entry>, FormatError> {
    let fault = |file: &Path, fault: String| ProblemList::single(file, text, 0, Mistake::Row(fault));
    let is_list = text.trim_start().starts_with('[');
    let (named, annotations) = match images {
        Some(images) => {
            let annotations = match is_list {
                true => parse::<Vec<Annotation>>(file, text)?,
                false => parse::<DataSet>(file, text)?.annotations,
            };
            (parse::<Images>(images, &read_text(images)?)?, annotations)
        }
        None if is_list => {
            let text = "a list of results has no names of images: set `images` to the file with `images` and `categories`";
            return Err(fault(file, text.into()));
        }
        None => (parse::<Images>(file, text)?, parse::<DataSet>(file, text)?.annotations),
    };
    let Images { images, categories } = named;
    let other =
        images.iter().find_map(|image| Some([image.width?, image.height?]).filter(|found| *found != size));
    if let Some([width, height]) = other {
        let [w, h] = size;
        return Err(fault(
            file,
            format!("an image has {width} × {height} pixels, and `camera` has {w} × {h}"),
        ));
    }
    frames
        .one_time_each(images.iter().map(|image| image.file_name.as_str()))
        .map_err(|text| fault(file, text))?;
    let categories = categories.into_iter().map(|category| (category.id, category.name));
    let classes = by_id("categories", categories).map_err(|text| fault(file, text))?;
    let images = images.into_iter().map(|image| (image.id, image.file_name));
    let names = by_id("images", images).map_err(|text| fault(file, text))?;
    let entry = |(place, found): (usize, Annotation)| {
        let row = row(&found, &names, &classes, frames).and_then(DetectionRow::check);
        (0, row.map_err(|mistake| Mistake::Row(format!("annotation {}: {mistake}", place + 1))))
    };
    let objects = annotations.into_iter().enumerate().filter(|(_, found)| found.is_one_object());
    Ok(objects.map(entry).collect())
}

/// Returns the names by id; an error if two of them have one id.
fn by_id(what: &str, names: impl Iterator<Item = (Id, String)>) -> Result<HashMap<Id, String>, String> {
    let mut all = HashMap::new();
    for (id, name) in names {
        if let Some(other) = all.get(&id).filter(|other| **other != name) {
            return Err(format!(
                "two {what} have the id {id}, `{other}` and `{name}`; expected one id for each"
            ));
        }
        all.insert(id, name);
    }
    Ok(all)
}

fn row(
    found: &Annotation,
    names: &HashMap<Id, String>,
    classes: &HashMap<Id, String>,
    frames: &Frames,
) -> Result<DetectionRow, Mistake> {
    let missing = |what: &str, id: &Id| Mistake::Row(format!("there is no {what} with the id {id}"));
    let name = names.get(&found.image_id).ok_or_else(|| missing("image", &found.image_id))?;
    let class = classes.get(&found.category_id).ok_or_else(|| missing("category", &found.category_id))?;
    let [left, top, width, height] = found.bbox;
    let sides = [left, top, left + width, top + height];
    Ok(DetectionRow::of_box(frames.time_of_name(name)?, class, found.score.unwrap_or(1.0), sides))
}
