//! Lines of space-separated fields, the structure of most formats in this crate.
use crate::error::Mistake;
use std::str::SplitWhitespace;

/// Returns the non-empty lines with their number from 1, without comments and outer spaces.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = (usize, &str)> {
    // A byte order mark is not part of the first field.
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    text.lines().enumerate().filter_map(|(i, line)| {
        let line = line.split('#').next().unwrap_or_default().trim();
        (!line.is_empty()).then_some((i + 1, line))
    })
}

/// The fields of a line, in order.
pub(crate) struct Fields<'a>(SplitWhitespace<'a>);

impl<'a> Fields<'a> {
    /// Splits a line into fields; `layout` contains the name of each field, separated by spaces.
    pub(crate) fn of(text: &'a str, layout: &'static str) -> Result<Self, Mistake> {
        let (expected, found) = (layout.split_whitespace().count(), text.split_whitespace().count());
        if expected == found {
            Ok(Self(text.split_whitespace()))
        } else {
            Err(Mistake::FieldCount { expected, layout, found })
        }
    }
    pub(crate) fn text(&mut self) -> &'a str {
        self.0.next().unwrap_or_default()
    }
    pub(crate) fn id(&mut self) -> Result<u64, Mistake> {
        id(self.text())
    }
    pub(crate) fn number(&mut self) -> Result<f64, Mistake> {
        number(self.text())
    }
    pub(crate) fn numbers<const N: usize>(&mut self) -> Result<[f64; N], Mistake> {
        let mut numbers = [0.0; N];
        for x in &mut numbers {
            *x = self.number()?;
        }
        Ok(numbers)
    }
}

pub(crate) fn number(text: &str) -> Result<f64, Mistake> {
    match text.parse::<f64>() {
        Ok(x) if x.is_finite() => Ok(x),
        _ => Err(Mistake::Field { expected: "a finite number", found: text.to_owned() }),
    }
}

pub(crate) fn id(text: &str) -> Result<u64, Mistake> {
    let expected = "a whole number from 0";
    text.parse().map_err(|_| Mistake::Field { expected, found: text.to_owned() })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_blanks_and_line_ends_do_not_matter() {
        let text = "\u{feff}# head\r\n\r\n  A  1 \t2  # tail\r\nB\n\n";
        assert_eq!(lines(text).collect::<Vec<_>>(), [(3, "A  1 \t2"), (4, "B")]);
    }

    #[test]
    fn fields_are_counted_and_checked() {
        let mistake = |text| match Fields::of(text, "x y") {
            Err(e) => e.to_string(),
            Ok(mut f) => f.numbers::<2>().unwrap_err().to_string(),
        };
        assert_eq!(mistake("1 2 3"), "expected 2 fields (x y), got 3");
        assert_eq!(mistake("1 NaN"), "expected a finite number, got `NaN`");
        assert_eq!(mistake("1 1e999"), "expected a finite number, got `1e999`");
        assert_eq!(mistake("1 two"), "expected a finite number, got `two`");
        assert_eq!(Fields::of(" +1.  -.5e-3 ", "x y").unwrap().numbers(), Ok([1.0, -0.0005]));
    }
}
