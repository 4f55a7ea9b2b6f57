//! Pictures, which go to files.
use crate::failure::Failure;
use manifactor::slam::output::write_whole;
use manifactor::viz::Picture;
use std::path::Path;

/// Writes pictures into a folder, each as SVG and as PNG.
pub(super) fn write(folder: &Path, pictures: &[Picture]) -> Result<(), Failure> {
    for picture in pictures {
        write_whole(&folder.join(format!("{}.svg", picture.name)), picture.svg())?;
        write_whole(&folder.join(format!("{}.png", picture.name)), picture.png().map_err(Failure::input)?)?;
    }
    Ok(())
}
