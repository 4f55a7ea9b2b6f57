//! Distributions of values by group.
use super::axes::{Axes, HEAD, LABELS, NUMBERS, fitted, title};
use super::scale::Scale;
use crate::canvas::{Anchor, Ink, Sheet, Stroke, Text, text_width};

/// Groups of values, one below the other.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Distribution {
    /// Title of the picture.
    pub(crate) title: String,
    /// Meaning of the values, with their unit.
    pub(crate) x: String,
    /// The groups, each with its name.
    pub(crate) groups: Vec<(String, Vec<f64>)>,
}

/// The five numbers of Tukey's box plot, and the values beyond the whiskers.
#[derive(Debug, Clone, PartialEq)]
struct FiveNumbers {
    whiskers: [f64; 2],
    quartiles: [f64; 3],
    beyond: Vec<f64>,
}

/// Height of a group in pixels, largest number of groups, and largest number of dots of a group.
const ROW: f64 = 30.0;
const ROWS: usize = 400;
const DOTS: usize = 60;
/// Largest number of values that are drawn as dots.
const FEW: usize = 5;

/// A group: its name, its five numbers, and its values.
type Group<'a> = (&'a String, FiveNumbers, &'a Vec<f64>);

impl Distribution {
    /// Draws the values of a group of at most five as dots, and a box plot for each larger group: the box spans the quartiles and shows the median; the whiskers end
    /// at the last value within 1.5 times the box's width. Values beyond the whiskers are dots; values off
    /// the scale are counted at an arrow. Non-finite values are omitted. Returns `None` if nothing is left.
    pub(crate) fn sheet(&self, width: f64) -> Option<Sheet> {
        let groups =
            self.groups.iter().filter_map(|(name, values)| Some((name, FiveNumbers::of(values)?, values)));
        let mut groups: Vec<Group<'_>> = groups.collect();
        let left_out = groups.len().saturating_sub(ROWS);
        groups.truncate(ROWS);
        let ends = groups.iter().flat_map(|(_, five, _)| five.whiskers);
        let within = Scale::over(ends, false)?.with_margin(1.0);
        let shown = |(_, five, _): &Group<'_>| -> Vec<f64> {
            five.beyond.iter().copied().filter(|x| within.holds(*x)).chain(five.whiskers).collect()
        };
        let x = Scale::over(groups.iter().flat_map(shown), false)?.with_margin(0.04);
        let widest = groups.iter().map(|(name, ..)| text_width(name, NUMBERS, false)).fold(0.0, f64::max);
        let left = (widest + 18.0).min(0.4 * width);
        let height = HEAD + 6.0 + ROW * groups.len() as f64 + 40.0;
        let mut sheet = Sheet::new(width, height);
        let text = match left_out {
            0 => self.title.clone(),
            n => format!("{} (the first {ROWS} groups; {n} more)", self.title),
        };
        title(&mut sheet, &text);
        let area = [left, HEAD + 6.0, width - 40.0, height - 40.0];
        let rows = Scale::new(0.0, groups.len() as f64);
        let axes = Axes { area, x, y: rows, x_label: String::new(), y_label: String::new() };
        grid(&axes, &mut sheet, &self.x);
        for (row, (name, five, values)) in groups.iter().enumerate() {
            let y = area[1] + (row as f64 + 0.5) * ROW;
            let name = fitted(name, NUMBERS, left - 16.0);
            sheet.text(Text::new(name, [left - 8.0, y + 4.0], NUMBERS, Ink::Text).anchored(Anchor::End));
            match values.len() {
                0..=FEW => FiveNumbers::draw_dots(values, &axes, y, &mut sheet),
                _ => five.draw(&axes, y, &mut sheet),
            }
        }
        Some(sheet)
    }
}

fn grid(axes: &Axes, sheet: &mut Sheet, label: &str) {
    let [xmin, ymin, xmax, ymax] = axes.area;
    for (x, text) in axes.x.ticks(((xmax - xmin) / 75.0).clamp(2.0, 10.0) as usize) {
        let at = axes.point(x, 0.0)[0];
        sheet.line(vec![[at, ymin], [at, ymax]], Stroke::solid(Ink::Grid, 1.0));
        sheet.text(Text::new(text, [at, ymax + 15.0], NUMBERS, Ink::Faint).anchored(Anchor::Middle));
    }
    let frame = vec![[xmin, ymin], [xmax, ymin], [xmax, ymax], [xmin, ymax]];
    sheet.outline(frame, Stroke::solid(Ink::Faint, 1.0), None);
    let label = fitted(label, LABELS, xmax - xmin);
    sheet.text(
        Text::new(label, [0.5 * (xmin + xmax), ymax + 33.0], LABELS, Ink::Text).anchored(Anchor::Middle),
    );
}

impl FiveNumbers {
    fn of(values: &[f64]) -> Option<Self> {
        let mut sorted: Vec<f64> = values.iter().copied().filter(|x| x.is_finite()).collect();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (*sorted.first()?, *sorted.last()?);
        let quartile = |share: f64| {
            let place = share * (sorted.len() - 1) as f64;
            let at = |place: f64| sorted.get(place as usize).copied().unwrap_or(last);
            // the difference of the two would overflow between -1e308 and 1e308
            at(place.floor()) * (1.0 - place.fract()) + at(place.ceil()) * place.fract()
        };
        let quartiles = [quartile(0.25), quartile(0.5), quartile(0.75)];
        let reach = 1.5 * (quartiles[2] - quartiles[0]);
        let (low, high) = (quartiles[0] - reach, quartiles[2] + reach);
        let inside = || sorted.iter().copied().filter(|x| *x >= low && *x <= high);
        // an interpolated quartile may lie outside of all values between the whiskers
        let whiskers = [
            inside().fold(last, f64::min).min(quartiles[0]),
            inside().fold(first, f64::max).max(quartiles[2]),
        ];
        let beyond = sorted.iter().copied().filter(|x| *x < whiskers[0] || *x > whiskers[1]).collect();
        Some(Self { whiskers, quartiles, beyond })
    }

    /// Draws the values themselves as dots: a box plot of a few values would hide how few there are.
    fn draw_dots(values: &[f64], axes: &Axes, y: f64, sheet: &mut Sheet) {
        for value in values.iter().filter(|value| value.is_finite() && axes.x.holds(**value)) {
            sheet.dot([axes.point(*value, 0.0)[0], y], 3.0, Ink::Series(0));
        }
    }

    fn draw(&self, axes: &Axes, y: f64, sheet: &mut Sheet) {
        let at = |x: f64| axes.point(x, 0.0)[0];
        let [low, high] = self.whiskers.map(at);
        let [first, median, third] = self.quartiles.map(at);
        let (stroke, half) = (Stroke::solid(Ink::Series(0), 1.4), 0.3 * ROW);
        sheet.line(vec![[low, y], [first, y]], stroke);
        sheet.line(vec![[third, y], [high, y]], stroke);
        for end in [low, high] {
            sheet.line(vec![[end, y - 0.5 * half], [end, y + 0.5 * half]], stroke);
        }
        let corners = vec![[first, y - half], [third, y - half], [third, y + half], [first, y + half]];
        sheet.outline(corners, stroke, Some((Ink::Series(0), 0.25)));
        sheet.line(vec![[median, y - half], [median, y + half]], Stroke::solid(Ink::Text, 2.0));
        let (seen, unseen): (Vec<f64>, Vec<f64>) = self.beyond.iter().partition(|x| axes.x.holds(**x));
        // the ends matter most; between them, only every n-th dot is drawn
        let each = seen.len().div_ceil(DOTS).max(1);
        let ends = |i: usize| i.is_multiple_of(each) || i + 1 == seen.len();
        seen.iter()
            .enumerate()
            .filter(|(i, _)| ends(*i))
            .for_each(|(_, x)| sheet.dot([at(*x), y], 1.8, Ink::Outlier));
        let (below, above): (Vec<f64>, Vec<f64>) = unseen.iter().partition(|x| **x < self.quartiles[0]);
        let [xmin, _, xmax, _] = axes.area;
        for (list, tip, way) in [(below, xmin, 1.0), (above, xmax, -1.0)] {
            if !list.is_empty() {
                let base = tip + way * 7.0;
                let arrow = vec![[tip, y], [base, y - 4.0], [base, y + 4.0]];
                sheet.outline(arrow, Stroke::solid(Ink::Outlier, 1.0), Some((Ink::Outlier, 1.0)));
                let anchor = if way > 0.0 { Anchor::Start } else { Anchor::End };
                let text = Text::new(far(&list), [base + 3.0 * way, y - 3.0], 9.0, Ink::Outlier);
                sheet.text(text.anchored(anchor));
            }
        }
    }
}

/// Describes the number of values off the scale, and the farthest of them.
fn far(list: &[f64]) -> String {
    let farthest = list.iter().copied().fold(0.0, |far: f64, x| if x.abs() > far.abs() { x } else { far });
    let farthest = if farthest.abs() < 1e9 { format!("{farthest:.3}") } else { format!("{farthest:.3e}") };
    match list.len() {
        1 => farthest,
        n => format!("{n}, to {farthest}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::{Colors, Theme};

    #[test]
    fn whiskers_do_not_end_inside_the_box() {
        for values in
            [vec![0.0, 0.0, 0.0, 10.0], vec![1.0, 2.0], vec![-50.0, 1.0, 1.1, 1.2, 1.3, 90.0], vec![3.0]]
        {
            let FiveNumbers { whiskers, quartiles, .. } = FiveNumbers::of(&values).unwrap();
            assert!(whiskers[0] <= quartiles[0] && whiskers[1] >= quartiles[2], "{values:?}");
            assert!(quartiles[0] <= quartiles[1] && quartiles[1] <= quartiles[2]);
        }
        assert_eq!(FiveNumbers::of(&[1.0, 2.0, 3.0, 4.0, 99.0]).unwrap().beyond, [99.0]);
    }

    #[test]
    fn a_picture_of_many_groups_ends() {
        let groups = (0..3000).map(|i| (format!("group {i}"), vec![f64::from(i)])).collect();
        let sheet = Distribution { title: "ate".into(), x: "ate".into(), groups }.sheet(900.0).unwrap();
        assert!(sheet.svg("", Colors::Of(Theme::Light)).contains("2600 more"));
        assert_eq!(sheet.png(Theme::Light).unwrap().get(..4), Some(&b"\x89PNG"[..]));
    }

    #[test]
    fn each_group_has_its_row_and_far_outliers_an_arrow() {
        let mut values: Vec<f64> = (0..100).map(|i| f64::from(i) / 50.0 - 1.0).collect();
        values.extend([1e5, 2e5, f64::INFINITY]);
        let groups = vec![("Q".into(), vec![0.1, 0.2, 0.4]), ("Q+O".into(), values), ("none".into(), vec![])];
        let shape = Distribution { title: "shape".into(), x: "shape".into(), groups };
        let svg = shape.sheet(600.0).unwrap().svg("shape", Colors::Of(Theme::Light));
        assert!(svg.contains(">Q<") && svg.contains(">Q+O<") && svg.contains(">2, to 200000.000<"));
        assert!(!svg.contains("inf") && !svg.contains("none<"));
        assert!(Distribution::default().sheet(600.0).is_none());
    }

    #[test]
    fn values_at_the_ends_of_all_numbers_are_drawn() {
        let ends = vec![-1e308, 1e308, f64::NAN, 1e30, -1e30, f64::MAX, f64::MIN];
        let mut outliers: Vec<f64> = (0..40).map(f64::from).collect();
        outliers.extend([-1e308, -1e308, 1e30, f64::NAN]);
        for groups in [vec![ends.clone()], vec![vec![-1e308]], vec![outliers.clone()], vec![ends, outliers]] {
            let groups = groups.into_iter().map(|values| ("residual".to_owned(), values)).collect();
            let sheet = Distribution { groups, ..Distribution::default() }.sheet(600.0).unwrap();
            assert_eq!(sheet.png(Theme::Light).unwrap().get(..4), Some(&b"\x89PNG"[..]));
            let svg = sheet.svg("", Colors::Of(Theme::Light));
            for wrong in ["NaN", "inf", &"0".repeat(30)] {
                assert!(!svg.contains(wrong), "{wrong} in {svg}");
            }
        }
    }
}
