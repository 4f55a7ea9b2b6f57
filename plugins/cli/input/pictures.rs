//! Options for pictures, and the writing of their files.
use crate::failure::Failure;
use crate::output::text::on_one_line;
use crate::output::watch::Watch;
use clap::{Args, ValueEnum};
use manifactor::slam::output::write_whole;
use manifactor::slam::record::RunRecord;
use manifactor::solve::{Interrupt, Observer};
use manifactor::viz::{Picture, Theme, run_pictures};
use std::ops::ControlFlow;
use std::path::Path;

/// Style of the pictures.
#[derive(Debug, Clone, Copy, Args)]
pub(crate) struct PictureStyle {
    /// Width of the pictures in pixels of the SVG; a PNG has twice as many.
    #[arg(long, value_name = "PIXELS", default_value_t = PictureStyle::default().size, value_parser = clap::value_parser!(u16).range(300..=4000))]
    size: u16,
    /// Colour theme of the pictures.
    #[arg(long, value_enum, default_value_t = PictureStyle::default().theme)]
    theme: Shade,
}

/// A colour theme.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Shade {
    /// Dark lines on white.
    Light,
    /// Light lines on black.
    Dark,
}

impl Default for PictureStyle {
    fn default() -> Self {
        Self { size: 900, theme: Shade::Light }
    }
}

impl PictureStyle {
    /// The width, in pixels of the SVG.
    pub(crate) fn width(self) -> f64 {
        self.size.into()
    }

    /// Writes pictures into a folder, each as SVG and as PNG. `goes_on` is called with the name of each
    /// file before it is drawn; `Break` ends the drawing and keeps the earlier files. Returns whether all
    /// files are written.
    pub(crate) fn write(
        self,
        folder: &Path,
        pictures: &[Picture],
        mut goes_on: impl FnMut(&str) -> ControlFlow<()>,
    ) -> Result<bool, Failure> {
        let theme = match self.theme {
            Shade::Light => Theme::Light,
            Shade::Dark => Theme::Dark,
        };
        for picture in pictures {
            let [svg, png] = ["svg", "png"].map(|ending| format!("{}.{ending}", picture.name));
            if goes_on(&svg).is_break() {
                return Ok(false);
            }
            write_whole(&folder.join(&svg), picture.svg(theme))?;
            if goes_on(&png).is_break() {
                return Ok(false);
            }
            let content = picture.png(theme).map_err(Failure::input)?;
            write_whole(&folder.join(&png), content)?;
        }
        Ok(true)
    }

    /// Draws the pictures of all variants of a run into their folders in `out`, until an interrupt. `watch`
    /// shows the current file.
    pub(crate) fn draw_run(
        self,
        out: &Path,
        record: &RunRecord,
        watch: &mut Watch,
        interrupt: &mut Interrupt,
    ) -> Result<Drawn, Failure> {
        let mut drawn = Drawn { pictures: 0, missing: vec![] };
        for variant in &record.variants {
            tracing::info!("pictures of {}", variant.name);
            let is_complete = interrupt.poll().is_continue() && {
                watch.show(&format!("drawing the pictures of {}", variant.name));
                let pictures = run_pictures(record, variant, self.width());
                drawn.pictures += pictures.len();
                self.write(&out.join(&variant.folder), &pictures, |file| {
                    watch.show(&drawing(&variant.folder, file));
                    interrupt.poll()
                })?
            };
            if !is_complete {
                drawn.missing.push(variant.name.clone());
            }
        }
        tracing::info!("all pictures are drawn");
        Ok(drawn)
    }
}

/// The progress while a file is drawn.
fn drawing(folder: &str, file: &str) -> String {
    format!("drawing {folder}/{file}")
}

/// Progress of the pictures of a run.
pub(crate) struct Drawn {
    /// Number of pictures. Valid only if none is missing.
    pub(crate) pictures: usize,
    /// Variants whose pictures are incomplete because of an interrupt.
    pub(crate) missing: Vec<String>,
}

impl Drawn {
    /// Returns a sentence with the incomplete variants and the command that draws them; `None` if nothing
    /// is missing.
    pub(crate) fn message(&self, out: &Path) -> Option<String> {
        let variants: Vec<_> = self.missing.iter().map(|name| on_one_line(name)).collect();
        let out = out.display();
        (!variants.is_empty()).then(|| {
            format!(
                "interrupted: some pictures of {} are missing or from an earlier run; `manifactor plot {out}` draws them",
                variants.join(", ")
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor::viz::latencies;

    #[test]
    fn an_interrupt_ends_the_drawing_before_the_next_file() {
        let folder = tempfile::tempdir().unwrap();
        let picture = latencies("latency", &[0.1, 0.2], 300.0).unwrap();
        let mut other = picture.clone();
        other.name = "other".to_owned();
        let mut interrupt = Interrupt::default();
        let flag = interrupt.0.clone();
        // set while the first picture is drawn
        let goes_on = |file: &str| {
            let flow = interrupt.poll();
            flag.store(file == "latency.png", std::sync::atomic::Ordering::Relaxed);
            flow
        };
        assert!(!PictureStyle::default().write(folder.path(), &[picture, other], goes_on).unwrap());
        let files = std::fs::read_dir(folder.path()).unwrap();
        let mut files: Vec<_> = files.map(|file| file.unwrap().file_name()).collect();
        files.sort_unstable();
        assert_eq!(files, ["latency.png", "latency.svg"]);
    }

    #[test]
    fn the_bar_shows_the_file_that_is_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let picture = latencies("latency", &[0.1, 0.2], 300.0).unwrap();
        let bar = indicatif::ProgressBar::hidden();
        let mut watch = Watch::Bar(bar.clone());
        let mut shown = vec![];
        let style = PictureStyle::default();
        let is_complete = style.write(folder.path(), &[picture], |file| {
            watch.show(&drawing("boxes", file));
            shown.push(bar.message());
            ControlFlow::Continue(())
        });
        assert!(is_complete.unwrap());
        assert_eq!(shown, ["drawing boxes/latency.svg", "drawing boxes/latency.png"]);
    }

    #[test]
    fn variants_without_all_pictures_are_named() {
        let out = Path::new("out");
        assert_eq!(Drawn { pictures: 8, missing: vec![] }.message(out), None);
        let text = Drawn { pictures: 8, missing: vec!["a".to_owned(), "b".to_owned()] }.message(out).unwrap();
        assert!(
            text.contains("some pictures of a, b are missing") && text.contains("`manifactor plot out`"),
            "{text}"
        );
    }
}
