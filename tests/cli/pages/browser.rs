//! A headless Chromium, controlled by its DevTools protocol over two pipes: NUL-terminated JSON on file
//! descriptors 3 and 4.
use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// Time limit for one answer on a busy machine.
const PATIENCE: Duration = Duration::from_secs(120);

/// A browser with one tab.
pub(crate) struct Browser {
    process: Child,
    to: ChildStdin,
    from: Receiver<Value>,
    sent: u64,
    session: String,
    /// Common prefix of the addresses that the page may request.
    origin: String,
    /// Messages that were not answers, in order.
    events: Vec<Value>,
    _profile: tempfile::TempDir,
}

impl Browser {
    /// Starts the browser. Returns `None`, with a message, if there is no Chromium, or no shell to connect
    /// its pipes.
    pub(crate) fn open(flags: &str) -> Option<Self> {
        let names = ["chromium", "chromium-browser", "google-chrome"];
        let there = |name: &&str| cfg!(unix) && Command::new(name).arg("--version").output().is_ok();
        let Some(name) = names.into_iter().find(there) else {
            eprintln!("skipped: there is no Chromium to open pages with");
            return None;
        };
        let profile = tempfile::tempdir().unwrap();
        let quiet = "--headless --no-sandbox --disable-quic --no-first-run --disable-background-networking \
                     --disable-component-update --disable-sync --hide-scrollbars --use-angle=swiftshader \
                     --enable-unsafe-swiftshader --remote-debugging-pipe";
        // the browser's pipes are our ends of its standard streams
        let script = format!(
            "exec {name} {quiet} {flags} --user-data-dir='{}' 3<&0 4>&1 0</dev/null 1>/dev/null 2>/dev/null",
            profile.path().display()
        );
        let mut command = Command::new("sh");
        command.args(["-c", &script]).stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command.spawn().unwrap();
        let (to, answers) = (process.stdin.take().unwrap(), process.stdout.take().unwrap());
        let (sender, from) = channel();
        std::thread::spawn(move || {
            for message in BufReader::new(answers).split(0).map_while(Result::ok) {
                let message = serde_json::from_slice(&message).unwrap();
                if sender.send(message).is_err() {
                    break;
                }
            }
        });
        let (session, origin) = (String::new(), String::new());
        let mut browser =
            Self { process, to, from, sent: 0, session, origin, events: vec![], _profile: profile };
        let tab = browser.call("Target.createTarget", json!({ "url": "about:blank" }));
        let attached = json!({ "targetId": tab["targetId"], "flatten": true });
        let session = browser.call("Target.attachToTarget", attached)["sessionId"].clone();
        session.as_str().unwrap().clone_into(&mut browser.session);
        for domain in ["Page", "Runtime", "Network", "Log"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        Some(browser)
    }

    /// Sends a request, and waits for the answer.
    pub(crate) fn call(&mut self, method: &str, parameters: impl Into<Value>) -> Value {
        self.sent += 1;
        let mut message = json!({ "id": self.sent, "method": method });
        message["params"] = parameters.into();
        if !self.session.is_empty() {
            message["sessionId"] = Value::from(self.session.as_str());
        }
        self.to.write_all(format!("{message}\0").as_bytes()).unwrap();
        self.to.flush().unwrap();
        loop {
            let message = self.from.recv_timeout(PATIENCE).unwrap_or_else(|e| panic!("{method}: {e}"));
            if message["id"] == self.sent {
                assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                return message["result"].clone();
            }
            self.events.push(message);
        }
    }

    /// Opens a file in a window of this width, and waits until it is loaded.
    pub(crate) fn show(&mut self, file: &Path, width: u32, scheme: &str) {
        self.visit(&format!("file://{}", file.display()), "file:", width, scheme);
    }

    /// Opens an address. The page may only request addresses that begin with `origin`.
    pub(crate) fn visit(&mut self, address: &str, origin: &str, width: u32, scheme: &str) {
        origin.clone_into(&mut self.origin);
        let window = json!({ "width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500 });
        self.call("Emulation.setDeviceMetricsOverride", window);
        let scheme = json!({ "features": [{ "name": "prefers-color-scheme", "value": scheme }] });
        self.call("Emulation.setEmulatedMedia", scheme);
        self.events.clear();
        self.call("Page.navigate", json!({ "url": address }));
        self.until("document.readyState === 'complete'");
    }

    /// Evaluates an expression in the page; a promise is awaited.
    pub(crate) fn value(&mut self, expression: &str) -> Value {
        let asked = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let answer = self.call("Runtime.evaluate", asked);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].clone()
    }

    /// Waits until a condition of the page holds; it is checked in every animation frame.
    pub(crate) fn until(&mut self, condition: &str) {
        self.value(&format!(
            "new Promise(done => {{ const look = () => ({condition}) ? done(true) : requestAnimationFrame(look); look(); }})"
        ));
    }

    /// Presses the left button at a point, moves by this offset, and releases it.
    pub(crate) fn drag(&mut self, [x, y]: [f64; 2], [dx, dy]: [f64; 2]) {
        let mut mouse = |kind: &str, x: f64, y: f64| {
            let event =
                json!({ "type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1 });
            self.call("Input.dispatchMouseEvent", event);
        };
        mouse("mousePressed", x, y);
        if dx != 0.0 || dy != 0.0 {
            mouse("mouseMoved", x + 0.5 * dx, y + 0.5 * dy);
            mouse("mouseMoved", x + dx, y + dy);
        }
        mouse("mouseReleased", x + dx, y + dy);
    }

    /// Puts two fingers to the right and left of a point, and moves them apart.
    pub(crate) fn pinch(&mut self, [x, y]: [f64; 2], from: f64, to: f64) {
        let fingers =
            |gap: f64| json!([{ "x": x - gap, "y": y, "id": 0 }, { "x": x + gap, "y": y, "id": 1 }]);
        for (kind, points) in [
            ("touchStart", fingers(from)),
            ("touchMove", fingers(0.5 * (from + to))),
            ("touchMove", fingers(to)),
            ("touchEnd", json!([])),
        ] {
            self.call("Input.dispatchTouchEvent", json!({ "type": kind, "touchPoints": points }));
        }
    }

    /// Fails if the page has reported an error since it was shown, or has requested anything from a
    /// network.
    #[track_caller]
    pub(crate) fn was_quiet(&self) {
        for event in &self.events {
            let (method, told) = (event["method"].as_str().unwrap_or_default(), &event["params"]);
            let error = method == "Runtime.exceptionThrown"
                || (method == "Log.entryAdded" && told["entry"]["level"] == "error");
            assert!(!error, "{told}");
            let address = told["request"]["url"].as_str().unwrap_or("data:");
            assert!(address.starts_with(&self.origin) || address.starts_with("data:"), "fetched {address}");
        }
    }

    /// Saves a screenshot for people, if MANIFACTOR_SCREENSHOTS names a folder.
    pub(crate) fn save_screenshot(&mut self, name: &str) {
        let Ok(folder) = std::env::var("MANIFACTOR_SCREENSHOTS") else { return };
        let shot = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes = decoded(shot["data"].as_str().unwrap());
        std::fs::write(Path::new(&folder).join(format!("{name}.png")), bytes).unwrap();
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // it may have ended
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Decodes base 64.
fn decoded(text: &str) -> Vec<u8> {
    let alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bytes, mut bits, mut held) = (vec![], 0u32, 0);
    for digit in text.chars().filter_map(|c| alphabet.find(c)) {
        (bits, held) = (bits << 6 | digit as u32, held + 6);
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held & 0xff) as u8);
        }
    }
    bytes
}
