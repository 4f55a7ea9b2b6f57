//! Operators and text: `a * b` composes, `a * v` acts on a vector, and `Display` writes poses.
use crate::{Se2, Se3, Sim3, So2, So3};
use manifactor_graph::Scalar;
use nalgebra::{Vector2, Vector3};
use std::fmt::{self, Display, Formatter};
use std::ops::Mul;

macro_rules! operators {
    ($($group:ident on $vector:ident),+) => {$(
        /// Composes a·b; `b` is applied first.
        impl<T: Scalar> Mul for $group<T> {
            type Output = Self;
            fn mul(self, b: Self) -> Self {
                self.compose(&b)
            }
        }

        /// Applies [`act`](Self::act) to the vector; a pose maps a point to the outer frame.
        impl<T: Scalar> Mul<$vector<T>> for $group<T> {
            type Output = $vector<T>;
            fn mul(self, v: $vector<T>) -> $vector<T> {
                self.act(&v)
            }
        }
    )+};
}
operators!(So2 on Vector2, Se2 on Vector2, So3 on Vector3, Se3 on Vector3, Sim3 on Vector3);

/// Writes `(1.000, -2.000)` with the format's number of decimals, or three.
fn list(f: &mut Formatter<'_>, numbers: &[f64]) -> fmt::Result {
    let decimals = f.precision().unwrap_or(3);
    let parts: Vec<String> = numbers.iter().map(|x| format!("{x:.decimals$}")).collect();
    write!(f, "({})", parts.join(", "))
}

/// Writes `17.189°`.
impl Display for So2 {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let decimals = f.precision().unwrap_or(3);
        write!(f, "{:.decimals$}°", self.angle().to_degrees())
    }
}

/// Writes `(1.000, 2.000) m, 17.189°`.
impl Display for Se2 {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        list(f, self.translation.as_slice())?;
        f.write_str(" m, ")?;
        self.rotation.fmt(f)
    }
}

/// Writes `90.000° about (0.000, 0.000, 1.000)`.
impl Display for So3 {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let (omega, decimals) = (self.log(), f.precision().unwrap_or(3));
        write!(f, "{:.decimals$}°", omega.norm().to_degrees())?;
        match omega.try_normalize(0.0) {
            Some(axis) => {
                f.write_str(" about ")?;
                list(f, axis.as_slice())
            }
            None => Ok(()),
        }
    }
}

/// Writes `(1.000, 0.000, 0.500) m, 90.000° about (0.000, 0.000, 1.000)`.
impl Display for Se3 {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        list(f, self.translation.as_slice())?;
        f.write_str(" m, ")?;
        self.rotation.fmt(f)
    }
}

/// Writes `(1.000, 0.000, 0.500) m, 90.000° about (0.000, 0.000, 1.000), scale 1.200`.
impl Display for Sim3 {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        self.pose().fmt(f)?;
        let decimals = f.precision().unwrap_or(3);
        write!(f, ", scale {:.decimals$}", self.scale)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{Vector6, vector};
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn a_product_composes_and_acts() {
        let (a, b) = (Se3::exp(&vector![0.1, 0.2, 0.3, 1.0, 2.0, 3.0]), Se3::exp(&Vector6::repeat(0.4)));
        let p = vector![1.0, -1.0, 0.5];
        assert_eq!((a * b, a * p), (a.compose(&b), a.act(&p)));
        assert!(((a * b) * p - a * (b * p)).norm() < 1e-12);
        let (a, p) = (Se2::exp(&vector![1.0, 2.0, 0.3]), vector![0.5, 0.25]);
        assert!(((a * a.inverse()) * p - p).norm() < 1e-12);
    }

    #[test]
    fn poses_are_reported_in_metres_and_degrees() {
        let turn = So3::exp(&vector![0.0, 0.0, FRAC_PI_2]);
        let text = Se3::new(turn, vector![1.0, 0.0, 0.5]).to_string();
        assert_eq!(text, "(1.000, 0.000, 0.500) m, 90.000° about (0.000, 0.000, 1.000)");
        assert_eq!(So3::identity().to_string(), "0.000°");
        let pose = Se2::exp(&vector![0.0, 0.0, 0.3]);
        assert_eq!(format!("{pose:.1}"), "(0.0, 0.0) m, 17.2°");
    }
}
