//! The duration of each update of a session.
use crate::canvas::Ink;
use crate::drawing::{Chart, Curve, Picture, figure};

/// Draws the latencies of updates in order, in milliseconds on a logarithmic axis, with lines at the median
/// and the 99th percentile. `None` if there are no updates.
pub fn latencies(title: &str, seconds: &[f64], width: f64) -> Option<Picture> {
    let ms: Vec<f64> = seconds.iter().map(|s| s * 1e3).collect();
    let mut sorted = ms.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let line = |name: &str, share: f64, ink: Ink| {
        let at = ((sorted.len() as f64 * share).ceil() as usize).clamp(1, sorted.len().max(1)) - 1;
        let level = sorted.get(at).copied().unwrap_or(f64::NAN);
        let points = vec![(1.0, level), (ms.len() as f64, level)];
        Curve::new(&format!("{name}: {level:.3} ms"), ink, points).dashed()
    };
    let each = ms.iter().enumerate().map(|(i, ms)| (i as f64 + 1.0, *ms)).collect();
    let curves = vec![
        Curve::new("update", Ink::Series(0), each),
        line("p50", 0.5, Ink::Series(1)),
        line("p99", 0.99, Ink::Series(2)),
    ];
    let panel = Chart { y: "ms".into(), log_y: true, begun_at_zero: false, curves };
    let sheet = figure(title, "updates", false, &[panel], width, 0.5 * width)?;
    Some(Picture::new("latency", title.to_owned(), sheet))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canvas::Theme;

    #[test]
    fn the_lines_are_those_that_half_and_nearly_all_stay_below() {
        let seconds: Vec<f64> = (1..=200).map(|i| f64::from(i) * 1e-3).collect();
        let svg = latencies("updates", &seconds, 700.0).unwrap().svg(Theme::Light);
        assert!(svg.contains("p50: 100.000 ms") && svg.contains("p99: 198.000 ms"), "{svg}");
        assert!(latencies("none", &[], 700.0).is_none());
    }
}
