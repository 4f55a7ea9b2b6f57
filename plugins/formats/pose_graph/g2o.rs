//! g2o files: pose graphs in the plane and in space, one vertex or edge per line.
//!
//! | line | fields |
//! | --- | --- |
//! | `VERTEX_SE2` | id x y θ |
//! | `VERTEX_XY` | id x y |
//! | `EDGE_SE2` | from to x y θ, upper triangle of the information by (x, y, θ) |
//! | `EDGE_SE2_XY` | pose point x y, upper triangle of the information |
//! | `EDGE_BEARING_SE2_XY` | pose point angle, information |
//! | `EDGE_PRIOR_SE2` | pose x y θ, upper triangle of the information by (x, y, θ) |
//! | `EDGE_PRIOR_SE2_XY` | pose x y, upper triangle of the information |
//! | `VERTEX_SE3:QUAT` | id x y z qx qy qz qw |
//! | `VERTEX_TRACKXYZ` | id x y z |
//! | `EDGE_SE3:QUAT` | from to x y z qx qy qz qw, upper triangle of the information, translation first |
//! | `EDGE_SE3_TRACKXYZ` | pose point sensor x y z, upper triangle of the information |
//! | `EDGE_SE3_PRIOR` | pose sensor x y z qx qy qz qw, upper triangle of the information, translation first |
//! | `PARAMS_SE3OFFSET` | sensor x y z qx qy qz qw |
//! | `FIX` | id … |
//!
//! The residual of `EDGE_SE3:QUAT` in g2o is (translation, vector part of the quaternion); here it is the
//! full logarithm, rotation first. The information is permuted and otherwise used as written. Read with
//! [`pose_graph::read`](crate::pose_graph::read), write with [`write()`].
use crate::error::Mistake;
use crate::lines::{Fields, id};
use crate::pose_graph::record::{
    Absolute, AbsoluteMeasurement, Edge, Measurement, Parse, Record, Vertex, exchange_halves, upper_triangle,
};
use crate::tum::pose;
use manifactor_geometry::{Point2, Point3, Se2, So2};

mod write;
pub use write::{G2oOmissions, format, write};

/// Returns the parser of a line with this tag.
pub(crate) fn parser(tag: &str) -> Option<Parse> {
    Some(match tag {
        "VERTEX_SE2" => vertex_se2,
        "VERTEX_XY" => vertex_xy,
        "EDGE_SE2" => edge_se2,
        "EDGE_SE2_XY" => edge_se2_xy,
        "EDGE_BEARING_SE2_XY" => edge_bearing_se2_xy,
        "EDGE_PRIOR_SE2" => prior_se2,
        "EDGE_PRIOR_SE2_XY" => prior_se2_xy,
        "EDGE_SE3_PRIOR" => prior_se3,
        "VERTEX_SE3:QUAT" => vertex_se3,
        "VERTEX_TRACKXYZ" => vertex_xyz,
        "EDGE_SE3:QUAT" => edge_se3,
        "EDGE_SE3_TRACKXYZ" => edge_se3_xyz,
        "PARAMS_SE3OFFSET" => sensor,
        "FIX" => fix,
        _ => return None,
    })
}

/// Parses `x y θ`.
pub(crate) fn se2(fields: &mut Fields<'_>) -> Result<Se2, Mistake> {
    let [x, y, theta] = fields.numbers()?;
    Ok(Se2::new(So2::exp(theta), [x, y].into()))
}

pub(crate) fn vertex_se2(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "id x y theta")?;
    Ok(Record::Vertex { id: f.id()?, value: Vertex::Se2(se2(&mut f)?) })
}

fn vertex_xy(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "id x y")?;
    Ok(Record::Vertex { id: f.id()?, value: Vertex::Point2(Point2::new(f.numbers::<2>()?)) })
}

fn vertex_se3(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "id x y z qx qy qz qw")?;
    Ok(Record::Vertex { id: f.id()?, value: Vertex::Se3(pose(&mut f)?) })
}

fn vertex_xyz(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "id x y z")?;
    Ok(Record::Vertex { id: f.id()?, value: Vertex::Point3(Point3::new(f.numbers::<3>()?)) })
}

fn edge_se2(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "from to x y theta I11 I12 I13 I22 I23 I33")?;
    Ok(Record::Edge(Edge {
        from: f.id()?,
        to: f.id()?,
        measurement: Measurement::Se2(se2(&mut f)?),
        information: Some(upper_triangle(3, &f.numbers::<6>()?)),
    }))
}

fn edge_se2_xy(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "pose point x y I11 I12 I22")?;
    Ok(Record::Edge(Edge {
        from: f.id()?,
        to: f.id()?,
        measurement: Measurement::Point2(Point2::new(f.numbers::<2>()?)),
        information: Some(upper_triangle(2, &f.numbers::<3>()?)),
    }))
}

fn edge_bearing_se2_xy(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "pose point angle I11")?;
    let (from, to) = (f.id()?, f.id()?);
    let [angle, information] = f.numbers()?;
    Ok(Record::Edge(Edge {
        from,
        to,
        measurement: Measurement::Bearing2(So2::exp(angle)),
        information: Some(upper_triangle(1, &[information])),
    }))
}

fn prior_se2(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "pose x y theta I11 I12 I13 I22 I23 I33")?;
    Ok(Record::Absolute(Absolute {
        id: f.id()?,
        measurement: AbsoluteMeasurement::Se2(se2(&mut f)?),
        information: upper_triangle(3, &f.numbers::<6>()?),
    }))
}

fn prior_se2_xy(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "pose x y I11 I12 I22")?;
    Ok(Record::Absolute(Absolute {
        id: f.id()?,
        measurement: AbsoluteMeasurement::Position2(Point2::new(f.numbers::<2>()?)),
        information: upper_triangle(2, &f.numbers::<3>()?),
    }))
}

fn prior_se3(text: &str) -> Result<Record, Mistake> {
    let layout = "pose sensor x y z qx qy qz qw I11 I12 I13 I14 I15 I16 I22 I23 I24 I25 I26 I33 I34 I35 I36 \
                  I44 I45 I46 I55 I56 I66";
    let mut f = Fields::of(text, layout)?;
    let (id, sensor) = (f.id()?, f.id()?);
    Ok(Record::Absolute(Absolute {
        id,
        measurement: AbsoluteMeasurement::Se3 { pose: pose(&mut f)?, sensor },
        information: exchange_halves(&upper_triangle(6, &f.numbers::<21>()?)),
    }))
}

fn edge_se3(text: &str) -> Result<Record, Mistake> {
    let layout = "from to x y z qx qy qz qw I11 I12 I13 I14 I15 I16 I22 I23 I24 I25 I26 I33 I34 I35 I36 \
                  I44 I45 I46 I55 I56 I66";
    let mut f = Fields::of(text, layout)?;
    Ok(Record::Edge(Edge {
        from: f.id()?,
        to: f.id()?,
        measurement: Measurement::Se3(pose(&mut f)?),
        information: Some(exchange_halves(&upper_triangle(6, &f.numbers::<21>()?))),
    }))
}

fn edge_se3_xyz(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "pose point sensor x y z I11 I12 I13 I22 I23 I33")?;
    let (from, to, sensor) = (f.id()?, f.id()?, Some(f.id()?));
    let position = Point3::new(f.numbers::<3>()?);
    Ok(Record::Edge(Edge {
        from,
        to,
        measurement: Measurement::Point3 { position, sensor },
        information: Some(upper_triangle(3, &f.numbers::<6>()?)),
    }))
}

fn sensor(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "id x y z qx qy qz qw")?;
    Ok(Record::Sensor { id: f.id()?, pose: pose(&mut f)? })
}

fn fix(text: &str) -> Result<Record, Mistake> {
    match text.is_empty() {
        true => Err(Mistake::Field { expected: "the numbers of vertices after FIX", found: String::new() }),
        false => Ok(Record::Fix(text.split_whitespace().map(id).collect::<Result<_, _>>()?)),
    }
}
