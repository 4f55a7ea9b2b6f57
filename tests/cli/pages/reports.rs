use crate::pages::browser::Browser;
use crate::{folder, manifactor, path};
use std::path::{Path, PathBuf};

const SMALL: &str = "--set source.trajectory.frames=30 --set source.scene.objects=4";

/// Checks that a browser would fetch nothing: the only addresses are namespaces, and no scripts or styles
/// are external.
fn assert_self_contained(html: &str) {
    for attribute in ["src=", "href=\"http", "url(http", "@import", "<link", "<script src"] {
        assert!(!html.contains(attribute), "{attribute}");
    }
    for (at, _) in html.match_indices("http") {
        let around = html.get(at.saturating_sub(16)..(at + 20).min(html.len())).unwrap_or_default();
        assert!(around.contains("xmlns") || around.contains("http-equiv"), "an address: {around}");
    }
}

/// The page of the desk with fewer frames and objects.
fn desk(out: &str) -> PathBuf {
    let ran = manifactor(&format!("run examples/desk/desk.toml --out {out} {SMALL}"));
    assert!(ran.code == 0 || ran.code == 1, "{}", ran.stderr);
    Path::new(out).join("report.html")
}

#[test]
fn the_report_of_a_run_needs_no_network() {
    let folder = folder(&[]);
    let out = path(&folder, "desk");
    let html = std::fs::read_to_string(desk(&out)).unwrap();
    assert_self_contained(&html);
    for text in [
        "simulated desk",
        "QuadricSLAM",
        "absolute pose error",
        "bounding_box",
        "not mapped because",
        "[source]",
    ] {
        assert!(html.contains(text), "{text}");
    }
    let pictures = html.matches("<svg").count();
    assert!(pictures > 20);
    assert_eq!(html.matches("viewBox=").count(), pictures);
    assert_eq!(html.matches("role=\"img\"").count(), pictures + 1);
    for name in [
        "map_top",
        "map_side",
        "error_over_time",
        "relative_error",
        "xyz",
        "rpy",
        "residuals",
        "cost",
        "image_000000",
    ] {
        let png = std::fs::read(Path::new(&out).join(format!("quadricslam/{name}.png"))).unwrap();
        assert_eq!(png.get(1..4), Some(&b"PNG"[..]), "{name}");
    }
}

#[test]
fn the_report_of_a_graph_shows_it_in_3d_and_its_costs() {
    let folder = folder(&[]);
    let page = path(&folder, "helix.html");
    let solve = format!("solve examples/python/helix.g2o --report {page}");
    manifactor(&solve).ended(0);
    let html = std::fs::read_to_string(&page).unwrap();
    assert_self_contained(&html);
    for text in
        ["helix.g2o", "Converged", "between_se3", "Factors with the largest costs", "seen from the side"]
    {
        assert!(html.contains(text), "{text}");
    }
    manifactor(&solve).ended(2).complains("exists already");
    manifactor(&format!("{solve} --force")).ended(0);
    manifactor("solve examples/python/helix.g2o --force").ended(2);
    let Some(mut browser) = Browser::open("") else { return };
    for (width, scheme) in [(390, "dark"), (1024, "light")] {
        browser.show(Path::new(&page), width, scheme);
        browser.until("document.documentElement.dataset.map && canvas.dataset.drawn > 0");
        assert_eq!(browser.value("document.documentElement.dataset.map"), "webgl");
        let wide = browser.value("document.documentElement.scrollWidth").as_f64().unwrap();
        assert!(wide <= f64::from(width), "{wide} of {width} pixels");
        browser.save_screenshot(&format!("graph_{width}_{scheme}"));
        browser.was_quiet();
    }
    let number = |browser: &mut Browser, expression: &str| browser.value(expression).as_f64().unwrap();
    // a click on a pose shows its factors
    browser.value(
        "const view = window.graphView, box = canvas.getBoundingClientRect(), at = view.project(view.graph.points[0].after);
         window.picked = { x: box.x + at[0], y: box.y + at[1] }; 0",
    );
    let at = [number(&mut browser, "picked.x"), number(&mut browser, "picked.y")];
    browser.drag(at, [0.0, 0.0]);
    browser.until("canvas.dataset.selected !== ''");
    let told = browser.value("document.getElementById('object').textContent");
    assert!(told.as_str().unwrap().contains("between_se3 ("), "{told}");
    browser.value("for (const box of document.querySelectorAll('[data-show]')) box.click(); 0");
    browser.until("!graphView.show.after && graphView.show.before && graphView.show.cost");
    browser.save_screenshot("graph_before");
    browser.was_quiet();
}

#[test]
fn the_map_turns_zooms_and_tells_of_an_object() {
    let folder = folder(&[]);
    let page = desk(&path(&folder, "desk"));
    let Some(mut browser) = Browser::open("") else { return };
    for (width, scheme) in [(390, "dark"), (1024, "light"), (1920, "dark")] {
        browser.show(&page, width, scheme);
        browser.until("document.documentElement.dataset.map && canvas.dataset.drawn > 0");
        assert_eq!(browser.value("document.documentElement.dataset.map"), "webgl");
        let wide = browser.value("document.documentElement.scrollWidth").as_f64().unwrap();
        assert!(wide <= f64::from(width), "{wide} of {width} pixels");
        // the map is the first thing below the verdict
        let top = browser.value("canvas.getBoundingClientRect().top").as_f64().unwrap();
        assert!(top < 400.0, "at {width} pixels the map begins at {top}");
        let verdict = browser.value("document.querySelector('.verdict').textContent");
        assert!(verdict.as_str().unwrap().contains("ours beside QuadricSLAM"), "{verdict}");
        browser.value("document.getElementById('map').scrollIntoView()");
        browser.save_screenshot(&format!("map_{width}_{scheme}"));
        // the text of a plot follows the page's theme
        let ink = browser.value("getComputedStyle(document.querySelector('svg text')).fill");
        assert_eq!(ink, if scheme == "dark" { "rgb(230, 233, 238)" } else { "rgb(29, 33, 41)" });
        browser.was_quiet();
    }
    let number = |browser: &mut Browser, expression: &str| browser.value(expression).as_f64().unwrap();
    // the position of the nearest object in the view
    browser.value(
        "const view = window.mapView, near = view.variants[0].objects.filter(o => o.estimate)
            .sort((a, b) => norm(sub(a.estimate, view.orbit.eye)) - norm(sub(b.estimate, view.orbit.eye)))[0];
         const box = canvas.getBoundingClientRect(), at = view.project(near.estimate, view.parts()[0]);
         window.picked = { id: near.id, class: near.class, x: box.x + at[0], y: box.y + at[1] }; 0",
    );
    let at = [number(&mut browser, "picked.x"), number(&mut browser, "picked.y")];
    browser.drag(at, [0.0, 0.0]);
    browser.until("canvas.dataset.selected === String(picked.id)");
    let told = browser.value("document.getElementById('object').textContent");
    let class = browser.value("picked.class");
    for text in [class.as_str().unwrap(), "semi-axes (m)", "position error (m)", "residual"] {
        assert!(told.as_str().unwrap().contains(text), "{text}: {told}");
    }
    browser.save_screenshot("picked");
    // the wheel zooms if the map has the focus, and scrolls the page otherwise
    let wheel = |browser: &mut Browser| {
        let event =
            serde_json::json!({ "type": "mouseWheel", "x": at[0], "y": at[1], "deltaX": 0, "deltaY": 40 });
        browser.call("Input.dispatchMouseEvent", event);
    };
    let near = number(&mut browser, "mapView.orbit.distance");
    wheel(&mut browser);
    browser.until(&format!("mapView.orbit.distance > {near}"));
    let (far, scrolled) = (number(&mut browser, "mapView.orbit.distance"), number(&mut browser, "scrollY"));
    browser.value("canvas.blur(); 0");
    wheel(&mut browser);
    browser.until(&format!("scrollY > {scrolled}"));
    assert_eq!(number(&mut browser, "mapView.orbit.distance"), far);
    browser.value(&format!("scrollTo(0, {scrolled}); mapView.orbit.reset(); 0"));
    browser.until(&format!("scrollY === {scrolled}"));
    let azimuth = number(&mut browser, "mapView.orbit.azimuth");
    browser.drag(at, [80.0, 30.0]);
    browser.until("canvas.dataset.drawn > 0");
    assert!((number(&mut browser, "mapView.orbit.azimuth") - azimuth).abs() > 0.3);
    assert_eq!(browser.value("canvas.dataset.selected === String(picked.id)"), true, "a drag picks nothing");
    let distance = number(&mut browser, "mapView.orbit.distance");
    browser.pinch(at, 30.0, 60.0);
    let ratio = distance / number(&mut browser, "mapView.orbit.distance");
    assert!((ratio - 2.0).abs() < 0.1, "{ratio}");
    browser.value("const time = document.getElementById('time'); time.value = 12; time.dispatchEvent(new Event('input')); 0");
    browser.until("canvas.dataset.frame === '12'");
    // all charts over time have the cursor at this frame, and a press on a chart moves the map
    let cursors = "document.querySelectorAll('svg .cursor').length";
    assert!(number(&mut browser, cursors) >= 12.0);
    assert_eq!(browser.value(cursors), browser.value("document.querySelectorAll('svg[data-time]').length"));
    browser.value("mapView.goToTime(mapView.longest.frames[7][0] + 0.01); 0");
    browser.until("canvas.dataset.frame === '7'");
    // the chart of errors has the value of a curve under the pointer
    browser.value(
        "const chart = document.querySelector('svg[data-time]'); chart.scrollIntoView({ block: 'center' });
         const around = chart.getBoundingClientRect();
         window.spot = { x: around.x + around.width / 2, y: around.y + around.height / 2 }; 0",
    );
    let spot = ["spot.x", "spot.y"].map(|place| number(&mut browser, place));
    let event = serde_json::json!({ "type": "mouseMoved", "x": spot[0], "y": spot[1] });
    browser.call("Input.dispatchMouseEvent", event);
    browser.until("chart.querySelector('text.value').textContent.includes(', ')");
    let off = number(
        &mut browser,
        "const [seconds, error] = chart.querySelector('text.value').textContent.split(', ').map(Number);
         const curves = mapView.run.variants[0].frames.flatMap(f => [[f[0], f[3]], [f[0], f[5]]]);
         Math.min(...curves.map(([s, e]) => Math.hypot(s / seconds - 1, e / error - 1)))",
    );
    assert!(off < 0.02, "{off}");
    browser.value("canvas.scrollIntoView(); 0");
    // a class that is not shown is neither drawn nor selected
    let names = "document.getElementById('names').textContent.split(picked.class).length - 1";
    let before = number(&mut browser, names);
    browser.value(
        "const tick = [...document.querySelectorAll('#classes label')].find(l => l.textContent === picked.class)
             .querySelector('input'); tick.click(); 0",
    );
    browser.until("canvas.dataset.selected === '' && !mapView.pending");
    assert!(before > 0.0 && number(&mut browser, names) == 0.0);
    browser.value("tick.click(); mapView.select(picked.id); 0");
    browser.until("canvas.dataset.selected === String(picked.id)");
    // a single object is hidden and shown again
    let shown = "mapView.objects(mapView.variants[0]).length";
    let all = number(&mut browser, shown);
    browser.value("document.querySelector('#object button').click(); 0");
    browser.until("canvas.dataset.selected === '' && !document.getElementById('unhide').hidden");
    assert_eq!(number(&mut browser, shown), all - 1.0);
    browser.value("document.getElementById('unhide').click(); mapView.select(picked.id); 0");
    browser.until("canvas.dataset.selected === String(picked.id)");
    assert_eq!(number(&mut browser, shown), all);
    // an overlay has one view for all variants
    browser.value("document.querySelector('[data-show=overlay]').click(); 0");
    browser.until(
        "mapView.parts().length === 1 && document.getElementById('key').textContent.includes('rings')",
    );
    browser.save_screenshot("overlay");
    browser.value(
        "document.querySelector('[data-show=overlay]').click(); document.getElementById('fit').click(); 0",
    );
    browser.value("document.querySelector('[data-show=error]').click(); 0");
    browser.until("document.getElementById('key').textContent.includes('error of the estimated path')");
    browser.save_screenshot("errors");
    browser.was_quiet();
}

#[test]
fn a_printed_report_fits_its_paper() {
    let folder = folder(&[]);
    let page = desk(&path(&folder, "desk"));
    let Some(mut browser) = Browser::open("") else { return };
    // the width of A4 without its margins
    browser.show(&page, 720, "dark");
    browser.until("document.documentElement.dataset.map && canvas.dataset.drawn > 0");
    browser.call("Emulation.setEmulatedMedia", serde_json::json!({ "media": "print" }));
    let display = |id: &str| format!("getComputedStyle(document.getElementById('{id}')).display");
    assert_eq!(browser.value(&display("map")), "none");
    assert_eq!(browser.value(&display("static-map")), "block");
    assert!(browser.value("document.documentElement.scrollWidth").as_f64().unwrap() <= 720.0);
    let cut = "[...document.querySelectorAll('.wide')].filter(w => w.getBoundingClientRect().width > 0
        && (w.scrollWidth > w.clientWidth + 1 || getComputedStyle(w).overflowY !== 'visible')).length";
    assert_eq!(browser.value(cut), 0);
    let paper = browser.value("getComputedStyle(document.documentElement).getPropertyValue('--paper')");
    assert_eq!(paper, "#ffffff");
    browser.save_screenshot("printed");
    // folded sections are open while the page is printed
    let folded = "document.querySelectorAll('details:not([open])').length";
    let before = browser.value(folded);
    assert_ne!(before, 0);
    browser.value("dispatchEvent(new Event('beforeprint')); 0");
    assert_eq!(browser.value(folded), 0);
    browser.value("dispatchEvent(new Event('afterprint')); 0");
    assert_eq!(browser.value(folded), before);
}

#[test]
fn without_webgl_there_is_a_picture() {
    let folder = folder(&[]);
    let page = desk(&path(&folder, "desk"));
    let Some(mut browser) = Browser::open("--disable-3d-apis") else { return };
    browser.show(&page, 1024, "light");
    browser.until("document.documentElement.dataset.map");
    assert_eq!(browser.value("document.documentElement.dataset.map"), "static");
    let shown =
        browser.value("document.querySelector('#static-map svg').getBoundingClientRect().width > 500");
    assert_eq!(shown, true);
    assert_eq!(browser.value("getComputedStyle(document.getElementById('map')).display"), "none");
    let caption = browser.value("document.querySelector('#static-map figcaption').textContent");
    assert!(caption.as_str().unwrap().contains("no WebGL 2"), "{caption}");
}

#[test]
fn names_in_a_report_do_nothing() {
    let nasty = "</script><img src=x onerror=document.title=1>";
    let run = format!(
        "title = \"{nasty}\"\nsource = {{ type = 'simulated', scene = {{ objects = 3 }}, trajectory = {{ frames = 20 }} }}\n\
         [[variants]]\nname = \"{nasty}\"\n"
    );
    let folder = folder(&[("run.toml", &run)]);
    let out = path(&folder, "out");
    manifactor(&format!("run {} --out {out}", path(&folder, "run.toml")));
    let page = Path::new(&out).join("report.html");
    let html = std::fs::read_to_string(&page).unwrap();
    assert!(!html.contains("<img") && html.contains("\\u003c/script\\u003e"));
    let Some(mut browser) = Browser::open("") else { return };
    browser.show(&page, 1024, "light");
    browser.until("canvas.dataset.drawn > 0");
    assert_eq!(browser.value("document.title"), nasty);
    assert_eq!(browser.value("document.querySelectorAll('img').length"), 0);
    browser.was_quiet();
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
    for text in ["noise of boxes", "position over sigma_px", "2 of 2 trials", "base.toml"] {
        assert!(html.contains(text), "{text}");
    }
    let Some(mut browser) = Browser::open("") else { return };
    browser.show(&page, 390, "dark");
    assert_eq!(browser.value("document.querySelectorAll('svg').length"), html.matches("<svg").count());
    assert!(browser.value("document.documentElement.scrollWidth").as_f64().unwrap() <= 390.0);
    // on a narrow screen each cell of the summary has its column's name, and none is off the screen
    let cell = "[...document.querySelectorAll('.cards td')].every(cell => {
        const { left, right } = cell.getBoundingClientRect();
        return left >= 0 && right <= 390 && getComputedStyle(cell, '::before').content.length > 2; })";
    assert_eq!(browser.value(cell), true);
    browser.was_quiet();
}

#[test]
fn pictures_are_made_again_from_the_folder() {
    let folder = folder(&[]);
    let out = path(&folder, "desk");
    desk(&out);
    let picture = |name: &str| std::fs::read(format!("{out}/quadricslam/{name}")).unwrap();
    let (svg, png) = (picture("map_top.svg"), picture("map_top.png"));
    manifactor(&format!("plot {out} --size 400 --theme dark")).ended(0);
    let dark = String::from_utf8(picture("map_top.svg")).unwrap();
    assert!(dark.contains("width=\"400\"") && dark.contains("#14171c"));
    manifactor(&format!("plot {out}")).ended(0);
    assert!(svg == picture("map_top.svg") && png == picture("map_top.png"));
    let ply = String::from_utf8(picture("map.ply")).unwrap();
    assert!(ply.starts_with("ply\nformat ascii 1.0\n") && ply.contains("element face"));
    let nowhere = manifactor(&format!("plot {}", path(&folder, "nowhere"))).ended(3);
    nowhere.complains("there is no such folder");
}

#[test]
fn pictures_go_nowhere_but_into_their_folders() {
    let folder = folder(&[]);
    let (out, other) = (path(&folder, "desk"), path(&folder, "other"));
    manifactor(&format!(
        "run examples/desk/desk.toml --out {out} --set source.trajectory.frames=20 --set source.scene.objects=4"
    ));
    // a folder of a different command
    std::fs::create_dir_all(format!("{other}/quadricslam")).unwrap();
    std::fs::write(format!("{other}/quadricslam/map.ply"), "precious").unwrap();
    manifactor(&format!("plot {out} --out {other}")).ended(2);
    assert_eq!(std::fs::read_to_string(format!("{other}/quadricslam/map.ply")).unwrap(), "precious");
    manifactor(&format!("plot {out} --out {other} --force")).ended(0);
    // a record with a path outside of the folder
    let record = std::fs::read_to_string(format!("{out}/record.json")).unwrap();
    let moved = record.replacen("\"folder\":\"quadricslam\"", "\"folder\":\"../escaped\"", 1);
    assert_ne!(moved, record);
    std::fs::write(format!("{out}/record.json"), moved).unwrap();
    manifactor(&format!("plot {out}")).ended(2).complains("which is not that of its name");
    assert!(!Path::new(&path(&folder, "escaped")).exists());
}
