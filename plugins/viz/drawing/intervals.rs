//! Means with their confidence intervals, by group.
use super::axes::{Axes, HEAD, LABELS, NUMBERS, fitted, title};
use super::scale::Scale;
use crate::canvas::{Anchor, Ink, Sheet, Stroke, Text, text_width};

/// A mean, and the ends of its confidence interval if there is one.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Mean {
    /// Name of the group.
    pub(crate) name: String,
    pub(crate) mean: f64,
    pub(crate) interval: Option<[f64; 2]>,
}

/// Means of groups, one below the other.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Intervals {
    /// Title of the picture.
    pub(crate) title: String,
    /// Meaning of the values, with their unit.
    pub(crate) x: String,
    /// True if the values are differences: a line marks zero.
    pub(crate) are_differences: bool,
    pub(crate) means: Vec<Mean>,
}

/// Height of a group, and half the height of the end of an interval. Unit: pixels.
const ROW: f64 = 26.0;
const END: f64 = 5.0;
/// Largest number of groups.
const ROWS: usize = 400;

impl Intervals {
    /// Draws a dot at each mean and a line over its interval. Groups without a finite mean are omitted, and so
    /// are those after the first 400. Returns `None` if nothing is left.
    pub(crate) fn sheet(&self, width: f64) -> Option<Sheet> {
        let means: Vec<&Mean> = self.means.iter().filter(|mean| mean.mean.is_finite()).take(ROWS).collect();
        let ends = |mean: &&Mean| mean.interval.into_iter().flatten().chain([mean.mean]);
        let zero = self.are_differences.then_some(0.0);
        let x = Scale::over(means.iter().flat_map(ends).chain(zero.filter(|_| !means.is_empty())), false)?;
        let (low, high) = x.ends();
        let room = 0.06 * (high - low);
        let x = Scale::new(low - room, high + room);
        let widest = means.iter().map(|mean| text_width(&mean.name, NUMBERS, false)).fold(0.0, f64::max);
        let left = (widest + 18.0).clamp(60.0, 0.45 * width);
        let height = HEAD + 6.0 + ROW * means.len() as f64 + 40.0;
        let mut sheet = Sheet::new(width, height);
        title(&mut sheet, &self.title);
        let area = [left, HEAD + 6.0, width - 18.0, height - 40.0];
        let y = Scale::new(0.0, means.len() as f64);
        let axes = Axes { area, x, y, x_label: self.x.clone(), y_label: String::new() };
        self.draw_grid(&axes, &mut sheet);
        for (row, mean) in means.iter().enumerate() {
            let y = area[1] + (row as f64 + 0.5) * ROW;
            let name = fitted(&mean.name, NUMBERS, left - 16.0);
            sheet.text(Text::new(name, [left - 8.0, y + 4.0], NUMBERS, Ink::Text).anchored(Anchor::End));
            let at = |x: f64| axes.point(x, 0.0)[0];
            // an interval on one side of zero is a difference that the trials show
            let is_clear = mean.interval.is_some_and(|[low, high]| low > 0.0 || high < 0.0);
            let ink = if is_clear || !self.are_differences { Ink::Series(0) } else { Ink::Faint };
            if let Some([low, high]) = mean.interval.filter(|ends| ends.iter().all(|x| x.is_finite())) {
                sheet.line(vec![[at(low), y], [at(high), y]], Stroke::solid(ink, 2.0));
                for end in [at(low), at(high)] {
                    sheet.line(vec![[end, y - END], [end, y + END]], Stroke::solid(ink, 2.0));
                }
            }
            sheet.dot([at(mean.mean), y], 4.0, ink);
        }
        Some(sheet)
    }

    fn draw_grid(&self, axes: &Axes, sheet: &mut Sheet) {
        let [xmin, ymin, xmax, ymax] = axes.area;
        let at = |x: f64| axes.point(x, 0.0)[0];
        for (x, text) in axes.x.ticks(((xmax - xmin) / 75.0).clamp(2.0, 10.0) as usize) {
            sheet.line(vec![[at(x), ymin], [at(x), ymax]], Stroke::solid(Ink::Grid, 1.0));
            let number = Text::new(text, [at(x), ymax + 15.0], NUMBERS, Ink::Faint);
            sheet.text(number.anchored(Anchor::Middle));
        }
        if self.are_differences {
            sheet.line(vec![[at(0.0), ymin], [at(0.0), ymax]], Stroke::solid(Ink::Text, 1.2));
        }
        let frame = vec![[xmin, ymin], [xmax, ymin], [xmax, ymax], [xmin, ymax]];
        sheet.outline(frame, Stroke::solid(Ink::Faint, 1.0), None);
        let label = fitted(&axes.x_label, LABELS, xmax - xmin);
        let at = [0.5 * (xmin + xmax), ymax + 33.0];
        sheet.text(Text::new(label, at, LABELS, Ink::Text).anchored(Anchor::Middle));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::{Colors, Theme};

    fn svg(means: &[(&str, f64, Option<[f64; 2]>)]) -> Option<String> {
        let mean = |(name, mean, interval): &(&str, f64, Option<[f64; 2]>)| Mean {
            name: (*name).to_owned(),
            mean: *mean,
            interval: *interval,
        };
        let means = means.iter().map(mean).collect();
        let picture = Intervals { title: "ate".into(), x: "change (%)".into(), are_differences: true, means };
        Some(picture.sheet(600.0)?.svg("", Colors::Of(Theme::Light)))
    }

    #[test]
    fn each_mean_has_its_row_and_its_interval() {
        let all = svg(&[("a", -3.0, Some([-5.0, -1.0])), ("b", 1.0, Some([-2.0, 4.0])), ("c", 2.0, None)]);
        let all = all.unwrap();
        assert_eq!(all.matches("<circle").count(), 3);
        assert!([">a<", ">b<", ">c<", "change (%)"].iter().all(|text| all.contains(text)));
        // an interval that contains zero is faint
        assert_eq!(all.matches(Ink::Series(0).hex(Theme::Light)).count(), 4);
    }

    #[test]
    fn means_that_are_not_finite_are_left_out() {
        assert_eq!(svg(&[("a", f64::NAN, None)]), None);
        let some = svg(&[("a", f64::INFINITY, None), ("b", 1.0, Some([f64::NAN, 2.0]))]).unwrap();
        assert!(!some.contains("NaN") && !some.contains("inf") && !some.contains(">a<"));
    }
}
