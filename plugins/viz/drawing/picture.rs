//! A picture before it is written to a file.
use crate::canvas::{Colors, Sheet, Theme};

/// A drawing, as SVG or PNG.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Name of its files without the extension.
    pub name: String,
    /// Description of its content, for screen readers.
    pub title: String,
    sheet: Sheet,
}

/// The reason why a picture has no PNG.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("the picture {name} cannot be drawn: {problem}")]
pub struct NotDrawn {
    /// Name of the picture.
    pub name: String,
    /// The problem.
    pub problem: String,
}

impl Picture {
    pub(crate) fn new(name: &str, title: impl Into<String>, sheet: Sheet) -> Self {
        // all characters except letters and digits become underscores
        let name = name.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
        Self { name, title: title.into(), sheet }
    }

    pub(crate) fn sheet(&self) -> &Sheet {
        &self.sheet
    }

    /// Returns the picture as SVG.
    pub fn svg(&self, theme: Theme) -> String {
        self.sheet.svg(&self.title, Colors::Of(theme))
    }

    /// Returns the picture as a part of a page, whose theme it follows.
    pub(crate) fn part(&self) -> String {
        self.sheet.svg(&self.title, Colors::OfPage)
    }

    /// Returns the picture as PNG, with twice the resolution of the SVG.
    ///
    /// # Errors
    /// If the picture is too large.
    pub fn png(&self, theme: Theme) -> Result<Vec<u8>, NotDrawn> {
        self.sheet.png(theme).map_err(|problem| NotDrawn { name: self.name.clone(), problem })
    }
}
