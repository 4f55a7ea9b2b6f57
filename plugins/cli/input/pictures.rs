//! Pictures, which go to files.
use crate::failure::Failure;
use clap::{Args, ValueEnum};
use manifactor::slam::output::write_whole;
use manifactor::viz::{Picture, Theme};
use std::path::Path;

/// How pictures look.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct Look {
    /// The width of pictures, in pixels of the SVG; a PNG has two for each.
    #[arg(long, value_name = "PIXELS", default_value_t = Look::default().size, value_parser = clap::value_parser!(u16).range(300..=4000))]
    size: u16,
    /// The theme of pictures.
    #[arg(long, value_enum, default_value_t = Look::default().theme)]
    theme: Shade,
}

/// The theme of a picture.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Shade {
    /// Dark lines on white.
    Light,
    /// Light lines on black.
    Dark,
}

impl Default for Look {
    fn default() -> Self {
        Self { size: 900, theme: Shade::Light }
    }
}

impl Look {
    /// Pixels of the SVG.
    pub(crate) fn width(self) -> f64 {
        self.size.into()
    }

    /// Writes pictures into a folder, each as SVG and as PNG.
    pub(crate) fn write(self, folder: &Path, pictures: &[Picture]) -> Result<(), Failure> {
        let theme = match self.theme {
            Shade::Light => Theme::Light,
            Shade::Dark => Theme::Dark,
        };
        for picture in pictures {
            write_whole(&folder.join(format!("{}.svg", picture.name)), picture.svg(theme))?;
            let png = picture.png(theme).map_err(Failure::input)?;
            write_whole(&folder.join(format!("{}.png", picture.name)), png)?;
        }
        Ok(())
    }
}
