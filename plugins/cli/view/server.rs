//! The server: the page, and its events. It answers GET, once for each connection.
use super::access::Access;
use super::feed::Feed;
use super::request::{NoRequest, Request};
use manifactor::viz::{LiveMap, live_page};
use std::io::{self, Write};
use std::net::{TcpListener, TcpStream};
use std::sync::Arc;
use std::thread;
use std::time::Duration;

/// Connections at once; more are turned away.
const MOST: usize = 32;
/// A browser that takes nothing for so long has gone.
const PATIENCE: Duration = Duration::from_secs(10);
/// From one state to the next at least; where there is no other, something is sent now and then to find out who has gone.
const PACE: Duration = Duration::from_millis(100);
const SILENCE: Duration = Duration::from_secs(15);
/// With every answer: it is kept nowhere, taken for what it says it is, and shown in no other page; the address, which may have
/// a token, is told nobody.
const HEADERS: &str = "Cache-Control: no-store\r\nX-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n\
    Cross-Origin-Resource-Policy: same-origin\r\nContent-Security-Policy: frame-ancestors 'none'\r\nConnection: close\r\n";

struct Server {
    access: Access,
    feed: Arc<Feed<LiveMap>>,
    page: String,
}

/// Serves from now on, until the program ends.
///
/// # Errors
/// Where the system has no thread for it.
pub(super) fn serve(listener: TcpListener, access: Access, feed: Arc<Feed<LiveMap>>) -> io::Result<()> {
    let server = Arc::new(Server { access, feed, page: live_page() });
    let accept = move || {
        for stream in listener.incoming() {
            let Ok(stream) = stream else {
                // too many files are open, say: that may pass
                thread::sleep(PACE);
                continue;
            };
            // each connection has one of these
            if Arc::strong_count(&server) > MOST {
                let _ = respond(&stream, "503 Service Unavailable", "", "too many look already");
                continue;
            }
            let server = server.clone();
            // without a thread the connection is closed
            let _ = thread::Builder::new().name("view of one".into()).spawn(move || server.answer(stream));
        }
    };
    thread::Builder::new().name("view".into()).spawn(accept).map(drop)
}

impl Server {
    /// Answers one request. What goes wrong is the browser's affair: it has gone, or asks again.
    fn answer(&self, mut stream: TcpStream) {
        let _ = stream.set_write_timeout(Some(PATIENCE)).and_then(|()| stream.set_nodelay(true));
        let _ = match Request::read(&mut stream) {
            Ok(request) => self.respond_to(&request, &stream),
            Err(NoRequest::Malformed) => respond(&stream, "400 Bad Request", "", "this is no HTTP"),
            Err(NoRequest::TooLong) => {
                respond(&stream, "431 Request Header Fields Too Large", "", "too long")
            }
            Err(NoRequest::Gone) => Ok(()),
        };
    }

    fn respond_to(&self, request: &Request, stream: &TcpStream) -> io::Result<()> {
        if !self.access.admits(request) {
            return respond(stream, "403 Forbidden", "", "open the address as it was told");
        }
        match (request.method.as_str(), request.path.as_str()) {
            ("GET", "/") => {
                respond(stream, "200 OK", "Content-Type: text/html; charset=utf-8\r\n", &self.page)
            }
            ("GET", "/events") => self.send_events(stream),
            ("GET", _) => respond(stream, "404 Not Found", "", "there is / and no more"),
            _ => respond(stream, "405 Method Not Allowed", "Allow: GET\r\n", "GET alone"),
        }
    }

    /// Sends each state that is new, at its own pace, until the last or until the browser has gone.
    fn send_events(&self, mut stream: &TcpStream) -> io::Result<()> {
        let watcher = self.feed.watch();
        let head =
            format!("HTTP/1.1 200 OK\r\nContent-Type: text/event-stream\r\n{HEADERS}\r\nretry: 1000\n\n");
        stream.write_all(head.as_bytes())?;
        let mut version = 0;
        loop {
            let Some(seen) = watcher.newer(version, SILENCE) else {
                stream.write_all(b":\n\n")?;
                continue;
            };
            version = seen.version;
            stream.write_all(format!("data: {}\n\n", seen.value.to_json()).as_bytes())?;
            if seen.is_last {
                return Ok(());
            }
            thread::sleep(PACE);
        }
    }
}

/// An answer, of plain text unless `headers` say otherwise.
fn respond(mut stream: &TcpStream, status: &str, headers: &str, body: &str) -> io::Result<()> {
    let kind = if headers.contains("Content-Type") { "" } else { "Content-Type: text/plain\r\n" };
    let length = body.len();
    let head = format!("HTTP/1.1 {status}\r\n{kind}{headers}{HEADERS}Content-Length: {length}\r\n\r\n");
    stream.write_all(format!("{head}{body}").as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use manifactor::viz::Phase;
    use std::io::{BufRead, BufReader, Read};
    use std::net::SocketAddr;

    fn served(access: Access) -> (SocketAddr, Arc<Feed<LiveMap>>) {
        let listener = TcpListener::bind("127.0.0.1:0").unwrap();
        let address = listener.local_addr().unwrap();
        let feed = Arc::new(Feed::new(LiveMap::new("desk", "only")));
        serve(listener, access, feed.clone()).unwrap();
        (address, feed)
    }

    fn asked(address: SocketAddr, request: &str) -> TcpStream {
        let mut stream = TcpStream::connect(address).unwrap();
        stream.write_all(request.as_bytes()).unwrap();
        stream
    }

    /// The status of an answer, and all of it.
    fn answer(address: SocketAddr, line: &str, host: &str) -> (u16, String) {
        let mut text = String::new();
        asked(address, &format!("{line} HTTP/1.1\r\nHost: {host}\r\n\r\n"))
            .read_to_string(&mut text)
            .unwrap();
        (text.split(' ').nth(1).unwrap().parse().unwrap(), text)
    }

    #[test]
    fn the_page_is_there_and_nothing_else() {
        let (address, _) = served(Access::Local);
        let status = |line: &str| answer(address, line, "localhost").0;
        let (ok, page) = answer(address, "GET /?x=1", &address.to_string());
        assert!(
            ok == 200 && page.contains("<title>Live map</title>") && page.contains("frame-ancestors 'none'")
        );
        assert_eq!(
            (status("GET /favicon.ico"), status("GET /../etc/passwd"), status("GET http://x/")),
            (404, 404, 404)
        );
        assert_eq!((status("POST /"), status("HEAD /"), status("DELETE /events")), (405, 405, 405));
        assert!(answer(address, "PUT /", "localhost").1.contains("\r\nAllow: GET\r\n"));
    }

    #[test]
    fn a_name_that_was_made_to_lead_here_is_refused() {
        let (address, _) = served(Access::Local);
        for host in
            ["example.org", "localhost.example.org", &format!("127.0.0.1.example.org:{}", address.port())]
        {
            for line in ["GET /", "GET /events", "GET /nowhere", "POST /"] {
                assert_eq!(answer(address, line, host).0, 403, "{line} of {host}");
            }
        }
        let mut text = String::new();
        asked(address, "GET / HTTP/1.1\r\n\r\n").read_to_string(&mut text).unwrap();
        assert!(text.starts_with("HTTP/1.1 403 "), "{text}");
    }

    #[test]
    fn every_request_needs_the_token() {
        let (address, feed) = served(Access::Token("0123abcd".to_owned()));
        let status = |line: &str| answer(address, line, "robot.example.org").0;
        for path in [
            "/",
            "/events",
            "/nowhere",
            "/?token=",
            "/?token=0123abce",
            "/?token=0123abcd0",
            "/events?token=1",
        ] {
            assert_eq!(status(&format!("GET {path}")), 403, "{path}");
        }
        assert_eq!(status("POST /"), 403);
        assert_eq!((status("GET /?token=0123abcd"), status("GET /x?token=0123abcd")), (200, 404));
        feed.end(|_| {}, Duration::ZERO);
        assert_eq!(status("GET /events?token=0123abcd"), 200);
    }

    #[test]
    fn what_is_no_request_is_told_so() {
        let (address, _) = served(Access::Local);
        let status = |text: &str| {
            let mut answer = String::new();
            asked(address, text).read_to_string(&mut answer).unwrap();
            answer
        };
        assert!(status("\u{16}\u{3}\u{1}\r\n\r\n").starts_with("HTTP/1.1 400 "));
        let many = format!("GET / HTTP/1.1\r\n{}\r\n", "a: b\r\n".repeat(101));
        assert!(status(&many).starts_with("HTTP/1.1 431 "));
    }

    #[test]
    fn events_are_whole_states_and_end_with_the_last() {
        let (address, feed) = served(Access::Local);
        let mut lines =
            BufReader::new(asked(address, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n")).lines();
        let mut state = || loop {
            let line = lines.next()?.unwrap();
            if let Some(json) = line.strip_prefix("data: ") {
                return Some(serde_json::from_str::<serde_json::Value>(json).unwrap());
            }
        };
        assert_eq!(state().unwrap()["phase"], "waiting");
        assert_eq!(feed.watchers(), 1);
        feed.change(|map| map.enter(Phase::Solving { iteration: 2 }, Some(0.5)));
        assert_eq!(state().unwrap()["words"], "iteration 2");
        feed.end(|map| map.enter(Phase::Ended("done".to_owned()), None), Duration::from_secs(60));
        assert_eq!(state().unwrap()["words"], "done");
        assert!(state().is_none() && feed.watchers() == 0);
    }

    #[test]
    fn who_takes_nothing_holds_up_nobody() {
        let (address, feed) = served(Access::Local);
        let deaf = asked(address, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
        // more than fits into any buffer on the way
        let long = "x".repeat(1 << 20);
        for i in 0..40 {
            feed.change(|map| *map = LiveMap::new(&long, &i.to_string()));
        }
        assert_eq!(answer(address, "GET /", "localhost").0, 200);
        drop(deaf);
    }

    #[test]
    fn there_is_an_end_to_how_many_look() {
        let (address, feed) = served(Access::Local);
        let looks = || asked(address, "GET /events HTTP/1.1\r\nHost: localhost\r\n\r\n");
        let heard = |stream: TcpStream| {
            let mut first = String::new();
            let mut reader = BufReader::new(stream);
            // one that is turned away may find the connection closed before it has read why
            let _ = reader.read_line(&mut first);
            (first, reader)
        };
        let all: Vec<_> = (0..MOST).map(|_| heard(looks())).collect();
        assert!(all.iter().all(|(first, _)| first.contains("200")));
        assert!(!heard(looks()).0.contains("200"));
        feed.end(|_| {}, Duration::ZERO);
    }
}
