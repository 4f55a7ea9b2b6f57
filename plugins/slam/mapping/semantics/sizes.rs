//! `sizes`: typical sizes of classes. Each becomes a rule with the factor `size_prior`.
use super::{RuleFactor, SemanticRule};
use manifactor_graph::loss::Cauchy;
use manifactor_graph::{Factor, Noise, number};
use manifactor_quadric::{AxisOrder, SemiAxes, SizePrior};
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::Deserialize;
use std::f64::consts::FRAC_2_PI;
use std::sync::Arc;

number! {
    /// Extent of an object. Unit: metres.
    pub Extent: "a length from 1e-6 to 1e6 metres", |x| x >= 1e-6 && x <= 1e6, { "minimum": 1e-6, "maximum": 1e6 };
    /// Factor by which sizes of a class differ.
    pub Spread: "a factor above 1, at most 100", |x| x > 1.0 && x <= 100.0, { "exclusiveMinimum": 1, "maximum": 100 };
}

/// Typical size of objects of some classes: extents with a log-normal spread.
///
/// It becomes a rule with the factor `size_prior` and a Cauchy loss. `size_m` are the extents of a box around the
/// object. An ellipsoid that fits the outlines of a box is larger than the box, and the rule takes this into
/// account, unless the `shape` is an ellipsoid.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ClassSize {
    /// Class names, in the spelling of any detector.
    pub classes: Vec<String>,
    /// Extents of a box around the object, in any order. Unit: metres.
    pub size_m: [Extent; 3],
    /// Shape of the objects.
    #[serde(default)]
    pub shape: Shape,
    /// Factor within which two thirds of all objects lie: 1.5 is from 2/3 to 3/2 of `size_m`.
    pub spread: Spread,
    /// Source of the numbers, for readers.
    #[serde(default)]
    pub source: Option<String>,
}

/// Shape of the objects of a class.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Shape {
    /// A box, or a body that fills most of one.
    #[default]
    Box,
    /// A ball, a fruit, or another ellipsoid.
    Ellipsoid,
}

impl ClassSize {
    /// Returns the semi-axes of the ellipsoid whose outlines are as wide as those of the shape. A box with half
    /// extents a reaches Σ aₖ|uₖ| along a direction u, and an ellipsoid √Σ sₖ²uₖ². The mean squares over all
    /// directions are equal for sₖ² = aₖ² + (2/π) aₖ Σ aⱼ, with the sum over the other two extents.
    pub fn semi_axes(&self) -> Vector3<f64> {
        let half = Vector3::from(self.size_m.map(|extent| 0.5 * *extent));
        match self.shape {
            Shape::Ellipsoid => half,
            Shape::Box => half.map(|a| (a * a + FRAC_2_PI * a * (half.sum() - a)).sqrt()),
        }
    }

    /// Returns the standard deviation of the logarithms of the extents.
    pub fn log_sigma(&self) -> f64 {
        self.spread.ln()
    }

    /// Returns the rule that states this size. `None` never occurs: the extents are valid semi-axes.
    pub(super) fn rule(self) -> Option<SemanticRule> {
        let semi_axes = SemiAxes::new(self.semi_axes()).ok()?;
        let factor: Arc<dyn Factor> = Arc::new(SizePrior { semi_axes, order: AxisOrder::Sorted });
        let document = serde_json::to_value(&factor).ok()?;
        Some(SemanticRule {
            noise: Noise::sigma(self.log_sigma()).ok()?,
            classes: self.classes,
            except: vec![],
            min_score: None,
            min_size_m: None,
            max_size_m: None,
            near: None,
            mixture: false,
            with: vec![],
            factor: RuleFactor::new(factor, document),
            loss: Some(Arc::new(Cauchy::default())),
            optional: false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::semantics::read::shipped_sizes;

    fn size(size_m: [f64; 3]) -> ClassSize {
        let size_m = size_m.map(Extent::literal);
        ClassSize {
            classes: vec!["cup".into()],
            size_m,
            shape: Shape::Box,
            spread: Spread::literal(1.5),
            source: None,
        }
    }

    #[test]
    fn the_ellipsoid_of_a_box_has_equally_wide_outlines() {
        for extents in [[0.44, 0.15, 0.03], [1.0, 1.0, 1.0], [2.0, 0.1, 0.1]] {
            let (half, semi_axes) = (Vector3::from(extents) / 2.0, size(extents).semi_axes());
            // directions of equal density on the sphere, along a spiral
            let n = 20_000;
            let directions = (0..n).map(|i| {
                let z = (2.0 * f64::from(i) + 1.0) / f64::from(n) - 1.0;
                let angle = f64::from(i) * 2.399_963_229_728_653;
                let across = (1.0 - z * z).sqrt();
                Vector3::new(across * angle.cos(), across * angle.sin(), z)
            });
            let squares = directions.map(|u| {
                let of_box = u.abs().dot(&half).powi(2);
                (of_box, u.component_mul(&semi_axes).norm_squared())
            });
            let [of_box, of_ellipsoid] =
                squares.fold([0.0; 2], |sum, (a, b)| [sum[0] + a, sum[1] + b]).map(|sum| sum / f64::from(n));
            assert!((of_box / of_ellipsoid - 1.0).abs() < 1e-3, "{of_box} {of_ellipsoid}");
        }
    }

    #[test]
    fn a_ball_keeps_its_radius() {
        let ball = ClassSize { shape: Shape::Ellipsoid, ..size([0.22; 3]) };
        assert_eq!(ball.semi_axes(), Vector3::repeat(0.11));
    }

    #[test]
    fn a_thin_rod_keeps_its_length() {
        let semi_axes = size([2.0, 1e-6, 1e-6]).semi_axes();
        assert!((semi_axes.x - 1.0).abs() < 1e-6 && semi_axes.y < 1e-3);
    }

    #[test]
    fn the_household_table_has_a_source_and_a_wide_spread_for_each_class() {
        let rows = shipped_sizes("household").unwrap();
        let mut classes: Vec<&str> = rows.iter().flat_map(|row| &row.classes).map(String::as_str).collect();
        assert!(["cup", "keyboard", "tv monitor", "car"].iter().all(|class| classes.contains(class)));
        let named = classes.len();
        classes.sort_unstable();
        classes.dedup();
        assert_eq!(classes.len(), named);
        for row in &rows {
            assert!(row.source.as_ref().is_some_and(|source| !source.is_empty()), "{row:?}");
            assert!(*row.spread >= 1.4, "{row:?}");
        }
    }
}
