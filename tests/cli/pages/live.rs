//! The page of a stream, in a browser, while its frames arrive.
use crate::commands::online::{DESK, LIVE};
use crate::endings::repeated::{same, timeless};
use crate::pages::browser::Browser;
use crate::{fed, folder, manifactor, path, root};
use serde_json::Value;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::Path;
use std::process::{Child, ChildStderr, ChildStdin, Command, Stdio};
use std::thread::JoinHandle;

/// A malicious class name from a detector.
const NASTY: &str = "<script>document.title=1</script><img src=x onerror=document.title=2>";

/// The binary at work on frames from a test.
struct Stream {
    child: Child,
    frames: Option<ChildStdin>,
    stderr: BufReader<ChildStderr>,
    url: String,
}

impl Stream {
    fn begin(arguments: &str) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_manifactor"))
            .current_dir(root())
            .args(arguments.split_whitespace())
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut stderr = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains("http://") {
            line.clear();
            assert!(stderr.read_line(&mut line).unwrap() > 0, "it told no address");
        }
        let url = line.split_whitespace().find(|word| word.starts_with("http://")).unwrap().to_owned();
        Self { frames: child.stdin.take(), child, stderr, url }
    }

    fn give(&mut self, frames: &[String]) {
        let stream = self.frames.as_mut().unwrap();
        writeln!(stream, "{}", frames.join("\n")).unwrap();
        stream.flush().unwrap();
    }

    /// Ends the stream of frames.
    fn end(&mut self) {
        self.frames = None;
    }

    /// Returns the exit code, and the messages after the address.
    fn ended(mut self) -> (i32, String) {
        let mut said = String::new();
        self.stderr.read_to_string(&mut said).unwrap();
        (self.child.wait().unwrap().code().unwrap(), said)
    }
}

/// The desk's frames; one of its classes is renamed.
fn frames(desk: &str, renamed: &str) -> Vec<String> {
    let lines = manifactor(&format!("simulate {desk} --lines")).ended(0).stdout;
    let rename = |line: &str| {
        let mut frame: Value = serde_json::from_str(line).unwrap();
        for seen in frame["boxes"].as_array_mut().unwrap() {
            if seen["class"] == "laptop" {
                seen["class"] = renamed.into();
            }
        }
        frame.to_string()
    };
    lines.lines().map(rename).collect()
}

/// Reads until the server closes the connection. The server has already sent a state before this returns.
fn open_events(url: &str) -> JoinHandle<()> {
    let host = url.trim_start_matches("http://").trim_end_matches('/').to_owned();
    let mut stream = TcpStream::connect(&host).unwrap();
    write!(stream, "GET /events HTTP/1.1\r\nHost: {host}\r\n\r\n").unwrap();
    let mut lines = BufReader::new(stream).lines().map_while(Result::ok);
    assert!(lines.any(|line| line.starts_with("data: ")));
    std::thread::spawn(move || lines.for_each(drop))
}

#[test]
fn a_page_shows_the_map_as_it_grows() {
    let folder = folder(&[("desk.toml", DESK), ("live.toml", LIVE)]);
    let (live, out) = (path(&folder, "live.toml"), path(&folder, "out"));
    let frames = frames(&path(&folder, "desk.toml"), NASTY);
    let Some(mut browser) = Browser::open("") else { return };
    let mut stream = Stream::begin(&format!("online {live} --out {out} --view"));
    let url = stream.url.clone();
    assert!(url.starts_with("http://127.0.0.1:"), "{url}");
    browser.visit(&url, &url, 1280, "light");
    browser.until("document.documentElement.dataset.phase === 'waiting'");
    stream.give(&frames[..30]);
    browser.until("document.documentElement.dataset.frames === '30'");
    let boxes =
        |frame: &str| serde_json::from_str::<Value>(frame).unwrap()["boxes"].as_array().unwrap().len();
    let number = |browser: &mut Browser, text: &str| browser.value(text).as_u64().unwrap() as usize;
    assert_eq!(number(&mut browser, "mapView.variants[0].frames.length"), 30);
    assert_eq!(number(&mut browser, "mapView.variants[0].frames.at(-1)[6].length"), boxes(&frames[29]));
    let objects = number(&mut browser, "mapView.variants[0].objects.length");
    assert!(objects > 3, "{objects} objects");
    assert_eq!(number(&mut browser, "document.querySelectorAll('#objects tbody tr').length"), objects);
    // the canvas has more colours than background and lines
    browser.until("+canvas.dataset.drawn > 0 && canvas.dataset.frame === '29'");
    let colors = "(() => { const c = document.createElement('canvas'); [c.width, c.height] = [300, 200];
        const draw = c.getContext('2d'); draw.drawImage(canvas, 0, 0, 300, 200);
        return new Set(new Uint32Array(draw.getImageData(0, 0, 300, 200).data.buffer)).size; })()";
    assert!(number(&mut browser, colors) > 100);
    let image = number(&mut browser, "document.querySelector('#images canvas').height");
    assert!(image > 100, "the image's boxes: {image} pixels high");
    // more frames, and a class that must not become markup
    stream.give(&frames[30..]);
    browser.until("document.documentElement.dataset.frames === '60'");
    assert!(number(&mut browser, "document.querySelectorAll('#latencies polyline').length") == 1);
    assert!(
        browser.value("document.getElementById('facts').textContent").as_str().unwrap().contains("frames60")
    );
    assert!(
        browser.value("document.getElementById('objects').textContent").as_str().unwrap().contains(NASTY)
    );
    assert_eq!(browser.value("document.querySelectorAll('img').length"), 0);
    assert_eq!(browser.value("document.title"), "live");
    // an object is selected by keys
    browser.value("canvas.focus(); canvas.dispatchEvent(new KeyboardEvent('keydown', { key: 'n' })); 0");
    browser.until("canvas.dataset.selected !== ''");
    let told = browser.value("document.getElementById('object').textContent");
    let told = told.as_str().unwrap();
    assert!(
        told.contains("semi-axes (m)") && told.contains("boxes") && !told.contains("detected in"),
        "{told}"
    );
    browser.was_quiet();
    // a late browser gets the whole state, on a phone too
    for (width, scheme) in [(1280, "dark"), (390, "dark"), (1280, "light")] {
        browser.visit(&url, &url, width, scheme);
        browser.until("document.documentElement.dataset.frames === '60'");
        assert_eq!(browser.value("document.documentElement.dataset.map"), "webgl");
        browser.until("canvas.dataset.frame === '59'");
        let wide = browser.value("document.documentElement.scrollWidth").as_f64().unwrap();
        assert!(wide <= f64::from(width), "{wide} of {width} pixels");
        browser.save_screenshot(&format!("live_{width}_{scheme}"));
        browser.was_quiet();
    }
    stream.end();
    browser.until("document.documentElement.dataset.phase === 'ended'");
    let (code, said) = stream.ended();
    assert_eq!(code, 0, "{said}");
    assert_eq!(
        browser.value("document.getElementById('words').textContent"),
        "finished; all files are written"
    );
    assert_eq!(browser.value("document.documentElement.dataset.frames"), "60");
    // the page shows the same results as the written files
    let metrics = std::fs::read_to_string(format!("{out}/estimate/metrics.json")).unwrap();
    let metrics: Value = serde_json::from_str(&metrics).unwrap();
    assert_eq!(browser.value("livePage.state.cost"), metrics["solve"]["final_cost"]);
    let last = std::fs::read_to_string(format!("{out}/estimate/trajectory.txt")).unwrap();
    let x: f64 = last.lines().last().unwrap().split(' ').nth(1).unwrap().parse().unwrap();
    let shown = browser.value("mapView.variants[0].frames.at(-1)[4][0]").as_f64().unwrap();
    assert!((x - shown).abs() < 1e-4, "{x} m is shown as {shown} m");
    browser.save_screenshot("live_ended");
    browser.was_quiet();
}

#[test]
fn a_map_is_the_same_with_and_without_browsers() {
    let folder = folder(&[("desk.toml", DESK), ("live.toml", LIVE)]);
    let (live, out) = (path(&folder, "live.toml"), |name: &str| path(&folder, name));
    let frames = frames(&path(&folder, "desk.toml"), "laptop");
    fed(&format!("online {live} --out {}", out("unseen")), &frames.join("\n")).ended(0);
    let mut stream = Stream::begin(&format!("online {live} --out {} --view", out("seen")));
    let readers = [open_events(&stream.url), open_events(&stream.url)];
    for frame in &frames {
        stream.give(std::slice::from_ref(frame));
    }
    stream.end();
    assert_eq!(stream.ended().0, 0);
    readers.into_iter().for_each(|reader| reader.join().unwrap());
    let files = |name: &str| {
        let mut files = timeless(Path::new(&out(name)));
        files.retain(|name, _| !name.contains("latency."));
        files
    };
    same(&files("unseen"), &files("seen"), [&out("unseen"), &out("seen")]);
}

#[test]
fn a_page_says_that_its_program_has_gone() {
    let folder = folder(&[("desk.toml", DESK), ("live.toml", LIVE)]);
    let (live, out) = (path(&folder, "live.toml"), path(&folder, "out"));
    let frames = frames(&path(&folder, "desk.toml"), "laptop");
    // without WebGL, the boxes of the image are still shown
    let Some(mut browser) = Browser::open("--disable-3d-apis") else { return };
    let mut stream = Stream::begin(&format!("online {live} --out {out} --view=localhost"));
    let url = stream.url.clone();
    browser.visit(&url, &url, 1024, "dark");
    stream.give(&frames[..5]);
    browser.until("document.documentElement.dataset.frames === '5'");
    assert_eq!(browser.value("document.documentElement.dataset.map"), "static");
    assert_eq!(browser.value("document.querySelector('#images canvas').width > 200"), true);
    assert_eq!(browser.value("getComputedStyle(document.getElementById('view')).display"), "none");
    browser.save_screenshot("live_static");
    browser.was_quiet();
    stream.child.kill().unwrap();
    stream.child.wait().unwrap();
    browser.until("document.documentElement.dataset.phase === 'lost'");
    assert_eq!(browser.value("document.getElementById('phase').textContent"), "connection lost");
    assert_eq!(browser.value("document.documentElement.dataset.frames"), "5");
}

#[test]
fn others_need_the_token_that_is_told() {
    let folder = folder(&[("live.toml", LIVE)]);
    let (live, out) = (path(&folder, "live.toml"), path(&folder, "out"));
    let stream = Stream::begin(&format!("online {live} --out {out} --view=0.0.0.0"));
    let (address, token) = stream.url.trim_start_matches("http://").split_once("/?token=").unwrap();
    let status = |target: &str| {
        let (mut stream, mut answer) = (TcpStream::connect(address).unwrap(), String::new());
        write!(stream, "GET {target} HTTP/1.1\r\nHost: robot\r\n\r\n").unwrap();
        stream.read_to_string(&mut answer).unwrap();
        answer.split(' ').nth(1).unwrap().to_owned()
    };
    assert_eq!((status("/"), status("/events")), ("403".to_owned(), "403".to_owned()));
    assert_eq!((token.len(), status(&format!("/?token={token}"))), (32, "200".to_owned()));
    let mut stream = stream;
    stream.end();
    // a stream without frames has no map
    assert_ne!(stream.ended().0, 0);
}

#[test]
fn an_address_that_cannot_be_is_told_before_any_frame() {
    let folder = folder(&[("desk.toml", DESK)]);
    let (desk, out) = (path(&folder, "desk.toml"), path(&folder, "out"));
    let taken = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = taken.local_addr().unwrap();
    let ran = manifactor(&format!("online {desk} --out {out} --view={address}")).ended(2);
    ran.complains(&format!("--view: cannot listen at {address}"));
    assert!(!Path::new(&out).exists());
    let ran = manifactor(&format!("online {desk} --out {out} --view=nowhere:80")).ended(2);
    ran.complains("expected an address such as 8080");
    // the run does not need a browser
    let ran = manifactor(&format!("online {desk} --out {out} --view --json --every 60")).ended(0);
    let first: Value = serde_json::from_str(ran.stdout.lines().next().unwrap()).unwrap();
    assert!(first["view"].as_str().unwrap().starts_with("http://127.0.0.1:"), "{first}");
    ran.complains("live map: http://127.0.0.1:");
}
