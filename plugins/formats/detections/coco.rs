//! COCO: boxes as `[left, top, width, height]` in pixels.
use super::DetectionRow;
use super::format::Entry;
use super::frames::Frames;
use crate::error::{FormatError, Mistake, ProblemList};
use crate::text::read_text;
use serde::Deserialize;
use std::collections::HashMap;
use std::path::Path;

/// Number of an image or a category; some programs write texts.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Deserialize)]
#[serde(untagged)]
enum Id {
    Number(i64),
    Text(String),
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
    let classes: HashMap<Id, String> =
        categories.into_iter().map(|category| (category.id, category.name)).collect();
    let names: HashMap<Id, String> = images.into_iter().map(|image| (image.id, image.file_name)).collect();
    let entry = |(place, found): (usize, Annotation)| {
        let row = row(&found, &names, &classes, frames).and_then(DetectionRow::check);
        (0, row.map_err(|mistake| Mistake::Row(format!("annotation {}: {mistake}", place + 1))))
    };
    Ok(annotations.into_iter().enumerate().map(entry).collect())
}

fn row(
    found: &Annotation,
    names: &HashMap<Id, String>,
    classes: &HashMap<Id, String>,
    frames: &Frames,
) -> Result<DetectionRow, Mistake> {
    let missing = |what: &str, id: &Id| Mistake::Row(format!("there is no {what} with the id {id:?}"));
    let name = names.get(&found.image_id).ok_or_else(|| missing("image", &found.image_id))?;
    let class = classes.get(&found.category_id).ok_or_else(|| missing("category", &found.category_id))?;
    let [left, top, width, height] = found.bbox;
    let sides = [left, top, left + width, top + height];
    Ok(DetectionRow::of_box(frames.time_of_name(name)?, class, found.score.unwrap_or(1.0), sides))
}
