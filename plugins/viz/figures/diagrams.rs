//! Diagrams of single ideas.
use super::movie::frustum;
use super::stage::Stage;
use crate::canvas::{Anchor, Ink, Sheet, Stroke, Text};
use crate::drawing::outline::ellipse;
use crate::drawing::{HEAD, LABELS, Picture, Viewpoint, ellipsoid, title};
use manifactor_geometry::{Se3, So3};
use manifactor_graph::Direction;
use manifactor_quadric::{BoundingBox, Camera, DualQuadric};
use manifactor_slam::record::BoxRecord;
use manifactor_slam::sequence::ObjectId;
use nalgebra::{Matrix2, Matrix3, Point2, Rotation3, Vector3};

/// Draws how an ellipsoid becomes a box: the ellipsoid and the camera at the left, its outline in the image and
/// the box around the outline at the right. `None` if the ellipsoid is not in view.
pub fn ellipsoid_and_box(width: f64) -> Option<Picture> {
    let camera = Camera { fx: 620.0, fy: 620.0, cx: 320.0, cy: 240.0, skew: 0.0, width: 640, height: 480 };
    let turn = So3::exp(&Vector3::new(0.5, 0.1, 0.7));
    let pose = Se3 { rotation: turn, translation: Vector3::new(0.1, 0.05, 0.25) };
    let quadric = DualQuadric { pose, semi_axes: Vector3::new(0.4, 0.16, 0.22) };
    let eye = looking_at(&Vector3::new(-0.5, -1.4, 0.85), &quadric.pose.translation);
    let whole = BoundingBox::new([0.0, 0.0, 640.0, 480.0]).ok()?;
    let seen = BoxRecord::new(ObjectId(0), whole, Some((&eye, &quadric)), &camera);
    let [xmin, ymin, xmax, ymax] = seen.projected?;
    // a detection with an error of some pixels
    let measured = [xmin - 14.0, ymin + 9.0, xmax + 8.0, ymax + 16.0];
    let (half, height) = (0.5 * width, 0.4 * width);
    let text = "The box of an ellipsoid: the bounds of its outline in the image";
    let mut sheet = Sheet::new(width, HEAD + height + 34.0);
    title(&mut sheet, text);

    let plane = Viewpoint::Oblique.plane(&Direction::Z);
    let lines = frustum(&eye);
    let shape = ellipsoid(&quadric);
    let all = lines.iter().flatten().map(|p| plane.project(p)).chain(shape.outline(&plane)?);
    let stage = Stage::around(plane, all, [20.0, HEAD + 10.0, half - 20.0, HEAD + height])?;
    let caption = |sheet: &mut Sheet, text: &str, x: f64| {
        let at = [x, HEAD + height + 22.0];
        sheet.text(Text::new(text, at, LABELS, Ink::Text).anchored(Anchor::Middle));
    };
    // rays from the camera to the points at which the outline touches its box
    let [x, y, xx, xy, yy] = seen.ellipse?;
    let touches = [
        [xx.sqrt(), xy / xx.sqrt()],
        [-xx.sqrt(), -xy / xx.sqrt()],
        [xy / yy.sqrt(), yy.sqrt()],
        [-xy / yy.sqrt(), -yy.sqrt()],
    ];
    let reach = (quadric.pose.translation - eye.translation).norm();
    for [dx, dy] in touches {
        let ray = Vector3::new((x + dx - camera.cx) / camera.fx, (y + dy - camera.cy) / camera.fy, 1.0);
        let end = eye.translation + eye.rotation.act(&ray.normalize()) * reach;
        sheet.line(vec![stage.point(&eye.translation), stage.point(&end)], Stroke::dashed(Ink::Faint, 1.0));
    }
    sheet.outline(stage.outline(&shape)?, Stroke::solid(Ink::Class(0), 2.0), Some((Ink::Class(0), 0.25)));
    for (axis, name) in shape.axes.column_iter().zip(["a", "b", "c"]) {
        let end = shape.centroid + axis;
        sheet.line(vec![stage.point(&shape.centroid), stage.point(&end)], Stroke::solid(Ink::Text, 1.4));
        let [x, y] = stage.point(&(shape.centroid + 1.12 * axis));
        sheet.text(Text::new(name, [x, y + 4.0], LABELS, Ink::Text).anchored(Anchor::Middle));
    }
    for line in &lines {
        sheet.line(line.iter().map(|p| stage.point(p)).collect(), Stroke::solid(Ink::Estimate, 1.8));
    }
    caption(&mut sheet, "camera, and ellipsoid with the semi-axes a, b, c", 0.5 * half);

    let scale = (half - 40.0) / f64::from(camera.width);
    let corner = [half + 20.0, HEAD + 10.0];
    let at = |[x, y]: [f64; 2]| [corner[0] + scale * x, corner[1] + scale * y];
    let rectangle = |[xmin, ymin, xmax, ymax]: [f64; 4]| {
        [[xmin, ymin], [xmax, ymin], [xmax, ymax], [xmin, ymax]].map(at).to_vec()
    };
    sheet.outline(rectangle([0.0, 0.0, 640.0, 480.0]), Stroke::solid(Ink::Faint, 1.0), None);
    let outline = ellipse(&Point2::new(x, y), &Matrix2::new(xx, xy, xy, yy))?;
    let outline = outline.iter().map(|p| at([p.x, p.y])).collect();
    sheet.outline(outline, Stroke::solid(Ink::Class(0), 2.0), Some((Ink::Class(0), 0.25)));
    sheet.outline(rectangle(seen.projected?), Stroke::solid(Ink::Class(0), 1.4), None);
    sheet.outline(rectangle(measured), Stroke::dashed(Ink::Odometry, 1.8), None);
    for [dx, dy] in touches {
        sheet.dot(at([x + dx, y + dy]), 3.0, Ink::Text);
    }
    caption(&mut sheet, "image: predicted box (solid), detection (dashed)", half + 0.5 * half);
    Some(Picture::new("ellipsoid_and_box", text, sheet))
}

/// Returns the pose of a camera at `from` that looks at `target`, with z up.
fn looking_at(from: &Vector3<f64>, target: &Vector3<f64>) -> Se3 {
    let ahead = (target - from).normalize();
    let right = ahead.cross(&Vector3::z()).normalize();
    let matrix = Matrix3::from_columns(&[right, ahead.cross(&right), ahead]);
    let turn = Rotation3::from_matrix_unchecked(matrix);
    Se3 { rotation: So3::exp(&turn.scaled_axis()), translation: *from }
}

/// Draws the factor graph after one more frame: two poses, three objects, and the factors between them.
pub fn factor_graph(width: f64) -> Picture {
    let text = "The factor graph of one frame: circles are variables, squares are factors";
    let height = 0.46 * width;
    let mut sheet = Sheet::new(width, HEAD + height);
    title(&mut sheet, text);
    let at = |x: f64, y: f64| [x * width, HEAD + y * height];
    let poses = [("x0", at(0.3, 0.28)), ("x1", at(0.7, 0.28))];
    let objects = [("q0: bottle", at(0.2, 0.76)), ("q1: book", at(0.5, 0.76)), ("q2: cup", at(0.8, 0.76))];
    let middle = |a: [f64; 2], b: [f64; 2]| [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
    let mut factor = |ends: &[[f64; 2]], at: [f64; 2], ink: Ink, name: &str, shift: [f64; 2]| {
        for end in ends {
            sheet.line(vec![at, *end], Stroke::solid(Ink::Faint, 1.4));
        }
        let [x, y] = at;
        sheet.area([x - 6.0, y - 6.0, x + 6.0, y + 6.0], ink, 1.0);
        let place = [x + shift[0], y + shift[1]];
        sheet.text(Text::new(name, place, LABELS, Ink::Text).anchored(Anchor::Middle));
    };
    let [before, now] = poses.map(|(_, at)| at);
    factor(&[before], at(0.12, 0.28), Ink::Series(6), "prior", [0.0, -14.0]);
    factor(&[before, now], middle(before, now), Ink::Series(1), "odometry", [0.0, -14.0]);
    for (_, object) in objects {
        let near = [0.45 * now[0] + 0.55 * object[0], 0.45 * now[1] + 0.55 * object[1]];
        factor(&[now, object], near, Ink::Series(0), "", [0.0, 0.0]);
    }
    for (_, object) in &objects[..2] {
        let near = [0.7 * before[0] + 0.3 * object[0], 0.7 * before[1] + 0.3 * object[1]];
        factor(&[before, *object], near, Ink::Series(0), "", [0.0, 0.0]);
    }
    let label = at(0.85, 0.5);
    factor(&[], label, Ink::Series(0), "bounding_box", [58.0, 4.0]);
    for (i, (_, [x, y])) in objects.into_iter().enumerate() {
        let name = ["vertical_orientation", "horizontal_orientation", "vertical_orientation"][i];
        factor(&[[x, y]], [x, y + 0.17 * height], Ink::Series(2), name, [0.0, 22.0]);
    }
    let variables = poses
        .iter()
        .map(|(name, at)| (*name, *at, Ink::Estimate))
        .chain(objects.iter().enumerate().map(|(i, (name, at))| (*name, *at, Ink::Class(i))));
    for (name, at, ink) in variables {
        sheet.dot(at, 17.0, ink);
        sheet.dot(at, 15.0, Ink::Paper);
        let (short, long) = name.split_once(": ").unwrap_or((name, ""));
        sheet.text(Text::new(short, [at[0], at[1] + 4.0], LABELS, Ink::Text).anchored(Anchor::Middle));
        sheet.text(Text::new(long, [at[0] + 24.0, at[1] + 4.0], LABELS, Ink::Text));
    }
    Picture::new("factor_graph", text, sheet)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Theme;

    #[test]
    fn the_camera_looks_at_its_target() {
        let (from, target) = (Vector3::new(1.0, -2.0, 0.5), Vector3::new(0.2, 0.1, 0.3));
        let pose = looking_at(&from, &target);
        let seen = pose.inverse().act(&target);
        assert!(seen.x.abs() < 1e-12 && seen.y.abs() < 1e-12 && seen.z > 2.0, "{seen}");
        let up = pose.rotation.inverse().act(&Vector3::z());
        assert!(up.y < 0.0, "y of an image points down");
    }

    #[test]
    fn diagrams_name_their_parts() {
        let svg = ellipsoid_and_box(800.0).unwrap().svg(Theme::Light);
        assert!(svg.contains("predicted box") && !svg.contains("NaN"));
        let svg = factor_graph(800.0).svg(Theme::Light);
        assert!(
            ["odometry", "bounding_box", "x1", "q2"].iter().all(|name| svg.contains(&format!(">{name}<")))
        );
    }
}
