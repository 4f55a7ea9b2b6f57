//! Residuals at the estimate: their distributions and statistics.
use crate::drawing::{Distribution, Picture};
use manifactor_slam::record::{FactorResiduals, VariantRecord};

/// Draws the distribution of the residuals by type of factor, in standard deviations.
pub(super) fn residuals(variant: &VariantRecord, width: f64) -> Option<Picture> {
    let groups = variant.residuals.iter().map(|of| (of.factor.clone(), of.rows.clone())).collect();
    let title = "residuals at the estimate".to_owned();
    let distribution = Distribution { title, x: "standard deviations".into(), groups };
    let sheet = distribution.sheet(width)?;
    Some(Picture::new("residuals", "residuals at the estimate, by type of factor", sheet))
}

/// Columns of [`row`].
pub(crate) const RESIDUALS: [&str; 7] =
    ["factor", "count", "inactive", "RMS", "median", "largest", "mean weight"];

/// Returns the statistics of one type of factor.
pub(crate) fn row(of: &FactorResiduals) -> Vec<String> {
    let mut sizes: Vec<f64> = of.rows.iter().map(|x| x.abs()).collect();
    sizes.sort_by(f64::total_cmp);
    let rms = (sizes.iter().map(|x| x * x).sum::<f64>() / sizes.len().max(1) as f64).sqrt();
    let median = sizes.get(sizes.len() / 2).copied().unwrap_or_default();
    let largest = sizes.last().copied().unwrap_or_default();
    let counts = [of.count + of.inactive, of.inactive].map(|n| n.to_string());
    let numbers = [rms, median, largest, of.weight].map(|x| format!("{x:.4}"));
    std::iter::once(of.factor.clone()).chain(counts).chain(numbers).collect()
}
