//! Reads a model of COLMAP.
use super::{CAMERAS, Camera, IMAGES, Image, ImagePoint, Lens, Model, POINTS, Point};
use crate::error::{FormatError, Mistake, ProblemList};
use crate::lines::{id, lines, number};
use crate::text::read_text;
use manifactor_geometry::{Coordinates, Se3, So3};
use nalgebra::{Vector2, Vector3};
use std::collections::{HashMap, HashSet};
use std::hash::Hash;
use std::path::Path;

const CAMERA_LAYOUT: &str = "id model width height parameters";
const IMAGE_LAYOUT: &str = "id qw qx qy qz tx ty tz camera name";
const POINT_LAYOUT: &str = "id x y z r g b error";

impl Model {
    /// Reads the model in a folder.
    ///
    /// # Errors
    /// As [`parse`](Self::parse).
    pub fn read(folder: &Path) -> Result<Self, FormatError> {
        let images = folder.join(IMAGES);
        Self::parse(&read_text(&images)?, &images)
    }

    /// Reads a model; `text` is that of `images.txt`, whose path is `path`. The other files are in the same folder.
    ///
    /// # Errors
    /// If a file is missing, a line is malformed, a number occurs twice or refers to nothing in the model, or images and
    /// points contradict each other. The error lists all mistakes of one file.
    pub fn parse(text: &str, path: &Path) -> Result<Self, FormatError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let file = folder.join(CAMERAS);
        let cameras = cameras(&read_text(&file)?, &file)?;
        let known = cameras.iter().map(|camera| camera.id).collect();
        let images = images(text, path, &known)?;
        let file = folder.join(POINTS);
        let points_text = read_text(&file)?;
        let points = points(&points_text, &file)?;
        let known: HashSet<u64> = points.iter().map(|(_, point)| point.id).collect();
        let mut problems = ProblemList::of(path, text);
        for (line, image) in &images {
            let seen = image.points.iter().filter_map(|point| point.point);
            for id in seen.filter(|id| !known.contains(id)) {
                problems
                    .push(line + 1, Mistake::Unknown { what: "point in points3D.txt with the number", id });
            }
        }
        problems.finish()?;
        let mut problems = ProblemList::of(&file, &points_text);
        check_tracks(&points, &images, &mut problems);
        problems.finish()?;
        let without_line = |(_, image)| image;
        let images = images.into_iter().map(without_line).collect();
        Ok(Self { cameras, images, points: points.into_iter().map(|(_, point)| point).collect() })
    }
}

/// Splits a line into its first `N` fields, whose names are those of `layout`, and the remaining text.
fn head<'a, const N: usize>(text: &'a str, layout: &'static str) -> Result<([&'a str; N], &'a str), Mistake> {
    let mut rest = text.trim_start();
    let mut fields = [""; N];
    for (i, field) in fields.iter_mut().enumerate() {
        if rest.is_empty() {
            let expected = layout.split_whitespace().count();
            return Err(Mistake::FieldCount { expected, layout, found: i });
        }
        let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
        (*field, rest) = rest.split_at(end);
        rest = rest.trim_start();
    }
    Ok((fields, rest))
}

/// Records a number that occurs twice.
fn once<K: Hash + Eq + ToString>(
    seen: &mut HashMap<K, usize>,
    key: K,
    what: &str,
    line: usize,
    problems: &mut ProblemList<'_>,
) {
    let name = key.to_string();
    if let Some(first) = seen.insert(key, line) {
        problems.push(line, Mistake::Row(format!("{what} {name} is defined twice, first in line {first}")));
    }
}

fn cameras(text: &str, path: &Path) -> Result<Vec<Camera>, FormatError> {
    let mut problems = ProblemList::of(path, text);
    let (mut cameras, mut seen) = (vec![], HashMap::new());
    for (line, text) in lines(text) {
        if let Some(camera) = problems.ok(line, camera(text)) {
            once(&mut seen, camera.id, "camera", line, &mut problems);
            cameras.push(camera);
        }
    }
    problems.finish().map(|()| cameras)
}

/// Parses a camera of `cameras.txt`.
///
/// # Errors
/// If the line is malformed or its model is not supported.
pub fn camera(text: &str) -> Result<Camera, Mistake> {
    let ([number_text, model, width, height], rest) = head(text, CAMERA_LAYOUT)?;
    let pixels = |text: &str| {
        let expected = "a whole number of pixels";
        text.parse::<u32>().map_err(|_| Mistake::Field { expected, found: text.to_owned() })
    };
    let size = [pixels(width)?, pixels(height)?];
    let parameters = rest.split_whitespace().map(number).collect::<Result<Vec<f64>, _>>()?;
    let camera_id = id(number_text)?;
    let (lens, model) =
        Lens::new(model, size, &parameters).map_err(|error| Mistake::Row(error.to_string()))?;
    Ok(Camera { id: camera_id, model, lens })
}

/// Returns the images with their line numbers.
fn images(text: &str, path: &Path, cameras: &HashSet<u64>) -> Result<Vec<(usize, Image)>, FormatError> {
    let mut problems = ProblemList::of(path, text);
    let (mut images, mut ids, mut names) = (vec![], HashMap::new(), HashMap::new());
    let mut lines = text.lines().enumerate().map(|(i, line)| (i + 1, line.trim()));
    while let Some((line, text)) = lines.next() {
        if text.is_empty() || text.starts_with('#') {
            continue;
        }
        // the line of an image without points is empty
        let (points_line, points_text) = lines.next().unwrap_or((line, ""));
        let points = problems.ok(points_line, image_points(points_text));
        let Some(image) = problems.ok(line, image(text)) else { continue };
        once(&mut ids, image.id, "image", line, &mut problems);
        once(&mut names, image.name.clone(), "image", line, &mut problems);
        if !cameras.contains(&image.camera) {
            problems.push(
                line,
                Mistake::Unknown { what: "camera in cameras.txt with the number", id: image.camera },
            );
        }
        images.push((line, Image { points: points.unwrap_or_default(), ..image }));
    }
    if problems.is_empty() && images.is_empty() {
        problems.push(0, Mistake::Empty { expected: "images", unknown: vec![] });
    }
    problems.finish().map(|()| images)
}

fn image(text: &str) -> Result<Image, Mistake> {
    let ([number_text, qw, qx, qy, qz, x, y, z, camera], name) = head(text, IMAGE_LAYOUT)?;
    if name.is_empty() {
        return Err(Mistake::FieldCount { expected: 10, layout: IMAGE_LAYOUT, found: 9 });
    }
    let rotation = So3::from_quaternion_xyzw([number(qx)?, number(qy)?, number(qz)?, number(qw)?])?;
    let translation = Vector3::new(number(x)?, number(y)?, number(z)?);
    Ok(Image {
        id: id(number_text)?,
        world_from_camera: Se3::new(rotation, translation).inverse(),
        camera: id(camera)?,
        name: name.to_owned(),
        points: vec![],
    })
}

fn image_points(text: &str) -> Result<Vec<ImagePoint>, Mistake> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let (points, rest) = words.as_chunks::<3>();
    if !rest.is_empty() {
        let what = format!(
            "expected the image points as x, y and the number of the point or -1, three numbers each, got {} numbers; \
             this line belongs to the image in the line before it",
            words.len()
        );
        return Err(Mistake::Row(what));
    }
    let point = |[x, y, point]: &[&str; 3]| {
        let pixel = Coordinates::new(Vector2::new(number(x)?, number(y)?))?;
        // older versions write -1 as a whole number from 0
        let is_none = *point == "-1" || *point == u64::MAX.to_string();
        Ok(ImagePoint { pixel, point: if is_none { None } else { Some(id(point)?) } })
    };
    points.iter().map(point).collect()
}

/// Returns the points with their line numbers.
fn points(text: &str, path: &Path) -> Result<Vec<(usize, Point)>, FormatError> {
    let mut problems = ProblemList::of(path, text);
    let (mut points, mut seen) = (vec![], HashMap::new());
    for (line, text) in lines(text) {
        if let Some(point) = problems.ok(line, point(text)) {
            once(&mut seen, point.id, "point", line, &mut problems);
            points.push((line, point));
        }
    }
    problems.finish().map(|()| points)
}

/// Checks that images see the points where their tracks say so.
fn check_tracks(points: &[(usize, Point)], images: &[(usize, Image)], problems: &mut ProblemList<'_>) {
    let images: HashMap<u64, &Image> = images.iter().map(|(_, image)| (image.id, image)).collect();
    for (line, point) in points {
        for (image, index) in &point.track {
            let place = usize::try_from(*index).unwrap_or(usize::MAX);
            let there = images.get(image).and_then(|image| image.points.get(place));
            if there.is_none_or(|there| there.point != Some(point.id)) {
                let what = format!(
                    "the track says that image {image} sees point {} at its image point {index}, counted from 0, but \
                     images.txt does not; write the model again with COLMAP",
                    point.id
                );
                problems.push(*line, Mistake::Row(what));
            }
        }
    }
}

fn point(text: &str) -> Result<Point, Mistake> {
    let ([number_text, x, y, z, r, g, b, error], rest) = head(text, POINT_LAYOUT)?;
    let colour = |text: &str| {
        let expected = "a whole number from 0 to 255";
        text.parse::<u8>().map_err(|_| Mistake::Field { expected, found: text.to_owned() })
    };
    let words: Vec<&str> = rest.split_whitespace().collect();
    let (track, odd) = words.as_chunks::<2>();
    if !odd.is_empty() {
        let what = format!("expected the track as pairs of image and index, got {} numbers", words.len());
        return Err(Mistake::Row(what));
    }
    Ok(Point {
        id: id(number_text)?,
        position: Vector3::new(number(x)?, number(y)?, number(z)?),
        colour: [colour(r)?, colour(g)?, colour(b)?],
        error: number(error)?,
        track: track
            .iter()
            .map(|[image, index]| Ok((id(image)?, id(index)?)))
            .collect::<Result<_, Mistake>>()?,
    })
}
