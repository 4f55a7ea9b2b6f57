//! Errors against the truth over time, as in evo.
use super::clock;
use crate::canvas::Ink;
use crate::drawing::{Chart, Curve, Picture, TIME, figure};
use manifactor_formats::words::count;
use manifactor_slam::record::{FrameRecord, PoseRecord, VariantRecord};

type Part = fn(&FrameRecord) -> &PoseRecord;
/// Odometry, then the estimate.
const BOTH: [(&str, Ink, Part); 2] =
    [("odometry", Ink::Odometry, |f| &f.odometry), ("estimated", Ink::Estimate, |f| &f.estimate)];

fn curves(variant: &VariantRecord, error: impl Fn(&PoseRecord) -> Option<f64>) -> Vec<Curve> {
    let clock = clock(variant);
    let curve = |(name, ink, of): &(&str, Ink, Part)| {
        let error = |f| error(of(f)).unwrap_or(f64::NAN);
        let points = variant.frames.iter().map(|f| (clock(f.timestamp), error(f)));
        Curve::new(name, *ink, points.collect())
    };
    BOTH.iter().map(curve).collect()
}

/// Describes the alignment of the trajectories.
fn aligned(variant: &VariantRecord) -> String {
    use manifactor_slam::metrics::Alignment;
    let how = variant.alignment.map(|alignment| match alignment {
        Alignment::Se3 => "aligned by SE(3)",
        Alignment::Sim3 => "aligned by Sim(3)",
        Alignment::FirstPose => "aligned at the first pose",
        Alignment::None => "not aligned",
    });
    how.unwrap_or_default().to_owned()
}

/// Draws the absolute error of positions.
pub(super) fn absolute(variant: &VariantRecord, width: f64) -> Option<Picture> {
    let curves = curves(variant, |pose| pose.error);
    let panel = Chart { y: "APE (m)".into(), begun_at_zero: true, curves, ..Chart::default() };
    let text = format!("absolute pose error, {}", aligned(variant));
    let sheet = figure(&text, TIME, false, &[panel], width, 0.5 * width)?;
    Some(Picture::new("error_over_time", text, sheet))
}

/// Draws the relative error of motions.
pub(super) fn relative(variant: &VariantRecord, width: f64) -> Option<Picture> {
    let panel = |y: &str, part: usize, unit: f64| {
        let curves = curves(variant, |pose| pose.relative?.get(part).map(|x| x * unit));
        Chart { y: y.into(), begun_at_zero: true, curves, ..Chart::default() }
    };
    let panels = [panel("RPE (m)", 0, 1.0), panel("RPE (°)", 1, 1f64.to_degrees())];
    let frames = variant.relative_over;
    let text = format!("relative pose error over {}", count(frames, "frame"));
    let sheet = figure(&text, TIME, false, &panels, width, 0.7 * width)?;
    Some(Picture::new("relative_error", text, sheet))
}
