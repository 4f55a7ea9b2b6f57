use crate::{folder, manifactor, path};
use std::path::Path;
use std::process::Command;

const SMALL: &str = "--set source.trajectory.frames=30 --set source.scene.objects=4";

/// Nothing that a browser would fetch: no addresses but names of namespaces.
fn assert_self_contained(html: &str) {
    for attribute in ["src=", "href=\"http", "url(http", "@import", "<script", "<link"] {
        assert!(!html.contains(attribute), "{attribute}");
    }
    for (at, _) in html.match_indices("http") {
        let before = html.get(at.saturating_sub(16)..at).unwrap_or_default();
        assert!(before.contains("xmlns"), "an address: {}", &html[at..(at + 60).min(html.len())]);
    }
}

/// What a headless Chromium makes of a page; `None`, said aloud, where there is none.
fn rendered(page: &Path) -> Option<String> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let browser = names.into_iter().find(|name| Command::new(name).arg("--version").output().is_ok());
    let Some(browser) = browser else {
        eprintln!("skipped: there is no Chromium to open report.html with");
        return None;
    };
    let arguments = [
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--host-resolver-rules=MAP * ~NOTFOUND",
        "--dump-dom",
    ];
    let address = format!("file://{}", page.display());
    let output = Command::new(browser).args(arguments).arg(address).output().unwrap();
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

#[test]
fn the_report_of_a_run_needs_no_network() {
    let folder = folder(&[]);
    let out = path(&folder, "desk");
    let ran = manifactor(&format!("run examples/desk/desk.toml --out {out} {SMALL}"));
    assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
    let page = Path::new(&out).join("report.html");
    let html = std::fs::read_to_string(&page).unwrap();
    assert_self_contained(&html);
    for text in [
        "simulated desk",
        "QuadricSLAM",
        "error of position over time",
        "bounding_box",
        "not mapped because",
        "[source]",
    ] {
        assert!(html.contains(text), "{text}");
    }
    // two maps, errors, residuals and four images, for each of two variants
    assert_eq!(html.matches("<svg").count(), 16);
    if let Some(dom) = rendered(&page) {
        assert!(dom.contains("simulated desk") && dom.matches("<svg").count() == 16);
    }
    for picture in ["map_top", "map_side", "error_over_time", "residuals", "image_000000"] {
        let png = std::fs::read(Path::new(&out).join(format!("quadricslam/{picture}.png"))).unwrap();
        assert_eq!(png.get(1..4), Some(&b"PNG"[..]), "{picture}");
    }
}

#[test]
fn the_report_of_an_experiment_needs_no_network() {
    let base = "source = { type = 'simulated', scene = { objects = 3 }, trajectory = { frames = 20 } }";
    let sweep = "
        title = 'noise of boxes'
        base = 'base.toml'
        axes = [{ columns = { sigma_px = 'source.detector.sigma_px' }, rows = [1.0, 4.0] }]
        summary = { by = ['sigma_px'], metrics = ['position'], curve = 'sigma_px' }";
    let folder = folder(&[("base.toml", base), ("sweep.toml", sweep)]);
    let out = path(&folder, "out");
    manifactor(&format!("experiment {} --out {out}", path(&folder, "sweep.toml"))).ended(0);
    let page = Path::new(&out).join("report.html");
    let html = std::fs::read_to_string(&page).unwrap();
    assert_self_contained(&html);
    if let Some(dom) = rendered(&page) {
        assert_eq!(dom.matches("<svg").count(), html.matches("<svg").count());
    }
    for text in ["noise of boxes", "position over sigma_px", "2 of 2 trials", "base.toml"] {
        assert!(html.contains(text), "{text}");
    }
}
