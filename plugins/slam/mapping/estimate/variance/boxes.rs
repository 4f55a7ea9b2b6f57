//! Noise of boxes: its size, its growth with the box, its differences between objects, and its correlation.
use super::correlation::autocorrelation_time;
use super::{BoxGroups, VarianceSettings};
use crate::mapping::{MappedObject, Mapping};
use indexmap::IndexMap;
use manifactor_geometry::OnBody;
use manifactor_graph::batch::FactorState;
use manifactor_graph::noise::NoiseError;
use manifactor_graph::{FactorEntry, Key, Noise};
use manifactor_quadric::BoundingBoxFactor;
use serde::Serialize;

/// The noise of a group of boxes.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct BoxComponent {
    /// Constant standard deviation of each side, in pixels.
    pub sigma_px: f64,
    /// Standard deviation relative to the size: to the width for left and right sides, to the height for
    /// upper and lower ones. Its variance adds to that of `sigma_px`. 0 if the setting `size` is off.
    pub of_size: f64,
    /// Number of consecutive boxes with as much information as one independent box.
    pub correlation_time: f64,
    /// Standard deviation in the graph, for a box of the mean size: √(correlation_time) · σ.
    pub effective_px: f64,
}

/// Median of |x| for a standard normal x.
const MEDIAN: f64 = 0.674_489_750_196_081_7;
/// Variance of the logarithm of a standard deviation from the median of n samples, times n. The efficiency of
/// the median is 37 % (Rousseeuw and Croux, *Alternatives to the Median Absolute Deviation*, 1993).
const MEDIAN_VARIANCE: f64 = 0.5 / 0.3678;
/// Redundancy 1 - h below which a row has no information about its noise.
const MIN_REDUNDANCY: f64 = 1e-9;
/// Number of bins of box sizes, at most; `MIN_BIN_ERRORS` is the smallest number of errors in a bin.
const MAX_BINS: usize = 8;
const MIN_BIN_ERRORS: usize = 20;
/// Variance of the squared sizes, relative to their mean square, below which all sizes count as equal.
const EQUAL_SIZE_VARIANCE: f64 = 1e-6;

impl BoxComponent {
    /// Creates the noise of a group. `size` is the mean size of its boxes, in pixels.
    pub(super) fn of(sigma_px: f64, of_size: f64, correlation_time: f64, size: f64) -> Self {
        let new = Self { sigma_px, of_size, correlation_time, effective_px: 0.0 };
        Self { effective_px: new.sigma_at(size) * new.inflation(), ..new }
    }

    /// Returns the noise multiplied by a factor.
    fn scaled(self, by: f64) -> Self {
        let Self { sigma_px, of_size, effective_px, .. } = self;
        Self { sigma_px: by * sigma_px, of_size: by * of_size, effective_px: by * effective_px, ..self }
    }

    /// Returns the noise of a box with these extents.
    pub(super) fn noise(&self, size: Option<[f64; 2]>) -> Result<Noise, NoiseError> {
        match size.filter(|_| self.of_size > 0.0) {
            None => Noise::sigma(self.effective_px),
            Some(size) => {
                let [x, y] = size.map(|size| self.sigma_at(size) * self.inflation());
                Noise::sigmas(&[x, y, x, y])
            }
        }
    }

    /// Returns the ratio of the standard deviation in the graph to the one of residuals.
    fn inflation(&self) -> f64 {
        self.correlation_time.sqrt()
    }

    /// Returns the standard deviation of a side, for the extent of its box.
    pub(super) fn sigma_at(&self, size: f64) -> f64 {
        self.sigma_px.hypot(self.of_size * size)
    }
}

/// Returns the box factor of an entry; `None` for other factors.
pub(super) fn box_of(entry: &FactorEntry) -> Option<&BoundingBoxFactor> {
    OnBody::unwrapped(&*entry.factor).erased().as_any().downcast_ref()
}

/// Returns width and height of the measured box; `None` for factors without a box.
pub(super) fn size(entry: &FactorEntry) -> Option<[f64; 2]> {
    let factor = box_of(entry)?;
    Some([factor.bounding_box.width(), factor.bounding_box.height()])
}

/// Errors of the boxes of an object: by side, then in the order of the boxes.
#[derive(Debug, Clone, Default)]
pub(super) struct BoxErrors([Vec<SideError>; 4]);

/// Unit: pixels.
#[derive(Debug, Clone, Copy)]
struct SideError {
    error: f64,
    /// Width of the box for a left or right side, height for an upper or lower one; 0 if unknown.
    size: f64,
}

/// A box factor at the estimate.
pub(super) struct ObservedBox<'a> {
    pub(super) entry: &'a FactorEntry,
    pub(super) state: &'a FactorState,
    pub(super) leverage: &'a [f64],
}

impl BoxErrors {
    /// Adds the errors of a box. Residuals are smaller than errors: their variance is σ²(1 - h), with the
    /// leverage h of the row.
    pub(super) fn add(&mut self, observed: &ObservedBox<'_>) {
        let ObservedBox { entry, state, leverage } = observed;
        let (size, rows) = (size(entry).unwrap_or_default(), entry.noise.observed());
        for (side, errors) in self.0.iter_mut().enumerate() {
            let seen = rows.is_none_or(|rows| rows.get(side).copied().unwrap_or(false));
            let redundancy = 1.0 - leverage.get(side).copied().unwrap_or(1.0);
            if let (true, Some(residual)) = (seen && redundancy > MIN_REDUNDANCY, state.residual.get(side)) {
                errors.push(SideError { error: residual / redundancy.sqrt(), size: size[side % 2] });
            }
        }
    }
}

/// Returns the name of the group of an object's boxes.
pub(super) fn group_name(object: &MappedObject, by: BoxGroups) -> String {
    match by {
        BoxGroups::All | BoxGroups::Given => "all".to_owned(),
        BoxGroups::Class => {
            object.class.as_ref().map_or_else(|| "unknown".to_owned(), |class| class.name.clone())
        }
        BoxGroups::Object => object.key.to_string(),
    }
}

/// Returns the noise of each group. With several groups, each has the noise of all boxes times a factor. The
/// factors shrink towards their mean, more strongly for groups with few boxes (empirical Bayes with
/// log-normal σ).
pub(super) fn components(
    mapping: &Mapping,
    boxes: &IndexMap<Key, BoxErrors>,
    settings: &VarianceSettings,
) -> IndexMap<String, BoxComponent> {
    let mut groups: IndexMap<String, Vec<&[SideError]>> = IndexMap::new();
    for object in mapping.mapped().filter(|_| settings.boxes != BoxGroups::Given) {
        let Some(BoxErrors(errors)) = boxes.get(&object.key) else { continue };
        let series = groups.entry(group_name(object, settings.boxes)).or_default();
        series.extend(errors.iter().map(Vec::as_slice));
    }
    let all: Vec<&[SideError]> = groups.values().flatten().copied().collect();
    let Some(of_all) = component(&all, settings) else { return IndexMap::new() };
    if settings.boxes == BoxGroups::All {
        return groups.into_keys().map(|name| (name, of_all)).collect();
    }
    let own = groups.values().map(|series| {
        let relative =
            median(series.iter().copied().flatten().map(|e| (e.error / of_all.sigma_at(e.size)).abs()));
        let rows = series.iter().map(|errors| errors.len()).sum::<usize>() as f64;
        // a group without errors has no information
        let relative = relative.map(f64::ln).filter(|log| log.is_finite());
        relative.map_or((0.0, 0.0), |log| (log, rows / of_all.correlation_time))
    });
    let factors = shrink_to_mean(&own.collect::<Vec<_>>());
    groups.into_keys().zip(factors).map(|(name, by)| (name, of_all.scaled(by.exp()))).collect()
}

/// Shrinks logarithms of standard deviations, each from a number of samples, towards their mean. The
/// shrinkage is stronger if their spread is explained by chance. An entry without samples gets the mean. The
/// spread is estimated as by DerSimonian and Laird (*Meta-analysis in Clinical Trials*, 1986).
fn shrink_to_mean(own: &[(f64, f64)]) -> Vec<f64> {
    let variance = |deviates: f64| MEDIAN_VARIANCE / deviates.max(1.0);
    let known = || own.iter().filter(|(_, deviates)| *deviates > 0.0);
    let mean = |spread: f64| {
        let weight = |deviates: f64| (spread + variance(deviates)).recip();
        let sum = known().map(|(log, deviates)| weight(*deviates) * log).sum::<f64>();
        let weights = known().map(|(_, deviates)| weight(*deviates)).sum::<f64>();
        if weights > 0.0 { sum / weights } else { 0.0 }
    };
    let inverse = |power: i32| known().map(|(_, deviates)| variance(*deviates).powi(-power)).sum::<f64>();
    let fixed = mean(0.0);
    let squares = known().map(|(log, deviates)| (log - fixed).powi(2) / variance(*deviates)).sum::<f64>();
    let degrees = known().count() as f64 - 1.0;
    let spread = (squares - degrees) / (inverse(1) - inverse(2) / inverse(1));
    let spread = if spread.is_finite() { spread.max(0.0) } else { 0.0 };
    let mean = mean(spread);
    let one = |(log, deviates): &(f64, f64)| {
        let share = if *deviates > 0.0 { spread / (spread + variance(*deviates)) } else { 0.0 };
        mean + (log - mean) * share
    };
    own.iter().map(one).collect()
}

/// Returns the standard deviation of normal samples from their median. Up to half of the samples may be
/// outliers.
fn median(deviates: impl Iterator<Item = f64>) -> Option<f64> {
    let mut sizes: Vec<f64> = deviates.collect();
    sizes.sort_by(f64::total_cmp);
    Some(sizes.get(sizes.len() / 2)? / MEDIAN)
}

fn component(series: &[&[SideError]], settings: &VarianceSettings) -> Option<BoxComponent> {
    let errors: Vec<SideError> = series.iter().copied().flatten().copied().collect();
    let white = median(errors.iter().map(|e| e.error.abs()))?;
    if !(white.is_finite() && white > 0.0) {
        return None;
    }
    let (sigma_px, of_size) = settings.size.then(|| fit_growth(&errors)).flatten().unwrap_or((white, 0.0));
    let size = errors.iter().map(|e| e.size).sum::<f64>() / errors.len() as f64;
    let one = BoxComponent::of(sigma_px, of_size, 1.0, size);
    if !settings.correlation {
        return Some(one);
    }
    // gross errors are detections of something else, not correlated noise
    let within = |errors: &&[SideError]| -> Vec<SideError> {
        errors.iter().filter(|e| e.error.abs() < 3.0 * one.sigma_at(e.size)).copied().collect()
    };
    let within: Vec<Vec<SideError>> = series.iter().map(within).collect();
    // without growth the errors stay in pixels, which keeps the result bit-identical
    let in_units = |e: &SideError| if of_size > 0.0 { e.error / one.sigma_at(e.size) } else { e.error };
    let errors: Vec<Vec<f64>> = within.iter().map(|series| series.iter().map(in_units).collect()).collect();
    let time = autocorrelation_time(&errors);
    Some(BoxComponent::of(sigma_px, of_size, time, size))
}

/// Fits σ² = σ₀² + κ² size² to medians over bins of similar size. Returns σ₀ and κ; `None` for too few
/// errors.
fn fit_growth(errors: &[SideError]) -> Option<(f64, f64)> {
    let mut sorted: Vec<SideError> = errors.iter().filter(|e| e.size > 0.0).copied().collect();
    sorted.sort_by(|a, b| a.size.total_cmp(&b.size));
    let parts = MAX_BINS.min(sorted.len() / MIN_BIN_ERRORS);
    if parts < 2 {
        return None;
    }
    let points = sorted.chunks(sorted.len().div_ceil(parts)).filter_map(|part| {
        let variance = median(part.iter().map(|e| e.error.abs()))?.powi(2);
        let square = part.iter().map(|e| e.size * e.size).sum::<f64>() / part.len() as f64;
        // weight: the standard deviation of a variance is proportional to the variance
        (variance > 0.0).then_some((square, variance, variance.powi(-2)))
    });
    let points: Vec<(f64, f64, f64)> = points.collect();
    let sum = |of: fn(&(f64, f64, f64)) -> f64| points.iter().map(of).sum::<f64>();
    let (w, x, y) = (sum(|p| p.2), sum(|p| p.2 * p.0), sum(|p| p.2 * p.1));
    let (xx, xy) = (sum(|p| p.2 * p.0 * p.0), sum(|p| p.2 * p.0 * p.1));
    // equal sizes do not determine the slope
    if points.len() < 2 || w * xx - x * x <= EQUAL_SIZE_VARIANCE * w * xx {
        return None;
    }
    let slope = (w * xy - x * y) / (w * xx - x * x);
    let offset = (y - slope * x) / w;
    // neither may be negative
    let (offset, slope) = match (offset > 0.0, slope > 0.0) {
        (true, true) => (offset, slope),
        (true, false) => (y / w, 0.0),
        (false, _) => (0.0, xy / xx),
    };
    (offset.is_finite() && slope.is_finite()).then(|| (offset.sqrt(), slope.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_distr::{Distribution, StandardNormal};
    use rand_pcg::Pcg64;

    fn errors(count: usize, sigma: f64, of_size: f64, seed: u64) -> Vec<SideError> {
        let mut rng = Pcg64::seed_from_u64(seed);
        let one = |_| {
            let size: f64 = rng.random_range(20.0..300.0);
            let deviate: f64 = StandardNormal.sample(&mut rng);
            SideError { error: deviate * sigma.hypot(of_size * size), size }
        };
        (0..count).map(one).collect()
    }

    fn settings(size: bool) -> VarianceSettings {
        VarianceSettings { size, correlation: false, ..VarianceSettings::default() }
    }

    #[test]
    fn what_grows_with_size_is_told_from_what_does_not() {
        let (sigma, of_size) = fit_growth(&errors(20_000, 2.0, 0.04, 1)).unwrap();
        assert!((sigma - 2.0).abs() < 0.3 && (of_size - 0.04).abs() < 0.003, "{sigma} {of_size}");
        let (sigma, of_size) = fit_growth(&errors(20_000, 2.0, 0.0, 2)).unwrap();
        assert!((sigma - 2.0).abs() < 0.1 && of_size < 0.003, "{sigma} {of_size}");
        let (sigma, of_size) = fit_growth(&errors(20_000, 0.0, 0.04, 3)).unwrap();
        assert!(sigma < 0.5 && (of_size - 0.04).abs() < 0.003, "{sigma} {of_size}");
        assert_eq!(fit_growth(&errors(30, 2.0, 0.04, 4)), None);
        let alike: Vec<_> =
            errors(1000, 2.0, 0.04, 5).into_iter().map(|e| SideError { size: 80.0, ..e }).collect();
        assert_eq!(fit_growth(&alike), None);
    }

    #[test]
    fn size_is_left_alone_where_it_is_not_asked_for() {
        let errors = errors(5000, 2.0, 0.04, 1);
        let plain = component(&[&errors], &settings(false)).unwrap();
        assert_eq!((plain.of_size, plain.effective_px), (0.0, plain.sigma_px));
        let grown = component(&[&errors], &settings(true)).unwrap();
        let [x, y] = [100.0, 200.0].map(|size| grown.sigma_at(size));
        assert_eq!(grown.noise(Some([100.0, 200.0])).unwrap(), Noise::sigmas(&[x, y, x, y]).unwrap());
        assert!(y > 1.5 * x, "{x} {y}");
    }

    #[test]
    fn groups_of_few_are_drawn_towards_all_and_those_of_many_are_not() {
        let many = shrink_to_mean(&[(-0.5, 1e6), (0.5, 1e6), (0.0, 1e6)]);
        assert!((many[0] + 0.5).abs() < 1e-3 && (many[1] - 0.5).abs() < 1e-3, "{many:?}");
        let mixed = shrink_to_mean(&[(-0.5, 1e6), (0.5, 10.0), (0.0, 1e6)]);
        assert!((mixed[0] + 0.5).abs() < 1e-3 && (0.05..0.3).contains(&mixed[1]), "{mixed:?}");
        // differences explained by chance vanish
        assert_eq!(shrink_to_mean(&[(-0.1, 10.0), (0.1, 10.0)]), [0.0, 0.0]);
        // groups of few samples do not move a well-known one, and an empty group gets the mean
        let found = shrink_to_mean(&[(0.0, 400.0), (-0.7, 2.0), (-0.6, 2.0), (0.0, 0.0)]);
        assert!(found.iter().all(|log| log.abs() < 0.02), "{found:?}");
        assert_eq!(shrink_to_mean(&[]), Vec::<f64>::new());
    }
}
