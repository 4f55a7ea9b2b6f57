//! Colours by meaning, shared by all pictures of a run and its page.

/// The meaning of an element, which determines its colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Ink {
    /// The background.
    Paper,
    /// Titles and labels.
    Text,
    /// Less important elements: axes and their numbers.
    Faint,
    /// Lines behind the data.
    Grid,
    /// The true trajectory.
    Truth,
    /// The trajectory from odometry alone.
    Odometry,
    /// The estimated trajectory.
    Estimate,
    /// Links of a page.
    Link,
    /// Warnings of a page.
    Warning,
    /// Outliers.
    Outlier,
    /// A class of objects, by its index among all classes.
    Class(usize),
    /// A curve of a chart, by its index.
    Series(usize),
}

/// A colour theme: dark lines on white, or light ones on black.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Theme {
    /// For paper.
    #[default]
    Light,
    /// For dark slides.
    Dark,
}

/// Colours of classes, all of medium lightness, so that they are visible on white and on black.
const CLASSES: [&str; 24] = [
    "#7b61d9", "#d6455d", "#2b9e55", "#1a9fc0", "#b8479e", "#c08a0e", "#1f9c8c", "#a06c3a", "#859528",
    "#4c78d6", "#dc6a3c", "#7d8590", "#5fa548", "#a55a80", "#e0559b", "#0d9a72", "#9a78e0", "#c4785a",
    "#4c8a8c", "#b04a40", "#5b7ff0", "#a5973a", "#d58724", "#7f8236",
];

/// Colours of curves that remain distinct without red (protanopia), after Okabe and Ito.
const SERIES: [&str; 8] =
    ["#1f83c4", "#dd6b20", "#1b9e77", "#c76aa3", "#d19a08", "#4fa9dc", "#8a8f98", "#a09a10"];

/// The inks that depend on the theme, with their names in style sheets and their colours on light and on
/// dark.
const THEMED: [(Ink, &str, [&str; 2]); 7] = [
    (Ink::Paper, "paper", ["#ffffff", "#14171c"]),
    (Ink::Text, "text", ["#1d2129", "#e6e9ee"]),
    (Ink::Faint, "faint", ["#5a6472", "#a3adba"]),
    (Ink::Grid, "grid", ["#e3e6ea", "#2c323b"]),
    (Ink::Truth, "truth", ["#1d2129", "#e6e9ee"]),
    (Ink::Link, "link", ["#1766b3", "#6fb4f5"]),
    (Ink::Warning, "warning", ["#9c4a0c", "#e79a5b"]),
];

impl Ink {
    /// Returns the name of its style sheet variable, if it depends on the theme.
    pub(crate) fn variable(self) -> Option<&'static str> {
        THEMED.iter().find(|(ink, ..)| *ink == self).map(|(_, name, _)| *name)
    }

    /// Returns the colour as hexadecimal text.
    pub(crate) fn hex(self, theme: Theme) -> &'static str {
        let of = |list: &'static [&'static str], place: usize| list.get(place % list.len()).copied();
        let fixed = match self {
            Self::Odometry => Some("#e07b30"),
            Self::Estimate => Some("#2a85d8"),
            Self::Outlier => Some("#d6455d"),
            Self::Class(place) => of(&CLASSES, place),
            Self::Series(place) => of(&SERIES, place),
            _ => None,
        };
        let themed = || {
            let colors = THEMED.iter().find(|(ink, ..)| *ink == self).map(|(_, _, colors)| colors);
            colors.map_or("#808080", |[light, dark]| if theme == Theme::Light { light } else { dark })
        };
        fixed.unwrap_or_else(themed)
    }

    /// Returns red, green and blue.
    pub(crate) fn rgb(self, theme: Theme) -> [u8; 3] {
        let hex = self.hex(theme);
        [1, 3, 5]
            .map(|at| hex.get(at..at + 2).and_then(|part| u8::from_str_radix(part, 16).ok()).unwrap_or(0))
    }
}

/// Returns the style sheet variables of all inks that depend on the theme.
pub(crate) fn style_sheet(theme: Theme) -> String {
    THEMED.iter().map(|(ink, name, _)| format!("--{name}:{};", ink.hex(theme))).collect()
}
