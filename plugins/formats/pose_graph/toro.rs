//! Pose graphs in TORO format, read by [`pose_graph::read`](crate::pose_graph::read) like g2o files.
//!
//! `VERTEX2` id x y θ · `EDGE2` from to x y θ I11 I12 I22 I33 I13 I23 (in that order) · `VERTEX3` id x y z
//! roll pitch yaw · `EDGE3` from to x y z roll pitch yaw, upper triangle of the information, translation
//! first · `EQUIV` a b. The rotation is Rz(yaw)·Ry(pitch)·Rx(roll). Edges may omit the information. `VERTEX`
//! and `EDGE` are older names for `VERTEX2` and `EDGE2`.
use crate::error::Mistake;
use crate::lines::Fields;
use crate::pose_graph::g2o::{se2, vertex_se2};
use crate::pose_graph::record::{Edge, Measurement, Parse, Record, Vertex, exchange_halves, upper_triangle};
use manifactor_geometry::{Se3, So3};
use nalgebra::Vector3;

/// Returns the parser of a line with this tag.
pub(crate) fn parser(tag: &str) -> Option<Parse> {
    Some(match tag {
        "VERTEX2" | "VERTEX" => vertex_se2,
        "EDGE2" | "EDGE" => edge2,
        "VERTEX3" => vertex3,
        "EDGE3" => edge3,
        "EQUIV" => equivalent,
        _ => return None,
    })
}

fn edge2(text: &str) -> Result<Record, Mistake> {
    let bare = text.split_whitespace().count() == 5;
    let layout = if bare { "from to x y theta" } else { "from to x y theta I11 I12 I22 I33 I13 I23" };
    let mut f = Fields::of(text, layout)?;
    let (from, to, measurement) = (f.id()?, f.id()?, Measurement::Se2(se2(&mut f)?));
    let information = match bare {
        true => None,
        false => {
            let [i11, i12, i22, i33, i13, i23] = f.numbers()?;
            Some(upper_triangle(3, &[i11, i12, i13, i22, i23, i33]))
        }
    };
    Ok(Record::Edge(Edge { from, to, measurement, information }))
}

/// Parses `x y z roll pitch yaw`.
fn se3(f: &mut Fields<'_>) -> Result<Se3, Mistake> {
    let translation = f.numbers::<3>()?.into();
    let [roll, pitch, yaw] = f.numbers()?;
    let about = |axis: usize, angle: f64| So3::exp(&Vector3::ith(axis, angle));
    Ok(Se3::new(about(2, yaw).compose(&about(1, pitch)).compose(&about(0, roll)), translation))
}

fn vertex3(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "id x y z roll pitch yaw")?;
    Ok(Record::Vertex { id: f.id()?, value: Vertex::Se3(se3(&mut f)?) })
}

fn edge3(text: &str) -> Result<Record, Mistake> {
    let bare = text.split_whitespace().count() == 8;
    let layout = match bare {
        true => "from to x y z roll pitch yaw",
        false => {
            "from to x y z roll pitch yaw I11 I12 I13 I14 I15 I16 I22 I23 I24 I25 I26 I33 I34 I35 I36 I44 \
             I45 I46 I55 I56 I66"
        }
    };
    let mut f = Fields::of(text, layout)?;
    let (from, to, measurement) = (f.id()?, f.id()?, Measurement::Se3(se3(&mut f)?));
    let information = match bare {
        true => None,
        false => Some(exchange_halves(&upper_triangle(6, &f.numbers::<21>()?))),
    };
    Ok(Record::Edge(Edge { from, to, measurement, information }))
}

fn equivalent(text: &str) -> Result<Record, Mistake> {
    let mut f = Fields::of(text, "id id")?;
    Ok(Record::Equivalent(f.id()?, f.id()?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    fn edge(text: &str, parse: Parse) -> Edge {
        match parse(text) {
            Ok(Record::Edge(edge)) => edge,
            other => panic!("expected an edge, got {other:?}"),
        }
    }

    #[test]
    fn the_information_of_edge2_is_in_toros_order() {
        let m = edge("0 1 1 2 3 11 12 22 33 13 23", edge2).information.unwrap();
        assert_eq!(m, nalgebra::dmatrix![11., 12., 13.; 12., 22., 23.; 13., 23., 33.]);
    }

    #[test]
    fn the_information_of_edge3_is_translation_first() {
        let text = "0 1 1 2 3 0 0 0 1 0 0 0 0 0 2 0 0 0 0 3 0 0 0 4 0 0 5 0 6";
        let diagonal = edge(text, edge3).information.unwrap().diagonal();
        assert_eq!(diagonal.as_slice(), [4., 5., 6., 1., 2., 3.]);
    }

    #[test]
    fn information_is_optional() {
        assert!(edge("0 1 1 2 3", edge2).information.is_none());
        assert!(edge("0 1 1 2 3 0 0 0", edge3).information.is_none());
        let mistake = edge3("0 1 1 2 3 0 0 0 1").unwrap_err().to_string();
        assert!(mistake.starts_with("expected 29 fields"), "{mistake}");
    }

    #[test]
    fn roll_turns_first_and_yaw_last() {
        let Ok(Record::Vertex { value: Vertex::Se3(pose), .. }) =
            vertex3(&format!("7 0 0 0 {FRAC_PI_2} 0 {FRAC_PI_2}"))
        else {
            panic!("expected a vertex")
        };
        // Roll rotates y to z, which yaw then keeps; if yaw were applied first, it would rotate y to -x.
        assert!((pose.act(&Vector3::y()) - Vector3::z()).norm() < 1e-15);
        assert!((pose.act(&Vector3::x()) - Vector3::y()).norm() < 1e-15);
    }
}
