//! Numeric cases from another implementation and from closed forms, read from the file in the environment
//! variable MANIFACTOR_CONFORMANCE. Tolerances: values 1e-9 of the largest entry, Jacobians 1e-8.
#![allow(clippy::print_stdout)]
use manifactor_geometry::{Se3, So3};
use manifactor_graph::{Direction, Factor, Manifold, Residual};
use manifactor_quadric::*;
use nalgebra::{DMatrix, Matrix3, Matrix4, SVector, Vector2, Vector3};
use serde_json::Value;

const VALUES: f64 = 1e-9;
const JACOBIANS: f64 = 1e-8;

/// A case or a part of it, with its path for messages.
struct Node<'a> {
    value: &'a Value,
    path: String,
}

type Checked = Result<(), String>;

impl<'a> Node<'a> {
    fn get(&self, key: &str) -> Result<Node<'a>, String> {
        self.find(key).ok_or_else(|| format!("{} has no `{key}`", self.path))
    }
    fn find(&self, key: &str) -> Option<Node<'a>> {
        self.value.get(key).map(|value| Node { value, path: format!("{}.{key}", self.path) })
    }
    fn text(&self) -> Result<&'a str, String> {
        self.value.as_str().ok_or_else(|| format!("{} is no text", self.path))
    }
    fn numbers(&self) -> Result<DMatrix<f64>, String> {
        let bad = || format!("{} is no number, vector or matrix: {}", self.path, self.value);
        let row = |v: &Value| match v.as_array() {
            Some(row) => row.iter().map(Value::as_f64).collect::<Option<Vec<f64>>>(),
            None => v.as_f64().map(|x| vec![x]),
        };
        let rows = match self.value.as_array() {
            Some(rows) => rows.iter().map(row).collect::<Option<Vec<_>>>().ok_or_else(bad)?,
            None => vec![row(self.value).ok_or_else(bad)?],
        };
        let columns = rows.first().map_or(0, Vec::len);
        if rows.iter().any(|r| r.len() != columns) {
            return Err(bad());
        }
        Ok(DMatrix::from_fn(rows.len(), columns, |r, c| rows[r][c]))
    }
    fn vector<const N: usize>(&self) -> Result<SVector<f64, N>, String> {
        let m = self.numbers()?;
        let fits = m.shape() == (N, 1);
        fits.then(|| SVector::from_fn(|i, _| m[i]))
            .ok_or_else(|| format!("{} has not {N} numbers", self.path))
    }
    fn square<const N: usize>(&self) -> Result<nalgebra::SMatrix<f64, N, N>, String> {
        let m = self.numbers()?;
        let fits = m.shape() == (N, N);
        fits.then(|| nalgebra::SMatrix::from_fn(|r, c| m[(r, c)]))
            .ok_or_else(|| format!("{} is not {N}×{N}", self.path))
    }
    fn pose(&self) -> Result<Se3, String> {
        let m: Matrix4<f64> = self.square()?;
        let rotation = So3::from_matrix(&m.fixed_view::<3, 3>(0, 0).into_owned());
        Ok(Se3::new(rotation, m.fixed_view::<3, 1>(0, 3).into_owned()))
    }
    fn quadric(&self) -> Result<DualQuadric, String> {
        let semi_axes = self.find("semi_axes").map_or_else(|| self.get("radii"), Ok)?.vector()?;
        Ok(DualQuadric { pose: self.get("quadric_pose_4x4")?.pose()?, semi_axes })
    }
    fn camera_pose(&self) -> Result<Se3, String> {
        match self.find("camera") {
            Some(camera) => camera.get("pose_4x4")?.pose(),
            None => self.get("camera_pose_4x4")?.pose(),
        }
    }
    fn camera(&self) -> Result<Camera, String> {
        let k: Matrix3<f64> = match (self.find("K_3x3"), self.find("K")) {
            (Some(k), _) => k.square()?,
            (None, Some(k)) => {
                let n = |key: &str| Ok::<_, String>(k.get(key)?.numbers()?[0]);
                Matrix3::new(n("fx")?, n("skew")?, n("cx")?, 0.0, n("fy")?, n("cy")?, 0.0, 0.0, 1.0)
            }
            // The quantities of this case need no camera.
            (None, None) => Matrix3::identity(),
        };
        let size = self.find("image_wh").map_or(Ok(Vector2::repeat(1.0)), |size| size.vector())?;
        let camera = Camera::new([k.m11, k.m22, k.m13, k.m23], size.x as u32, size.y as u32);
        Ok(Camera { skew: k.m12, ..camera.map_err(|e| e.to_string())? })
    }

    /// Compares with numbers of equal shape; a vector matches a row.
    fn is(&self, found: impl Into<DMatrix<f64>>, tolerance: f64) -> Checked {
        let (found, expected) = (found.into(), self.numbers()?);
        if found.len() != expected.len() {
            return Err(format!("{}: expected {expected}, found {found}", self.path));
        }
        let found = if found.nrows() == expected.nrows() { found } else { found.transpose() };
        let scale = if expected.amax() > 0.0 { expected.amax() } else { 1.0 };
        let error = (&found - &expected).amax() / scale;
        // This form also rejects NaN.
        if error <= tolerance {
            Ok(())
        } else {
            Err(format!("{}: off by {error:e} of its size; expected {expected}found {found}", self.path))
        }
    }
    fn is_bool(&self, found: bool) -> Checked {
        match self.value.as_bool() {
            Some(expected) if expected == found => Ok(()),
            _ => Err(format!("{}: expected {}, found {found}", self.path, self.value)),
        }
    }
    fn is_box(&self, found: Option<BoundingBox>) -> Checked {
        match (self.value, found) {
            (Value::Null, None) => Ok(()),
            (Value::Null, Some(b)) => Err(format!("{}: expected nothing, found {b:?}", self.path)),
            (_, None) => Err(format!("{}: expected {}, found nothing", self.path, self.value)),
            (_, Some(b)) => self.is(row(&b.bounds()), VALUES),
        }
    }
    /// Runs a check for each entry; an unknown entry is an error.
    fn each(&self, mut check: impl FnMut(&str, &Node<'a>) -> Option<Checked>) -> Checked {
        let entries = self.value.as_object().ok_or_else(|| format!("{} is no table", self.path))?;
        for key in entries.keys() {
            let node = self.get(key)?;
            check(key, &node).unwrap_or_else(|| Err(format!("{}: not known to this test", node.path)))?;
        }
        Ok(())
    }
}

fn row(x: &[f64]) -> DMatrix<f64> {
    DMatrix::from_row_slice(1, x.len(), x)
}

fn dense<const R: usize, const C: usize>(m: nalgebra::SMatrix<f64, R, C>) -> DMatrix<f64> {
    DMatrix::from_column_slice(R, C, m.as_slice())
}

/// The reference detects an ellipse by the sign of a minor of C/C₃₃, with C the inverse of C*. It accepts an
/// ellipse without real points and rejects one through the image origin, at which C₃₃ = 0.
fn is_ellipse(node: &Node<'_>, conic: &DualConic) -> Checked {
    let found = conic.is_ellipse();
    let primal = conic.0.try_inverse();
    let through_origin = primal.is_some_and(|c| c[(2, 2)].abs() < 1e-12 * c.amax());
    let imaginary = primal.is_some_and(|c| c.cholesky().is_some() || (-c).cholesky().is_some());
    if (found && through_origin) || (!found && imaginary) {
        let why = if imaginary { "has no real points" } else { "passes through the origin" };
        println!("{}: the reference says {} of a conic that {why}; {found} is right", node.path, node.value);
        return Ok(());
    }
    node.is_bool(found)
}

fn quadric_matrix(input: &Node<'_>, output: &Node<'_>) -> Checked {
    let q = input.quadric()?;
    let b = q.axes_aligned_box();
    output.each(|key, node| {
        Some(match key {
            "dual_quadric_4x4" => node.is(dense(q.matrix()), VALUES),
            "aabb_xxyyzz" => node.is(row(&[b.min.x, b.max.x, b.min.y, b.max.y, b.min.z, b.max.z]), VALUES),
            "centroid" => node.is(dense(q.centroid()), VALUES),
            _ => return None,
        })
    })
}

fn constrain(input: &Node<'_>, output: &Node<'_>, differs: bool) -> Checked {
    let matrix = input.get("matrix_4x4")?.square()?;
    match (DualQuadric::from_matrix(&matrix), differs) {
        (Err(_), true) => Ok(()),
        (Ok(q), true) => Err(format!("{}: expected an error, found {q:?}", input.path)),
        (Err(error), false) => Err(format!("{}: {error}", input.path)),
        // Axes may be permuted, so the matrix is compared.
        (Ok(q), false) => {
            output.get("translation")?.is(dense(q.centroid()), VALUES)?;
            output.get("matrix_of_result_4x4")?.is(dense(q.matrix()), VALUES)
        }
    }
}

fn visibility(input: &Node<'_>, output: &Node<'_>) -> Checked {
    let (q, pose) = (input.quadric()?, input.camera_pose()?);
    let seen = Ellipsoid::in_camera_frame(&pose, &q);
    output.each(|key, node| {
        Some(match key {
            "isBehind" => node.is_bool(seen.centroid.z < 0.0),
            "contains" => node.is_bool(q.contains(&pose.translation)),
            "isEllipse" => is_ellipse(node, &seen.dual_conic(&input.camera().ok()?)),
            _ => return None,
        })
    })
}

fn conic(conic: &DualConic, key: &str, node: &Node<'_>) -> Option<Checked> {
    Some(match key {
        "bounds" | "bounds_xmin_ymin_xmax_ymax" => node.is_box(conic.bounds()),
        "isEllipse" => is_ellipse(node, conic),
        "isDegenerate" => node.is_bool(conic.is_degenerate()),
        _ => return None,
    })
}

fn projection(input: &Node<'_>, output: &Node<'_>) -> Checked {
    let (q, pose, camera) = (input.quadric()?, input.camera_pose()?, input.camera()?);
    let seen = Ellipsoid::in_camera_frame(&pose, &q);
    let dual = seen.dual_conic(&camera);
    output.each(|key, node| match key {
        "P_3x4" => Some(node.is(dense(camera.projection(&pose)), VALUES)),
        "dual_conic_3x3" => Some(node.is(dense(dual.0), VALUES)),
        _ => conic(&dual, key, node),
    })
}

fn factor(input: &Node<'_>, model: BoxModel) -> Result<(BoundingBoxFactor, Se3, DualQuadric), String> {
    let measured = input.find("measured").map_or(Ok(SVector::zeros()), |b| b.vector::<4>())?;
    let bounding_box = BoundingBox::new(measured.into()).map_err(|e| e.to_string())?;
    Ok((
        BoundingBoxFactor { bounding_box, camera: input.camera()?, model },
        input.camera_pose()?,
        input.quadric()?,
    ))
}

fn standard_factor(input: &Node<'_>, output: &Node<'_>) -> Checked {
    let (factor, pose, q) = factor(input, BoxModel::Standard)?;
    let erased = Factor::erased(&factor);
    for way in [erased.linearize(&[&pose, &q]), erased.autodiff(&[&pose, &q])] {
        let l = way.ok_or("the variables do not fit")?;
        output.each(|key, node| {
            Some(match key {
                "error" => node.is(row(&l.residual), VALUES),
                "H_pose_4x6" => node.is(l.jacobians[0].clone(), JACOBIANS),
                "H_quadric_4x9" => {
                    // d/d(log s) = s d/ds.
                    let mut by_log = node.numbers().ok()?;
                    for i in 0..3 {
                        by_log.column_mut(6 + i).scale_mut(q.semi_axes[i]);
                    }
                    let error = (&l.jacobians[1] - &by_log).amax() / by_log.amax();
                    let message = || format!("{}: off by {error:e}; expected {by_log}", node.path);
                    if error <= JACOBIANS { Ok(()) } else { Err(message()) }
                }
                _ => return None,
            })
        })?;
    }
    Ok(())
}

/// Only checks that the factor reports itself as undefined.
fn failing_factor(input: &Node<'_>) -> Checked {
    for model in [BoxModel::Standard, BoxModel::Truncated] {
        let (factor, pose, q) = factor(input, model)?;
        let l = Factor::erased(&factor).linearize(&[&pose, &q]).ok_or("the variables do not fit")?;
        let zero = l.residual.iter().chain(l.jacobians.iter().flatten()).all(|x| *x == 0.0);
        if factor.is_defined((&pose, &q)) || !zero {
            return Err(format!("{}: expected an inactive factor, found {l:?}", input.path));
        }
    }
    Ok(())
}

fn truncated_factor(input: &Node<'_>, output: &Node<'_>) -> Checked {
    let (pose, q, camera) = (input.camera_pose()?, input.quadric()?, input.camera()?);
    let seen = Ellipsoid::in_camera_frame(&pose, &q);
    let outline = seen.is_in_front().then(|| seen.outline(&camera));
    let box_of = |bounds: Option<[f64; 4]>| bounds.and_then(|b| BoundingBox::new(b).ok());
    output.each(|key, node| {
        Some(match key {
            "truncated_bounds" => node
                .is_box(box_of(outline.and_then(|o| o.truncated_bounds(camera.size()))))
                .and(node.is_box(seen.dual_conic(&camera).truncated_bounds(camera.width, camera.height))),
            "untruncated_bounds" => node.is_box(box_of(outline.map(|o| o.bounds()))),
            "reference_said" => Ok(()),
            _ => return None,
        })
    })
}

fn box2(input: &Node<'_>, output: &Node<'_>, differs: bool) -> Checked {
    let read = |key| BoundingBox::new(input.get(key)?.vector::<4>()?.into()).map_err(|e| e.to_string());
    let (a, b) = (read("a")?, read("b")?);
    output.each(|key, node| {
        Some(match key {
            "iou" => node.is(row(&[a.iou(&b)]), VALUES),
            "contains" => node.is_bool(a.contains(&b)),
            // The reference returns false for a box inside another one.
            "intersects" if differs && (a.contains(&b) || b.contains(&a)) => match a.intersects(&b) {
                true => Ok(()),
                false => Err(format!("{}: a box inside of another intersects it", node.path)),
            },
            "intersects" => node.is_bool(a.intersects(&b)),
            "width" => node.is(row(&[a.width()]), VALUES),
            "height" => node.is(row(&[a.height()]), VALUES),
            "center" => node.is(dense(a.centre()), VALUES),
            "lines" => node.is(DMatrix::from_fn(4, 3, |r, c| a.lines()[r][c]), VALUES),
            _ => return None,
        })
    })
}

fn box3(input: &Node<'_>, output: &Node<'_>) -> Checked {
    let read = |key| {
        let b = input.get(key)?.vector::<6>()?;
        Box3::new(Vector3::new(b[0], b[2], b[4]), Vector3::new(b[1], b[3], b[5])).map_err(|e| e.to_string())
    };
    let (a, b): (Box3, Box3) = (read("a")?, read("b")?);
    output.each(|key, node| {
        Some(match key {
            "iou" => node.is(row(&[a.iou(&b)]), VALUES),
            "dimensions" => node.is(dense(a.dimensions()), VALUES),
            "centroid" => node.is(dense(a.centroid()), VALUES),
            "volume" => node.is(row(&[a.volume()]), VALUES),
            _ => return None,
        })
    })
}

fn view(input: &Node<'_>, output: &Node<'_>) -> Checked {
    let (q, pose, camera) = (input.quadric()?, input.camera_pose()?, input.camera()?);
    let seen = Ellipsoid::in_camera_frame(&pose, &q);
    let outline = seen.is_in_front().then(|| seen.outline(&camera)).ok_or("it should be in front")?;
    let up = Direction::new(input.get("up")?.vector()?).map_err(|e| e.to_string())?;
    let mut squares = q.semi_axes.map(|s| s * s).as_slice().to_vec();
    squares.sort_by(f64::total_cmp);
    output.each(|key, node| {
        Some(match key {
            "dual_quadric_4x4" => node.is(dense(q.matrix()), VALUES),
            "dual_conic_3x3_unit_corner" => node.is(dense(seen.dual_conic(&camera).unit_corner()?), VALUES),
            "bounds" => node.is_box(BoundingBox::new(outline.bounds()).ok()),
            "truncated_bounds" => {
                let bounds = outline.truncated_bounds(camera.size());
                node.is_box(bounds.and_then(|b| BoundingBox::new(b).ok()))
            }
            "aabb_min" => node.is(dense(q.axes_aligned_box().min), VALUES),
            "aabb_max" => node.is(dense(q.axes_aligned_box().max), VALUES),
            "cosine" => node.is(row(&[q.major_axis().dot(&up).abs()]), VALUES),
            "vertical_residual" => {
                node.is(dense(VerticalOrientation { up: up.into() }.residual::<f64>((q,))), VALUES)
            }
            "horizontal_residual" => {
                node.is(dense(HorizontalOrientation { up: up.into() }.residual::<f64>((q,))), VALUES)
            }
            "axis_gap" => node.is(row(&[(squares[2] - squares[1]) / squares[2]]), VALUES),
            _ => return None,
        })
    })
}

fn run(case: &Node<'_>) -> Checked {
    let (input, output) = (case.get("input")?, case.get("output")?);
    let (kind, expect) = (case.get("kind")?.text()?, case.get("expect")?.text()?);
    let differs = match expect {
        "differ" => true,
        "match" | "pose_part" | "truncated_bounds" => false,
        other => return Err(format!("{}: `expect` = `{other}` is not known to this test", case.path)),
    };
    match kind {
        "quadric_matrix" => quadric_matrix(&input, &output),
        "constrain" => constrain(&input, &output, differs),
        "retract" => {
            let moved = input.quadric()?.retract(&input.get("v9")?.vector()?);
            output.get("quadric_pose_4x4")?.is(dense(moved.pose.matrix()), VALUES)
        }
        "localCoordinates" => {
            let delta = input.get("q1")?.quadric()?.local(&input.get("q2")?.quadric()?);
            let expected = output.get("v9")?.vector::<9>()?;
            let error = (delta.fixed_rows::<6>(0) - expected.fixed_rows::<6>(0)).amax() / expected.amax();
            if error <= VALUES { Ok(()) } else { Err(format!("{}: off by {error:e}", output.path)) }
        }
        _ if differs && !matches!(kind, "bbox_factor_failure" | "box2") => not_to_be_matched(case, kind),
        "visibility" => visibility(&input, &output),
        "projection" => projection(&input, &output),
        "conic" => {
            let dual = DualConic(input.get("dual_conic_3x3")?.square()?);
            output.each(|key, node| conic(&dual, key, node))
        }
        "bbox_factor_failure" => failing_factor(&input),
        "bbox_factor_standard" => standard_factor(&input, &output),
        "bbox_factor_truncated" => truncated_factor(&input, &output),
        "box2" => box2(&input, &output, differs),
        "box3" => box3(&input, &output),
        "view" => view(&input, &output),
        other => Err(format!("{}: cases of kind `{other}` are not known to this test", case.path)),
    }
}

/// A case that is wrong in the reference and whose kind has no expected answer in the file.
fn not_to_be_matched(case: &Node<'_>, kind: &str) -> Checked {
    let why = case.find("why").and_then(|why| why.text().ok()).unwrap_or("it does not say why");
    println!("{}: a {kind} that is not to be matched: {why}", case.path);
    Ok(())
}

#[test]
fn every_case_comes_out_as_expected() {
    let Some(path) = std::env::var_os("MANIFACTOR_CONFORMANCE").filter(|path| !path.is_empty()) else {
        println!("skipped: MANIFACTOR_CONFORMANCE names no file with cases");
        return;
    };
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let file: Value = serde_json::from_str(&text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let cases = file["cases"].as_array().expect("a list `cases`");
    let mut wrong = vec![];
    for case in cases {
        let path = format!("case {} ({}, {})", case["id"], case["kind"], case["name"]);
        wrong.extend(run(&Node { value: case, path }).err());
    }
    println!("{} of {} cases as expected", cases.len() - wrong.len(), cases.len());
    assert!(!cases.is_empty() && wrong.is_empty(), "{} cases are off:\n{}", wrong.len(), wrong.join("\n"));
}
