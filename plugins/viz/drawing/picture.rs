//! A picture, before it is a file.
use crate::canvas::{Colors, Sheet, Theme};

/// A drawing, as SVG or PNG.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// What its files are called, without their ending.
    pub name: String,
    /// What it shows, for those who do not see it.
    pub title: String,
    sheet: Sheet,
}

/// Why there is no PNG of a picture.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the picture {name} cannot be drawn: {problem}")]
pub struct NotDrawn {
    /// The picture.
    pub name: String,
    /// What is wrong.
    pub problem: String,
}

impl Picture {
    pub(crate) fn new(name: &str, title: impl Into<String>, sheet: Sheet) -> Self {
        // letters and digits as they are, all else a low line
        let name = name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        Self { name, title: title.into(), sheet }
    }

    /// As SVG.
    pub fn svg(&self, theme: Theme) -> String {
        self.sheet.svg(&self.title, Colors::Of(theme))
    }

    /// As a part of a page, whose theme it follows.
    pub(crate) fn part(&self) -> String {
        self.sheet.svg(&self.title, Colors::OfPage)
    }

    /// As PNG, with two pixels for each of the SVG.
    ///
    /// # Errors
    /// If the picture is too large for that.
    pub fn png(&self, theme: Theme) -> Result<Vec<u8>, NotDrawn> {
        self.sheet.png(theme).map_err(|problem| NotDrawn { name: self.name.clone(), problem })
    }
}
