//! An axis: its range and its ticks.
use crate::canvas::PanelAxis;

/// Largest absolute value on an axis; margins and ratios of larger numbers would overflow.
pub(crate) const FAR: f64 = 1e300;

/// Range of an axis, from the first to the last value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    low: f64,
    high: f64,
    log: bool,
}

impl Scale {
    /// Creates a linear scale between two numbers.
    pub(crate) fn new(low: f64, high: f64) -> Self {
        Self { low, high, log: false }.with_extent()
    }

    /// Creates a scale over the finite numbers, on a logarithmic axis only over positive ones. `None` if
    /// there are none.
    pub(crate) fn over(numbers: impl Iterator<Item = f64>, log: bool) -> Option<Self> {
        let shown = numbers.filter(|x| x.is_finite() && (!log || *x > 0.0));
        let ends = shown.fold(None, |ends: Option<(f64, f64)>, x| {
            Some(ends.map_or((x, x), |(low, high)| (low.min(x), high.max(x))))
        });
        // margins and ratios of larger numbers would overflow
        let (low, high) = ends.map(|(low, high)| (low.clamp(-FAR, FAR), high.clamp(-FAR, FAR)))?;
        let low = if log { low.max(high * 1e-100).max(1.0 / FAR) } else { low };
        Some(Self { low, high: high.max(low), log }.with_extent())
    }

    /// Widens a scale that is too narrow to draw, because all of its numbers are equal up to rounding.
    fn with_extent(self) -> Self {
        let Self { low, high, log } = self;
        if log {
            return if high > low * 1.0001 { self } else { Self { low: low / 1.5, high: high * 1.5, log } };
        }
        let size = low.abs().max(high.abs());
        let least = 1e-12 * size;
        if high - low > least {
            return self;
        }
        if size == 0.0 {
            return Self { low: 0.0, high: 1.0, log };
        }
        let room = (0.1 * size).min(0.5).max(10.0 * least);
        Self { low: low - room, high: high + room, log }
    }

    /// Returns the first and the last value.
    pub(crate) fn ends(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    pub(crate) fn axis(&self) -> PanelAxis {
        PanelAxis { ends: [self.low, self.high], log: self.log }
    }

    /// Adds a share of the range above, and also below unless the axis begins at zero.
    pub(crate) fn with_margin(self, share: f64) -> Self {
        let Self { low, high, log } = self;
        if log {
            let factor = (high / low).powf(share);
            return Self { low: (low / factor).max(1.0 / FAR), high: (high * factor).min(FAR), log };
        }
        let margin = share * (high - low);
        Self { low: if low == 0.0 { 0.0 } else { low - margin }, high: high + margin, log }
    }

    /// Maps a number to its position, from 0 at the lower end to 1 at the upper end. Numbers are clamped to
    /// ±[`FAR`].
    pub(crate) fn place(&self, x: f64) -> f64 {
        let x = x.clamp(-FAR, FAR);
        if self.log {
            (x / self.low).ln() / (self.high / self.low).ln()
        } else {
            (x - self.low) / (self.high - self.low)
        }
    }

    pub(crate) fn holds(&self, x: f64) -> bool {
        x.is_finite() && x >= self.low && x <= self.high
    }

    /// Returns roughly `most` ticks, each with its label.
    pub(crate) fn ticks(&self, most: usize) -> Vec<(f64, String)> {
        if self.log && self.high > 10.0 * self.low { self.powers(most) } else { self.round_numbers(most) }
    }

    fn round_numbers(&self, most: usize) -> Vec<(f64, String)> {
        let rough = (self.high - self.low) / most.max(1) as f64;
        let power = 10f64.powf(rough.log10().floor());
        let step = [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * power).find(|s| *s >= rough * 0.999);
        let step = step.unwrap_or(power * 10.0);
        let (first, last) = ((self.low / step - 1e-6).ceil(), (self.high / step + 1e-6).floor());
        let numbers = (0..).map(|k| first + f64::from(k)).take_while(|k| *k <= last).take(100);
        numbers.map(|k| (k * step, written(k * step, step))).collect()
    }

    fn powers(&self, most: usize) -> Vec<(f64, String)> {
        let (first, last) =
            ((self.low.log10() - 1e-6).ceil() as i32, (self.high.log10() + 1e-6).floor() as i32);
        let powers = usize::try_from(last - first + 1).unwrap_or(0);
        let each = powers.div_ceil(most.max(1)).max(1);
        let parts: &[f64] = if 3 * powers <= most { &[1.0, 2.0, 5.0] } else { &[1.0] };
        let numbers = (first - 1..=last)
            .step_by(each)
            .flat_map(|power| parts.iter().map(move |m| m * 10f64.powi(power)));
        let inside = |x: &f64| *x >= self.low * 0.999 && *x <= self.high * 1.001;
        numbers.filter(inside).map(|x| (x, written(x, x))).collect()
    }
}

/// Formats a number with enough digits to distinguish it from its neighbours at this step.
fn written(x: f64, step: f64) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    // position of the last digit: a step of 0.2 needs one decimal, like 0.5 and 0.1
    let exponent = |x: f64| (x.abs() * 1.0001).log10().floor() as i32;
    let last = exponent(step);
    if last >= 5 || (last < -4 && x.abs() < 1e-2) {
        let digits = usize::try_from(exponent(x) - last).unwrap_or(0).min(15);
        return format!("{x:.digits$e}");
    }
    let digits = usize::try_from(-last).unwrap_or(0).min(15);
    format!("{x:.digits$}")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ticks(numbers: &[f64], log: bool) -> Vec<String> {
        let scale = Scale::over(numbers.iter().copied(), log).unwrap();
        scale.ticks(5).into_iter().map(|(_, text)| text).collect()
    }

    #[test]
    fn ticks_are_round_and_within_the_data() {
        assert_eq!(ticks(&[0.13, 1.02], false), ["0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(ticks(&[-0.02, 0.05], false), ["-0.02", "0", "0.02", "0.04"]);
        assert_eq!(ticks(&[3.0, 3.0, f64::NAN], false), ["2.8", "3.0", "3.2"]);
        assert_eq!(ticks(&[1e-6, 1e-2], true), ["1e-6", "1e-5", "0.0001", "0.001", "0.01"]);
    }

    #[test]
    fn neighbours_are_told_apart() {
        assert_eq!(ticks(&[0.0, 3e-4], false), ["0", "0.0001", "0.0002", "0.0003"]);
        assert_eq!(ticks(&[5e-5, 2e-4], false), ["5e-5", "1.0e-4", "1.5e-4", "2.0e-4"]);
        assert_eq!(ticks(&[5e6, 5e6 + 4.0], false), ["5000000", "5000001", "5000002", "5000003", "5000004"]);
        assert_eq!(ticks(&[1.2, 1.200_02], false).get(1).map(String::as_str), Some("1.200005"));
        assert_eq!(ticks(&[0.0, 4e7], false), ["0", "1e7", "2e7", "3e7", "4e7"]);
    }

    #[test]
    fn one_number_and_the_ends_of_all_numbers_have_room() {
        assert_eq!(ticks(&[0.0, 0.0], false).first().map(String::as_str), Some("0"));
        assert!(ticks(&[0.0, 0.0], false).iter().all(|text| !text.starts_with('-')));
        assert_eq!(ticks(&[1e-5, 1e-5], false), ["9.0e-6", "9.5e-6", "1.00e-5", "1.05e-5", "1.10e-5"]);
        for numbers in [[1e308, 1e-308], [f64::MAX, f64::MIN_POSITIVE], [-1e308, 1e308], [1e-320, 1e-310]] {
            for log in [false, true] {
                let Some(scale) = Scale::over(numbers.into_iter(), log) else { continue };
                let scale = scale.with_margin(0.05);
                assert!(scale.ticks(5).iter().all(|(x, _)| (-0.1..=1.1).contains(&scale.place(*x))));
            }
        }
    }

    #[test]
    fn an_axis_begins_where_the_data_do() {
        let scale = Scale::over([2.5, 7.5].into_iter(), false).unwrap();
        assert_eq!((scale.place(2.5), scale.place(7.5), scale.place(5.0)), (0.0, 1.0, 0.5));
        assert!(Scale::over([f64::INFINITY].into_iter(), false).is_none());
        assert!(Scale::over([-1.0].into_iter(), true).is_none());
    }
}
